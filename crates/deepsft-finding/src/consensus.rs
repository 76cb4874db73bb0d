//! Matches that their neighbours confirm.
//!
//! A match of two corners with direction and scale tells how the sheet lies around it: a similarity from image to sheet. On a
//! sheet that bends, neighbours still agree about it roughly, and wrong matches agree with nobody. (Pizarro and Bartoli 2012 and
//! ROBUSfT, Shetab-Bushehri et al. 2022, use the same idea on positions alone.)

use crate::matching::Match;
use deepsft_geometry::DisjointSets;
use deepsft_geometry::glam::Vec2;
use std::cmp::Reverse;
use std::collections::HashSet;
use std::f32::consts::{PI, TAU};

/// How far the place of a neighbour may lie from where a match's similarity puts it, as a fraction of their distance: a tilt of
/// 60 degrees halves lengths along one direction.
const DISTORTION: f32 = 0.5;

/// Largest difference between the angles of neighbours, radians, and between the logarithms of their scales.
const TURN: f32 = 0.6;
const SCALING: f32 = 0.6;

/// Fewest neighbours that confirm a match.
const FEWEST: usize = 3;

/// Least places of a group, as a fraction of those of the first.
const MIN_PLACES: f32 = 0.25;

/// Most matches that are looked at.
const MAX_MATCHES: usize = 1500;

/// Groups of matches that confirm one another, the one with most places on the sheet first: many corners of a repeated pattern that all look
/// like the same few of the sheet have these few places. Those with less than [`MIN_PLACES`] of them are left out.
///
/// Neighbours are between `nearest` and `farthest` pixels apart in the image: matches nearer to each other may be of one corner at two
/// sizes, and say nothing of each other. `place_mm` is how exact places are: what neighbours may be off beside the distortion.
pub(crate) fn groups(matches: &[Match], [nearest, farthest]: [f32; 2], place_mm: f32) -> Vec<Vec<Match>> {
    let matches = &matches[..matches.len().min(MAX_MATCHES)];
    let similarities: Vec<Vec2> = matches.iter().map(|m| Vec2::from_angle(m.angle) * m.scale).collect();
    let explains = |i: usize, j: usize| {
        let (a, b) = (&matches[i], &matches[j]);
        let expected = similarities[i].rotate(b.pixel - a.pixel);
        let off = (b.place - a.place).distance(expected);
        off <= DISTORTION * expected.length() + place_mm
    };
    let agree = |i: usize, j: usize| {
        let (a, b) = (&matches[i], &matches[j]);
        let turn = (a.angle - b.angle + PI).rem_euclid(TAU) - PI;
        (a.scale / b.scale).ln().abs() < SCALING && turn.abs() < TURN && explains(i, j) && explains(j, i)
    };
    let mut order: Vec<usize> = (0..matches.len()).collect();
    order.sort_by(|&i, &j| matches[i].pixel.x.total_cmp(&matches[j].pixel.x));
    let mut pairs = Vec::new();
    let mut confirmed = vec![0_usize; matches.len()];
    for (k, &i) in order.iter().enumerate() {
        for &j in &order[k + 1..] {
            let apart = matches[j].pixel - matches[i].pixel;
            if apart.x > farthest {
                break;
            }
            if (nearest..=farthest).contains(&apart.length()) && agree(i, j) {
                pairs.push([i, j]);
                confirmed[i] += 1;
                confirmed[j] += 1;
            }
        }
    }
    let is_confirmed = |i: &usize| confirmed[*i] >= FEWEST;
    let mut sets = DisjointSets::new(matches.len());
    for [i, j] in pairs.into_iter().filter(|pair| pair.iter().all(is_confirmed)) {
        sets.join(i, j);
    }
    let mut groups: Vec<Vec<Match>> = vec![Vec::new(); matches.len()];
    for i in (0..matches.len()).filter(is_confirmed) {
        groups[sets.first(i)].push(matches[i]);
    }
    groups.retain(|g| !g.is_empty());
    groups.sort_by_cached_key(|group| Reverse(covered(group, 2.0 * place_mm)));
    let least = groups
        .first()
        .map_or(0.0, |first| MIN_PLACES * covered(first, 2.0 * place_mm) as f32);
    groups.retain(|group| covered(group, 2.0 * place_mm) as f32 >= least);
    groups
}

/// In how many cells of a sheet, with sides of `side_mm`, `matches` have their places.
fn covered(matches: &[Match], side_mm: f32) -> usize {
    let cells = matches.iter().map(|m| (m.place / side_mm).as_ivec2().to_array());
    cells.collect::<HashSet<_>>().len()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::descriptor::xorshift;

    #[test]
    fn of_matches_nine_tenths_wrong_those_on_a_bent_sheet_are_kept() {
        let mut random = xorshift(0x9e37_79b9_7f4a_7c15);
        let mut random = move || (random() >> 40) as f32 / (1 << 24) as f32;
        // A sheet of 200 x 150 mm around a cylinder of radius 70 mm seen from far away, turned by 2 radians, 2 pixels per mm:
        // x = 70 sin(u / 70), so lengths across shrink by cos(u / 70), down to 0.14 at the edges.
        let turn = 2.0_f32;
        let pixel = |place: Vec2| {
            let bend = (place.x - 100.0) / 70.0;
            let flat = Vec2::new(70.0 * bend.sin(), place.y - 75.0) * 2.0;
            Vec2::from_angle(turn).rotate(flat) + 500.0
        };
        let mut matches = Vec::new();
        for k in 0..1000 {
            let place = Vec2::new(200.0 * random(), 150.0 * random());
            let m = Match {
                pixel: pixel(place),
                place,
                // Corners tell angle and scale roughly.
                angle: -turn + 0.3 * (random() - 0.5),
                scale: 0.5 * (0.5 * (random() - 0.5)).exp(),
            };
            let wrong = Match {
                pixel: Vec2::new(1000.0 * random(), 1000.0 * random()),
                place,
                angle: TAU * random(),
                scale: random() + 0.2,
            };
            matches.push(if k % 10 == 0 { m } else { wrong });
        }
        let right = |m: &&Match| m.pixel.distance(pixel(m.place)) < 1e-2;
        let groups = groups(&matches, [3.0, 116.0], 2.5);
        let (kept, count) = (groups[0].iter().filter(right).count(), groups[0].len());
        assert!(kept >= 75 && count - kept <= 4, "{kept} right of {count}");
        assert!(groups.get(1).is_none_or(|second| second.len() < 8));
    }
}
