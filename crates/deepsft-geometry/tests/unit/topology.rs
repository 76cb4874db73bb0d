//! Pieces, charts, seams and borders of meshes.

use deepsft_geometry::glam::{DVec2, DVec3};
use deepsft_geometry::{TemplateError, Topology, TriangleMesh};

/// A square ring of four sides (a tube without ends, or a torus of four-sided sections), vertices shared.
fn torus(n: usize, m: usize) -> TriangleMesh {
    let mut vertices = Vec::new();
    for i in 0..n {
        for j in 0..m {
            let (a, b) = (i as f64 / n as f64, j as f64 / m as f64);
            let (a, b) = (std::f64::consts::TAU * a, std::f64::consts::TAU * b);
            let r = 3.0 + b.cos();
            vertices.push(DVec3::new(r * a.cos(), r * a.sin(), b.sin()));
        }
    }
    let at = |i: usize, j: usize| (i % n) * m + j % m;
    let mut faces = Vec::new();
    for i in 0..n {
        for j in 0..m {
            faces.extend([
                [at(i, j), at(i + 1, j), at(i, j + 1)],
                [at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)],
            ]);
        }
    }
    let count = vertices.len();
    TriangleMesh::new(vertices, vec![DVec2::ZERO; count], faces).unwrap()
}

#[test]
fn a_torus_has_one_handle_and_two_are_two_pieces() {
    let one = torus(8, 5);
    let topology = Topology::of(&one).unwrap();
    // V - E + F = 40 - 120 + 80
    assert_eq!((topology.euler_characteristic, topology.genus()), (0, Some(1)));
    assert_eq!((topology.pieces, topology.border_edges), (1, 0));
    let far: Vec<DVec3> = one.vertices().iter().map(|p| *p + DVec3::X * 20.0).collect();
    let faces = one.faces().iter().copied();
    let both = faces.clone().chain(faces.map(|f| f.map(|v| v + 40))).collect();
    let both = TriangleMesh::new([one.vertices(), &far].concat(), vec![DVec2::ZERO; 80], both).unwrap();
    let topology = Topology::of(&both).unwrap();
    assert_eq!((topology.pieces, topology.charts, topology.genus()), (2, 2, None));
}

/// Two triangles that share the edge from (0, 0) to (0, 1), the second turned over on demand and in a chart of its own.
fn pair(turned: bool) -> TriangleMesh {
    let p = |x: f64, y: f64| DVec3::new(x, y, 0.0);
    let points = vec![
        p(0.0, 0.0),
        p(0.0, 1.0),
        p(-1.0, 0.0),
        p(0.0, 0.0),
        p(0.0, 1.0),
        p(1.0, 0.0),
    ];
    let uv = [(0.0, 0.0), (0.4, 0.0), (0.0, 0.4), (0.6, 0.6), (1.0, 0.6), (0.6, 1.0)];
    let second = if turned { [3, 4, 5] } else { [4, 3, 5] };
    let uv = uv.map(|(u, v)| DVec2::new(u, v)).to_vec();
    TriangleMesh::new(points, uv, vec![[0, 1, 2], second]).unwrap()
}

#[test]
fn a_seam_is_found_and_a_face_turned_over_is_refused_by_its_number() {
    let topology = Topology::of(&pair(false)).unwrap();
    assert_eq!(
        (
            topology.pieces,
            topology.charts,
            topology.seam_edges,
            topology.border_edges
        ),
        (1, 2, 1, 4)
    );
    assert_eq!(Topology::of(&pair(true)), Err(TemplateError::FaceOrientation(0, 1)));
}
