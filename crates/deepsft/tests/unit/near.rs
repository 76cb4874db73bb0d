//! Sheets that are too near for the training camera's angle of view, and not for the camera's; and a far one in few pixels.

use deepsft::features::{FeatureFinder, Features};
use deepsft::session::{VideoFollower, VideoOptions};
use deepsft::{Device, Estimator, Finder, ModelBundle, Target, TargetFinder, View};
use deepsft_geometry::glam::{DVec2, DVec3};
use deepsft_geometry::raster::VisibleSurface;
use deepsft_geometry::{Camera, CanonicalViews, Picture, Template, training_camera};
use std::collections::BTreeMap;
use std::path::Path;

fn poster() -> ModelBundle {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../models/poster-a4");
    let read = |name: &str| (name.to_owned(), std::fs::read(folder.join(name)).unwrap());
    let names = [
        "model.json",
        "weights.bpk",
        "template/template.json",
        "template/texture.png",
    ];
    ModelBundle::from_files(&BTreeMap::from(names.map(read))).unwrap()
}

/// The sheet around a cylinder, its middle at `depth_mm`, its long side upright in the image but for a few degrees.
pub fn bent(template: &Template, depth_mm: f64) -> Vec<DVec3> {
    let turn = DVec2::from_angle(1.5);
    let place = |p: &DVec3| {
        let angle = p.x / 260.0;
        let at = turn.rotate(DVec2::new(260.0 * angle.sin(), p.y));
        DVec3::new(at.x, at.y, depth_mm + 260.0 * (1.0 - angle.cos()))
    };
    template.mesh().vertices().iter().map(place).collect()
}

/// What `camera` sees of it before a wall.
pub fn photograph(template: &Template, vertices: &[DVec3], camera: &Camera) -> Picture {
    let maps = VisibleSurface::new(template.mesh(), vertices, camera).maps();
    let texture = template.texture().halved();
    let size = texture.size().as_dvec2();
    Picture::from_fn(camera.size().width, camera.size().height, |x, y| {
        let pixel = camera.size().width * y + x;
        if !maps.inside(pixel) {
            return [(60 + (x / 40 + y / 40) % 2 * 25) as u8; 3];
        }
        let at = maps.uv(pixel) * size;
        texture.sample(at.x, at.y).map(|c| (0.8 * c + 10.0) as u8)
    })
}

/// RMS distance of the vertices from the true ones, mm.
fn distance(vertices: &[DVec3], truth: &[DVec3]) -> f64 {
    let squares = vertices.iter().zip(truth).map(|(p, q)| p.distance_squared(*q));
    (squares.sum::<f64>() / truth.len() as f64).sqrt()
}

/// A sheet 230 mm away fills a picture of 4 : 3 from top to bottom; a quarter of the rows is outside of the canonical image.
#[test]
fn a_sheet_that_only_the_whole_image_holds_is_measured_whole() {
    let bundle = poster();
    let template = bundle.template();
    let camera = Camera::typical((1280, 960)).unwrap();
    let vertices = bent(template, 300.0);
    let inside = |camera: &Camera| {
        let limit = camera.size().as_dvec2();
        let seen = |p: &&DVec3| {
            let at = camera.project(**p).unwrap();
            at.cmpge(DVec2::ZERO).all() && at.cmple(limit).all()
        };
        vertices.iter().filter(seen).count() as f64 / vertices.len() as f64
    };
    assert!(inside(&camera) == 1.0 && inside(&training_camera()) < 0.9);
    let image = photograph(template, &vertices, &camera);
    let mut view = View::new(&image, &camera);
    let by_features = Target::from_template(template.clone());
    for target in [Target::from_model(&bundle, &Device::Cpu).unwrap(), by_features] {
        let mut finder = TargetFinder::new(target).unwrap();
        let estimate = pollster::block_on(finder.estimate(&mut view)).unwrap();
        let views = CanonicalViews::new(&training_camera(), &camera);
        assert!(estimate.judgement.found && estimate.canonical_camera == *views.widest());
        let error = distance(&estimate.surface.unwrap().vertices_camera, &vertices);
        // The nearest view shows four fifths of the sheet. The rest is guessed.
        let cut = pollster::block_on(finder.estimate_in(&mut view, views.nearest())).unwrap();
        let cut = cut
            .surface
            .map_or(f64::INFINITY, |fit| distance(&fit.vertices_camera, &vertices));
        assert!(error < 0.4, "{error} mm");
        assert!(cut > 2.0 * error, "{cut} mm in the nearest view");
    }
}

/// Before the wider camera the sheet looks as it does before the training camera from farther away.
#[test]
fn depths_of_a_network_in_a_wider_view_are_those_of_the_camera() {
    let bundle = poster();
    let network = Estimator::new(&bundle, &Device::Cpu).unwrap();
    let views = CanonicalViews::new(network.training_camera(), &Camera::typical((1280, 960)).unwrap());
    let depth_in = |view: &Camera, depth_mm: f64| {
        let image = photograph(bundle.template(), &bent(bundle.template(), depth_mm), view);
        let maps = pollster::block_on(network.infer(&image, view)).unwrap();
        let mut depths: Vec<f32> = maps.depth().iter().copied().filter(|depth| *depth > 0.0).collect();
        assert!(depths.len() > 10_000);
        let middle = depths.len() / 2;
        f64::from(*depths.select_nth_unstable_by(middle, f32::total_cmp).1)
    };
    let zoom = views.widest().focal().x / views.nearest().focal().x;
    let (near, far) = (depth_in(views.widest(), 320.0), depth_in(views.nearest(), 320.0 / zoom));
    // Its relief looks deeper than any sheet's, which takes some per cent.
    assert!((near / (far * zoom) - 1.0).abs() < 0.06, "{near} and {far} mm");
    assert!((near / 340.0 - 1.0).abs() < 0.15, "{near} mm");
}

/// Between the laths of a fence strips of the sheet are seen, too narrow to place the mesh by.
#[test]
fn what_a_network_sees_is_told_where_it_is_too_little_to_place_the_mesh() {
    let bundle = poster();
    let camera = training_camera();
    let whole = photograph(bundle.template(), &bent(bundle.template(), 480.0), &camera);
    let fenced = Picture::from_fn(480, 270, |x, y| match x % 36 < 12 && y.abs_diff(135) < 100 {
        true => whole.pixel(x, y),
        false => [80; 3],
    });
    let target = Target::from_model(&bundle, &Device::Cpu).unwrap();
    let network = target.network().unwrap().clone();
    let mut finder = TargetFinder::with_finders(target, vec![Finder::Network(Box::new(network))]);
    let mut view = View::new(&fenced, &camera);
    let (sightings, maps) = pollster::block_on(finder.find(&mut view, &camera)).unwrap();
    assert!(sightings.is_empty() && maps.unwrap().area() > 500);
}

#[test]
fn a_sheet_that_comes_near_and_goes_away_is_followed_all_the_way() {
    let bundle = poster();
    let camera = Camera::typical((640, 480)).unwrap();
    let target = Target::from_model(&bundle, &Device::Cpu).unwrap();
    let network = target.network().unwrap().clone();
    let mut finder = TargetFinder::with_finders(target, vec![Finder::Network(Box::new(network))]);
    let options = VideoOptions {
        delay: 2,
        ..VideoOptions::default()
    };
    let depth = |frame: usize| 390.0 + 130.0 * (std::f64::consts::TAU * frame as f64 / 48.0).cos();
    let mut follow = |frames: std::ops::Range<usize>| {
        let mut tracker = VideoFollower::new(&mut finder, options.clone(), || 0.0).unwrap();
        let mut seen = Vec::new();
        for frame in frames {
            let vertices = bent(bundle.template(), depth(frame));
            let image = photograph(bundle.template(), &vertices, &camera);
            let mut view = View::new(&image, &camera);
            let time_s = frame as f64 / 30.0;
            let followed = pollster::block_on(tracker.follow(time_s, &mut view)).unwrap();
            let surface = &followed.followed.surface;
            let error = surface
                .as_ref()
                .map(|surface| distance(&surface.vertices_camera, &vertices));
            seen.push((followed.view.focal().x, error));
        }
        seen
    };
    let whole = follow(0..49);
    assert!(
        whole.iter().skip(3).all(|(_, error)| error.is_some_and(|mm| mm < 1.0)),
        "{whole:?}"
    );
    // Once wider, once back.
    let focals: Vec<f64> = whole.iter().map(|(focal, _)| *focal).collect();
    assert!(focals[0] == 380.0 && focals[24] < 300.0 && focals[48] == 380.0);
    assert_eq!(focals.windows(2).filter(|pair| pair[0] != pair[1]).count(), 2);
    // A video that begins with the sheet near: where the nearest view does not show it the finders look in the widest in turn.
    let near = follow(20..29);
    assert!(near.last().unwrap().1.is_some_and(|mm| mm < 1.0), "{near:?}");
}

#[test]
fn a_far_sheet_is_found_by_a_second_look_in_few_pixels_and_in_many() {
    let bundle = poster();
    let template = bundle.template();
    let camera = |width: usize| training_camera().resized((width, width * 9 / 16)).unwrap();
    let mut first_look = FeatureFinder::new(template.clone()).unwrap();
    let mut finder = TargetFinder::new(Target::from_template(template.clone())).unwrap();
    // 80 pixels of 480, and 140 of 1920: 35 of the canonical image.
    for (width, depth_mm, most_mm) in [(480, 1400.0, 8.0), (1920, 3200.0, 48.0)] {
        let truth = bent(template, depth_mm);
        let (fine, camera) = (camera(4 * width), camera(width));
        let image = photograph(template, &truth, &fine).halved().halved();
        let (features, seen_by) = Features::of(&image, &camera).unwrap();
        assert!(first_look.find(&features, &seen_by).unwrap().is_none(), "{width}");
        let estimate = pollster::block_on(finder.estimate(&mut View::new(&image, &camera))).unwrap();
        let off = estimate
            .surface
            .map(|surface| distance(&surface.vertices_camera, &truth));
        assert!(
            estimate.judgement.found && off.is_some_and(|off| off < most_mm),
            "{width}: {off:?} mm"
        );
    }
}
