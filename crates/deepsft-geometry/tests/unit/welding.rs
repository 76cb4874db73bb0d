//! Seams and their vertices.

use deepsft_geometry::glam::{DVec2, DVec3};
use deepsft_geometry::{TriangleMesh, Welding};

/// A square of 2 x 2 cells, cut along its middle when `cut`, at height z.
fn square(z: f64, cut: bool) -> TriangleMesh {
    let halves = if cut { vec![(0, 2), (1, 3)] } else { vec![(0, 3)] };
    let (mut vertices, mut faces) = (vec![], vec![]);
    for (first, end) in halves {
        let columns = first..end;
        let (start, width) = (vertices.len(), columns.len());
        for row in 0..3 {
            vertices.extend(
                columns
                    .clone()
                    .map(|column| DVec3::new(f64::from(column), f64::from(row), z)),
            );
        }
        for row in 0..2 {
            for column in 0..width - 1 {
                let a = start + row * width + column;
                faces.extend([[a, a + width, a + 1], [a + 1, a + width, a + width + 1]]);
            }
        }
    }
    TriangleMesh::new(vertices.clone(), vec![DVec2::ZERO; vertices.len()], faces).unwrap()
}

#[test]
fn a_cut_square_is_one_again_and_an_uncut_one_stays_as_it_is() {
    let cut = Welding::of(&square(0.0, true)).unwrap();
    assert_eq!((cut.vertices(), cut.mesh().vertices().len()), (12, 9));
    assert_eq!(cut.mesh().edges().len(), 16);
    let whole = square(0.0, false);
    assert_eq!(Welding::of(&whole).unwrap().mesh(), &whole);
}

#[test]
fn values_go_to_all_charts_and_come_back() {
    let cut = Welding::of(&square(0.0, true)).unwrap();
    let numbers: Vec<usize> = (0..9).collect();
    let split = cut.split(&numbers);
    assert_eq!(split[1], split[6], "both sides of the cut");
    assert_eq!(cut.weld(&split), numbers);
    assert_eq!(cut.welded(12), None);
}

#[test]
fn sheets_that_touch_keep_their_inner_vertices_apart() {
    let (lower, upper) = (square(0.0, false), square(-0.0, false));
    let n = lower.vertices().len();
    let vertices = [lower.vertices(), upper.vertices()].concat();
    let faces = lower.faces().iter().copied();
    let faces = faces.clone().chain(faces.map(|f| f.map(|v| v + n))).collect();
    let both = TriangleMesh::new(vertices, vec![DVec2::ZERO; 2 * n], faces).unwrap();
    let welded = Welding::of(&both).unwrap();
    assert_eq!(welded.mesh().vertices().len(), 2 * n - 8, "the 8 of the rim are shared");
    assert_ne!(welded.welded(4), welded.welded(n + 4), "the middle");
}
