//! A layout in which every place is one place of the surface: charts of neighbouring faces, each flat and of the surface's own size.
//!
//! Charts of the file are kept as they are, scaled to their areas on the surface, as far as they do not lie on themselves; mirrored ones are
//! turned over, so that a print reads as on the object. Faces without a place in a texture are projected along the normal of one among them.

use super::mending::{beyond, on_points};
use super::surface::Surface;
use deepsft_geometry::glam::{DMat2, DVec2, DVec3};
use deepsft_geometry::{DisjointSets, rows_within};
use std::collections::{BTreeMap, HashMap};
use std::f64::consts::FRAC_PI_2;
use std::ops::Range;

/// A face is stretched beyond use in the file's texture where it is so many times longer one way than the other, or its area there is not
/// within these multiples of that of its chart's other faces.
const USABLE_STRETCH: f64 = 8.0;
const USABLE_AREAS: [f64; 2] = [0.02, 50.0];

/// Least cosine of the angle between the normals of a face and of that along whose normal it is projected.
const FLAT_COSINE: f64 = 0.64;

/// Squares across the whole surface, and per face, in which a place is taken or not.
const SQUARES: f64 = 1024.0 * 1024.0;
const SQUARES_PER_FACE: f64 = 16.0;

/// Squares that a face or the surface is long, at most, and squares from the origin.
const LONGEST: f64 = 16_384.0;
const FARTHEST: f64 = 1e12;

/// Angles by which a chart is turned to lie in a smaller rectangle.
const TURNS: usize = 12;

/// Least fraction by which that rectangle must be smaller.
const WORTH_TURNING: f64 = 0.1;

/// Faces that lie flat beside one another.
pub(super) struct Chart {
    /// The faces, each with the places of its corners, mm, u to the right and v down.
    pub(super) faces: Vec<(usize, [DVec2; 3])>,
    /// Sides of the rectangle around it, whose corner is the origin, mm.
    pub(super) extent: DVec2,
}

/// Lays all faces out. `texels` is the size of the texture of a face, (1, 1) without one.
pub(super) fn charts(surface: &Surface, texels: impl Fn(usize) -> DVec2) -> Vec<Chart> {
    let count = surface.faces.len();
    let areas: Vec<f64> = (0..count).map(|face| surface.normal(face).length()).collect();
    let squares = SQUARES.max(SQUARES_PER_FACE * count as f64);
    let lengths = surface.vertices.iter().map(|at| at.position.length());
    let farthest = lengths.fold(0.0, f64::max);
    let mut growth = Growth {
        is_laid: vec![false; count],
        squares_per_mm: (2.0 * squares / areas.iter().sum::<f64>())
            .sqrt()
            .min(LONGEST / (2.0 * farthest)),
    };
    let mut charts = Vec::new();

    let beside = beyond(&surface.faces);
    let in_file = |face: usize| {
        let is_mirrored = surface.texture_area(face) > 0.0;
        let sides = texels(face) * DVec2::new(if is_mirrored { -1.0 } else { 1.0 }, 1.0);
        surface.corners(face).map(|at| at.uv * sides)
    };
    let is_even: Vec<bool> = (0..count).map(|face| is_even(surface, face, in_file(face))).collect();
    let mut sets = DisjointSets::new(count);
    for (face, others) in beside.iter().enumerate() {
        let side = surface.texture_area(face);
        let is_of_chart = |other: usize| surface.texture_area(other) * side > 0.0 && is_even[face] && is_even[other];
        let of_chart = others.iter().filter(|(other, _)| is_of_chart(*other));
        of_chart.for_each(|&(other, _)| sets.join(face, other));
    }
    let set: Vec<usize> = (0..count).map(|face| sets.first(face)).collect();
    // Areas on the surface and in the texture of the charts of the file.
    let mut sums = vec![(0.0, 0.0); count];
    let flat_area = |face: usize| surface.texture_area(face).abs() * texels(face).element_product();
    for face in 0..count {
        let (on_surface, in_texture) = &mut sums[set[face]];
        *on_surface += areas[face];
        *in_texture += flat_area(face);
    }
    for seed in 0..count {
        let (on_surface, in_texture) = sums[set[seed]];
        let mm_per_texel = (on_surface / in_texture).sqrt();
        let place = |face: usize| {
            let stretch = flat_area(face) * mm_per_texel * mm_per_texel / areas[face];
            let is_usable =
                is_even[face] && set[face] == set[seed] && (USABLE_AREAS[0]..USABLE_AREAS[1]).contains(&stretch);
            is_usable.then(|| in_file(face).map(|at| at * mm_per_texel))
        };
        charts.extend(growth.chart(seed, &beside, place));
    }

    let beside = beyond(&on_points(&surface.positions(), &surface.faces));
    let mut by_area: Vec<usize> = (0..count).filter(|&face| !growth.is_laid[face]).collect();
    by_area.sort_by(|&a, &b| areas[b].total_cmp(&areas[a]));
    for seed in by_area {
        let normal = surface.normal(seed) / areas[seed];
        let (right, down) = axes(normal);
        let place = |face: usize| {
            let is_flat = surface.normal(face).dot(normal) >= FLAT_COSINE * areas[face];
            let flat = |p: DVec3| DVec2::new(p.dot(right), p.dot(down));
            is_flat.then(|| surface.corners(face).map(|at| flat(at.position)))
        };
        charts.extend(growth.chart(seed, &beside, place));
    }
    charts
}

/// Whether the shape of a face is kept well enough in a plane where its corners are `flat`.
fn is_even(surface: &Surface, face: usize, flat: [DVec2; 3]) -> bool {
    let [a, b, c] = surface.corners(face).map(|at| at.position);
    let (along, across) = (b - a, c - a);
    let length = along.length();
    let foot = across.dot(along) / length;
    let height = along.cross(across).length() / length;
    // The derivatives by the lengths along and across the first side.
    let by_along = (flat[1] - flat[0]) / length;
    let by_across = (flat[2] - flat[0] - by_along * foot) / height;
    let squares = by_along.length_squared() + by_across.length_squared();
    let determinant = by_along.perp_dot(by_across).abs();
    // The singular values s and t have s² + t² = squares and s t = determinant.
    squares < (USABLE_STRETCH + 1.0 / USABLE_STRETCH) * determinant
}

/// Right and down in the plane that is seen against `normal`; upright in the template frame where there is an upright.
fn axes(normal: DVec3) -> (DVec3, DVec3) {
    let across = |axis: DVec3| axis - normal * normal.dot(axis);
    let (upright, lying) = (across(DVec3::Y), across(DVec3::NEG_Z));
    let down = if upright.length() > 0.1 { upright } else { lying }.normalize();
    (normal.cross(down), down)
}

/// Charts as they grow.
struct Growth {
    is_laid: Vec<bool>,
    squares_per_mm: f64,
}

impl Growth {
    /// The chart that grows from the face `seed` to faces `beside` one another which have a `place` in it and lie on no other. None when
    /// that face is laid already, or has none.
    fn chart(
        &mut self,
        seed: usize,
        beside: &[Vec<(usize, bool)>],
        place: impl Fn(usize) -> Option<[DVec2; 3]>,
    ) -> Option<Chart> {
        let mut faces = Vec::new();
        // Of each row where runs of taken squares begin and end.
        let mut taken: HashMap<i64, BTreeMap<i64, i64>> = HashMap::new();
        let mut wave = vec![seed];
        while !wave.is_empty() {
            let mut next = Vec::new();
            for face in wave {
                let Some(at) = place(face).filter(|_| !self.is_laid[face]) else {
                    continue;
                };
                let mut rows = Vec::new();
                let in_squares = at.map(|place| place * self.squares_per_mm);
                let is_near = |place: &DVec2| place.distance(in_squares[0]) <= LONGEST && place.length() <= FARTHEST;
                if !in_squares.iter().all(is_near) {
                    continue;
                }
                rows_within(in_squares, |row, columns| rows.push((row, columns)));
                let is_taken = |(row, columns): &(i64, Range<i64>)| {
                    let run_before = taken.get(row).and_then(|runs| runs.range(..columns.end).next_back());
                    run_before.is_some_and(|(_, end)| *end > columns.start)
                };
                if rows.iter().any(is_taken) {
                    continue;
                }
                for (row, columns) in rows {
                    taken.entry(row).or_default().insert(columns.start, columns.end);
                }
                self.is_laid[face] = true;
                faces.push((face, at));
                let others = beside[face].iter().map(|&(other, _)| other);
                next.extend(others.filter(|&other| !self.is_laid[other]));
            }
            wave = next;
        }
        (!faces.is_empty()).then(|| Chart::around(faces))
    }
}

impl Chart {
    /// The chart of these faces, turned if it then lies in a smaller rectangle.
    fn around(mut faces: Vec<(usize, [DVec2; 3])>) -> Self {
        let bounds = |turn: DMat2| {
            let places = faces.iter().flat_map(|(_, places)| places);
            places.fold((DVec2::INFINITY, DVec2::NEG_INFINITY), |(low, high), place| {
                (low.min(turn * *place), high.max(turn * *place))
            })
        };
        let area = |turn: &DMat2| {
            let (low, high) = bounds(*turn);
            (high - low).element_product()
        };
        let turns = (1..TURNS).map(|k| DMat2::from_angle(k as f64 * FRAC_PI_2 / TURNS as f64));
        let mut turn = DMat2::IDENTITY;
        if let Some(best) = turns.min_by(|a, b| area(a).total_cmp(&area(b)))
            && area(&best) < (1.0 - WORTH_TURNING) * area(&turn)
        {
            turn = best;
        }
        let (low, high) = bounds(turn);
        let moved = faces.iter_mut().flat_map(|(_, places)| places);
        moved.for_each(|place| *place = turn * *place - low);
        Self {
            faces,
            extent: high - low,
        }
    }
}
