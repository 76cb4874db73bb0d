//! Meshes whose texture has a seam: completion and solver keep together what is one point of the surface.

use crate::arap_completion::{complete, points};
use crate::shapes::{PointData, bent, pose, rmse, sheet};
use deepsft_geometry::glam::{DVec2, DVec3};
use deepsft_geometry::solver::{Bending, Isometry, MeshSolver, SolveOptions, mean_edge_length};
use deepsft_geometry::{ArapCompletion, CompletionOptions, TriangleMesh, VertexPoint, Welding};

/// The sheet with its texture cut into two charts along the middle column: vertices there stand twice. The mesh, and
/// for each of its vertices the one of the sheet.
fn cut_sheet() -> (TriangleMesh, Vec<usize>) {
    let whole = sheet();
    let mut of_whole = Vec::new();
    let (mut vertices, mut uv, mut faces) = (vec![], vec![], vec![]);
    for (left, shift) in [(true, -0.01), (false, 0.01)] {
        // Number of each vertex of the whole sheet in this chart.
        let mut number = vec![None; whole.vertices().len()];
        for face in whole.faces() {
            let centre = face.iter().map(|&v| whole.texture_coordinates()[v].x).sum::<f64>() / 3.0;
            if (centre < 0.5) == left {
                faces.push(face.map(|v| {
                    *number[v].get_or_insert_with(|| {
                        of_whole.push(v);
                        vertices.push(whole.vertices()[v]);
                        uv.push(whole.texture_coordinates()[v] * DVec2::new(0.98, 1.0) + DVec2::new(0.01 + shift, 0.0));
                        vertices.len() - 1
                    })
                }));
            }
        }
    }
    (TriangleMesh::new(vertices, uv, faces).unwrap(), of_whole)
}

#[test]
fn a_texture_seam_does_not_tear_even_when_only_one_chart_is_seen() {
    let (whole, (cut, of_whole)) = (sheet(), cut_sheet());
    let doubled = cut.vertices().len() - whole.vertices().len();
    assert!(doubled > 10, "the seam's vertices stand twice");
    let truth = bent(&whole, |s| 1.2 * s);
    // Points right of x = 0 only: the left chart sees nothing but its copies on the seam.
    let seen = points(&truth, |i| whole.vertices()[i].x >= 0.0);
    let expected = complete(&whole, &seen);
    let of_cut = |vertex: usize| of_whole.iter().rposition(|&w| w == vertex).unwrap();
    let seen_in_cut: Vec<_> = seen
        .iter()
        .map(|point| VertexPoint {
            vertex: of_cut(point.vertex),
            ..*point
        })
        .collect();
    let completed = complete(&cut, &seen_in_cut);
    // The order of the vertices, and with it that of eliminations and sums, is another.
    for (vertex, &w) in completed.vertices.iter().zip(&of_whole) {
        assert!(vertex.distance(expected.vertices[w]) < 1e-6);
    }
    // From a start, and with points on both copies of the seam's vertices, which count once.
    let both: Vec<_> = (0..of_whole.len())
        .filter(|&i| cut.vertices()[i].x >= 0.0)
        .map(|vertex| VertexPoint {
            vertex,
            p_camera: truth[of_whole[vertex]],
            weight: 0.5,
        })
        .collect();
    assert!(both.len() > seen.len());
    let mut completion = ArapCompletion::new(&cut, CompletionOptions::default()).unwrap();
    let warm = completion.complete(&both, Some(&completed.vertices)).unwrap();
    for (i, &w) in of_whole.iter().enumerate() {
        let other = of_whole.iter().position(|&v| v == w).unwrap();
        assert_eq!(warm.vertices[i], warm.vertices[other], "both copies are one point");
    }
}

#[test]
fn without_welding_the_mesh_solver_would_tear_what_it_keeps_together_on_the_welded_mesh() {
    let (cut, _) = cut_sheet();
    let welding = Welding::of(&cut).unwrap();
    let truth: Vec<DVec3> = cut.vertices().iter().map(|&v| pose(v)).collect();
    let start: Vec<DVec3> = cut.vertices().iter().map(|&v| v + 500.0 * DVec3::Z).collect();
    let solved = |mesh: &TriangleMesh, start: &[DVec3], vertex: &dyn Fn(usize) -> usize| {
        let scale = mean_edge_length(mesh).unwrap();
        let isometry = Isometry::new(mesh, 10.0).unwrap();
        let bending = Bending::new(mesh, 10.0).unwrap();
        // Three corners of the right chart are seen.
        let seen: Vec<_> = (0..truth.len())
            .filter(|&i| cut.vertices()[i].x > 50.0)
            .map(|i| VertexPoint {
                vertex: vertex(i),
                p_camera: truth[i],
                weight: 1.0,
            })
            .collect();
        let data = PointData::new(scale, &seen);
        let mut solver = MeshSolver::new(mesh, &[&isometry, &bending]).unwrap();
        solver
            .solve(&[&data, &isometry, &bending], start, &SolveOptions::default())
            .unwrap()
            .vertices
    };
    let torn = solved(&cut, &start, &|i| i);
    assert!(rmse(&torn, &truth, |_| true) > 20.0, "the left chart hangs on nothing");
    let welded = solved(welding.mesh(), &welding.weld(&start), &|i| welding.welded(i).unwrap());
    assert!(rmse(&welding.split(&welded), &truth, |_| true) < 0.1);
}
