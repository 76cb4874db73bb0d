//! Physics refinement of a drawn sheet whose true maps are known.

#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic)]

use deepsft_geometry::glam::DVec3;
use deepsft_geometry::metrics::frame_metrics;
use deepsft_geometry::physics::{PhysicsOptions, PhysicsRefinement};
use deepsft_geometry::raster::VisibleSurface;
use deepsft_geometry::{Camera, GeometryError, Maps, Picture, Template, training_camera};

/// A print that is nowhere like itself, in strokes of 5 to 20 mm.
fn print() -> Picture {
    Picture::from_fn(594, 420, |x, y| {
        let (x, y) = (x as f64 / 2.0, y as f64 / 2.0);
        let wave = |a: f64, b: f64, c: f64| (a * x + b * y + c * (x * y) / 200.0).sin();
        let value = |k: f64| 120.0 + 45.0 * wave(0.31 + k, 0.22, 0.4) + 40.0 * wave(0.11, -0.45 + k, 0.7);
        [value(0.0) as u8, value(0.05) as u8, value(0.1) as u8]
    })
}

fn template() -> Template {
    Template::thin_shell(print(), 297.0, 210.0).unwrap()
}

/// The sheet bent over a cylinder of radius 180 mm, tilted, some half a metre away: an isometry.
fn bent(template: &Template) -> Vec<DVec3> {
    let (radius, tilt) = (180.0, 0.35_f64);
    let place = |p: &DVec3| {
        let angle = (p.x + 0.3 * p.y) / 1.09_f64.sqrt() / radius;
        let along = (p.y - 0.3 * p.x) / 1.09_f64.sqrt();
        let across = radius * angle.sin();
        let lift = radius * (1.0 - angle.cos());
        let x = (across - 0.3 * along) / 1.09_f64.sqrt();
        let y = (along + 0.3 * across) / 1.09_f64.sqrt();
        let (y, z) = (y * tilt.cos() - lift * tilt.sin(), y * tilt.sin() + lift * tilt.cos());
        DVec3::new(x + 20.0, y - 10.0, z + 430.0)
    };
    template.mesh().vertices().iter().map(place).collect()
}

/// The sheet in light that falls off to the right, before a chequered wall.
fn image(template: &Template, truth: &Maps) -> Picture {
    let texture = template.texture().halved();
    Picture::from_fn(truth.width(), truth.height(), |x, y| {
        let pixel = y * truth.width() + x;
        if !truth.inside(pixel) {
            return [if (x / 12 + y / 9) % 2 == 0 { 60 } else { 150 }; 3];
        }
        let [u, v] = truth.registration()[pixel].map(f64::from);
        let color = texture.sample(u * texture.width() as f64, v * texture.height() as f64);
        let light = 0.9 - 0.4 * x as f32 / truth.width() as f32;
        color.map(|c| (light * c + 10.0) as u8)
    })
}

/// The maps with a registration up to 5 mm and a depth 4 % and a tilt off, as a network might say.
fn mistaken(truth: &Maps) -> Maps {
    let mut maps = truth.clone();
    for pixel in (0..truth.depth().len()).filter(|&p| truth.inside(p)) {
        let (x, y) = ((pixel % truth.width()) as f32, (pixel / truth.width()) as f32);
        let [u, v] = truth.registration()[pixel];
        let du = 0.012 * (x / 60.0).sin() + 0.005 * (y / 9.0).cos();
        let dv = 0.015 * (x / 80.0 + y / 50.0).cos();
        let depth = truth.depth()[pixel] * (1.04 + 0.02 * (x - 240.0) / 240.0);
        maps.set(pixel, depth, [(u + du).clamp(0.0, 1.0), (v + dv).clamp(0.0, 1.0)]);
    }
    maps
}

struct Scene {
    template: Template,
    camera: Camera,
    truth: Maps,
    image: Picture,
}

fn scene() -> Scene {
    let template = template();
    let camera = training_camera();
    let truth = VisibleSurface::new(template.mesh(), &bent(&template), &camera).maps();
    let image = image(&template, &truth);
    Scene {
        template,
        camera,
        truth,
        image,
    }
}

#[test]
fn maps_that_are_a_little_wrong_become_exact() {
    let Scene {
        template,
        camera,
        truth,
        image,
    } = scene();
    let mut refinement = PhysicsRefinement::new(&template, PhysicsOptions::default()).unwrap();
    let start = mistaken(&truth);
    let refined = refinement.refine(&image, &camera, &start, None).unwrap().unwrap();
    assert!(refined.accepted, "{:?}", refined.photometric_cost);
    let error = |maps: &Maps| frame_metrics(maps, &truth, &camera, template.size_mm()).unwrap();
    let (before, after) = (error(&start), error(&refined.maps));
    let [before_px, after_px] = [before, after].map(|m| m.registration_rmse_px.unwrap());
    let [before_mm, after_mm] = [before, after].map(|m| m.depth_rmse_mm.unwrap());
    assert!(before_px > 2.0 && before_mm > 15.0, "{before_px} px, {before_mm} mm");
    assert!(after_px < 0.6 && after_mm < 3.0, "{after_px} px, {after_mm} mm");
    // The sheet has kept its lengths.
    let rest = template.mesh().vertices();
    for [a, b] in template.mesh().edges() {
        let length = refined.vertices_camera[a].distance(refined.vertices_camera[b]);
        assert!((length / rest[a].distance(rest[b]) - 1.0).abs() < 0.02);
    }
}

#[test]
fn a_mesh_that_explains_the_image_worse_leaves_the_networks_maps() {
    let Scene {
        template,
        camera,
        truth,
        image,
    } = scene();
    // So stiff against bending that the bent sheet cannot be fitted.
    let options = PhysicsOptions {
        bending: 1e6,
        ..PhysicsOptions::default()
    };
    let mut refinement = PhysicsRefinement::new(&template, options).unwrap();
    let refined = refinement.refine(&image, &camera, &truth, None).unwrap().unwrap();
    assert!(!refined.accepted, "{:?}", refined.photometric_cost);
    assert_eq!(refined.maps, truth);
}

#[test]
fn an_image_that_shows_nothing_does_not_drag_the_sheet_away() {
    let Scene {
        template,
        camera,
        truth,
        ..
    } = scene();
    let mut refinement = PhysicsRefinement::new(&template, PhysicsOptions::default()).unwrap();
    let grey = Picture::from_fn(480, 270, |x, y| [((x * 7919 + y * 104_729) % 200) as u8; 3]);
    let refined = refinement.refine(&grey, &camera, &truth, None).unwrap().unwrap();
    let metrics = frame_metrics(&refined.maps, &truth, &camera, template.size_mm()).unwrap();
    assert!(metrics.registration_rmse_px.unwrap() < 3.0, "{metrics:?}");
}

#[test]
fn too_little_to_fit_is_said_and_wrong_sizes_are_refused() {
    let Scene {
        template,
        camera,
        image,
        ..
    } = scene();
    let mut refinement = PhysicsRefinement::new(&template, PhysicsOptions::default()).unwrap();
    let nothing = Maps::empty(480, 270);
    assert!(refinement.refine(&image, &camera, &nothing, None).unwrap().is_none());
    let small = Maps::empty(48, 27);
    assert!(matches!(
        refinement.refine(&image, &camera, &small, None),
        Err(GeometryError::MapSize { .. })
    ));
}
