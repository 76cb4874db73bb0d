//! Depth of one camera in the image of another: forward projection with a z-test.

use crate::recording::sensor::RgbdSensor;
use deepsft_geometry::Camera;
use deepsft_geometry::glam::{DVec2, DVec3};
use std::ops::Range;

/// Depths that fall into one pixel and differ from the nearest by less than this fraction are one surface and are
/// averaged: a dozen times the noise of a time-of-flight sensor, and less than a hand before a sheet.
const SAME_SURFACE: f64 = 0.03;

/// Most pixels of the target along a side of a square. A depth camera with a square as large has some ten columns, or the
/// square lies at the target's pinhole, where a wrong pose puts it; then every square could cover the whole image.
const LARGEST_SQUARE: usize = 48;

/// Alignment of a depth sensor's pictures with a target camera that stands where the colour camera does. The target is the
/// canonical camera: it has other intrinsics and no distortion.
///
/// Every depth pixel that measured something is a small square of the surface at its depth. The square is projected into
/// the target's image, where it covers the pixels whose centres it holds. Where the depth camera is finer, a square can
/// hold no centre; it then covers the pixel in which it lies. Of all squares over a pixel the nearest surface wins
/// (z-test), and the squares of that surface are averaged.
///
/// A pixel without a square is a hole: the depth camera did not see it, or measured nothing, or a square is larger than
/// any that a camera's pixel has. Holes stay holes, because a
/// network would learn a made-up depth.
#[derive(Clone, Debug)]
pub(crate) struct DepthAlignment {
    sensor: RgbdSensor,
    target: Camera,
    /// Rays through the corners of the depth pixels, row-major, (width + 1) x (height + 1).
    corners: Vec<DVec2>,
}

impl DepthAlignment {
    /// From the depth pictures of `sensor` to the image of `target`, which has no lens distortion.
    pub(crate) fn new(sensor: &RgbdSensor, target: &Camera) -> Self {
        let (width, height) = (sensor.depth.size().width, sensor.depth.size().height);
        let corners = (0..=height)
            .flat_map(|y| (0..=width).map(move |x| DVec2::new(x as f64, y as f64)))
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
    pub(crate) fn apply(&self, raw: &[u16]) -> Vec<f32> {
        let pixels = self.target.size().width * self.target.size().height;
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
        let width = self.sensor.depth.size().width;
        let (columns, rows) = (self.target.size().width, self.target.size().height);
        let mm = 1000.0 / self.sensor.depth_scale;
        for (pixel, &units) in raw.iter().enumerate().filter(|(_, units)| **units > 0) {
            let corner = (pixel / width) * (width + 1) + pixel % width;
            let depth = f64::from(units) * mm;
            let moved = [corner, corner + width + 2].map(|index| self.moved(self.corners[index], depth));
            let [Some(a), Some(b)] = moved.map(|p| self.target.project(p)) else {
                continue;
            };
            let z = f64::midpoint(moved[0].z, moved[1].z);
            let (across, down) = (covered(a.x, b.x, columns), covered(a.y, b.y, rows));
            if across.len().max(down.len()) > LARGEST_SQUARE {
                continue;
            }
            for row in down {
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

/// The pixels of a row of `length` whose centres lie between two positions; if there are none, the pixel between them.
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
