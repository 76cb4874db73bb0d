//! The meshes that completion is timed on, and how they move.

use super::rod_bend::RodBend;
use anyhow::Result;
use deepsft_geometry::glam::{DQuat, DVec2, DVec3, EulerRot};
use deepsft_geometry::solver::VertexPoint;
use deepsft_geometry::{RigidMotion, TriangleMesh, Welding};
use deepsft_synth::capsule;

/// Size of the sheet, mm.
const SHEET_MM: [f64; 2] = [297.0, 210.0];

/// Vertices of the sheets' grids, columns and rows: about 1.5, 6, 11 and 40 thousand faces.
const SHEETS: [[usize; 2]; 4] = [[33, 24], [65, 47], [88, 63], [168, 120]];

/// Length and radius of the closed mesh, mm.
const CAPSULE_MM: [f64; 2] = [240.0, 30.0];

/// Vertices of the closed meshes from pole to pole and around.
const CAPSULES: [[usize; 2]; 4] = [[33, 24], [64, 48], [88, 64], [169, 120]];

/// A template that bends more and more while it turns.
pub struct BenchmarkShape {
    /// `sheet` or `closed`.
    pub name: &'static str,
    pub mesh: TriangleMesh,
    /// Turn a frame, about (x, y, z) along the shape.
    bend: DVec3,
}

/// One frame: every vertex's true place, and the half of the vertices that is given.
pub struct BenchmarkFrame {
    pub truth: Vec<DVec3>,
    /// Ascending.
    pub given: Vec<usize>,
}

impl BenchmarkShape {
    /// All shapes, smallest first, sheets before closed meshes.
    pub fn all() -> Result<Vec<Self>> {
        let mut shapes = Vec::new();
        for [columns, rows] in SHEETS {
            shapes.push(Self {
                name: "sheet",
                mesh: sheet(columns, rows)?,
                bend: DVec3::new(0.0, 1.2, 0.0),
            });
        }
        for [rings, around] in CAPSULES {
            let [length, radius] = CAPSULE_MM;
            shapes.push(Self {
                name: "closed",
                mesh: Welding::of(&capsule(length, radius, rings, around)?)?.mesh().clone(),
                bend: DVec3::new(0.3, 0.5, 0.6),
            });
        }
        Ok(shapes)
    }

    /// Frame `index` of a video: the shape bends by a fiftieth more a frame and turns by half a degree; the line between
    /// the given half and the hidden one turns by 20 degrees, so that hundreds of vertices change sides.
    pub fn frame(&self, index: usize) -> BenchmarkFrame {
        let time = index as f64;
        let bend = RodBend {
            turn_rad: self.bend * (1.0 + 0.02 * time),
            growth: 0.3,
        };
        let motion = RigidMotion {
            rotation: DQuat::from_euler(EulerRot::XYZ, 0.3, -0.4, 0.5 + 0.009 * time),
            translation: DVec3::new(20.0 + time, -10.0, 500.0),
        };
        let rest = self.mesh.vertices();
        let side = DQuat::from_axis_angle(self.sweep_axis(), 0.35 * time) * DVec3::Y;
        let mut order: Vec<usize> = (0..rest.len()).collect();
        order.sort_by(|&a, &b| rest[a].dot(side).total_cmp(&rest[b].dot(side)));
        let mut given = order.split_off(rest.len() / 2);
        given.sort_unstable();
        BenchmarkFrame {
            truth: bend.apply(rest).into_iter().map(|p| motion.apply(p)).collect(),
            given,
        }
    }

    /// The hidden half goes around a sheet's centre, and around the closed mesh as its back does when it turns.
    fn sweep_axis(&self) -> DVec3 {
        if self.name == "sheet" { DVec3::Z } else { DVec3::X }
    }
}

impl BenchmarkFrame {
    /// The given vertices as points of a weight.
    pub fn points(&self, weight: f64) -> Vec<VertexPoint> {
        let point = |&vertex: &usize| VertexPoint {
            vertex,
            p_camera: self.truth[vertex],
            weight,
        };
        self.given.iter().map(point).collect()
    }

    /// The rest shape moved rigidly onto the given vertices.
    pub fn aligned(&self, rest: &[DVec3]) -> Vec<DVec3> {
        let pairs = self.given.iter().map(|&vertex| (rest[vertex], self.truth[vertex], 1.0));
        let motion = RigidMotion::align(pairs, RigidMotion::IDENTITY);
        rest.iter().map(|&p| motion.apply(p)).collect()
    }
}

/// A flat grid with alternating diagonals, as a thin-shell template has.
fn sheet(columns: usize, rows: usize) -> Result<TriangleMesh> {
    let mut vertices = Vec::new();
    let mut texture_coordinates = Vec::new();
    let mut faces = Vec::new();
    for row in 0..rows {
        for column in 0..columns {
            let uv = DVec2::new(column as f64 / (columns - 1) as f64, row as f64 / (rows - 1) as f64);
            texture_coordinates.push(uv);
            vertices.push(((uv - 0.5) * DVec2::from(SHEET_MM)).extend(0.0));
            if row + 1 < rows && column + 1 < columns {
                let a = row * columns + column;
                let (b, c, d) = (a + 1, a + columns, a + columns + 1);
                if (row + column) % 2 == 0 {
                    faces.extend([[a, c, d], [a, d, b]]);
                } else {
                    faces.extend([[a, c, b], [b, c, d]]);
                }
            }
        }
    }
    Ok(TriangleMesh::new(vertices, texture_coordinates, faces)?)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn shapes_have_about_the_faces_that_the_issue_of_speed_asks_for() {
        let shapes = BenchmarkShape::all().unwrap();
        for (shape, wanted) in shapes
            .iter()
            .zip([1_500.0, 6_000.0, 11_000.0, 40_000.0].into_iter().cycle())
        {
            let fraction = shape.mesh.faces().len() as f64 / wanted;
            assert!((0.97..1.03).contains(&fraction), "{} {fraction}", shape.name);
        }
    }

    #[test]
    fn half_of_the_vertices_is_given_and_another_half_in_the_next_frame() {
        for shape in &BenchmarkShape::all().unwrap()[3..5] {
            let (first, second) = (shape.frame(0), shape.frame(1));
            assert_eq!(first.given.len(), shape.mesh.vertices().len().div_ceil(2));
            let kept = second
                .given
                .iter()
                .filter(|v| first.given.binary_search(v).is_ok())
                .count();
            let fraction = kept as f64 / first.given.len() as f64;
            assert!((0.8..0.95).contains(&fraction), "{} {fraction}", shape.name);
        }
    }
}
