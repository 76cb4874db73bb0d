//! What programs that scan leave wrong in a mesh: faces turned over, crumbs beside the object.

use deepsft_geometry::DisjointSets;
use deepsft_geometry::glam::{DVec2, DVec3};
use std::collections::HashMap;

/// Fraction of the whole area below which a piece is a crumb.
const CRUMB: f64 = 0.001;

/// Fraction of the whole area that crumbs have together at most.
const MOST_CRUMBS: f64 = 0.05;

/// Position and texture coordinates.
pub(super) type Vertex = (DVec3, DVec2);

/// Faces that hang together as those of an object do.
pub(super) struct Mended {
    pub(super) faces: Vec<[usize; 3]>,
    /// How many of them were turned over.
    pub(super) turned: usize,
    /// How many pieces were left out.
    pub(super) crumbs: usize,
}

/// Turns over what has its front on another side than most of its piece, and leaves out pieces that are small beside the whole.
pub(super) fn mended(vertices: &[Vertex], mut faces: Vec<[usize; 3]>) -> Mended {
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
    let mut is_turned: Vec<Option<bool>> = vec![None; faces.len()];
    for first in 0..faces.len() {
        if is_turned[first].is_some() {
            continue;
        }
        let (mut patch, mut next) = (vec![first], 0);
        is_turned[first] = Some(false);
        while let Some(&face) = patch.get(next) {
            next += 1;
            for &(other, is_other_way) in &beyond[face] {
                if is_turned[other].is_none() {
                    is_turned[other] = is_turned[face].map(|turned| turned != is_other_way);
                    patch.push(other);
                }
            }
        }
        let signed = |&face: &usize| {
            if is_turned[face] == Some(true) {
                -area(faces[face])
            } else {
                area(faces[face])
            }
        };
        if patch.iter().map(signed).sum::<f64>() < 0.0 {
            patch
                .iter()
                .for_each(|&face| is_turned[face] = is_turned[face].map(|turned| !turned));
        }
    }
    let mut areas: HashMap<usize, f64> = HashMap::new();
    for (face, corners) in faces.iter().enumerate() {
        *areas.entry(pieces.first(face)).or_default() += area(*corners);
    }
    let whole = areas.values().sum::<f64>();
    let small = areas.values().filter(|area| **area < CRUMB * whole).sum::<f64>();
    // What is made of small pieces altogether has no crumbs.
    let least = if small < MOST_CRUMBS * whole {
        CRUMB * whole
    } else {
        0.0
    };
    let crumbs = areas.values().filter(|area| **area < least).count();
    let is_kept: Vec<bool> = (0..faces.len())
        .map(|face| areas[&pieces.first(face)] >= least)
        .collect();
    let turned = is_turned.iter().map(|turned| *turned == Some(true));
    for (face, _) in faces.iter_mut().zip(turned.clone()).filter(|(_, turned)| *turned) {
        face.swap(1, 2);
    }
    let turned = turned.zip(&is_kept).filter(|(turned, kept)| *turned && **kept).count();
    let mut kept = is_kept.into_iter();
    faces.retain(|_| kept.next().unwrap_or(true));
    Mended { faces, turned, crumbs }
}

/// The same without the vertices that no face has.
pub(super) fn without_unused(vertices: &[Vertex], mut faces: Vec<[usize; 3]>) -> (Vec<Vertex>, Vec<[usize; 3]>) {
    let mut used = Vec::new();
    let mut new: HashMap<usize, usize> = HashMap::new();
    for v in faces.iter_mut().flatten() {
        *v = *new.entry(*v).or_insert_with(|| {
            used.push(vertices[*v]);
            used.len() - 1
        });
    }
    (used, faces)
}
