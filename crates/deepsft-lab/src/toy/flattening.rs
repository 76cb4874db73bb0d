//! A piece of a surface laid flat with as little distortion as possible.

use deepsft_geometry::glam::{DVec2, DVec3};

/// Rounds of fitting rotations and moving vertices.
const ROUNDS: usize = 400;

/// Cotangent weights are kept between these, so that no vertex comes loose and no needle rules.
const WEIGHT_BOUNDS: [f64; 2] = [0.05, 10.0];

/// As-rigid-as-possible parameterisation (Liu et al. 2008) by Gauss-Seidel sweeps: flat positions of the vertices, in
/// the unit of `vertices`, near the `start`, from which the fronts of `faces` must be seen as fronts.
pub(crate) fn flattened(vertices: &[DVec3], faces: &[[usize; 3]], start: Vec<DVec2>) -> Vec<DVec2> {
    // Each triangle laid flat by itself, with the cotangents of its corners.
    let shapes: Vec<([DVec2; 3], [f64; 3])> = faces
        .iter()
        .map(|&[a, b, c]| {
            let (e, f) = (vertices[b] - vertices[a], vertices[c] - vertices[a]);
            let x = e.normalize_or_zero();
            let up = f - x * f.dot(x);
            // v points down: a front is a negative area.
            let flat = [
                DVec2::ZERO,
                DVec2::new(e.length(), 0.0),
                DVec2::new(f.dot(x), -up.length()),
            ];
            let cotangent = |k: usize| {
                let (p, q) = (flat[(k + 1) % 3] - flat[k], flat[(k + 2) % 3] - flat[k]);
                let (low, high) = (WEIGHT_BOUNDS[0], WEIGHT_BOUNDS[1]);
                (p.dot(q) / p.perp_dot(q).abs().max(1e-12)).clamp(low, high)
            };
            (flat, [0, 1, 2].map(cotangent))
        })
        .collect();
    // Half-edges around each vertex: the neighbour, the face, the corner of the vertex in it, and that of the neighbour.
    let mut around = vec![Vec::new(); vertices.len()];
    for (face, corners) in faces.iter().enumerate() {
        for k in 0..3 {
            around[corners[k]].extend([(face, k, (k + 1) % 3), (face, k, (k + 2) % 3)]);
        }
    }
    let mut flat = start;
    let mut rotations = vec![DVec2::X; faces.len()];
    for _ in 0..ROUNDS {
        for (rotation, (face, (shape, cotangents))) in rotations.iter_mut().zip(faces.iter().zip(&shapes)) {
            // The best rotation of a plane as a complex number: sum of conj(rest) times deformed.
            let mut sum = DVec2::ZERO;
            for (k, weight) in cotangents.iter().enumerate() {
                let (i, j) = ((k + 1) % 3, (k + 2) % 3);
                let (rest, now) = (shape[j] - shape[i], flat[face[j]] - flat[face[i]]);
                sum += *weight * DVec2::new(rest.dot(now), rest.perp_dot(now));
            }
            *rotation = sum.normalize_or(*rotation);
        }
        for vertex in 0..flat.len() {
            let (mut sum, mut weights) = (DVec2::ZERO, 0.0);
            for &(face, k, other) in &around[vertex] {
                let (shape, cotangents) = &shapes[face];
                let weight = cotangents[3 - k - other];
                sum += weight * (flat[faces[face][other]] + rotations[face].rotate(shape[k] - shape[other]));
                weights += weight;
            }
            if weights > 0.0 {
                flat[vertex] = sum / weights;
            }
        }
    }
    flat
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_bent_strip_is_laid_flat_at_its_own_size() {
        // A quarter of a tube of radius 50 along x: developable, 20 x 78.5 mm.
        let (columns, rows) = (5, 17);
        let angle = |j: usize| std::f64::consts::FRAC_PI_2 * j as f64 / (rows - 1) as f64;
        let mut vertices = Vec::new();
        for j in 0..rows {
            let a = angle(j) - angle(rows - 1) / 2.0;
            vertices.extend((0..columns).map(|i| DVec3::new(5.0 * i as f64, 50.0 * a.sin(), -50.0 * a.cos())));
        }
        let mut faces = Vec::new();
        for j in 0..rows - 1 {
            for i in 0..columns - 1 {
                let a = j * columns + i;
                faces.extend([[a, a + columns, a + columns + 1], [a, a + columns + 1, a + 1]]);
            }
        }
        let flat = flattened(&vertices, &faces, vertices.iter().map(|p| p.truncate()).collect());
        let chord = 2.0 * 50.0 * (angle(1) / 2.0).sin();
        let long = flat[0].distance(flat[(rows - 1) * columns]);
        let across = flat[0].distance(flat[columns - 1]);
        // The chords, laid end to end; the sweeps end a thousandth before that.
        assert!((long - chord * (rows - 1) as f64).abs() < 0.15, "{long}");
        assert!((across - 20.0).abs() < 0.15, "{across}");
        for &[a, b, c] in &faces {
            assert!((flat[b] - flat[a]).perp_dot(flat[c] - flat[a]) < 0.0);
        }
    }
}
