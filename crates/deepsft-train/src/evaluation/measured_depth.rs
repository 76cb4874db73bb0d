//! Which pixels of a measured depth map are compared with an estimate.

use deepsft_geometry::{ImageSize, Maps};

/// Pixels by which a mask is taken in before depth is compared: where the sensor's edges fly and cameras differ.
const MARGIN: usize = 2;

/// In training, measured and estimated depths that differ by more than this fraction are taken for something else than the
/// object: a hand before it, the wall behind it.
const LARGEST_DIFFERENCE: f32 = 0.15;

/// Neighbours whose measured depths differ by more than this fraction lie on two surfaces: at a focal length of 380 pixels a
/// surface that is tilted by 85 degrees changes by as much from pixel to pixel.
const LARGEST_STEP: f32 = 0.03;

/// Where training compares measured depths with the estimate `maps`: two pixels inside its mask, where something was measured
/// that differs by less than 15 % from the estimate.
pub(crate) fn trusted_depth(maps: &Maps, depth_mm: &[f32]) -> Vec<bool> {
    let well_inside = eroded(&maps.mask(), maps.size().width, false);
    let near = |pixel: usize| {
        let (measured, estimated) = (depth_mm[pixel], maps.depth()[pixel]);
        measured > 0.0 && (measured - estimated).abs() < LARGEST_DIFFERENCE * estimated
    };
    (0..depth_mm.len())
        .map(|pixel| well_inside[pixel] && near(pixel))
        .collect()
}

/// The measured depth as maps, inside where networks are measured against it, with a registration that means nothing: two
/// pixels inside the mask `object` and away from jumps of the measured depth. No estimate has a say in it, so that an error of
/// any size counts, and all networks are compared over the same pixels. `depth_mm` is 0 where nothing was measured.
pub(crate) fn measured_maps(object: &[bool], depth_mm: &[f32], size: ImageSize) -> Maps {
    let (width, mut surface) = (size.width, object.to_vec());
    let mut check = |one: usize, other: usize| {
        let (a, b) = (depth_mm[one], depth_mm[other]);
        if a > 0.0 && b > 0.0 && (a - b).abs() > LARGEST_STEP * a.min(b) {
            surface[one] = false;
            surface[other] = false;
        }
    };
    for pixel in 0..depth_mm.len() {
        if (pixel + 1) % width != 0 {
            check(pixel, pixel + 1);
        }
        if pixel + width < depth_mm.len() {
            check(pixel, pixel + width);
        }
    }
    let well_inside = eroded(&surface, width, false);
    let mut maps = Maps::empty(size);
    for pixel in (0..depth_mm.len()).filter(|&pixel| well_inside[pixel] && depth_mm[pixel] > 0.0) {
        maps.set(pixel, depth_mm[pixel], [0.5; 2]);
    }
    maps
}

/// The pixels whose neighbours up to two pixels away are all in `mask`; `beyond` says whether those beyond the image are.
pub(crate) fn eroded(mask: &[bool], width: usize, beyond: bool) -> Vec<bool> {
    let height = mask.len() / width.max(1);
    let inside = |x: usize, y: usize| {
        let (right, below) = (x + MARGIN, y + MARGIN);
        if !beyond && (x < MARGIN || y < MARGIN || right >= width || below >= height) {
            return false;
        }
        let columns = x.saturating_sub(MARGIN)..=right.min(width - 1);
        let mut rows = y.saturating_sub(MARGIN)..=below.min(height - 1);
        rows.all(|row| columns.clone().all(|column| mask[row * width + column]))
    };
    (0..mask.len())
        .map(|pixel| mask[pixel] && inside(pixel % width, pixel / width))
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// 12 x 8 pixels of 20 x 12 at 600 mm.
    fn sheet() -> Maps {
        let mut maps = Maps::empty((20, 12));
        for y in 2..10 {
            for x in 3..15 {
                maps.set(y * 20 + x, 600.0, [0.5; 2]);
            }
        }
        maps
    }

    #[test]
    fn training_trusts_depth_well_inside_the_object_that_is_near_what_was_estimated() {
        let mut depth = vec![610.0; 240];
        depth[5 * 20 + 7] = 0.0;
        depth[6 * 20 + 7] = 480.0;
        let counts = trusted_depth(&sheet(), &depth);
        let at = |x: usize, y: usize| counts[y * 20 + x];
        // Columns 3 to 14 and rows 2 to 9 less two on each side, less two pixels.
        assert_eq!(counts.iter().filter(|&&c| c).count(), 8 * 4 - 2);
        assert!(at(5, 4) && at(12, 7) && !at(4, 4) && !at(13, 4) && !at(7, 5) && !at(7, 6));
    }
}
