//! Where to look for a sheet that has moved farther than a fit can follow.

use crate::image::GreyImage;
use crate::maps::PairedSums;
use glam::DVec2;

/// Side of the cells in whose means print and image are compared, pixels of the canonical image: about what a quick hand blurs.
const CELL_PX: usize = 8;

/// Cells by which the sheet is moved at most, to each side: 72 pixels of the canonical image, 2.5 m/s half a metre away at 30 frames per second.
const FARTHEST: isize = 9;

/// Fraction of a cell that must be drawn for it to count.
const MIN_DRAWN: f32 = 0.5;

/// Fewest cells that are compared, and least fraction of those drawn: of a sheet that is moved out of the image little is
/// left.
const MIN_CELLS: usize = 24;
const MIN_FRACTION: f64 = 0.5;

/// The shift, in pixels, with which `drawn` (the print where `mask` is above 0) correlates best with `image`: both are
/// compared as means of cells, so blur and what bends in between hardly matter, and by correlation, so light does not.
/// Zero when there is too little to compare. The three are of one size.
pub(crate) fn best_shift(drawn: &GreyImage, mask: &[f32], image: &GreyImage) -> DVec2 {
    let [columns, rows] = [image.size.width, image.size.height].map(|side| side / CELL_PX);
    let seen = cells(image, None);
    let placed = |(k, mean): (usize, Option<f64>)| Some(((k % columns) as isize, (k / columns) as isize, mean?));
    let means = cells(drawn, Some(mask)).into_iter().enumerate();
    let cells: Vec<_> = means.filter_map(placed).collect();
    if cells.len() < MIN_CELLS {
        return DVec2::ZERO;
    }
    let fewest = MIN_CELLS.max((MIN_FRACTION * cells.len() as f64) as usize);
    let correlation = |dx: isize, dy: isize| {
        let mut sums = PairedSums::default();
        for &(x, y, printed) in &cells {
            let (x, y) = (x + dx, y + dy);
            if (0..columns as isize).contains(&x)
                && (0..rows as isize).contains(&y)
                && let Some(value) = seen[y as usize * columns + x as usize]
            {
                sums.add(printed, value);
            }
        }
        (sums.count as usize >= fewest).then(|| sums.correlation())
    };
    let shifts = (-FARTHEST..=FARTHEST).flat_map(|dy| (-FARTHEST..=FARTHEST).map(move |dx| (dx, dy)));
    let correlated = shifts.filter_map(|(dx, dy)| Some((correlation(dx, dy)?, dx, dy)));
    let Some((peak, dx, dy)) = correlated.max_by(|a, b| a.0.total_cmp(&b.0)) else {
        return DVec2::ZERO;
    };
    let within = |before: Option<f64>, after: Option<f64>| match (before, after) {
        (Some(before), Some(after)) => top_of_parabola(before, peak, after),
        _ => 0.0,
    };
    let cell = DVec2::new(
        dx as f64 + within(correlation(dx - 1, dy), correlation(dx + 1, dy)),
        dy as f64 + within(correlation(dx, dy - 1), correlation(dx, dy + 1)),
    );
    cell * CELL_PX as f64
}

/// Mean of each whole cell, row-major, over the pixels where `mask` is above 0; `None` where that is too little.
fn cells(image: &GreyImage, mask: Option<&[f32]>) -> Vec<Option<f64>> {
    let [columns, rows] = [image.size.width, image.size.height].map(|side| side / CELL_PX);
    let mean = |cell: usize| {
        let (left, top) = (cell % columns * CELL_PX, cell / columns * CELL_PX);
        let (mut sum, mut weight) = (0.0_f32, 0.0_f32);
        for y in top..top + CELL_PX {
            for pixel in (y * image.size.width + left..).take(CELL_PX) {
                if mask.is_none_or(|mask| mask[pixel] > 0.0) {
                    sum += image.values[pixel];
                    weight += 1.0;
                }
            }
        }
        let drawn = weight >= MIN_DRAWN * (CELL_PX * CELL_PX) as f32;
        drawn.then(|| f64::from(sum / weight))
    };
    (0..columns * rows).map(mean).collect()
}

/// Where the parabola through three values a step apart is highest, from the middle one, -1/2 to 1/2.
fn top_of_parabola(before: f64, middle: f64, after: f64) -> f64 {
    let curvature = before - 2.0 * middle + after;
    if curvature < 0.0 {
        (0.5 * (before - after) / curvature).clamp(-0.5, 0.5)
    } else {
        0.0
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn too_small_a_sheet_moves_nothing() {
        let values = (0..480 * 270).map(|p| (p * 7919 % 251) as f32).collect();
        let size = (480, 270).into();
        let grey = GreyImage { size, values };
        let mut mask = vec![0.0; 480 * 270];
        assert_eq!(best_shift(&grey, &mask, &grey), DVec2::ZERO);
        mask[..16].fill(1.0);
        assert_eq!(best_shift(&grey, &mask, &grey), DVec2::ZERO);
    }
}
