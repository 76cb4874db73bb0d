//! How far the canonical view is zoomed out for what is too near.

use deepsft_geometry::glam::DVec2;
use deepsft_geometry::glam::DVec3;
use deepsft_geometry::{Camera, CanonicalViews, Maps, training_camera};

fn focals(source: &Camera) -> Vec<f64> {
    let views = CanonicalViews::new(&training_camera(), source);
    views.all().iter().map(|view| view.focal().x).collect()
}

/// Focal lengths of the views: 380 times half of the canonical image's side, as a ray, by the outermost ray of the camera's image.
#[test]
fn views_reach_as_far_as_the_image_and_no_further_than_119_degrees() {
    let near = |actual: Vec<f64>, expected: &[f64]| {
        assert!(
            actual.len() == expected.len() && actual.iter().zip(expected).all(|(a, b)| (a - b).abs() < 1e-9),
            "{actual:?}, not {expected:?}"
        );
    };
    near(focals(&training_camera()), &[380.0]);
    near(focals(&Camera::typical((1280, 720)).unwrap()), &[380.0]);
    let webcam = [380.0, 135.0 / 240.0 * 0.79 * 640.0];
    near(focals(&Camera::typical((640, 480)).unwrap()), &webcam);
    near(focals(&Camera::typical((480, 640)).unwrap()), &webcam);
    let kinect = Camera::pinhole((1920, 1080), DVec2::new(1057.8, 1064.0), DVec2::new(947.6, 530.4)).unwrap();
    near(focals(&kinect), &[380.0, 240.0 / (1920.0 - 947.6) * 1057.8]);
    let fisheye = Camera::pinhole((800, 600), DVec2::new(250.0, 250.0), DVec2::new(400.0, 300.0)).unwrap();
    near(
        focals(&fisheye.with_fisheye([0.0; 4]).unwrap()),
        &[380.0, 285.0, 190.0, 142.5],
    );
    // A longer lens sees less than the training camera.
    near(
        focals(&Camera::pinhole((1920, 1080), DVec2::new(1686.8, 1694.2), DVec2::new(952.8, 563.5)).unwrap()),
        &[380.0],
    );
}

#[test]
fn a_mesh_that_comes_near_is_followed_in_a_wider_view_until_it_is_well_inside_the_nearer_one() {
    let views = CanonicalViews::new(&training_camera(), &Camera::typical((640, 480)).unwrap());
    let (near, wide) = (*views.nearest(), *views.widest());
    // A square of 100 mm: its corners are 50 f / z from the middle, of 135 pixels.
    let square =
        |z: f64| [(-50.0, -50.0), (50.0, -50.0), (50.0, 50.0), (-50.0, 50.0)].map(|(x, y)| DVec3::new(x, y, z));
    let mut view = near;
    let followed = [150.0, 144.05, 143.8, 150.0, 170.9, 171.3].map(|z| {
        view = *views.following(&view, &square(z));
        view
    });
    assert_eq!(followed, [near, near, wide, wide, wide, near]);
    // What is beyond the image does not count: nothing could show it.
    assert_eq!(views.following(&near, &square(20.0)), &near);
}

#[test]
fn an_object_is_cut_where_its_maps_end_at_the_view_and_the_image_goes_on() {
    let column = |x: usize| {
        let mut maps = Maps::empty((480, 270));
        (0..270).for_each(|y| maps.set(480 * y + x, 300.0, [0.5; 2]));
        maps
    };
    let mut inside = column(240);
    (0..9).chain(261..270).for_each(|y| inside.clear(480 * y + 240));
    // Of 640 x 480 pixels the view shows all columns, and not all rows.
    let views = CanonicalViews::new(&training_camera(), &Camera::typical((640, 480)).unwrap());
    assert!(!views.cuts(views.nearest(), &column(240)), "two pixels are no edge");
    let mut wide = Maps::empty((480, 270));
    (100..300).for_each(|pixel| wide.set(pixel, 300.0, [0.5; 2]));
    assert!(views.cuts(views.nearest(), &wide));
    assert!(!views.cuts(views.widest(), &wide) && !views.cuts(views.nearest(), &inside));
    assert!(!views.cuts(views.nearest(), &column(0)));
}
