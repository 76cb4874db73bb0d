//! Islands of a mask: pieces too small to be the object.

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
