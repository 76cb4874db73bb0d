//! The two sides of a sheet that was scanned from both.

use crate::mesh::{Side, TriangleMesh, nearest_in_triangle, weighted};
use glam::DVec3;
use std::cmp::Reverse;
use std::collections::BinaryHeap;

/// Least fraction of the surface that each side has: the rest is the rim.
const LEAST_SIDE: f64 = 0.4;

/// Faces, evenly over the area, whose opposite is looked for: these pairs are where paths begin.
const TRIED: usize = 64;

/// By so much less, radians, a path from the own side turns: of the faces where paths begin, and of all, without the better part of a round rim.
const CLEARLY: f64 = 0.3;
const BEYOND_RIM: f64 = 2.1;

/// Cosine between the fronts of opposite faces, at most.
const OPPOSITE: f64 = -0.95;

/// Faces of a side whose distance from the other is measured, and the part of them that lies within the distance of the two.
const MEASURED: usize = 200;
const NEARLY_ALL: f64 = 0.95;

/// What a path turns by is counted in these, radians.
const TURN: f64 = 1e-6;

/// Finds the faces of both sides of a surface, and the distance of the sides, mm: of paper or card that was scanned from both sides its
/// thickness. `mesh` is welded. `None` where no two halves of the surface have their backs to each other.
///
/// A face belongs to the side from which a path over the surface reaches it with less turning: from the other side the path goes around
/// the rim, 180 degrees more, however the sheet is bent. The rim itself, sharp or round, lies between and is left out.
pub(crate) fn sheet_sides(mesh: &TriangleMesh) -> Option<([Vec<usize>; 2], f64)> {
    let corners = |face: usize| mesh.faces()[face].map(|v| mesh.vertices()[v]);
    let centre = |face: usize| corners(face).iter().sum::<DVec3>() / 3.0;
    let faces = || 0..mesh.faces().len();
    let (normals, areas): (Vec<DVec3>, Vec<f64>) = faces()
        .map(|face| {
            let [a, b, c] = corners(face);
            let doubled = (b - a).cross(c - a);
            (doubled.normalize_or_zero(), doubled.length() / 2.0)
        })
        .unzip();
    let whole: f64 = areas.iter().sum();

    let opposite = |face: usize| {
        let apart = |other: usize| centre(other).distance_squared(centre(face));
        let others = faces().filter(|&other| normals[other].dot(normals[face]) < OPPOSITE);
        let nearest = others.map(|other| (apart(other), [face, other]));
        nearest.min_by(|a, b| a.0.total_cmp(&b.0))
    };
    let mut passed = 0.0;
    let tried = faces().filter(|&face| {
        let before = passed;
        passed += areas[face] * TRIED as f64 / whole;
        f64::floor(before) < f64::floor(passed)
    });
    let mut pairs: Vec<_> = tried.filter_map(opposite).collect();
    pairs.sort_by(|a, b| a.0.total_cmp(&b.0));
    let (typical, _) = *pairs.get(pairs.len() / 2)?;
    // Faces of the rim have theirs far away.
    pairs.retain(|(apart, _)| *apart <= 4.0 * typical);
    let (_, middles) = pairs[0];

    let neighbours = neighbours(mesh);
    let nearer = |starts: &[Vec<usize>; 2], by: f64, among: &mut dyn Iterator<Item = usize>| {
        let [one, other] = starts.each_ref().map(|starts| turning(starts, &normals, &neighbours));
        let by = (by / TURN) as u64;
        let is_nearer = |own: u64, other: u64| own.checked_add(by).is_some_and(|most| most < other);
        let mut sides = [Vec::new(), Vec::new()];
        for face in among {
            if is_nearer(one[face], other[face]) {
                sides[0].push(face);
            } else if is_nearer(other[face], one[face]) {
                sides[1].push(face);
            }
        }
        sides
    };
    // First all the pairs: a path along the flat edge of a rolled sheet turns by 180 degrees only, however far it goes.
    let mut paired = pairs.iter().flat_map(|(_, pair)| *pair);
    let starts = nearer(&middles.map(|middle| vec![middle]), CLEARLY, &mut paired);
    let sides = nearer(&starts, BEYOND_RIM, &mut faces());
    let is_small = |side: &Vec<usize>| side.iter().map(|&face| areas[face]).sum::<f64>() < LEAST_SIDE * whole;
    if sides.iter().any(is_small) {
        return None;
    }
    let mut distances: Vec<f64> = (sides[0].iter().step_by(sides[0].len().div_ceil(MEASURED)))
        .map(|&face| {
            let to = |&other: &usize| {
                let nearest = nearest_in_triangle(centre(face), corners(other));
                weighted(nearest, corners(other)).distance_squared(centre(face))
            };
            sides[1].iter().map(to).fold(f64::INFINITY, f64::min).sqrt()
        })
        .collect();
    distances.sort_unstable_by(f64::total_cmp);
    let distance = distances[(NEARLY_ALL * (distances.len() - 1) as f64) as usize];
    Some((sides, distance))
}

fn neighbours(mesh: &TriangleMesh) -> Vec<Vec<usize>> {
    let mut neighbours = vec![Vec::new(); mesh.faces().len()];
    for around in Side::by_edge(&Side::of(mesh.faces())) {
        for one in around {
            let others = around.iter().filter(|other| *other != one);
            neighbours[one.face].extend(others.map(|other| other.face));
        }
    }
    neighbours
}

/// The least sum of angles between faces on a path from one of `starts` to each face, in [`TURN`]; `u64::MAX` where none leads (Dijkstra's algorithm).
fn turning(starts: &[usize], normals: &[DVec3], neighbours: &[Vec<usize>]) -> Vec<u64> {
    let mut turned = vec![u64::MAX; normals.len()];
    starts.iter().for_each(|&start| turned[start] = 0);
    let mut queue: BinaryHeap<_> = starts.iter().map(|&start| Reverse((0, start))).collect();
    while let Some(Reverse((so_far, face))) = queue.pop() {
        if so_far > turned[face] {
            continue;
        }
        for &next in &neighbours[face] {
            let angle = normals[face].dot(normals[next]).clamp(-1.0, 1.0).acos();
            let sum = so_far + (angle / TURN) as u64;
            if sum < turned[next] {
                turned[next] = sum;
                queue.push(Reverse((sum, next)));
            }
        }
    }
    turned
}
