//! Depth of one camera in the image of another: forward projection with a z-test.

use crate::recording::sensor::RgbdSensor;
use deepsft_geometry::Camera;
use deepsft_geometry::glam::{DVec2, DVec3};
use std::ops::Range;

/// Depths that fall into one pixel and differ from the nearest by less than this fraction are one surface and are
/// averaged: a dozen times the noise of a time-of-flight sensor, and less than a hand before a sheet.
const SAME_SURFACE: f64 = 0.03;

/// Brings the depth pictures of a sensor into the image of a camera that stands where the colour camera does (the
/// canonical camera: the colour camera with other intrinsics and without distortion).
///
/// Every depth pixel that measured something is a small square of the surface at its depth. The square is moved into the
/// target's frame and laid over the target's image, where it covers the pixels whose centres it holds; one that holds no
/// centre (the depth camera is finer) counts for the pixel in which it lies. Of all squares over a pixel the nearest
/// surface wins (z-test), and those of that surface are averaged.
///
/// A pixel over which no square lies is a hole: the depth camera did not see it, or measured nothing. Holes stay holes;
/// nothing is filled in, since a made-up depth would be learnt.
#[derive(Clone, Debug)]
pub struct DepthAlignment {
    sensor: RgbdSensor,
    target: Camera,
    /// Rays through the corners of the depth pixels, row-major, (width + 1) x (height + 1).
    corners: Vec<DVec2>,
}

impl DepthAlignment {
    /// From the depth pictures of `sensor` to the image of `target`, which has no lens distortion.
    pub fn new(sensor: &RgbdSensor, target: &Camera) -> Self {
        let (width, height) = (sensor.depth.width(), sensor.depth.height());
        let corners = (0..=height)
            .flat_map(|y| (0..=width).map(move |x| DVec2::new(f64::from(x), f64::from(y))))
            .map(|corner| sensor.depth.ray_from_pixel(corner))
            .collect();
        Self {
            sensor: sensor.clone(),
            target: *target,
            corners,
        }
    }

    /// Depth in mm of every pixel of the target, 0 in holes. `raw` are the numbers of a depth picture, row-major, 0 where
    /// nothing was measured.
    pub fn apply(&self, raw: &[u16]) -> Vec<f32> {
        let pixels = (self.target.width() * self.target.height()) as usize;
        let mut nearest = vec![f64::INFINITY; pixels];
        self.each_covered(raw, |pixel, depth| nearest[pixel] = nearest[pixel].min(depth));
        let mut sums = vec![(0.0, 0_u32); pixels];
        self.each_covered(raw, |pixel, depth| {
            if depth <= nearest[pixel] * (1.0 + SAME_SURFACE) {
                sums[pixel].0 += depth;
                sums[pixel].1 += 1;
            }
        });
        let mean = |(sum, count): (f64, u32)| {
            if count > 0 {
                (sum / f64::from(count)) as f32
            } else {
                0.0
            }
        };
        sums.into_iter().map(mean).collect()
    }

    /// Calls `each(target pixel, depth in the target's frame, mm)` for every pixel that every measured square covers.
    fn each_covered(&self, raw: &[u16], mut each: impl FnMut(usize, f64)) {
        let width = self.sensor.depth.width() as usize;
        let (columns, rows) = (self.target.width() as usize, self.target.height() as usize);
        let mm = 1000.0 / self.sensor.depth_scale;
        for (pixel, &units) in raw.iter().enumerate().filter(|(_, units)| **units > 0) {
            let corner = (pixel / width) * (width + 1) + pixel % width;
            let depth = f64::from(units) * mm;
            let moved = [corner, corner + width + 2].map(|index| self.moved(self.corners[index], depth));
            let [Some(a), Some(b)] = moved.map(|p| self.target.project(p)) else {
                continue;
            };
            let z = f64::midpoint(moved[0].z, moved[1].z);
            let across = covered(a.x, b.x, columns);
            for row in covered(a.y, b.y, rows) {
                for column in across.clone() {
                    each(row * columns + column, z);
                }
            }
        }
    }

    /// The point at `depth` along a ray of the depth camera, in the target's frame.
    fn moved(&self, ray: DVec2, depth: f64) -> DVec3 {
        self.sensor.color_from_depth.transform_point3(ray.extend(1.0) * depth)
    }
}

/// The pixels of a row of `length` whose centres lie between two positions; the pixel between them where there is none.
fn covered(a: f64, b: f64, length: usize) -> Range<usize> {
    let (low, high) = (a.min(b), a.max(b));
    // Negative positions become 0, the first pixel that is there.
    let (first, end) = ((low - 0.5).ceil(), (high - 0.5).ceil());
    let (first, end) = if first < end {
        (first, end)
    } else {
        let middle = f64::midpoint(low, high).floor();
        (middle, middle + 1.0)
    };
    let end = (end.max(0.0) as usize).min(length);
    (first.max(0.0) as usize).min(end)..end
}

#[cfg(test)]
mod tests {
    use super::*;
    use deepsft_geometry::glam::DAffine3;
    use deepsft_geometry::training_camera;

    /// A depth picture of `sensor`, in its units.
    fn picture(sensor: &RgbdSensor, depth_mm: impl Fn(f64, f64) -> f64) -> Vec<u16> {
        let (width, height) = (sensor.depth.width(), sensor.depth.height());
        let at = |i: u32| (f64::from(i % width) + 0.5, f64::from(i / width) + 0.5);
        (0..width * height)
            .map(|i| {
                let (x, y) = at(i);
                (depth_mm(x, y) / 1000.0 * sensor.depth_scale).round() as u16
            })
            .collect()
    }

    #[test]
    fn depth_of_the_target_camera_itself_is_copied_and_holes_stay() {
        let sensor = RgbdSensor::registered(training_camera());
        let mut raw = picture(&sensor, |x, y| 500.0 + x.floor() + y.floor());
        raw[7] = 0;
        let aligned = DepthAlignment::new(&sensor, &training_camera()).apply(&raw);
        assert!(aligned.iter().zip(&raw).all(|(&a, &r)| a == f32::from(r)));
        assert_eq!(aligned[7], 0.0);
    }

    #[test]
    fn four_times_as_fine_a_picture_is_averaged_over_the_surface_that_is_seen() {
        let color = training_camera().resized(1920, 1080).unwrap();
        let sensor = RgbdSensor {
            depth_scale: 5000.0,
            ..RgbdSensor::registered(color)
        };
        // 600 mm with noise of +-5 in turns; the left half of the image holds a post at 400 mm in every fourth column.
        let raw = picture(&sensor, |x, y| match (x as u32, y as u32) {
            (x, _) if x < 960 && x % 4 == 0 => 400.0,
            (x, y) => 600.0 + if (x + y).is_multiple_of(2) { 5.0 } else { -5.0 },
        });
        let aligned = DepthAlignment::new(&sensor, &training_camera()).apply(&raw);
        assert!(
            (aligned[100 * 480 + 100] - 400.0).abs() < 1e-3,
            "the nearest surface wins"
        );
        assert!((aligned[100 * 480 + 400] - 600.0).abs() < 1e-3, "noise is averaged");
        assert!(aligned.iter().all(|&d| d > 0.0), "no holes");
    }

    #[test]
    fn a_depth_camera_beside_sees_the_same_plane_and_leaves_a_hole_where_it_cannot_look() {
        // The depth camera is 50 mm to the right, half as fine. A wall at 800 mm, a screen at 400 mm before it in the
        // colour image's columns 240 to 300: X from 0 to 60 * 400 / 380 mm.
        let depth = training_camera().resized(240, 135).unwrap();
        let sensor = RgbdSensor {
            depth,
            color_from_depth: DAffine3::from_translation(DVec3::new(50.0, 0.0, 0.0)),
            ..RgbdSensor::registered(training_camera())
        };
        let right = 60.0 * 400.0 / 380.0;
        let raw = picture(&sensor, |x, _| {
            let ray = (x - 120.0) / 190.0;
            let at_screen = ray * 400.0 + 50.0;
            if (0.0..right).contains(&at_screen) {
                400.0
            } else {
                800.0
            }
        });
        let aligned = DepthAlignment::new(&sensor, &training_camera()).apply(&raw);
        let row = &aligned[135 * 480..136 * 480];
        // Squares are two pixels wide in the target: the edges are right to one of them.
        assert!(row[243..297].iter().all(|&d| d == 400.0), "{:?}", &row[235..305]);
        assert!(row[304..400].iter().all(|&d| d == 800.0));
        // The depth camera sees the wall left of the screen's left edge from x = 50 mm: the line through (0, 400) meets
        // the wall at X = -50, which is 50 / 800 * 380 = 24 px left of the colour image's middle.
        assert!(row[219..237].iter().all(|&d| d == 0.0), "{:?}", &row[210..245]);
        assert!(row[100..213].iter().all(|&d| d == 800.0));
    }

    #[test]
    fn squares_without_a_centre_count_where_they_lie_and_nothing_counts_outside() {
        assert_eq!(covered(3.6, 5.4, 10), 4..5);
        assert_eq!(covered(5.4, 3.4, 10), 3..5);
        assert_eq!(covered(3.6, 3.9, 10), 3..4);
        assert_eq!(covered(-3.0, -1.0, 10), 0..0);
        assert_eq!(covered(11.0, 14.0, 10), 10..10);
        assert_eq!(covered(-2.0, 20.0, 10), 0..10);
    }
}
