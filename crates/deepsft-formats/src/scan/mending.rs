//! What programs that scan leave wrong in a mesh: faces turned over, crumbs beside the object.

use deepsft_geometry::DisjointSets;
use deepsft_geometry::glam::{DVec2, DVec3};
use std::collections::HashMap;

/// Fraction of the whole area below which a piece is a crumb.
const CRUMB: f64 = 0.001;

/// Fraction of the whole area that crumbs have together at most.
const MOST_CRUMBS: f64 = 0.05;

/// Faces that hang together as those of an object do.
pub(super) struct Mended {
    pub(super) faces: Vec<[usize; 3]>,
    /// How many of them were turned over.
    pub(super) turned: usize,
    /// How many pieces were left out.
    pub(super) crumbs: usize,
}

/// Turns over what has its front on another side than most of its piece, and leaves out pieces that are small beside the whole.
/// Vertices are positions and texture coordinates.
pub(super) fn mended(vertices: &[(DVec3, DVec2)], faces: &[[usize; 3]]) -> Mended {
    // Vertices of seams are one point.
    let mut points = HashMap::new();
    let mut point = |v: usize| {
        let count = points.len();
        *points
            .entry(vertices[v].0.to_array().map(f64::to_bits))
            .or_insert(count)
    };
    let mut edges: HashMap<[usize; 2], Vec<(usize, bool)>> = HashMap::new();
    for (face, corners) in faces.iter().enumerate() {
        let corners = corners.map(&mut point);
        for k in 0..3 {
            let (a, b) = (corners[k], corners[(k + 1) % 3]);
            edges.entry([a.min(b), a.max(b)]).or_default().push((face, a < b));
        }
    }
    let mut pieces = DisjointSets::new(faces.len());
    // Of each face those beyond its edges, and whether they lie the other way.
    let mut beyond = vec![Vec::new(); faces.len()];
    for around in edges.values() {
        around.iter().for_each(|(face, _)| pieces.join(around[0].0, *face));
        if let [(one, forward), (other, is_same)] = around[..] {
            beyond[one].push((other, forward == is_same));
            beyond[other].push((one, forward == is_same));
        }
    }
    let area = |[a, b, c]: [usize; 3]| {
        let [a, b, c] = [a, b, c].map(|v| vertices[v].0);
        (b - a).cross(c - a).length()
    };
    let (mut is_turned, mut is_reached) = (vec![false; faces.len()], vec![false; faces.len()]);
    for first in 0..faces.len() {
        let mut patch = Vec::from_iter((!is_reached[first]).then_some(first));
        is_reached[first] = true;
        let mut next = 0;
        while let Some(&face) = patch.get(next) {
            next += 1;
            for &(other, is_other_way) in &beyond[face] {
                if !std::mem::replace(&mut is_reached[other], true) {
                    is_turned[other] = is_turned[face] != is_other_way;
                    patch.push(other);
                }
            }
        }
        let turned = |is: bool| {
            patch
                .iter()
                .filter(|face| is_turned[**face] == is)
                .map(|face| area(faces[*face]))
                .sum::<f64>()
        };
        if turned(true) > turned(false) {
            patch.iter().for_each(|&face| is_turned[face] = !is_turned[face]);
        }
    }
    let mut areas = vec![0.0; faces.len()];
    for (face, corners) in faces.iter().enumerate() {
        areas[pieces.first(face)] += area(*corners);
    }
    let whole = areas.iter().sum::<f64>();
    let crumbs: Vec<f64> = areas
        .iter()
        .copied()
        .filter(|area| *area > 0.0 && *area < CRUMB * whole)
        .collect();
    // What is made of small pieces altogether has no crumbs.
    let has_crumbs = crumbs.iter().sum::<f64>() < MOST_CRUMBS * whole;
    let mut is_crumb = |face: usize| has_crumbs && areas[pieces.first(face)] < CRUMB * whole;
    let kept: Vec<usize> = (0..faces.len()).filter(|&face| !is_crumb(face)).collect();
    let oriented = kept.iter().map(|&face| match (faces[face], is_turned[face]) {
        ([a, b, c], true) => [a, c, b],
        (corners, false) => corners,
    });
    Mended {
        faces: oriented.collect(),
        turned: kept.iter().filter(|face| is_turned[**face]).count(),
        crumbs: if has_crumbs { crumbs.len() } else { 0 },
    }
}
