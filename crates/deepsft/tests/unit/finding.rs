//! Targets and their finders, by features and by descriptors.

use crate::printed_box::printed_box;
use deepsft::features::GradeLevel;
use deepsft::session::{Session, VideoFollower};
use deepsft::{
    CameraOrigin, DeepSftError, DescriptorFinder, FinderKind, SharedDescriptorNetwork, Target, TargetFinder, View,
};
use deepsft_geometry::glam::{DQuat, DVec2, DVec3};
use deepsft_geometry::metrics::frame_metrics;
use deepsft_geometry::raster::VisibleSurface;
use deepsft_geometry::{Camera, Maps, Picture, Template, TemplateError, draw_template, training_camera};
use std::sync::{Arc, Mutex};
use std::time::{Duration, Instant};

/// Rectangles of any colour on grey, 297 x 210 mm.
pub fn print() -> Picture {
    let mut state = 7_u64;
    let mut random = move |below: u64| {
        state = state
            .wrapping_mul(6_364_136_223_846_793_005)
            .wrapping_add(1_442_695_040_888_963_407);
        ((state >> 33) % below) as usize
    };
    let mut colors = vec![[120_u8; 3]; 594 * 420];
    for _ in 0..400 {
        let (left, top, width, height) = (random(594), random(420), 8 + random(60), 8 + random(60));
        let color = [random(256) as u8, random(256) as u8, random(256) as u8];
        for y in top..(top + height).min(420) {
            colors[594 * y + left..594 * y + (left + width).min(594)].fill(color);
        }
    }
    Picture::from_fn(594, 420, |x, y| colors[594 * y + x])
}

/// A camera with 960 columns, what it sees of the print around a cylinder, before a dark wall, and where the mesh is.
fn photograph(template: &Template) -> (Camera, Picture, Maps, Vec<DVec3>) {
    let camera = training_camera().resized((960, 540)).unwrap();
    let turn = DVec2::from_angle(2.1);
    let place = |p: &DVec3| {
        let (angle, turned) = (p.x / 160.0, turn);
        let bent = DVec2::new(160.0 * angle.sin(), p.y);
        let at = turned.rotate(bent);
        DVec3::new(at.x, at.y, 480.0 + 160.0 * (1.0 - angle.cos()))
    };
    let vertices: Vec<DVec3> = template.mesh().vertices().iter().map(place).collect();
    let truth = VisibleSurface::new(template.mesh(), &vertices, &camera).maps();
    let texture = template.texture();
    let image = Picture::from_fn(960, 540, |x, y| {
        let pixel = 960 * y + x;
        match truth.inside(pixel) {
            true => {
                let at = truth.uv(pixel) * texture.size().as_dvec2();
                texture.sample(at.x, at.y).map(|c| (0.8 * c + 10.0) as u8)
            }
            false => [40; 3],
        }
    });
    (camera, image, truth, vertices)
}

/// Servers hold finders and trackers in one task and run it on many threads.
#[test]
fn finders_trackers_and_their_futures_may_move_between_threads() {
    fn is_send<T: Send>() {}
    fn of_value<T: Send>(_: &T) {}
    is_send::<TargetFinder>();
    is_send::<SharedDescriptorNetwork>();
    is_send::<VideoFollower<'_>>();
    is_send::<Session>();
    let _: fn(&mut TargetFinder, &mut View<'_>) = |finder, view| of_value(&finder.estimate(view));
    let _: fn(&mut VideoFollower<'_>, &mut View<'_>) = |tracker, view| of_value(&tracker.follow(0.0, view));
}

#[test]
fn a_picture_is_found_fitted_and_judged_and_an_empty_room_is_not() {
    let target = Target::from_picture(print(), 297.0).unwrap();
    let (camera, image, truth, bent) = photograph(target.template());
    let mut finder = TargetFinder::new(target.clone()).unwrap();
    assert!(!finder.can_deny());
    assert_eq!(finder.grade().map(|grade| grade.level), Some(GradeLevel::Good));
    let mut view = View::new(&image, &camera);
    let estimate = pollster::block_on(finder.estimate(&mut view)).unwrap();
    assert_eq!(
        (estimate.by, estimate.judgement.found),
        (Some(FinderKind::Features), true)
    );
    assert!(estimate.judgement.confidence > 0.8 && estimate.surface.is_some());
    let mut errors: Vec<f64> = (0..480 * 270)
        .map(|p| (p, 960 * (2 * (p / 480)) + 2 * (p % 480)))
        .filter(|&(p, q)| estimate.maps.inside(p) && truth.inside(q))
        .map(|(p, q)| ((estimate.maps.uv(p) - truth.uv(q)) * target.template().size_mm()).length())
        .collect();
    errors.sort_by(f64::total_cmp);
    assert!(
        errors.len() > 20_000 && errors[errors.len() / 2] < 1.0,
        "{} {:?}",
        errors.len(),
        errors.get(errors.len() / 2)
    );
    // A track starts from the fitted mesh. Where something else hides most of the print, what is left still matches, but the image
    // contradicts the whole.
    let hidden = Picture::from_fn(960, 540, |x, y| match y {
        0..230 => image.pixel(x, y),
        _ => [(x * y / 64 % 256) as u8; 3],
    });
    let mut behind = View::new(&hidden, &camera);
    let seen = [&mut view, &mut behind].map(|view| pollster::block_on(finder.find(view, &training_camera())).unwrap());
    let [(seen, maps), (behind, _)] = seen;
    assert_eq!((seen.len(), behind.len(), maps), (1, 0, None));
    // The estimate has gone on in the pixels of the image itself.
    let estimated = estimate.surface.unwrap().vertices_camera;
    // The other bend has almost the same projection, and depths 20 mm off.
    let off = estimated
        .iter()
        .zip(&bent)
        .map(|(p, q)| (p.z - q.z).powi(2))
        .sum::<f64>();
    let off_mm = (off / bent.len() as f64).sqrt();
    assert!(off_mm < 2.0, "{off_mm} mm");
    let pairs = seen[0].vertices_camera.iter().zip(&estimated);
    let apart = pairs.map(|(p, q)| p.distance(*q)).sum::<f64>() / estimated.len() as f64;
    assert!(apart > 0.0 && apart < 5.0, "{apart} mm");

    let wall = Picture::from_fn(960, 540, |x, y| [(90 + (x / 31 + y / 17) % 2 * 60) as u8; 3]);
    let nothing = pollster::block_on(finder.estimate(&mut View::new(&wall, &camera))).unwrap();
    assert!(!nothing.judgement.found, "{:?}", nothing.judgement);
}

/// In a frame with a tilted, bent sheet the camera is told from one that is 20 % too short; a known one is left as it is.
#[test]
fn one_photograph_of_a_bent_sheet_tells_its_camera() {
    let target = Target::from_picture(print(), 297.0).unwrap();
    let (camera, image, _, bent) = photograph(target.template());
    let mut finder = TargetFinder::new(target).unwrap();
    let short = camera.zoomed(0.8);
    let mut estimate = |camera: &Camera, origin| {
        let (estimate, told) = pollster::block_on(finder.estimate_with_camera(&image, camera, origin)).unwrap();
        let vertices = estimate.surface.unwrap().vertices_camera;
        let mean_z = |vertices: &[DVec3]| vertices.iter().map(|p| p.z).sum::<f64>() / vertices.len() as f64;
        let fraction = mean_z(&vertices) / mean_z(&bent);
        (fraction, told)
    };
    let (depth, told) = estimate(&short, CameraOrigin::Assumed);
    let told = told.unwrap();
    let ratio = told.camera.focal().x / camera.focal().x;
    assert!(
        (ratio.ln() / told.focal_deviation).abs() < 2.0 && (ratio - 1.0).abs() < 0.08,
        "{ratio} {}",
        told.focal_deviation
    );
    assert!((depth - 1.0).abs() < 0.08, "{depth}");
    assert!((told.assumed, told.camera.size()) == (short, camera.size()));
    assert_eq!(told.camera.lens(), camera.lens(), "one view tells no distortion");
    let (depth, told) = estimate(&short, CameraOrigin::Known);
    assert!(told.is_none() && (depth - 0.8).abs() < 0.03, "{depth}");
}

#[test]
fn images_of_no_cameras_shape_were_cropped() {
    for (size, is_cropped) in [
        ((4000, 3000), false),
        ((3024, 4032), false),
        ((1920, 1080), false),
        ((1080, 1080), false),
        ((6000, 4000), false),
        ((1956, 2485), true),
        ((2340, 1080), true),
    ] {
        let size = size.into();
        assert_eq!(CameraOrigin::Exif.is_cropped(size), is_cropped, "{size}");
        assert!(!CameraOrigin::Known.is_cropped(size));
        assert_eq!(CameraOrigin::Known.focal_deviation(size), 0.0);
    }
}

/// The camera held a quarter turned sees the same mesh, turned, in maps that stand upright.
#[test]
fn in_an_upright_image_the_same_is_found_upright() {
    let target = Target::from_picture(print(), 297.0).unwrap();
    let (camera, image, ..) = photograph(target.template());
    let upright = camera.turned_anticlockwise();
    let turned = image.turned_clockwise().turned_clockwise().turned_clockwise();
    let mut finder = TargetFinder::new(target).unwrap();
    let mut look = |image: &Picture, camera: &Camera| {
        let estimate = pollster::block_on(finder.estimate(&mut View::new(image, camera))).unwrap();
        (
            estimate.judgement.found,
            estimate.maps.size(),
            estimate.surface.unwrap().vertices_camera,
        )
    };
    let (across_found, _, across) = look(&image, &camera);
    let (found, size, vertices) = look(&turned, &upright);
    assert!(across_found && found);
    assert_eq!(size, (270, 480).into());
    let apart = across
        .iter()
        .zip(&vertices)
        .map(|(p, q)| (DVec3::new(p.y, -p.x, p.z) - *q).length_squared());
    let rms = (apart.sum::<f64>() / vertices.len() as f64).sqrt();
    assert!(rms < 1.0, "{rms} mm");
}

#[test]
fn widths_that_are_none_are_refused() {
    for width_mm in [0.0, -5.0, f64::NAN, f64::INFINITY] {
        let refused = Target::from_picture(print(), width_mm);
        assert!(
            matches!(refused, Err(DeepSftError::Template(TemplateError::Size { .. }))),
            "{width_mm}"
        );
    }
}

#[test]
fn a_box_is_found_without_training_from_all_sides_and_nowhere_else() {
    let template = printed_box(8, print());
    let camera = training_camera();
    let mut finder = TargetFinder::new(Target::from_template(template.clone())).unwrap();
    assert_eq!(finder.grade(), None, "grades are of flat prints");
    let ground = |x: usize, y: usize| [(90 + (x * 37 + y * 91) % 61) as u8; 3];
    for k in 0..6 {
        let turn = DQuat::from_rotation_x(0.6 - 0.2 * f64::from(k)) * DQuat::from_rotation_y(0.4 + f64::from(k));
        let posed: Vec<DVec3> = (template.mesh().vertices().iter())
            .map(|&p| turn * p + DVec3::new(20.0, -10.0, 260.0))
            .collect();
        let truth = VisibleSurface::new(template.mesh(), &posed, &camera).maps();
        let drawn = draw_template(template.texture(), &truth);
        let image = Picture::from_fn(480, 270, |x, y| match truth.inside(y * 480 + x) {
            true => drawn.pixel(x, y),
            false => ground(x, y),
        });
        let estimate = pollster::block_on(finder.estimate(&mut View::new(&image, &camera))).unwrap();
        assert!(estimate.judgement.found, "side {k}: {:?}", estimate.judgement);
        assert!(
            !estimate.judgement.shape_determined,
            "of a solid nothing says how sure it is"
        );
        let errors = frame_metrics(&estimate.maps, &truth, &camera, &template).unwrap();
        let (px, mm) = (errors.registration_rmse_px.unwrap(), errors.points_rmse_mm.unwrap());
        assert!(px < 1.0 && mm < 4.0, "side {k}: {px} px, {mm} mm");
    }
    let image = Picture::from_fn(480, 270, ground);
    let nothing = pollster::block_on(finder.estimate(&mut View::new(&image, &camera))).unwrap();
    assert!(!nothing.judgement.found, "{:?}", nothing.judgement);
}

/// The shipped network.
fn descriptor_network() -> SharedDescriptorNetwork {
    let weights = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("../../models/any-picture/weights.bpk");
    SharedDescriptorNetwork::from_bytes(&std::fs::read(weights).unwrap()).unwrap()
}

#[test]
fn bytes_that_are_no_weights_of_the_descriptor_network_are_refused() {
    let file = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("../../models/any-picture/weights.bpk");
    let whole = std::fs::read(file).unwrap();
    for broken in [&whole[..whole.len() / 2], b"no weights", &[]] {
        assert!(matches!(
            SharedDescriptorNetwork::from_bytes(broken),
            Err(DeepSftError::BundleContent { .. })
        ));
    }
}

#[test]
fn matches_of_the_shipped_descriptors_tell_place_roll_and_scale() {
    let network = descriptor_network();
    let template = Template::thin_shell(print(), 297.0, 210.0).unwrap();
    let mut finder = DescriptorFinder::new(&network, &template).unwrap();
    // The print in the middle of the image, turned by 3 radians, 200 pixels long.
    let (camera, mm_per_pixel, turn) = (training_camera(), 297.0 / 200.0, 3.0_f64);
    let to_print = |pixel: DVec2| {
        let from_middle = DVec2::from_angle(-turn).rotate(pixel - DVec2::new(240.0, 135.0));
        from_middle * mm_per_pixel + template.size_mm() / 2.0
    };
    let is_inside = |place: DVec2| place.cmpge(DVec2::ZERO).all() && place.cmple(template.size_mm()).all();
    let image = Picture::from_fn(480, 270, |x, y| {
        let place = to_print(DVec2::new(x as f64 + 0.5, y as f64 + 0.5));
        match is_inside(place) {
            true => template.texture().halved().sample(place.x, place.y).map(|c| c as u8),
            false => [120; 3],
        }
    });
    let mut view = View::new(&image, &camera);
    let matches = finder.matches(&mut view, &camera).unwrap();
    // Another camera's image in between changes nothing, and has matches of its own.
    let shifted = Camera::pinhole((480, 270), DVec2::splat(380.0), DVec2::new(200.0, 135.0)).unwrap();
    let others = finder.matches(&mut view, &shifted).unwrap();
    view.canonical(&camera).unwrap();
    let again = finder.matches(&mut view, &camera).unwrap();
    assert!(again == matches && others != matches);
    let on_print = matches.iter().filter(|m| is_inside(to_print(m.pixel.as_dvec2())));
    let right = on_print.filter(|m| {
        let turned = (f64::from(m.angle) + turn).rem_euclid(std::f64::consts::TAU);
        m.place.as_dvec2().distance(to_print(m.pixel.as_dvec2())) < 10.0
            && turned.min(std::f64::consts::TAU - turned) < 0.5
            && (0.6..1.6).contains(&(f64::from(m.scale) / mm_per_pixel))
    });
    let right = right.count();
    // The print covers 437 cells.
    assert!(
        right > 250 && right * 10 > matches.len() * 8,
        "{right} of {}",
        matches.len()
    );
}

/// A server shares the network among its threads and hands them images as they come. The test ends after a minute at the latest:
/// threads that wait for one another do so for ever.
#[test]
fn threads_of_a_pool_describe_images_with_one_network_at_the_same_time() {
    let target = Target::from_picture(print(), 297.0).unwrap();
    let network = descriptor_network();
    let finder = || Mutex::new(DescriptorFinder::new(&network, target.template()).unwrap());
    let finders: Arc<[_]> = (0..4).map(|_| finder()).collect();
    let pool = rayon::ThreadPoolBuilder::new().num_threads(4).build().unwrap();
    let (done, results) = std::sync::mpsc::channel();
    for _ in 0..40 {
        let (finders, done) = (finders.clone(), done.clone());
        pool.spawn(move || {
            let camera = training_camera();
            let image = Picture::from_fn(480, 270, |x, y| [(x / 9 * 37 + y / 7 * 91) as u8; 3]);
            // Of the finders one that no other image has.
            let free = finders.iter().find_map(|finder| finder.try_lock().ok());
            let described = free.map(|mut finder| finder.matches(&mut View::new(&image, &camera), &camera).is_ok());
            done.send(described).unwrap();
        });
    }
    let last = Instant::now() + Duration::from_secs(60);
    let result = |_| results.recv_timeout(last.saturating_duration_since(Instant::now()));
    let results: Vec<_> = (0..40).map(result).collect();
    assert!(results.iter().all(Result::is_ok), "some wait for ever: {results:?}");
    assert!(results.contains(&Ok(Some(true))) && !results.contains(&Ok(Some(false))));
}
