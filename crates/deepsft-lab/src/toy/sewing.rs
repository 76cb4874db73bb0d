//! The pieces of cloth that the toy is sewn from: which faces belong to which, with smooth seams, laid flat.

use super::body::{self, LIMBS, Limb};
use super::flattening::flattened;
use super::surface_nets::{Implicit, neighbours};
use deepsft_geometry::glam::{DVec2, DVec3};
use std::collections::BTreeMap;

/// Rounds in which a face between faces of another piece joins them.
const MAJORITY_ROUNDS: usize = 4;

/// Rounds in which seams are drawn straight.
const SEAM_ROUNDS: usize = 12;

/// Angles at which the smallest box around a piece is looked for.
const TURNS: usize = 36;

/// Which side of its limb a piece covers. The toy's own left is +x.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub(crate) enum Side {
    Front,
    Back,
    BackLeft,
    BackRight,
}

/// A piece of cloth.
#[derive(Clone, Debug)]
pub(crate) struct Piece {
    pub(crate) limb: Limb,
    pub(crate) side: Side,
    /// Its vertices as indices of the toy's.
    pub(crate) vertices: Vec<usize>,
    /// Its faces as indices of `vertices`.
    pub(crate) faces: Vec<[usize; 3]>,
    /// Its vertices laid flat, mm, the corner of the box around them at the origin.
    pub(crate) flat_mm: Vec<DVec2>,
    /// Sides of that box, mm.
    pub(crate) size_mm: DVec2,
}

/// The piece at a point of the surface.
fn piece_at(p: DVec3) -> (Limb, Side) {
    let limb = body::limb_at(p);
    let side = if limb.behind_side_seam(p) < 0.0 {
        Side::Front
    } else if limb == Limb::Body {
        // The back has a seam along the spine, so that the tail leaves no hole in a piece.
        if p.x > 0.0 { Side::BackLeft } else { Side::BackRight }
    } else {
        Side::Back
    };
    (limb, side)
}

/// Cuts the surface into pieces and draws the seams straight (vertices move along the surface).
pub(crate) fn pieces(implicit: &Implicit<'_>, vertices: &mut Vec<DVec3>, faces: &[[usize; 3]]) -> Vec<Piece> {
    let middle = |face: &[usize; 3]| face.iter().map(|&v| vertices[v]).sum::<DVec3>() / 3.0;
    let mut labels: Vec<(Limb, Side)> = faces.iter().map(|face| piece_at(middle(face))).collect();
    let beside = faces_beside(faces);
    for _ in 0..MAJORITY_ROUNDS {
        for face in 0..faces.len() {
            let [a, b, c] = beside[face].map(|other| labels[other]);
            labels[face] = if a == b || a == c {
                a
            } else if b == c {
                b
            } else {
                labels[face]
            };
        }
    }
    join_islands(&mut labels, &beside);
    *vertices = straight_seams(implicit, vertices, faces, &labels);

    let mut of_piece: BTreeMap<(Limb, Side), Vec<usize>> = BTreeMap::new();
    for (face, label) in labels.iter().enumerate() {
        of_piece.entry(*label).or_default().push(face);
    }
    debug_assert!(LIMBS.iter().all(|limb| of_piece.keys().any(|key| key.0 == *limb)));
    let cut = of_piece.into_iter().map(|((limb, side), own)| {
        let own: Vec<[usize; 3]> = own.into_iter().map(|face| faces[face]).collect();
        Piece::new(limb, side, vertices, &own)
    });
    cut.collect()
}

impl Piece {
    fn new(limb: Limb, side: Side, positions: &[DVec3], own: &[[usize; 3]]) -> Self {
        let mut vertices: Vec<usize> = own.iter().flatten().copied().collect();
        vertices.sort_unstable();
        vertices.dedup();
        let local = |v: &usize| vertices.binary_search(v).unwrap_or_default();
        let faces: Vec<[usize; 3]> = own.iter().map(|face| face.each_ref().map(local)).collect();
        let points: Vec<DVec3> = vertices.iter().map(|&v| positions[v]).collect();
        // Seen from the front or from behind, nothing is mirrored.
        let across = if side == Side::Front { 1.0 } else { -1.0 };
        let start = points.iter().map(|p| DVec2::new(across * p.x, p.y)).collect();
        let mut flat_mm = flattened(&points, &faces, start);
        if !matches!(limb, Limb::Head | Limb::Body) {
            turn_to_smallest_box(&mut flat_mm);
        }
        let (low, high) = bounds(&flat_mm);
        flat_mm.iter_mut().for_each(|p| *p -= low);
        Self {
            limb,
            side,
            vertices,
            faces,
            flat_mm,
            size_mm: high - low,
        }
    }
}

fn bounds(points: &[DVec2]) -> (DVec2, DVec2) {
    points
        .iter()
        .fold((DVec2::INFINITY, DVec2::NEG_INFINITY), |(low, high), p| {
            (low.min(*p), high.max(*p))
        })
}

fn turn_to_smallest_box(flat: &mut [DVec2]) {
    let turned = |k: usize| {
        let turn = DVec2::from_angle(std::f64::consts::PI * k as f64 / TURNS as f64);
        flat.iter().map(|p| turn.rotate(*p)).collect::<Vec<_>>()
    };
    let area = |k: &usize| {
        let (low, high) = bounds(&turned(*k));
        (high - low).element_product()
    };
    let best = (0..TURNS)
        .min_by(|a, b| area(a).total_cmp(&area(b)))
        .unwrap_or_default();
    let best = turned(best);
    flat.copy_from_slice(&best);
}

/// The faces on the other side of each face's edges; the face itself where there is none.
fn faces_beside(faces: &[[usize; 3]]) -> Vec<[usize; 3]> {
    let mut sides: Vec<([usize; 2], usize, usize)> = Vec::with_capacity(3 * faces.len());
    for (face, corners) in faces.iter().enumerate() {
        for k in 0..3 {
            let (a, b) = (corners[k], corners[(k + 1) % 3]);
            sides.push(([a.min(b), a.max(b)], face, k));
        }
    }
    sides.sort_unstable();
    let mut beside: Vec<[usize; 3]> = (0..faces.len()).map(|face| [face; 3]).collect();
    for pair in sides.chunk_by(|a, b| a.0 == b.0) {
        if let [(_, one, i), (_, other, j)] = pair {
            beside[*one][*i] = *other;
            beside[*other][*j] = *one;
        }
    }
    beside
}

/// All but the largest connected part of each piece join a piece beside them.
fn join_islands(labels: &mut [(Limb, Side)], beside: &[[usize; 3]]) {
    let mut part = vec![usize::MAX; labels.len()];
    let mut parts: Vec<Vec<usize>> = Vec::new();
    for start in 0..labels.len() {
        if part[start] != usize::MAX {
            continue;
        }
        let (number, mut front, mut members) = (parts.len(), vec![start], Vec::new());
        part[start] = number;
        while let Some(face) = front.pop() {
            members.push(face);
            for other in beside[face] {
                if part[other] == usize::MAX && labels[other] == labels[face] {
                    part[other] = number;
                    front.push(other);
                }
            }
        }
        parts.push(members);
    }
    let mut largest: BTreeMap<(Limb, Side), usize> = BTreeMap::new();
    for members in &parts {
        let size = largest.entry(labels[members[0]]).or_default();
        *size = members.len().max(*size);
    }
    for members in &parts {
        let own = labels[members[0]];
        if members.len() < largest[&own] {
            let around = members.iter().flat_map(|&face| beside[face]).map(|other| labels[other]);
            if let Some(other) = around.into_iter().find(|label| *label != own) {
                members.iter().for_each(|&face| labels[face] = other);
            }
        }
    }
}

/// The vertices after those on seams have moved towards their neighbours along the seam, and the others have followed.
fn straight_seams(
    implicit: &Implicit<'_>,
    vertices: &[DVec3],
    faces: &[[usize; 3]],
    labels: &[(Limb, Side)],
) -> Vec<DVec3> {
    let sides = || faces.iter().flat_map(|f| [0, 1, 2].map(|k| [f[k], f[(k + 1) % 3]]));
    let mut around = neighbours(vertices.len(), sides());
    let seams = faces
        .iter()
        .zip(faces_beside(faces))
        .enumerate()
        .flat_map(|(face, (corners, beside))| {
            let seam = move |k: &usize| labels[beside[*k]] != labels[face];
            (0..3).filter(seam).map(|k| [corners[k], corners[(k + 1) % 3]])
        });
    let along = neighbours(vertices.len(), seams);
    for (all, seam) in around.iter_mut().zip(along) {
        if !seam.is_empty() {
            *all = seam;
        }
    }
    (0..SEAM_ROUNDS).fold(vertices.to_vec(), |vertices, _| implicit.evened(&vertices, &around))
}
