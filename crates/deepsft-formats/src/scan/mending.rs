//! What programs that scan leave wrong in a mesh: faces turned over, crumbs beside the object.

use deepsft_geometry::glam::DVec3;
use deepsft_geometry::{DisjointSets, Side};
use std::collections::HashMap;

/// Fraction of the whole area below which a piece is a crumb.
const CRUMB: f64 = 0.001;

/// Fraction of the whole area that crumbs have together at most.
const MOST_CRUMBS: f64 = 0.05;

/// Turns over what has its front on another side than most of its piece, and leaves out pieces that are small beside the whole, fins and
/// faces at which a twisted band meets its own back. `note` is told how many of each.
pub(super) fn mended(positions: &[DVec3], faces: &[[usize; 3]], note: &mut impl FnMut(usize, &str)) -> Vec<[usize; 3]> {
    let (faces, fins) = without_fins(positions, faces);
    let on_points = on_points(positions, &faces);
    let mut pieces = DisjointSets::new(faces.len());
    for around in Side::by_edge(&Side::of(&on_points)) {
        around.iter().for_each(|side| pieces.join(around[0].face, side.face));
    }
    let beyond_each = beyond(&on_points);
    let area = |face| double_area(positions, face);
    let (mut is_turned, mut is_reached) = (vec![false; faces.len()], vec![false; faces.len()]);
    for first in 0..faces.len() {
        let mut patch = Vec::from_iter((!is_reached[first]).then_some(first));
        is_reached[first] = true;
        let mut next = 0;
        while let Some(&face) = patch.get(next) {
            next += 1;
            for &(other, is_other_way) in &beyond_each[face] {
                if !std::mem::replace(&mut is_reached[other], true) {
                    is_turned[other] = is_turned[face] != is_other_way;
                    patch.push(other);
                }
            }
        }
        let turned = |is: bool| {
            let such = patch.iter().filter(|face| is_turned[**face] == is);
            such.map(|face| area(faces[*face])).sum::<f64>()
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
    let mut kept: Vec<usize> = (0..faces.len()).filter(|&face| !is_crumb(face)).collect();
    let (whole, turned) = (kept.len(), kept.iter().filter(|face| is_turned[**face]).count());
    let oriented = |faces: &[[usize; 3]], kept: &[usize]| -> Vec<[usize; 3]> {
        let face = |&face: &usize| match (faces[face], is_turned[face]) {
            ([a, b, c], true) => [a, c, b],
            (corners, false) => corners,
        };
        kept.iter().map(face).collect()
    };
    // An edge of more than two faces may have two when one of them has gone.
    loop {
        let mut is_torn = vec![false; kept.len()];
        for (one, others) in beyond(&oriented(&on_points, &kept)).iter().enumerate() {
            for &(other, _) in others
                .iter()
                .filter(|(other, is_other_way)| *is_other_way && one <= *other)
            {
                let is_smaller = area(faces[kept[one]]) < area(faces[kept[other]]);
                is_torn[if is_smaller { one } else { other }] = true;
            }
        }
        if !is_torn.contains(&true) {
            break;
        }
        let mut torn = is_torn.into_iter();
        kept.retain(|_| torn.next() == Some(false));
    }
    note(
        turned,
        "faces had their fronts on the other side than those around them and were turned",
    );
    note(
        if has_crumbs { crumbs.len() } else { 0 },
        "small pieces beside it were left out",
    );
    note(fins, "faces that stand on an edge of two others were left out");
    note(
        whole - kept.len(),
        "faces with no side for their front were left out, as of a twisted band",
    );
    oriented(&faces, &kept)
}

fn double_area(positions: &[DVec3], face: [usize; 3]) -> f64 {
    let [a, b, c] = face.map(|v| positions[v]);
    (b - a).cross(c - a).length()
}

/// The faces without those that stand on an edge of two or more others and hang on nothing else, and how many these are. Where they are much
/// of the whole they are meant, and stay.
fn without_fins(positions: &[DVec3], faces: &[[usize; 3]]) -> (Vec<[usize; 3]>, usize) {
    let (mut free, mut crowded) = (vec![0; faces.len()], vec![false; faces.len()]);
    for around in Side::by_edge(&Side::of(&on_points(positions, faces))) {
        match around {
            [alone] => free[alone.face] += 1,
            [_, _] => {}
            more => more.iter().for_each(|side| crowded[side.face] = true),
        }
    }
    let is_fin = |face: usize| crowded[face] && free[face] == 2;
    let area = |is_counted: &dyn Fn(usize) -> bool| -> f64 {
        let counted = (0..faces.len()).filter(|face| is_counted(*face));
        counted.map(|face| double_area(positions, faces[face])).sum()
    };
    if area(&is_fin) > MOST_CRUMBS * area(&|_| true) {
        return (faces.to_vec(), 0);
    }
    let kept: Vec<[usize; 3]> = (0..faces.len())
        .filter(|face| !is_fin(*face))
        .map(|face| faces[face])
        .collect();
    let fins = faces.len() - kept.len();
    (kept, fins)
}

/// Of each face those beyond the edges that it shares with one other, and whether they lie the other way.
pub(super) fn beyond(faces: &[[usize; 3]]) -> Vec<Vec<(usize, bool)>> {
    let mut beyond = vec![Vec::new(); faces.len()];
    for around in Side::by_edge(&Side::of(faces)) {
        if let [one, other] = around {
            let is_other_way = one.is_forward(faces) == other.is_forward(faces);
            beyond[one.face].push((other.face, is_other_way));
            beyond[other.face].push((one.face, is_other_way));
        }
    }
    beyond
}

/// The faces between the points at which vertices are: those of seams are one point.
pub(super) fn on_points(positions: &[DVec3], faces: &[[usize; 3]]) -> Vec<[usize; 3]> {
    let mut points = HashMap::new();
    let mut point = |at: &DVec3| {
        let count = points.len();
        *points.entry(bits(*at)).or_insert(count)
    };
    let points: Vec<usize> = positions.iter().map(&mut point).collect();
    faces.iter().map(|face| face.map(|v| points[v])).collect()
}

/// Numbers by which equal positions are known.
pub(super) fn bits(p: DVec3) -> [u64; 3] {
    // Adding 0 makes one of 0 and -0.
    p.to_array().map(|number| (number + 0.0).to_bits())
}
