//! An object with a volume: a closed mesh whose texture has two charts.

use deepsft_geometry::TriangleMesh;
use deepsft_geometry::glam::{DVec2, DVec3};
use std::f64::consts::{FRAC_PI_2, TAU};

/// The charts of the texture: ranges of u, with a gap between them.
const CHARTS: [[f64; 2]; 2] = [[0.0, 0.49], [0.51, 1.0]];

/// A tube along x with round ends, closed: a template of the volumic kind. Its texture has two charts, one for each
/// half around the axis, so two seams run from pole to pole; vertices on them and at the poles
/// stand in the mesh more than once, and [`deepsft_geometry::Welding`] makes it a closed surface of genus 0.
///
/// `rings` vertices from pole to pole, `around` (even) around the axis: 2 around (rings - 2) faces. From 4 rings and 6 around,
/// `length_mm` from two radii.
pub fn capsule(length_mm: f64, radius_mm: f64, rings: usize, around: usize) -> TriangleMesh {
    let mut vertices = Vec::new();
    let mut texture_coordinates = Vec::new();
    let mut faces = Vec::new();
    let half = around / 2;
    for (chart, [left, right]) in CHARTS.into_iter().enumerate() {
        let first = vertices.len();
        let mut put = |ring: usize, column: f64| {
            let (along, across) = outline(length_mm, radius_mm, ring as f64 / (rings - 1) as f64);
            // Reduced first, so that both sides of a seam have the very same position.
            let angle = TAU * ((chart * half) as f64 + column).rem_euclid(around as f64) / around as f64;
            vertices.push(DVec3::new(along, across * angle.cos(), across * angle.sin()));
            let u = left + (right - left) * column / half as f64;
            texture_coordinates.push(DVec2::new(u, ring as f64 / (rings - 1) as f64));
        };
        // One pole vertex per column of faces, in its middle.
        (0..half).for_each(|column| put(0, column as f64 + 0.5));
        for ring in 1..rings - 1 {
            (0..=half).for_each(|column| put(ring, column as f64));
        }
        (0..half).for_each(|column| put(rings - 1, column as f64 + 0.5));
        let at = |ring: usize, column: usize| first + half + (ring - 1) * (half + 1) + column;
        for column in 0..half {
            faces.push([first + column, at(1, column + 1), at(1, column)]);
            let pole = at(rings - 1, 0) + column;
            faces.push([pole, at(rings - 2, column), at(rings - 2, column + 1)]);
            for ring in 1..rings - 2 {
                let (a, b) = (at(ring, column), at(ring, column + 1));
                let (c, d) = (at(ring + 1, column), at(ring + 1, column + 1));
                if (ring + column) % 2 == 0 {
                    faces.extend([[a, b, c], [b, d, c]]);
                } else {
                    faces.extend([[a, d, c], [a, b, d]]);
                }
            }
        }
    }
    TriangleMesh::new(vertices, texture_coordinates, faces).unwrap()
}

/// Position along the axis and distance from it at a fraction of the way from pole to pole. On the axis exactly at the
/// poles.
fn outline(length: f64, radius: f64, fraction: f64) -> (f64, f64) {
    let (quarter, straight) = (radius * FRAC_PI_2, length - 2.0 * radius);
    let way = fraction * (2.0 * quarter + straight);
    if fraction <= 0.0 || fraction >= 1.0 {
        (length * (fraction - 0.5), 0.0)
    } else if way < quarter {
        let angle = way / radius;
        (-0.5 * straight - radius * angle.cos(), radius * angle.sin())
    } else if way < quarter + straight {
        (way - quarter - 0.5 * straight, radius)
    } else {
        let angle = (way - quarter - straight) / radius;
        (0.5 * straight + radius * angle.sin(), radius * angle.cos())
    }
}
