//! Rest positions of a box: each side is a chart of its own.

use crate::printed_box::{SIDES, on_side, printed_box};
use deepsft_geometry::glam::{DVec2, DVec3};
use deepsft_geometry::metrics::frame_metrics;
use deepsft_geometry::{Maps, Picture, RestSurface, Template, training_camera};

/// Numbers in 0..1 without a pattern.
struct Numbers(u64);

impl Numbers {
    fn next(&mut self) -> f64 {
        self.0 = self
            .0
            .wrapping_mul(6_364_136_223_846_793_005)
            .wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 11) as f64 / (1_u64 << 53) as f64
    }

    fn point(&mut self) -> DVec3 {
        DVec3::new(self.next(), self.next(), self.next())
    }
}

fn box_template() -> Template {
    printed_box(1, Picture::from_fn(30, 20, |_, _| [0; 3]))
}

/// The rest position of a point of the unit cube whose sides are the box's: the longest is 1.
fn rest_position(point: DVec3) -> DVec3 {
    (point - 0.5) * SIDES / 100.0 + 0.5
}

#[test]
fn every_texture_position_has_its_rest_position_and_comes_back() {
    let surface = RestSurface::new(&box_template());
    assert_eq!(RestSurface::side_mm(&box_template()), 100.0);
    let mut numbers = Numbers(1);
    for k in (0..6).cycle().take(300) {
        let (point, uv) = on_side(k, DVec2::new(numbers.next(), numbers.next()));
        let position = surface.position(uv).unwrap();
        assert!(
            (position - rest_position(point)).length() < 1e-9,
            "side {k}: {position}"
        );
        // Points on a face's border are drawn inside by a ten-thousandth of it.
        let back = surface.registration(position).unwrap();
        assert!((back - uv).length() < 1e-4, "side {k}: {back} for {uv}");
    }
    assert_eq!(surface.position(DVec2::new(0.001, 0.001)), None, "between the charts");
    assert_eq!(surface.registration(DVec3::NAN), None);
}

#[test]
fn a_position_off_the_surface_is_that_of_the_nearest_point() {
    let surface = RestSurface::new(&box_template());
    let mut numbers = Numbers(2);
    for _ in 0..2000 {
        let position = numbers.point() * 2.0 - 0.5;
        // In mm from the box's middle.
        let point = (position - 0.5) * 100.0;
        let mut nearest = point.clamp(-SIDES / 2.0, SIDES / 2.0);
        if nearest == point {
            // Inside: out through the nearest side.
            let room = SIDES / 2.0 - point.abs();
            let axis = if room.x <= room.y.min(room.z) {
                0
            } else if room.y <= room.z {
                1
            } else {
                2
            };
            nearest[axis] = SIDES[axis] / 2.0 * point[axis].signum();
        }
        let expected = nearest.distance(point);
        let uv = surface.registration(position).unwrap();
        let found = (surface.position(uv).unwrap() - 0.5) * 100.0;
        assert!(
            found.distance(point) < expected + 0.02,
            "{point}: {found}, not {nearest}"
        );
    }
}

#[test]
fn gradients_are_those_of_the_registration_along_the_surface() {
    let surface = RestSurface::new(&box_template());
    const STEP: f64 = 1e-3;
    for k in 0..6 {
        let (point, _) = on_side(k, DVec2::new(0.3, 0.6));
        let position = rest_position(point);
        let uv = surface.registration(position).unwrap();
        let gradients = surface.registration_gradients(position).unwrap();
        for axis in [DVec3::X, DVec3::Y, DVec3::Z] {
            let moved = surface.registration(position + axis * STEP).unwrap() - uv;
            let predicted = DVec2::new(gradients[0].dot(axis), gradients[1].dot(axis)) * STEP;
            assert!(
                (moved - predicted).length() < 1e-3 * STEP,
                "side {k}, {axis}: {moved} {predicted}"
            );
        }
    }
}

#[test]
fn an_error_over_an_edge_is_as_long_as_the_way_in_space() {
    // Frontal at 380 mm: a pixel is a millimetre. The side k = 4 fills 60 x 100 pixels.
    let template = box_template();
    let mut truth = Maps::empty((480, 270));
    for y in 0..100 {
        for x in 0..60 {
            let (_, uv) = on_side(4, DVec2::new((x as f64 + 0.5) / 60.0, (y as f64 + 0.5) / 100.0));
            truth.set((y + 80) * 480 + x + 200, 380.0, uv.as_vec2().to_array());
        }
    }
    // The last column but one is taken for what is half a millimetre around the edge: 2 mm away.
    let mut predicted = truth.clone();
    for y in 0..100 {
        let (_, uv) = on_side(1, DVec2::new((y as f64 + 0.5) / 100.0, 0.5 / 40.0));
        predicted.set((y + 80) * 480 + 258, 380.0, uv.as_vec2().to_array());
    }
    let metrics = frame_metrics(&predicted, &truth, &training_camera(), &template).unwrap();
    let expected = (1.5_f64.hypot(0.5).powi(2) / 60.0).sqrt();
    let mm = metrics.registration_rmse_mm.unwrap();
    assert!((mm - expected).abs() < 1e-3, "{mm} mm for {expected}");
    // In pixels only what lies along the side counts; of the 58 columns and 98 rows that have neighbours.
    let px = metrics.registration_rmse_px.unwrap();
    assert!((px - (1.5_f64.powi(2) / 58.0).sqrt()).abs() < 1e-3, "{px} px");
    // In the texture it is far away.
    let flat = frame_metrics(&predicted, &truth, &training_camera(), template.size_mm()).unwrap();
    assert!(flat.registration_rmse_mm.unwrap() > 5.0);
}
