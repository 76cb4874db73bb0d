//! Islands of a mask, pieces too small to be the object, and its margin.

use super::depth_and_registration::{Maps, OUTSIDE};
use crate::mesh::DisjointSets;
use std::ops::Range;

/// Clears small connected components of the maps' mask and returns the number of pixels cleared. Pixels are joined by
/// their sides; small is less than `min_fraction` of the largest component. A hand before a sheet cuts it into
/// several large pieces, which stay; a few pixels far from it are a network's mistake. Linear in the mask's area.
///
/// ```
/// use deepsft_geometry::{Maps, remove_islands};
/// let mut maps = Maps::empty((480, 270));
/// (0..100).for_each(|x| maps.set(480 + x, 500.0, [0.5, 0.5]));
/// maps.set(48_000, 500.0, [0.5, 0.5]);
/// assert_eq!(remove_islands(&mut maps, 0.05), 1);
/// assert_eq!(maps.area(), 100);
/// ```
pub fn remove_islands(maps: &mut Maps, min_fraction: f64) -> usize {
    let width = maps.size().width;
    // Pixels of one row that are next to each other and inside the mask, and which of these runs hang together.
    let (mut runs, mut pieces) = (Vec::<Range<usize>>::new(), DisjointSets::default());
    let mut above = 0..0;
    for row in 0..maps.size().height {
        let first = runs.len();
        let mut end = row * width;
        let alike = |a: &f32, b: &f32| (*a > OUTSIDE) == (*b > OUTSIDE);
        for run in maps.depth()[end..][..width].chunk_by(alike) {
            let start = end;
            end += run.len();
            if maps.inside(start) {
                runs.push(start..end);
                pieces.add();
            }
        }
        // Both rows' runs ascend: walk them side by side.
        let (mut upper, mut lower) = (above.start, first);
        while upper < above.end && lower < runs.len() {
            let (top, bottom) = (&runs[upper], &runs[lower]);
            if top.start + width < bottom.end && bottom.start < top.end + width {
                pieces.join(upper, lower);
            }
            if runs[upper].end + width < runs[lower].end {
                upper += 1;
            } else {
                lower += 1;
            }
        }
        above = first..runs.len();
    }
    let mut areas = vec![0; runs.len()];
    for (index, run) in runs.iter().enumerate() {
        areas[pieces.first(index)] += run.len();
    }
    let largest = areas.iter().copied().max().unwrap_or(0);
    let mut cleared = 0;
    for (index, run) in runs.into_iter().enumerate() {
        if (areas[pieces.first(index)] as f64) < min_fraction * largest as f64 {
            cleared += run.len();
            run.for_each(|pixel| maps.clear(pixel));
        }
    }
    cleared
}

/// Clears every pixel of a 0-or-1 mask (rows of `width`) within `margin` pixels, along rows and columns, of one that is
/// clear. The image's border does not count: an object that it cuts off goes on beyond.
pub(crate) fn erode(mask: &mut [f32], width: usize, margin: usize) {
    if margin == 0 || width == 0 {
        return;
    }
    let mut padded = vec![1.0; width + 2 * margin];
    for row in mask.chunks_exact_mut(width) {
        padded[margin..margin + width].copy_from_slice(row);
        (0..=2 * margin).for_each(|shift| clear_where_clear(row, &padded[shift..]));
    }
    let across = mask.to_vec();
    for (y, row) in mask.chunks_exact_mut(width).enumerate() {
        let near = across.chunks_exact(width).take(y + margin + 1);
        let near = near.skip(y.saturating_sub(margin));
        near.for_each(|other| clear_where_clear(row, other));
    }
}

/// Products: compilers make vector instructions of them.
fn clear_where_clear(row: &mut [f32], other: &[f32]) {
    row.iter_mut().zip(other).for_each(|(mask, other)| *mask *= other);
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn erosion_takes_the_margin_away_but_not_at_the_images_border() {
        // Columns 2 to 9 of 10, all 6 rows but the last.
        let mut mask: Vec<f32> = (0..60).map(|i| f32::from(u8::from(i % 10 >= 2 && i < 50))).collect();
        erode(&mut mask, 10, 2);
        for (i, &m) in mask.iter().enumerate() {
            let kept = i % 10 >= 4 && i < 30;
            assert_eq!(m > 0.0, kept, "column {}, row {}", i % 10, i / 10);
        }
    }
}
