//! Fit and tracker of a solid: a box that is bent and turned.

use crate::printed_box::{blocks, printed_box};
use deepsft_geometry::fitting::{FrameFitter, Start};
use deepsft_geometry::glam::{DQuat, DVec2, DVec3};
use deepsft_geometry::metrics::{FrameMetrics, frame_metrics};
use deepsft_geometry::raster::VisibleSurface;
use deepsft_geometry::tracking::{TrackUpdate, Tracker, TrackerImage};
use deepsft_geometry::{Camera, ImageSize, Maps, Picture, Surface, Template, draw_template, training_camera};

/// The box bent about its z axis, each fibre along y to an arc; `radius` to the middle, mm.
fn bent(p: DVec3, radius: f64) -> DVec3 {
    let (s, c) = (p.y / radius).sin_cos();
    DVec3::new((radius + p.x) * c - radius, (radius + p.x) * s, p.z)
}

/// The box in front of the camera.
struct Scene {
    template: Template,
    camera: Camera,
}

impl Scene {
    fn new() -> Self {
        Self {
            template: printed_box(10, blocks()),
            camera: training_camera(),
        }
    }

    /// The vertices of the box, bent to `radius`, turned by `turn` (radians) about its own axis and tilted, `away` from the camera.
    fn vertices(&self, radius: f64, [turn, tilt]: [f64; 2], away: DVec3) -> Vec<DVec3> {
        let rotation = DQuat::from_rotation_x(tilt) * DQuat::from_rotation_y(turn);
        let rest = self.template.mesh().vertices().iter();
        rest.map(|&p| rotation * bent(p, radius) + away).collect()
    }

    fn maps(&self, vertices: &[DVec3]) -> Maps {
        VisibleSurface::new(self.template.mesh(), vertices, &self.camera).maps()
    }

    fn picture(&self, maps: &Maps) -> Picture {
        let drawn = draw_template(self.template.texture(), maps);
        let ImageSize { width, height } = maps.size();
        Picture::from_fn(width, height, |x, y| match maps.inside(y * width + x) {
            true => drawn.pixel(x, y),
            false => [(120 + (x * 31 + y * 17) % 23) as u8; 3],
        })
    }

    /// How much distances between vertices of opposite corners differ from those at rest, at most, mm.
    fn change(&self, vertices: &[DVec3]) -> f64 {
        let rest = self.template.mesh().vertices();
        let pairs = (0..rest.len() / 2).map(|i| [i, rest.len() - 1 - i]);
        let change = |[a, b]: [usize; 2]| (vertices[a].distance(vertices[b]) - rest[a].distance(rest[b])).abs();
        pairs.map(change).fold(0.0, f64::max)
    }

    /// The surface fitted to what is seen of a box with its vertices at `truth`, from one with them at `start`, and the errors of both.
    fn fitted(&self, truth: &[DVec3], start: &[DVec3]) -> (Surface, [FrameMetrics; 2]) {
        let (true_maps, start_maps) = (self.maps(truth), self.maps(start));
        let mut fitter = FrameFitter::new(&self.template).unwrap();
        let from = Start::Maps(start_maps.clone());
        let image = self.picture(&true_maps);
        let surface = fitter.fit(&image, &self.camera, &from).unwrap().unwrap();
        let errors = [start_maps, surface.maps(self.template.mesh())].map(|maps| self.errors(&maps, &true_maps));
        (surface, errors)
    }

    fn errors(&self, maps: &Maps, truth: &Maps) -> FrameMetrics {
        frame_metrics(maps, truth, &self.camera, &self.template).unwrap()
    }
}

const AWAY: DVec3 = DVec3::new(0.0, 0.0, 330.0);

#[test]
fn a_bent_box_is_fitted_from_a_rigid_one_that_is_off_and_its_hidden_sides_follow() {
    let scene = Scene::new();
    let truth = scene.vertices(500.0, [0.7, -0.5], AWAY);
    let start = scene.vertices(1e6, [0.74, -0.46], AWAY + DVec3::new(3.0, -2.0, 6.0));
    let (surface, [before, after]) = scene.fitted(&truth, &start);
    let [before_px, after_px] = [before, after].map(|errors| errors.registration_rmse_px.unwrap());
    assert!(before_px > 4.0 && after_px < 0.5, "{before_px} -> {after_px} px");
    let [before_mm, after_mm] = [before, after].map(|errors| errors.points_rmse_mm.unwrap());
    assert!(before_mm > 7.0 && after_mm < 2.5, "{before_mm} -> {after_mm} mm");
    assert!(
        surface.verdict.is_found() && surface.verdict.correlation > 0.9,
        "{:?}",
        surface.verdict
    );
    // Three of the six sides are hidden.
    let mut off: Vec<f64> = (surface.vertices_camera.iter().zip(&truth))
        .map(|(a, b)| a.distance(*b))
        .collect();
    off.sort_by(f64::total_cmp);
    assert!(off[off.len() / 2] < 2.0 && off[off.len() * 9 / 10] < 6.0, "{off:?}");
    // Points on an edge stand there once for each side, and stay together.
    let rest = scene.template.mesh().vertices();
    for i in 0..rest.len() {
        for j in 0..i {
            let together = surface.vertices_camera[i] == surface.vertices_camera[j];
            assert_eq!(rest[i] == rest[j], together, "{i} and {j}");
        }
    }
}

#[test]
fn a_box_that_waves_is_followed_by_a_softer_one() {
    let scene = Scene::new();
    let rotation = DQuat::from_rotation_x(-0.5) * DQuat::from_rotation_y(0.7);
    let [truth, start] = [12.0, 0.0].map(|height| -> Vec<DVec3> {
        let waving = |p: &DVec3| *p + DVec3::Z * height * (p.y / 22.0).sin();
        let rest = scene.template.mesh().vertices().iter();
        rest.map(|p| rotation * waving(p) + AWAY).collect()
    });
    let (surface, [before, after]) = scene.fitted(&truth, &start);
    let [before, after] = [before, after].map(|errors| errors.registration_rmse_px.unwrap());
    assert!(
        before > 8.0 && after < 2.0,
        "{before} -> {after} px {:?}",
        surface.verdict
    );
}

#[test]
fn a_box_that_is_not_bent_keeps_its_shape_and_a_bent_one_does_not() {
    let scene = Scene::new();
    let focal = scene.camera.focal() * 2.0;
    let camera = Camera::pinhole((960, 540), focal, DVec2::new(480.0, 270.0)).unwrap();
    let mut means = Vec::new();
    for (radius, is_rigid) in [(1e6, true), (700.0, false)] {
        let truth = scene.vertices(radius, [0.7, -0.5], AWAY);
        let image = |camera| scene.picture(&VisibleSurface::new(scene.template.mesh(), &truth, camera).maps());
        let start = scene.vertices(1e6, [0.73, -0.47], AWAY + DVec3::new(2.0, -2.0, 5.0));
        let mut fitter = FrameFitter::new(&scene.template).unwrap();
        let found = fitter.fit(&image(&scene.camera), &scene.camera, &Start::Mesh(start));
        let surface = fitter
            .fit_close_ups(&image(&camera), &camera, found.unwrap().unwrap())
            .unwrap();
        let most = scene.change(&surface.vertices_camera);
        assert_eq!(most < 1e-6, is_rigid, "radius {radius} mm: lengths change by {most} mm");
        let mut off: Vec<f64> = surface
            .vertices_camera
            .iter()
            .zip(&truth)
            .map(|(a, b)| a.distance(*b))
            .collect();
        let stated: Vec<f64> = surface
            .deviations
            .iter()
            .map(|deviation| f64::from(*deviation))
            .collect();
        let within = off
            .iter()
            .zip(&stated)
            .filter(|(off, stated)| **off < 2.0 * **stated)
            .count();
        assert!(
            within * 10 > off.len() * 8,
            "radius {radius} mm: {within} of {} within two deviations",
            off.len()
        );
        means.push(stated.iter().sum::<f64>() / stated.len() as f64);
        off.sort_by(f64::total_cmp);
        let median = off[off.len() / 2];
        assert!(
            median < if is_rigid { 0.3 } else { 1.5 },
            "radius {radius} mm: {median} mm off"
        );
    }
    // Where the shape must be told too, nothing is as sure: 0.3 and 2.6 mm.
    assert!(
        means[0] > 0.05 && means[0] < 1.0 && means[1] > 3.0 * means[0] && means[1] < 6.0,
        "{means:?}"
    );
}

#[test]
fn a_box_that_was_matched_tilted_the_other_way_is_turned_round() {
    let scene = Scene::new();
    for (turn, distance) in [(0.2, 450.0), (0.3, 300.0)] {
        let away = DVec3::new(20.0, -10.0, distance);
        let truth = scene.vertices(1e6, [turn, 0.1], away);
        // The side before the camera looks almost the same, and another one is beside it.
        let start = Start::Mesh(scene.vertices(1e6, [-turn, -0.1], away));
        let image = scene.picture(&scene.maps(&truth));
        let mut fitter = FrameFitter::new(&scene.template).unwrap();
        let found = fitter.fit(&image, &scene.camera, &start).unwrap().unwrap();
        let off = found.vertices_camera.iter().zip(&truth).map(|(a, b)| a.distance(*b));
        let farthest = off.fold(0.0, f64::max);
        assert!(farthest < 8.0, "turned by {turn}: {farthest} mm off");
    }
}

#[test]
fn a_box_is_followed_while_its_sides_come_into_view_and_leave_and_bends_once_the_image_tells_so() {
    let scene = Scene::new();
    let mut tracker = Tracker::new(&scene.template).unwrap();
    let mut worst: f64 = 0.0;
    // Once all around.
    for frame in 0..126 {
        let (turn, time_s) = (0.05 * frame as f64, frame as f64 / 30.0);
        let since = frame as f64 - 42.0;
        let bend = if since < 0.0 {
            1e6
        } else {
            600.0 + 200.0 * (0.2 * since).cos() + 3000.0 * (-since / 5.0).exp()
        };
        let truth = scene.vertices(bend, [turn, -0.4], AWAY);
        let maps = scene.maps(&truth);
        let mut picture = scene.picture(&maps);
        let is_missed = frame == 25;
        if is_missed {
            picture = Picture::from_fn(480, 270, |_, _| [90; 3]);
        }
        let picture = TrackerImage::of(&picture);
        let tracked = tracker.follow(frame, time_s, &picture, &scene.camera).unwrap();
        if frame == 0 {
            assert_eq!(tracker.update(0, Some(&truth)).unwrap(), TrackUpdate::Started);
            continue;
        }
        assert_eq!(tracked.held, is_missed, "{frame}");
        if is_missed {
            continue;
        }
        let surface = tracked.surface.as_ref().unwrap();
        let errors = scene.errors(&surface.maps(scene.template.mesh()), &maps);
        worst = worst.max(errors.registration_rmse_px.unwrap());
        // Whether it is bent is asked every eight frames.
        let change = scene.change(&surface.vertices_camera);
        match frame {
            9..42 => assert!(change < 1e-6, "{frame}: lengths change by {change} mm"),
            60.. => assert!(change > 0.1, "{frame}: lengths change by {change} mm"),
            _ => {}
        }
    }
    assert!(worst < 2.0, "{worst} px");
}
