//! Which pixels of a measured depth map are compared.

use deepsft_geometry::Maps;

/// Pixels by which a mask is taken in before depth is compared: where the sensor's edges fly and cameras differ.
const DEPTH_MARGIN: usize = 2;

/// Measured and estimated depths that differ by more than this share are taken for something else than the object: a hand
/// before it, the wall behind it.
const LARGEST_DIFFERENCE: f32 = 0.15;

/// Where measured depths are compared with estimated ones: two pixels inside the mask of `maps`, where something was
/// measured that differs by less than 15 % from the estimate.
pub(crate) fn depth_counts(maps: &Maps, depth_mm: &[f32]) -> Vec<bool> {
    let (width, height) = (maps.width(), maps.height());
    let margin = DEPTH_MARGIN;
    let well_inside = |pixel: usize| {
        let (x, y) = (pixel % width, pixel / width);
        x >= margin
            && y >= margin
            && x + margin < width
            && y + margin < height
            && (y - margin..=y + margin)
                .all(|row| (x - margin..=x + margin).all(|column| maps.inside(row * width + column)))
    };
    (0..width * height)
        .map(|pixel| {
            let (measured, estimated) = (depth_mm[pixel], maps.depth()[pixel]);
            measured > 0.0
                && maps.inside(pixel)
                && (measured - estimated).abs() < LARGEST_DIFFERENCE * estimated
                && well_inside(pixel)
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn depth_counts_well_inside_the_object_where_it_was_measured_and_is_near_what_was_estimated() {
        let mut maps = Maps::empty(20, 12);
        for y in 2..10 {
            for x in 3..15 {
                maps.set(y * 20 + x, 600.0, [0.5; 2]);
            }
        }
        let mut depth = vec![610.0; 240];
        depth[5 * 20 + 7] = 0.0;
        depth[6 * 20 + 7] = 480.0;
        let counts = depth_counts(&maps, &depth);
        let at = |x: usize, y: usize| counts[y * 20 + x];
        // Columns 3 to 14 and rows 2 to 9 less two on each side, less two pixels.
        assert_eq!(counts.iter().filter(|&&c| c).count(), 8 * 4 - 2);
        assert!(at(5, 4) && at(12, 7) && !at(4, 4) && !at(13, 4) && !at(7, 5) && !at(7, 6));
    }
}
