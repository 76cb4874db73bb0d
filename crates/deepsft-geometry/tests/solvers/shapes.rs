//! Sheets and closed meshes with known deformations.

use deepsft_geometry::glam::{DQuat, DVec2, DVec3, EulerRot};
use deepsft_geometry::solver::{Energy, ResidualSink};
use deepsft_geometry::{Picture, Template, TriangleMesh, VertexPoint};

/// The paper's E_data: vertices at measured points, lengths divided by the mean edge length.
pub struct PointData {
    points: Vec<VertexPoint>,
    per_length: f64,
}

impl PointData {
    pub fn new(scale: f64, points: &[VertexPoint]) -> Self {
        Self {
            points: points.to_vec(),
            per_length: scale.recip(),
        }
    }
}

impl Energy for PointData {
    fn name(&self) -> &'static str {
        "point data"
    }

    fn stencils(&self, visit: &mut dyn FnMut(&[usize])) {
        self.points.iter().for_each(|p| visit(&[p.vertex]));
    }

    fn energy(&self, vertices: &[DVec3]) -> f64 {
        let square = |p: &VertexPoint| p.weight * vertices[p.vertex].distance_squared(p.p_camera);
        self.points.iter().map(square).sum::<f64>() * self.per_length * self.per_length
    }

    fn linearize(&self, vertices: &[DVec3], sink: &mut dyn ResidualSink) {
        for p in &self.points {
            let residual = (vertices[p.vertex] - p.p_camera) * self.per_length;
            sink.vector(residual, p.weight, &[(p.vertex, self.per_length)]);
        }
    }
}

/// An A4 sheet, mm.
pub fn sheet() -> TriangleMesh {
    let picture = Picture::from_fn(1, 1, |_, _| [0; 3]);
    Template::thin_shell(picture, 297.0, 210.0).unwrap().mesh().clone()
}

/// The same sheet with 12 x 9 cells.
pub fn coarse_sheet() -> TriangleMesh {
    let uv: Vec<DVec2> = (0..130)
        .map(|k| DVec2::new(f64::from(k % 13) / 12.0, f64::from(k / 13) / 9.0))
        .collect();
    let vertices = uv
        .iter()
        .map(|p| ((*p - 0.5) * DVec2::new(297.0, 210.0)).extend(0.0))
        .collect();
    let faces = (0..108).flat_map(|k| {
        let a = k / 12 * 13 + k % 12;
        if (k / 12 + k) % 2 == 0 {
            [[a, a + 13, a + 14], [a, a + 14, a + 1]]
        } else {
            [[a, a + 13, a + 1], [a + 1, a + 13, a + 14]]
        }
    });
    TriangleMesh::new(vertices, uv, faces.collect()).unwrap()
}

/// The sheet's vertices bent about the y axis by `turn` radians in all, then posed half a metre in front
/// of the camera. Between its columns the sheet stays flat, so every edge keeps its length exactly: the
/// polyhedron is isometric to the sheet, not only the surface it approximates.
pub fn bent(sheet: &TriangleMesh, turn: impl Fn(f64) -> f64) -> Vec<DVec3> {
    let mut xs: Vec<f64> = sheet.vertices().iter().map(|v| v.x).collect();
    xs.sort_by(f64::total_cmp);
    xs.dedup_by(|a, b| (*a - *b).abs() < 1e-9);
    let mut profile = vec![DVec2::ZERO];
    for pair in xs.windows(2) {
        let angle = turn((pair[0] + pair[1]) / 2.0 / (xs[xs.len() - 1] - xs[0]));
        let last = profile[profile.len() - 1];
        profile.push(last + (pair[1] - pair[0]) * DVec2::new(angle.cos(), angle.sin()));
    }
    let centre = profile.iter().sum::<DVec2>() / profile.len() as f64;
    let column = |x: f64| xs.iter().position(|c| (c - x).abs() < 1e-9).unwrap();
    sheet
        .vertices()
        .iter()
        .map(|v| {
            let p = profile[column(v.x)] - centre;
            pose(DVec3::new(p.x, v.y, p.y))
        })
        .collect()
}

/// A pose in front of the camera, turned about all axes.
pub fn pose(p: DVec3) -> DVec3 {
    DQuat::from_euler(EulerRot::XYZ, 0.3, -0.4, 0.5) * p + DVec3::new(20.0, -10.0, 500.0)
}

/// A closed tube with round ends along x, 240 mm long and 60 mm thick: a template of the volumic kind.
pub fn closed_tube() -> TriangleMesh {
    let (rings, around) = (40, 24);
    let (half_length, radius) = (90.0, 30.0);
    // Ring k sits at angle or position along the outline of a capsule.
    let quarter = radius * std::f64::consts::FRAC_PI_2;
    let outline = |s: f64| {
        // Arc length from the left pole.
        if s < quarter {
            let a = s / radius;
            (-half_length - radius * a.cos(), radius * a.sin())
        } else if s < quarter + 2.0 * half_length {
            (s - quarter - half_length, radius)
        } else {
            let a = (s - quarter - 2.0 * half_length) / radius;
            (half_length + radius * a.sin(), radius * a.cos())
        }
    };
    let total = 2.0 * quarter + 2.0 * half_length;
    let mut vertices = vec![DVec3::new(-half_length - radius, 0.0, 0.0)];
    for k in 1..rings {
        let (x, r) = outline(total * f64::from(k) / f64::from(rings));
        for j in 0..around {
            let angle = std::f64::consts::TAU * (f64::from(j) + 0.5 * f64::from(k % 2)) / f64::from(around);
            vertices.push(DVec3::new(x, r * angle.cos(), r * angle.sin()));
        }
    }
    vertices.push(DVec3::new(half_length + radius, 0.0, 0.0));
    let last = vertices.len() - 1;
    let ring = |k: i32, j: i32| 1 + ((k - 1) * around + j.rem_euclid(around)) as usize;
    let mut faces = Vec::new();
    for j in 0..around {
        faces.push([0, ring(1, j + 1), ring(1, j)]);
        faces.push([last, ring(rings - 1, j), ring(rings - 1, j + 1)]);
        for k in 1..rings - 1 {
            // Odd rings are turned by half a step.
            let (a, b, c, d) = (ring(k, j), ring(k, j + 1), ring(k + 1, j), ring(k + 1, j + 1));
            if k % 2 == 0 {
                faces.extend([[a, b, c], [b, d, c]]);
            } else {
                faces.extend([[a, d, c], [a, b, d]]);
            }
        }
    }
    let uv = vec![DVec2::ZERO; vertices.len()];
    TriangleMesh::new(vertices, uv, faces).unwrap()
}

/// The tube bent about the z axis by `turn` radians in all: its axis becomes an arc, its sections
/// stay round.
pub fn bent_tube(tube: &TriangleMesh, turn: f64) -> Vec<DVec3> {
    let curvature = turn / 240.0;
    let bend = |v: &DVec3| {
        let (radius, angle) = (1.0 / curvature - v.y, v.x * curvature);
        pose(DVec3::new(
            radius * angle.sin(),
            1.0 / curvature - radius * angle.cos(),
            v.z,
        ))
    };
    tube.vertices().iter().map(bend).collect()
}

/// Normals (not unit) of the faces on given positions.
pub fn normals<'a>(mesh: &'a TriangleMesh, v: &'a [DVec3]) -> impl Iterator<Item = DVec3> + 'a {
    mesh.faces().iter().map(|&[a, b, c]| (v[b] - v[a]).cross(v[c] - v[a]))
}

/// Root mean square distance over the vertices that `select` names.
pub fn rmse(a: &[DVec3], b: &[DVec3], select: impl Fn(usize) -> bool) -> f64 {
    let squares: Vec<f64> = (0..a.len())
        .filter(|&i| select(i))
        .map(|i| a[i].distance_squared(b[i]))
        .collect();
    (squares.iter().sum::<f64>() / squares.len() as f64).sqrt()
}
