//! Corners of a grey picture: the segment test (Rosten and Drummond 2006), ranked by Harris's measure, with the direction of
//! the intensity centroid (Rosin 1999), as ORB does (Rublee et al. 2011).

use crate::pyramid::PyramidLevel;

/// Pixels at a level's border in which no corner is taken: descriptors reach this far.
pub(crate) const MARGIN: usize = 16;

/// Radius of the disc whose intensity centroid gives a corner its direction, pixels.
const CENTROID_RADIUS: i32 = 15;

/// Side of the cells among which the corners are dealt out, pixels.
const CELL: usize = 32;

/// Across from the centre to the pixels of the circle of radius 3, clockwise from the top; down it is the same a quarter earlier.
const CIRCLE: [isize; 16] = [0, 1, 2, 3, 3, 3, 2, 1, 0, -1, -2, -3, -3, -3, -2, -1];

#[derive(Clone, Copy, Debug)]
pub(crate) struct Corner {
    pub x: u16,
    pub y: u16,
    /// Harris's measure.
    pub strength: f32,
    /// Direction from the corner to the intensity centroid, radians.
    pub angle: f32,
}

/// At most about `budget` corners of a level, spread over it: cells of 32 pixels have the same number each, and what poor
/// cells leave goes to the strongest corners anywhere. `threshold`: least difference in grey levels.
pub(crate) fn corners(level: &PyramidLevel, threshold: u8, budget: usize) -> Vec<Corner> {
    let (width, height) = (level.width, level.height);
    if width <= 2 * MARGIN + 1 || height <= 2 * MARGIN + 1 {
        return Vec::new();
    }
    let cells = width.div_ceil(CELL) * height.div_ceil(CELL);
    let mut dealt = dealt(scored(level, threshold), cells, budget);
    // Half widths of the rows of the disc, from the middle down.
    let halves: [i32; CENTROID_RADIUS as usize + 1] =
        std::array::from_fn(|v| ((CENTROID_RADIUS * CENTROID_RADIUS - (v * v) as i32) as f32).sqrt() as i32);
    for corner in &mut dealt {
        corner.angle = centroid_angle(level, corner, &halves);
    }
    dealt
}

/// Corners by the segment test: nine pixels of the circle in a row are all brighter or all darker by more than `threshold`. With their cells;
/// only those whose score no neighbour exceeds. The score is the largest threshold under which a pixel is a corner.
fn scored(level: &PyramidLevel, threshold: u8) -> Vec<(usize, Corner)> {
    let (width, height, values) = (level.width, level.height, &level.values);
    let offsets: [isize; 16] = std::array::from_fn(|k| CIRCLE[(k + 12) % 16] * width as isize + CIRCLE[k]);
    let (mut scores, mut scored) = (vec![0_u8; values.len()], Vec::new());
    let length = width - 2 * (MARGIN - 1);
    let mut possible = vec![0; length];
    for y in MARGIN - 1..height - MARGIN + 1 {
        let start = y * width + MARGIN - 1;
        let row = |offset: isize| &values[start.wrapping_add_signed(offset)..][..length];
        // Nine in a row hold one of each pair of opposite pixels.
        let pairs = [0, 2, 4, 6].map(|k| [row(offsets[k]), row(offsets[k + 8])]);
        possible_corners(&mut possible, row(0), &pairs, threshold);
        for x in marked(&possible) {
            let i = start + x;
            let centre = i16::from(values[i]);
            let ring: [i16; 16] =
                std::array::from_fn(|k| i16::from(values[i.wrapping_add_signed(offsets[k])]) - centre);
            let score = longest_run(&std::array::from_fn(|k| ring[k % 16]));
            if score > i16::from(threshold) {
                scores[i] = score.min(255) as u8;
                scored.push(i);
            }
        }
    }
    let columns = width.div_ceil(CELL);
    let corner = |i: usize| {
        let (x, y, score) = (i % width, i / width, scores[i]);
        if !(MARGIN..width - MARGIN).contains(&x) || !(MARGIN..height - MARGIN).contains(&y) {
            return None;
        }
        let before = [i - width - 1, i - width, i - width + 1, i - 1];
        let after = [i + 1, i + width - 1, i + width, i + width + 1];
        // Of equal neighbours the first is kept.
        if before.iter().any(|&j| scores[j] >= score) || after.iter().any(|&j| scores[j] > score) {
            return None;
        }
        let corner = Corner {
            x: x as u16,
            y: y as u16,
            strength: harris(level, x, y),
            angle: 0.0,
        };
        Some((y / CELL * columns + x / CELL, corner))
    };
    scored.into_iter().filter_map(corner).collect()
}

/// The strongest corners of each of so many cells, then the strongest of the rest.
fn dealt(mut found: Vec<(usize, Corner)>, cells: usize, budget: usize) -> Vec<Corner> {
    let strongest_first = |a: &Corner, b: &Corner| b.strength.total_cmp(&a.strength);
    found.sort_unstable_by(|a, b| a.0.cmp(&b.0).then(strongest_first(&a.1, &b.1)));
    let each = (budget / 2).div_ceil(cells.max(1));
    let (mut kept, mut rest) = (Vec::new(), Vec::new());
    for cell in found.chunk_by(|a, b| a.0 == b.0) {
        let (first, others) = cell.split_at(each.min(cell.len()));
        kept.extend(first.iter().map(|found| found.1));
        rest.extend(others.iter().map(|found| found.1));
    }
    let left = budget.saturating_sub(kept.len());
    if left < rest.len() {
        rest.select_nth_unstable_by(left, strongest_first);
        rest.truncate(left);
    }
    kept.append(&mut rest);
    kept
}

/// Marks the pixels of a row of which each pair has one that is brighter by more than `threshold`, or each one that is darker.
fn possible_corners(possible: &mut [u8], row: &[u8], pairs: &[[&[u8]; 2]; 4], threshold: u8) {
    let pairs = pairs.map(|pair| pair.map(|pixels| &pixels[..row.len()]));
    for (x, (possible, &centre)) in possible.iter_mut().zip(row).enumerate() {
        let (mut brighter, mut darker) = (u8::MAX, u8::MAX);
        for [a, b] in pairs {
            brighter = brighter.min(a[x].max(b[x]).saturating_sub(centre));
            darker = darker.min(centre.saturating_sub(a[x].min(b[x])));
        }
        *possible = brighter.max(darker).saturating_sub(threshold);
    }
}

/// Indices of the values that are not 0, where most are.
fn marked(values: &[u8]) -> impl Iterator<Item = usize> {
    let chunks = values.chunks(16).enumerate();
    let any = chunks.filter(|(_, chunk)| chunk.iter().fold(0, |all, value| all | value) != 0);
    any.flat_map(|(k, chunk)| (0..chunk.len()).filter(|&x| chunk[x] != 0).map(move |x| 16 * k + x))
}

/// The largest value that nine neighbours of the ring (written twice) all reach, or all fall below as its negative.
fn longest_run(ring: &[i16; 32]) -> i16 {
    let (mut low, mut high) = (*ring, *ring);
    for reach in [1, 2, 4] {
        for k in 0..32 - reach {
            low[k] = low[k].min(low[k + reach]);
            high[k] = high[k].max(high[k + reach]);
        }
    }
    let mut best = 0;
    for k in 0..16 {
        best = best.max(low[k].min(ring[k + 8])).max(-high[k].max(ring[k + 8]));
    }
    best
}

/// Harris's measure over 7 x 7 pixels.
fn harris(level: &PyramidLevel, x: usize, y: usize) -> f32 {
    let width = level.width;
    let at = |x: usize, y: usize| f32::from(level.values[y * width + x]);
    let (mut xx, mut yy, mut xy) = (0.0_f32, 0.0_f32, 0.0_f32);
    for v in y - 3..=y + 3 {
        for u in x - 3..=x + 3 {
            let (dx, dy) = (at(u + 1, v) - at(u - 1, v), at(u, v + 1) - at(u, v - 1));
            xx += dx * dx;
            yy += dy * dy;
            xy += dx * dy;
        }
    }
    xx * yy - xy * xy - 0.04 * (xx + yy).powi(2)
}

fn centroid_angle(level: &PyramidLevel, corner: &Corner, halves: &[i32]) -> f32 {
    let (x, y) = (usize::from(corner.x), usize::from(corner.y));
    let (mut across, mut down) = (0_i32, 0_i32);
    for v in -CENTROID_RADIUS..=CENTROID_RADIUS {
        let half = halves[v.unsigned_abs() as usize];
        let start = (y as i32 + v) as usize * level.width + (x as i32 - half) as usize;
        let mut sum = 0_i32;
        for (u, &value) in (-half..).zip(&level.values[start..=start + 2 * half as usize]) {
            sum += i32::from(value);
            across += u * i32::from(value);
        }
        down += v * sum;
    }
    (down as f32).atan2(across as f32)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn nine_in_a_row_count_and_eight_do_not() {
        let ring = |count: usize, value: i16| {
            std::array::from_fn::<i16, 32, _>(|k| if (k % 16 + 3) % 16 < count { value } else { 0 })
        };
        assert_eq!(longest_run(&ring(9, 40)), 40);
        assert_eq!(longest_run(&ring(9, -40)), 40);
        assert_eq!(longest_run(&ring(8, 40)), 0);
        assert_eq!(longest_run(&ring(16, 7)), 7);
    }
}
