//! What completion is compared with: rigid alignment, and Laplacian interpolation.

use deepsft_geometry::glam::DVec3;
use deepsft_geometry::solver::VertexPoint;
use deepsft_geometry::{RigidMotion, Welding};

/// The interpolation is done when its residual has fallen to this fraction.
const TOLERANCE: f64 = 1e-9;

/// The rest shape brought onto the visible points by one rigid motion, one position a vertex of the mesh.
pub fn rigid(rest: &[DVec3], points: &[VertexPoint]) -> Vec<DVec3> {
    let pairs = points.iter().map(|p| (rest[p.vertex], p.p_camera, p.weight));
    let motion = RigidMotion::align(pairs, RigidMotion::IDENTITY);
    rest.iter().map(|&p| motion.apply(p)).collect()
}

/// Visible vertices at their points; the displacement of the others from the rigid alignment is harmonic (uniform
/// Laplacian on the welded mesh), by conjugate gradients.
pub fn laplacian(welding: &Welding, rest: &[DVec3], points: &[VertexPoint]) -> Vec<DVec3> {
    let aligned = rigid(rest, points);
    let start = welding.weld(&aligned);
    let n = start.len();
    let mut neighbours = vec![Vec::new(); n];
    for [a, b] in welding.mesh().edges() {
        neighbours[a].push(b);
        neighbours[b].push(a);
    }
    let (mut sums, mut counts) = (vec![DVec3::ZERO; n], vec![0.0; n]);
    for point in points {
        if let Some(vertex) = welding.welded(point.vertex) {
            sums[vertex] += point.p_camera;
            counts[vertex] += 1.0;
        }
    }
    let given = |i: usize| counts[i] > 0.0;
    let mut moved: Vec<DVec3> = (0..n)
        .map(|i| {
            if given(i) {
                sums[i] / counts[i] - start[i]
            } else {
                DVec3::ZERO
            }
        })
        .collect();
    // degree x_i - sum of x_j, at hidden vertices; given ones do not move.
    let apply = |x: &[DVec3]| -> Vec<DVec3> {
        (0..n)
            .map(|i| {
                if given(i) {
                    DVec3::ZERO
                } else {
                    neighbours[i].len() as f64 * x[i] - neighbours[i].iter().map(|&j| x[j]).sum::<DVec3>()
                }
            })
            .collect()
    };
    let dot = |a: &[DVec3], b: &[DVec3]| a.iter().zip(b).map(|(a, b)| a.dot(*b)).sum::<f64>();
    let mut residual: Vec<DVec3> = apply(&moved).into_iter().map(|r| -r).collect();
    let mut direction = residual.clone();
    let mut square = dot(&residual, &residual);
    let last = square * TOLERANCE * TOLERANCE;
    for _ in 0..10 * n {
        if square <= last {
            break;
        }
        let image = apply(&direction);
        let step = square / dot(&direction, &image);
        for i in 0..n {
            moved[i] += step * direction[i];
            residual[i] -= step * image[i];
        }
        let next = dot(&residual, &residual);
        for (d, r) in direction.iter_mut().zip(&residual) {
            *d = *r + next / square * *d;
        }
        square = next;
    }
    let placed: Vec<DVec3> = start.iter().zip(&moved).map(|(a, b)| a + b).collect();
    welding.split(&placed)
}

#[cfg(test)]
mod tests {
    use super::*;
    use deepsft_geometry::TriangleMesh;
    use deepsft_geometry::glam::DVec2;

    #[test]
    fn between_given_ends_a_strip_is_interpolated_evenly() {
        // A strip of 2 x 5 vertices whose ends are given, one 4 mm up: a harmonic function rises by 1 a column.
        let vertices: Vec<DVec3> = (0..10)
            .map(|k| DVec3::new(f64::from(k / 2), f64::from(k % 2), 0.0))
            .collect();
        let faces = (0..4).flat_map(|k| [[2 * k, 2 * k + 1, 2 * k + 2], [2 * k + 1, 2 * k + 3, 2 * k + 2]]);
        let mesh = TriangleMesh::new(vertices, vec![DVec2::ZERO; 10], faces.collect()).unwrap();
        let points = [0, 1, 8, 9].map(|vertex| VertexPoint {
            vertex,
            p_camera: mesh.vertices()[vertex] + DVec3::new(0.0, 0.0, if vertex > 5 { 4.0 } else { 0.0 }),
            weight: 1.0,
        });
        let found = laplacian(&Welding::of(&mesh).unwrap(), mesh.vertices(), &points);
        for point in points {
            assert!(found[point.vertex].distance(point.p_camera) < 1e-9);
        }
        let middle = (found[4] + found[5]) / 2.0;
        assert!((middle.z - 2.0).abs() < 0.05, "{middle}");
        assert!(found[2].z > 0.5 && found[2].z < found[4].z && found[4].z < found[6].z);
    }
}
