//! Corners of a grey picture: the segment test (Rosten and Drummond 2006), ranked by Harris's measure, with the direction of
//! the intensity centroid (Rosin 1999), as ORB does (Rublee et al. 2011).

use crate::pyramid::Level;

/// Pixels at a level's border in which no corner is taken: descriptors reach this far.
pub(crate) const MARGIN: usize = 16;

/// Radius of the disc whose intensity centroid gives a corner its direction, pixels.
const CENTROID_RADIUS: i32 = 15;

/// Side of the cells among which the corners are dealt out, pixels.
const CELL: usize = 32;

/// The circle of radius 3 around a pixel, clockwise from the top.
const CIRCLE: [(i32, i32); 16] = [
    (0, -3),
    (1, -3),
    (2, -2),
    (3, -1),
    (3, 0),
    (3, 1),
    (2, 2),
    (1, 3),
    (0, 3),
    (-1, 3),
    (-2, 2),
    (-3, 1),
    (-3, 0),
    (-3, -1),
    (-2, -2),
    (-1, -3),
];

/// A corner of one level.
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
pub(crate) fn corners(level: &Level, threshold: u8, budget: usize) -> Vec<Corner> {
    let (width, height) = (level.width, level.height);
    if width <= 2 * MARGIN + 1 || height <= 2 * MARGIN + 1 {
        return Vec::new();
    }
    let scores = segment_scores(level, threshold);
    let (columns, rows) = (width.div_ceil(CELL), height.div_ceil(CELL));
    let mut cells: Vec<Vec<Corner>> = vec![Vec::new(); columns * rows];
    for y in MARGIN..height - MARGIN {
        for x in MARGIN..width - MARGIN {
            let i = y * width + x;
            let score = scores[i];
            if score == 0 {
                continue;
            }
            let before = [i - width - 1, i - width, i - width + 1, i - 1];
            let after = [i + 1, i + width - 1, i + width, i + width + 1];
            // Of equal neighbours the first is kept.
            if before.iter().any(|&j| scores[j] >= score) || after.iter().any(|&j| scores[j] > score) {
                continue;
            }
            cells[y / CELL * columns + x / CELL].push(Corner {
                x: x as u16,
                y: y as u16,
                strength: harris(level, x, y),
                angle: 0.0,
            });
        }
    }
    let mut kept = dealt(cells, budget);
    let halves = disc_halves();
    for corner in &mut kept {
        corner.angle = centroid_angle(level, corner, &halves);
    }
    kept
}

/// The strongest corners of each cell, then the strongest of the rest.
fn dealt(mut cells: Vec<Vec<Corner>>, budget: usize) -> Vec<Corner> {
    let strongest_first = |a: &Corner, b: &Corner| b.strength.total_cmp(&a.strength);
    let each = (budget / 2).div_ceil(cells.len().max(1));
    let (mut kept, mut rest) = (Vec::new(), Vec::new());
    for cell in &mut cells {
        cell.sort_by(strongest_first);
        let first = each.min(cell.len());
        rest.extend_from_slice(&cell[first..]);
        kept.extend_from_slice(&cell[..first]);
    }
    rest.sort_by(strongest_first);
    rest.truncate(budget.saturating_sub(kept.len()));
    kept.extend(rest);
    kept
}

/// For each pixel the largest threshold under which it is a corner: nine pixels of the circle in a row are all brighter or all
/// darker by more. 0 where that is not above `threshold`.
fn segment_scores(level: &Level, threshold: u8) -> Vec<u8> {
    let (width, height, values) = (level.width, level.height, &level.values);
    let offsets = CIRCLE.map(|(dx, dy)| dy as isize * width as isize + dx as isize);
    let mut scores = vec![0_u8; values.len()];
    let threshold = i16::from(threshold);
    for y in MARGIN - 1..height - MARGIN + 1 {
        for x in MARGIN - 1..width - MARGIN + 1 {
            let i = y * width + x;
            let centre = i16::from(values[i]);
            let difference = |k: usize| i16::from(values[i.wrapping_add_signed(offsets[k])]) - centre;
            // Nine in a row hold one of each pair of opposite pixels.
            let near = |k: usize| difference(k).abs() <= threshold;
            if near(0) && near(8) || near(4) && near(12) || near(2) && near(10) || near(6) && near(14) {
                continue;
            }
            let mut ring = [0_i16; 32];
            for k in 0..16 {
                ring[k] = difference(k);
                ring[k + 16] = ring[k];
            }
            let score = longest_run(&ring);
            if score > threshold {
                scores[i] = score.min(255) as u8;
            }
        }
    }
    scores
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
fn harris(level: &Level, x: usize, y: usize) -> f32 {
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

/// Half widths of the rows of the disc, from the middle down.
fn disc_halves() -> [i32; CENTROID_RADIUS as usize + 1] {
    std::array::from_fn(|v| ((CENTROID_RADIUS * CENTROID_RADIUS - (v * v) as i32) as f32).sqrt() as i32)
}

fn centroid_angle(level: &Level, corner: &Corner, halves: &[i32]) -> f32 {
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
