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

/// Fewest matches of a group, that a mesh is fitted to.
pub(crate) const SMALLEST_GROUP: usize = 6;

/// Most groups, and as many kernels.
const MAX_GROUPS: usize = 4;

/// A group's kernel: those of its matches of whose neighbours in it this fraction agree, left out in so many rounds. Where half of a group
/// is wrong, a mesh bent to all of it is nowhere exact.
const MIN_AGREEING: f32 = 0.4;
const PRUNINGS: usize = 3;

/// Least places of a group, as a fraction of those of the first.
const MIN_PLACES: f32 = 0.25;

/// Most matches that are looked at.
const MAX_MATCHES: usize = 1500;

/// Groups of matches that confirm one another, the one with most places on the sheet first: many corners of a repeated pattern that all look
/// like the same few of the sheet have these few places. Those with less than [`MIN_PLACES`] of them are left out. Then the same of their
/// kernels.
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
    let mut neighbours = Vec::new();
    for (k, &i) in order.iter().enumerate() {
        for &j in &order[k + 1..] {
            let apart = matches[j].pixel - matches[i].pixel;
            if apart.x > farthest {
                break;
            }
            if (nearest..=farthest).contains(&apart.length()) {
                neighbours.push(([i, j], agree(i, j)));
            }
        }
    }
    let mut graph = AgreementGraph {
        matches,
        neighbours,
        kept: vec![true; matches.len()],
    };
    graph.prune(0.0);
    let mut groups = graph.groups(2.0 * place_mm);
    for _ in 0..PRUNINGS {
        graph.prune(MIN_AGREEING);
    }
    let mut kernels = graph.groups(2.0 * place_mm);
    kernels.retain(|kernel| !groups.contains(kernel));
    groups.extend(kernels);
    groups
}

/// Matches, and which of those near one another agree.
struct AgreementGraph<'a> {
    matches: &'a [Match],
    neighbours: Vec<([usize; 2], bool)>,
    kept: Vec<bool>,
}

impl AgreementGraph<'_> {
    /// Groups of kept matches: those that agree are in one.
    fn sets(&self) -> DisjointSets {
        let mut sets = DisjointSets::new(self.matches.len());
        for &([i, j], agrees) in &self.neighbours {
            if agrees && self.kept[i] && self.kept[j] {
                sets.join(i, j);
            }
        }
        sets
    }

    /// Keeps matches that [`FEWEST`] kept neighbours confirm, and of their neighbours in the same group at least this fraction.
    fn prune(&mut self, min_agreeing: f32) {
        let mut sets = self.sets();
        let mut counted = vec![[0_usize; 2]; self.matches.len()];
        for &([i, j], agrees) in &self.neighbours {
            if self.kept[i] && self.kept[j] && sets.first(i) == sets.first(j) {
                counted[i][usize::from(agrees)] += 1;
                counted[j][usize::from(agrees)] += 1;
            }
        }
        for (kept, [against, agreeing]) in self.kept.iter_mut().zip(counted) {
            *kept &= agreeing >= FEWEST && agreeing as f32 >= min_agreeing * (against + agreeing) as f32;
        }
    }

    /// The groups of kept matches, by how many cells of the sheet with sides of `cell_mm` they cover.
    fn groups(&self, cell_mm: f32) -> Vec<Vec<Match>> {
        let mut sets = self.sets();
        let mut groups: Vec<Vec<Match>> = vec![Vec::new(); self.matches.len()];
        for (i, _) in self.kept.iter().enumerate().filter(|(_, kept)| **kept) {
            groups[sets.first(i)].push(self.matches[i]);
        }
        groups.retain(|group| group.len() >= SMALLEST_GROUP);
        groups.sort_by_cached_key(|group| Reverse(covered(group, cell_mm)));
        let covered = |group: &Vec<Match>| covered(group, cell_mm) as f32;
        let least = groups.first().map_or(0.0, |first| MIN_PLACES * covered(first));
        groups.retain(|group| covered(group) >= least);
        groups.truncate(MAX_GROUPS);
        groups
    }
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
        // Beside it nothing but its kernel.
        let is_within = |group: &Vec<Match>| group.iter().all(|m| groups[0].contains(m));
        assert!(groups[1..].iter().all(|group| group.len() < 8 || is_within(group)));
    }

    #[test]
    fn a_group_of_which_half_is_wrong_has_a_kernel_that_is_right() {
        let mut random = xorshift(0x9e37_79b9_7f4a_7c15);
        let mut random = move || (random() >> 40) as f32 / (1 << 24) as f32;
        // A flat sheet, 2 pixels per mm. Corners of one spot are matched to one place 27 mm beside theirs: they confirm each other, and what is
        // farther away agrees too.
        let at = |place: Vec2, off: Vec2| Match {
            pixel: 2.0 * place,
            place: place + off,
            angle: 0.0,
            scale: 0.5,
        };
        let mut matches = Vec::new();
        for k in 0..200 {
            let place = Vec2::new(200.0 * random(), 150.0 * random());
            if k % 5 > 0 {
                matches.push(at(place, Vec2::ZERO));
                continue;
            }
            let off = 27.0 * Vec2::from_angle(TAU * random());
            let around = [Vec2::ZERO, Vec2::X, Vec2::Y, Vec2::ONE].map(|step| at(place + 3.0 * step, off));
            matches.extend(around);
        }
        let is_right = |m: &&Match| m.place.distance(m.pixel / 2.0) < 1.0;
        let groups = groups(&matches, [3.0, 116.0], 2.5);
        let [whole, kernel] = [groups.first(), groups.last()].map(|group| {
            let group = group.unwrap();
            (group.iter().filter(is_right).count(), group.len())
        });
        assert!(whole.1 - whole.0 > 100, "{whole:?}");
        assert!(kernel.0 > 140 && kernel.1 - kernel.0 < 20, "{kernel:?}");
    }
}
