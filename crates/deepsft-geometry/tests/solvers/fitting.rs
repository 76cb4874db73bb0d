//! A mesh fitted to a drawn sheet whose true maps are known.

use crate::sheet::{bent, folded, image, place, template};
use deepsft_geometry::fitting::{FrameFitter, Start};
use deepsft_geometry::glam::DVec3;
use deepsft_geometry::metrics::frame_metrics;
use deepsft_geometry::raster::VisibleSurface;
use deepsft_geometry::{Camera, GeometryError, Maps, Picture, Template, training_camera};

/// The maps with a registration up to 5 mm and a depth 4 % and a tilt off, as a network might say.
fn mistaken(truth: &Maps) -> Maps {
    let mut maps = truth.clone();
    for pixel in (0..truth.depth().len()).filter(|&p| truth.inside(p)) {
        let (x, y) = ((pixel % truth.size().width) as f32, (pixel / truth.size().width) as f32);
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
    let truth = VisibleSurface::new(template.mesh(), &bent(&template, 0.0), &camera).maps();
    let image = image(&template, &truth);
    Scene {
        template,
        camera,
        truth,
        image,
    }
}

/// Maps that say nonsense smoothly, each `k` another: what a network says where its object is not, depths of some
/// centimetres among it.
fn nonsense(truth: &Maps, k: usize) -> Maps {
    let mut maps = truth.clone();
    let phase = |n: usize| ((k * 37 + n * 101) as f32 * 0.618).fract() * std::f32::consts::TAU;
    let wave =
        |n: usize, x: f32, y: f32| (phase(n).sin() * x / 50.0 + phase(n + 1).cos() * y / 50.0 + phase(n + 2)).sin();
    for pixel in 0..truth.depth().len() {
        let (x, y) = ((pixel % truth.size().width) as f32, (pixel / truth.size().width) as f32);
        let depth = 70.0 * 10.0_f32.powf(0.6 * wave(0, x, y) + 0.3 * phase(3).sin());
        maps.set(pixel, depth, [0.5 + 0.5 * wave(4, x, y), 0.5 + 0.5 * wave(8, x, y)]);
    }
    maps
}

#[test]
fn maps_that_say_nonsense_are_no_error() {
    let scene = scene();
    let mut fitter = FrameFitter::new(&scene.template).unwrap();
    for k in 0..30 {
        let start = Start::Maps(nonsense(&scene.truth, k));
        let fitted = fitter.fit(&scene.image, &scene.camera, &start).unwrap();
        assert!(!fitted.is_some_and(|surface| surface.verdict.is_found()), "maps {k}");
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
    let mut fitter = FrameFitter::new(&template).unwrap();
    let start = mistaken(&truth);
    let fitted = fitter
        .fit(&image, &camera, &Start::Maps(start.clone()))
        .unwrap()
        .unwrap();
    assert!(fitted.verdict.is_found() && fitted.verdict.ambiguity.is_none());
    let error = |maps: &Maps| frame_metrics(maps, &truth, &camera, template.size_mm()).unwrap();
    let (before, after) = (error(&start), error(&fitted.maps(template.mesh())));
    let [before_px, after_px] = [before, after].map(|m| m.registration_rmse_px.unwrap());
    let [before_mm, after_mm] = [before, after].map(|m| m.depth_rmse_mm.unwrap());
    assert!(before_px > 2.0 && before_mm > 15.0, "{before_px} px, {before_mm} mm");
    assert!(after_px < 0.6 && after_mm < 3.0, "{after_px} px, {after_mm} mm");
    // The sheet has kept its lengths.
    let rest = template.mesh().vertices();
    for [a, b] in template.mesh().edges() {
        let length = fitted.vertices_camera[a].distance(fitted.vertices_camera[b]);
        assert!((length / rest[a].distance(rest[b]) - 1.0).abs() < 0.02);
    }
}

#[test]
fn a_sharp_fold_goes_where_the_network_sees_it() {
    let (template, camera) = (template(), training_camera());
    let truth = VisibleSurface::new(template.mesh(), &folded(&template, 1.0), &camera).maps();
    let image = image(&template, &truth);
    let start = Start::Maps(mistaken(&truth));
    let mut fitter = FrameFitter::new(&template).unwrap();
    let fitted = fitter.fit(&image, &camera, &start).unwrap().unwrap();
    let metrics = frame_metrics(&fitted.maps(template.mesh()), &truth, &camera, template.size_mm()).unwrap();
    let (px, mm) = (metrics.registration_rmse_px.unwrap(), metrics.points_rmse_mm.unwrap());
    assert!(px < 0.5 && mm < 2.5, "{px} px, {mm} mm");
}

#[test]
fn a_mesh_of_matches_becomes_exact() {
    let Scene {
        template,
        camera,
        truth,
        image,
    } = scene();
    // 4 px aside, 3 % too far, and flatter than it is.
    let coarse = bent(&template, 0.0)
        .into_iter()
        .map(|p| 1.03 * (p + DVec3::new(4.7, 0.0, 0.2 * (450.0 - p.z))));
    let start = Start::Mesh(coarse.collect());
    let mut fitter = FrameFitter::new(&template).unwrap();
    let fitted = fitter.fit(&image, &camera, &start).unwrap().unwrap();
    let metrics = frame_metrics(&fitted.maps(template.mesh()), &truth, &camera, template.size_mm()).unwrap();
    let (px, mm) = (metrics.registration_rmse_px.unwrap(), metrics.depth_rmse_mm.unwrap());
    assert!(
        px < 0.6 && mm < 4.0 && fitted.verdict.explained > 0.9,
        "{px} px, {mm} mm, {:?}",
        fitted.verdict
    );
}

#[test]
fn an_image_that_shows_nothing_does_not_drag_the_sheet_away() {
    let Scene {
        template,
        camera,
        truth,
        ..
    } = scene();
    let mut fitter = FrameFitter::new(&template).unwrap();
    let grey = Picture::from_fn(480, 270, |x, y| [((x * 7919 + y * 104_729) % 200) as u8; 3]);
    let fitted = fitter
        .fit(&grey, &camera, &Start::Maps(truth.clone()))
        .unwrap()
        .unwrap();
    let metrics = frame_metrics(&fitted.maps(template.mesh()), &truth, &camera, template.size_mm()).unwrap();
    assert!(metrics.registration_rmse_px.unwrap() < 3.0, "{metrics:?}");
}

#[test]
fn from_the_whole_surface_the_fit_tells_what_hides_the_sheet_and_whether_it_is_there() {
    let Scene {
        template,
        camera,
        truth,
        image,
    } = scene();
    let mut fitter = FrameFitter::new(&template).unwrap();
    // A hand of one colour, with an edge of its own.
    let hides = |x: usize, y: usize| (200..290).contains(&x) && (100..190).contains(&y);
    let covered = Picture::from_fn(480, 270, |x, y| match hides(x, y) {
        true => [190, 140, 110 + (x % 2) as u8],
        false => image.pixel(x, y),
    });
    let aside = bent(&template, 0.0).into_iter().map(|p| p + DVec3::new(4.0, 0.0, 8.0));
    let start = Start::Mesh(aside.collect());
    let fitted = fitter.fit(&covered, &camera, &start).unwrap().unwrap();
    let maps = fitted.maps(template.mesh());
    let share = |hidden: bool| {
        let pixels: Vec<usize> = (0..480 * 270)
            .filter(|&p| truth.inside(p) && hides(p % 480, p / 480) == hidden)
            .collect();
        let shown = pixels.iter().filter(|&&p| maps.inside(p)).count();
        shown as f64 / pixels.len() as f64
    };
    assert!(
        share(true) < 0.3 && share(false) > 0.9,
        "{} {}",
        share(true),
        share(false)
    );
    assert!(
        (0.6..0.95).contains(&fitted.verdict.explained),
        "{}",
        fitted.verdict.explained
    );
    assert!(fitted.verdict.confirmed_px > 5000.0, "{}", fitted.verdict.confirmed_px);
    // Where something else is shown, next to nothing is confirmed.
    let other = Picture::from_fn(480, 270, |x, y| [((x / 7 * 7919 + y / 5 * 104_729) % 200) as u8; 3]);
    let fitted = fitter.fit(&other, &camera, &start).unwrap().unwrap();
    assert!(fitted.verdict.explained < 0.2, "{}", fitted.verdict.explained);
}

#[test]
fn too_little_to_fit_is_said_and_wrong_sizes_are_refused() {
    let Scene {
        template,
        camera,
        image,
        ..
    } = scene();
    let mut fitter = FrameFitter::new(&template).unwrap();
    let nothing = Start::Maps(Maps::empty((480, 270)));
    assert!(fitter.fit(&image, &camera, &nothing).unwrap().is_none());
    let behind = Start::Mesh(vec![-DVec3::Z; template.mesh().vertices().len()]);
    assert!(fitter.fit(&image, &camera, &behind).unwrap().is_none());
    let short = Start::Mesh(vec![DVec3::Z; 3]);
    assert!(matches!(
        fitter.fit(&image, &camera, &short),
        Err(GeometryError::StartLength { actual: 3, .. })
    ));
    let small = Start::Maps(Maps::empty((48, 27)));
    assert!(matches!(
        fitter.fit(&image, &camera, &small),
        Err(GeometryError::MapSize { .. })
    ));
}

/// A sheet of 300 x 200 mm with 6 x 4 motifs that have no symmetry of their own.
fn rows_of_one_motif() -> Template {
    let picture = Picture::from_fn(600, 400, |x, y| match (x % 100, y % 100) {
        (10..70, 15..35) | (10..30, 15..85) => [20; 3],
        (50..85, 60..85) => [140, 60, 60],
        _ => [240; 3],
    });
    Template::thin_shell(picture, 300.0, 200.0).unwrap()
}

#[test]
fn a_fit_that_has_slipped_by_a_row_goes_back_and_where_no_border_is_seen_its_place_is_ambiguous() {
    let (template, camera) = (rows_of_one_motif(), training_camera());
    let mut fitter = FrameFitter::new(&template).unwrap();
    assert!(fitter.is_self_similar());
    let mut slipped = |distance: f64, to: DVec3| {
        // Where matches have slipped by a motif, the mesh lies 50 mm aside on the bent surface.
        let moved = |by_mm: f64| -> Vec<DVec3> {
            let place = |p: &DVec3| place(&(p - by_mm * to), 0.0) + (distance - 450.0) * DVec3::Z;
            template.mesh().vertices().iter().map(place).collect()
        };
        let vertices = moved(0.0);
        let truth = VisibleSurface::new(template.mesh(), &vertices, &camera).maps();
        let image = image(&template, &truth);
        let start = Start::Mesh(moved(50.0));
        let fitted = fitter.fit(&image, &camera, &start).unwrap().unwrap();
        let metrics = frame_metrics(&fitted.maps(template.mesh()), &truth, &camera, template.size_mm()).unwrap();
        (metrics.registration_rmse_px.unwrap(), fitted.verdict.ambiguity.unwrap())
    };
    for to in [DVec3::X, DVec3::Y] {
        let (error, ambiguity) = slipped(450.0, to);
        assert!(error < 0.5 && ambiguity < 0.92, "{error} px, ambiguity {ambiguity}");
    }
    // So near that the image shows two rows and no border.
    let (_, ambiguity) = slipped(130.0, DVec3::X);
    assert!(ambiguity > 0.95, "ambiguity {ambiguity}");
    // A print that looks like itself nowhere else is not ambiguous.
    let Scene {
        template,
        camera,
        image,
        ..
    } = scene();
    let mut fitter = FrameFitter::new(&template).unwrap();
    let start = Start::Mesh(bent(&template, 0.0));
    let fitted = fitter.fit(&image, &camera, &start).unwrap().unwrap();
    assert!(!fitter.is_self_similar() && fitted.verdict.ambiguity.is_none());
}
