//! Matches that their neighbours confirm.
//!
//! A match of two corners with direction and scale tells how the sheet lies around it: a similarity from image to sheet. On a
//! sheet that bends, neighbours still agree about it roughly, and wrong matches agree with nobody. (Pizarro and Bartoli 2012 and
//! ROBUSfT, Shetab-Bushehri et al. 2022, use the same idea on positions alone.)

use crate::matching::Match;
use std::f32::consts::{PI, TAU};

/// How far the place of a neighbour may lie from where a match's similarity puts it, as a fraction of their distance: a tilt of
/// 60 degrees halves lengths along one direction.
const DISTORTION: f32 = 0.5;

/// The same in mm, for neighbours so near that the corners' own positions count.
const PLACE_MM: f32 = 2.5;

/// Largest difference between the angles of neighbours, radians, and between the logarithms of their scales.
const TURN: f32 = 0.6;
const SCALING: f32 = 0.6;

/// Fewest neighbours that confirm a match.
const FEWEST: usize = 3;

/// Most matches that are looked at.
const MOST_MATCHES: usize = 1500;

/// Groups of matches that confirm one another, the largest first. `reach`: distance in the image within which matches are
/// neighbours, pixels.
pub(crate) fn groups(matches: &[Match], reach: f32) -> Vec<Vec<Match>> {
    let matches = &matches[..matches.len().min(MOST_MATCHES)];
    let similarities: Vec<[f32; 2]> = matches
        .iter()
        .map(|m| {
            let (sin, cos) = m.angle.sin_cos();
            [cos, sin].map(|x| x * m.log_scale.exp())
        })
        .collect();
    let explains = |i: usize, j: usize| {
        let (a, b) = (&matches[i], &matches[j]);
        let [x, y] = [b.pixel[0] - a.pixel[0], b.pixel[1] - a.pixel[1]];
        let [c, s] = similarities[i];
        let expected = [c * x - s * y, s * x + c * y];
        let off = (b.place[0] - a.place[0] - expected[0]).hypot(b.place[1] - a.place[1] - expected[1]);
        off <= DISTORTION * expected[0].hypot(expected[1]) + PLACE_MM
    };
    let agree = |i: usize, j: usize| {
        let (a, b) = (&matches[i], &matches[j]);
        let turn = (a.angle - b.angle + PI).rem_euclid(TAU) - PI;
        (a.log_scale - b.log_scale).abs() < SCALING && turn.abs() < TURN && explains(i, j) && explains(j, i)
    };
    let mut order: Vec<usize> = (0..matches.len()).collect();
    order.sort_by(|&i, &j| matches[i].pixel[0].total_cmp(&matches[j].pixel[0]));
    let mut pairs = Vec::new();
    let mut confirmed = vec![0_usize; matches.len()];
    for (k, &i) in order.iter().enumerate() {
        for &j in &order[k + 1..] {
            let [x, y] = [
                matches[j].pixel[0] - matches[i].pixel[0],
                matches[j].pixel[1] - matches[i].pixel[1],
            ];
            if x > reach {
                break;
            }
            // Matches of one corner at two sizes say nothing of each other.
            if x * x + y * y > reach * reach || x * x + y * y < 9.0 {
                continue;
            }
            if agree(i, j) {
                pairs.push([i, j]);
                confirmed[i] += 1;
                confirmed[j] += 1;
            }
        }
    }
    grouped(matches, &pairs, &confirmed)
}

/// The connected groups of confirmed matches.
fn grouped(matches: &[Match], pairs: &[[usize; 2]], confirmed: &[usize]) -> Vec<Vec<Match>> {
    let mut sets = deepsft_geometry::DisjointSets::new(matches.len());
    for &[i, j] in pairs {
        if confirmed[i] >= FEWEST && confirmed[j] >= FEWEST {
            sets.join(i, j);
        }
    }
    let mut groups: Vec<Vec<Match>> = vec![Vec::new(); matches.len()];
    for (i, m) in matches.iter().enumerate() {
        if confirmed[i] >= FEWEST {
            groups[sets.first(i)].push(*m);
        }
    }
    groups.retain(|g| !g.is_empty());
    groups.sort_by_key(|g| std::cmp::Reverse(g.len()));
    groups
}
