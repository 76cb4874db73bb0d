//! Finite differences of every term of the mesh solver, and the shapes for which each term is zero.

use deepsft_geometry::glam::{DQuat, DVec2, DVec3};
use deepsft_geometry::solver::{
    Bending, ContrastNormalizedImage, DepthPrior, Energy, ImagePoint, Isometry, PhotoConsistency, PointDepth,
    Reprojection, ResidualSink, Robust, SurfacePoint, TexturePoint, mean_edge_length,
};
use deepsft_geometry::{Camera, GeometryError, Picture, Template, TriangleMesh};

/// Residual, weight, and derivatives by vertex.
type Row<R, D> = (R, f64, Vec<(usize, D)>);

#[derive(Default)]
struct Recorder {
    scalars: Vec<Row<f64, DVec3>>,
    vectors: Vec<Row<DVec3, f64>>,
}

impl ResidualSink for Recorder {
    fn scalar(&mut self, residual: f64, weight: f64, gradient: &[(usize, DVec3)]) {
        self.scalars.push((residual, weight, gradient.to_vec()));
    }
    fn vector(&mut self, residual: DVec3, weight: f64, coefficients: &[(usize, f64)]) {
        self.vectors.push((residual, weight, coefficients.to_vec()));
    }
}

impl Recorder {
    fn of(energy: &dyn Energy, vertices: &[DVec3]) -> Self {
        let mut recorder = Self::default();
        energy.linearize(vertices, &mut recorder);
        recorder
    }

    /// The gradient of the energy.
    fn gradient(&self, vertices: usize) -> Vec<DVec3> {
        let mut sum = vec![DVec3::ZERO; vertices];
        for (residual, weight, gradient) in &self.scalars {
            for &(i, g) in gradient {
                sum[i] += 2.0 * weight * residual * g;
            }
        }
        for (residual, weight, coefficients) in &self.vectors {
            for &(i, c) in coefficients {
                sum[i] += 2.0 * weight * c * residual;
            }
        }
        sum
    }
}

/// Central differences have an error of h^2 times the third derivative plus rounding / h: with
/// h = 1e-5 of the length scale, 1e-6 of the largest entry leaves a decade.
const TOLERANCE: f64 = 1e-6;

/// Checks the gradient of the energy and, where the residuals are smooth functions of the vertices
/// (`jacobian`), every residual's own derivatives. `step` is in the vertices' unit.
fn finite_differences(energy: &dyn Energy, vertices: &[DVec3], step: f64, jacobian: bool) {
    let here = Recorder::of(energy, vertices);
    assert!(
        here.scalars.len() + here.vectors.len() > 0,
        "{} has no residual",
        energy.name()
    );
    let gradient = here.gradient(vertices.len());
    let largest = gradient.iter().fold(0.0_f64, |m, g| m.max(g.abs().max_element()));
    assert!(largest > 0.0, "{}: a gradient of zero tests nothing", energy.name());
    for (i, axis) in (0..vertices.len()).flat_map(|i| DVec3::AXES.map(|a| (i, a))) {
        let moved = |by: f64| {
            let mut moved = vertices.to_vec();
            moved[i] += by * axis;
            moved
        };
        let (plus, minus) = (moved(step), moved(-step));
        let numeric = (energy.energy(&plus) - energy.energy(&minus)) / (2.0 * step);
        assert!(
            (numeric - gradient[i].dot(axis)).abs() <= TOLERANCE * largest,
            "{}: vertex {i} {axis}: {numeric} numerically, {} claimed",
            energy.name(),
            gradient[i].dot(axis)
        );
        if jacobian {
            let (plus, minus) = (Recorder::of(energy, &plus), Recorder::of(energy, &minus));
            for (k, (_, _, row)) in here.scalars.iter().enumerate() {
                let claimed = row.iter().find(|g| g.0 == i).map_or(0.0, |g| g.1.dot(axis));
                let size = row.iter().fold(0.0_f64, |m, g| m.max(g.1.length()));
                let numeric = (plus.scalars[k].0 - minus.scalars[k].0) / (2.0 * step);
                assert!((numeric - claimed).abs() <= TOLERANCE * size, "{}", energy.name());
            }
            for (k, (_, _, row)) in here.vectors.iter().enumerate() {
                let claimed = row.iter().find(|c| c.0 == i).map_or(0.0, |c| c.1);
                let size = row.iter().fold(0.0_f64, |m, c| m.max(c.1.abs()));
                let numeric = (plus.vectors[k].0 - minus.vectors[k].0) / (2.0 * step);
                assert!(
                    (numeric - claimed * axis).length() <= TOLERANCE * size,
                    "{}",
                    energy.name()
                );
            }
        }
    }
    // Energy and residuals tell the same story where nothing is robust.
    let sum = here.scalars.iter().map(|(r, w, _)| w * r * r).sum::<f64>()
        + here.vectors.iter().map(|(r, w, _)| w * r.length_squared()).sum::<f64>();
    assert!(sum >= 0.0 && energy.energy(vertices) >= sum * (1.0 - 1e-9));
}

#[test]
fn the_weight_of_a_robust_function_is_its_derivative() {
    for robust in [Robust::Squares, Robust::Cauchy(2.0)] {
        for square in [0.5, 3.9, 4.1, 100.0] {
            let h = 1e-6;
            let numeric = (robust.rho(square + h) - robust.rho(square - h)) / (2.0 * h);
            assert!((numeric - robust.weight(square)).abs() < 1e-8, "{robust:?} at {square}");
        }
    }
}

/// A small sheet, 80 x 60 mm: enough cells for every kind of stencil, few enough for differences of each.
fn small() -> TriangleMesh {
    let v = |i: usize, j: usize| DVec3::new(20.0 * i as f64 - 40.0, 20.0 * j as f64 - 30.0, 0.0);
    let vertices: Vec<_> = (0..20).map(|k| v(k % 5, k / 5)).collect();
    let faces = (0..12).flat_map(|k| {
        let a = k / 4 * 5 + k % 4;
        [[a, a + 5, a + 6], [a, a + 6, a + 1]]
    });
    TriangleMesh::new(vertices, vec![DVec2::ZERO; 20], faces.collect()).unwrap()
}

/// The sheet rolled up a little, dented, turned and moved in front of the camera: no symmetry is left.
fn deformed(mesh: &TriangleMesh) -> Vec<DVec3> {
    let rotation = DQuat::from_axis_angle(DVec3::new(1.0, 2.0, -0.5).normalize(), 0.6);
    let dent = |v: &DVec3| 0.004 * v.x * v.x + 0.002 * v.x * v.y + 3.0 * (v.y / 17.0).sin();
    let bend = |v: &DVec3| rotation * (v.with_z(dent(v)) + 0.05 * v.y * DVec3::X) + DVec3::new(8.0, -5.0, 300.0);
    mesh.vertices().iter().map(bend).collect()
}

fn rigidly_moved(mesh: &TriangleMesh) -> Vec<DVec3> {
    let rotation = DQuat::from_rotation_y(2.0) * DQuat::from_rotation_x(0.5);
    mesh.vertices()
        .iter()
        .map(|&v| rotation * v + DVec3::new(1.0, 2.0, 400.0))
        .collect()
}

fn camera() -> Camera {
    Camera::pinhole((640, 480), DVec2::new(500.0, 510.0), DVec2::new(322.0, 239.0))
        .unwrap()
        .with_distortion([-0.2, 0.05, 0.001, -0.002, 0.01])
        .unwrap()
}

fn surface_points(mesh: &TriangleMesh) -> Vec<SurfacePoint> {
    let barycentric = [0.5, 0.3, 0.2];
    (0..mesh.faces().len())
        .step_by(3)
        .map(|face| SurfacePoint { face, barycentric })
        .collect()
}

/// 1e-5 of the edge length of 20 mm and of the distance the projection bends over: see the check's
/// tolerance.
const STEP_MM: f64 = 2e-3;

#[test]
fn reprojection_through_a_distorting_lens_has_its_derivatives() {
    let mesh = small();
    let vertices = deformed(&mesh);
    let points: Vec<_> = surface_points(&mesh)
        .into_iter()
        .map(|point| ImagePoint {
            point,
            pixel: DVec2::new(330.0, 200.0 + point.face as f64),
            weight: 0.7,
        })
        .collect();
    for robust in [Robust::Squares, Robust::Cauchy(3.0)] {
        let term = Reprojection::new(&mesh, &camera(), &points, robust).unwrap();
        finite_differences(&term, &vertices, STEP_MM, true);
    }
}

#[test]
fn photo_consistency_has_its_derivatives() {
    let mesh = small();
    let picture = Picture::from_fn(640, 480, |x, y| {
        [(128.0 + 100.0 * (x as f64 / 9.0).sin() * (y as f64 / 7.0).cos()) as u8; 3]
    });
    let image = ContrastNormalizedImage::new(&picture, 2.0, 8.0);
    let points: Vec<_> = surface_points(&mesh)
        .into_iter()
        .map(|point| TexturePoint { point, value: 0.3 })
        .collect();
    for robust in [Robust::Squares, Robust::Cauchy(0.8)] {
        let term = PhotoConsistency::new(&mesh, &camera(), &image, &points, 2.0, robust).unwrap();
        // 1e-5 mm is 2e-5 px: no sample crosses from one pixel's bilinear patch into the next.
        finite_differences(&term, &deformed(&mesh), 1e-5, false);
    }
    let other = Camera::pinhole((480, 270), DVec2::splat(380.0), DVec2::new(240.0, 135.0)).unwrap();
    let error = PhotoConsistency::new(&mesh, &other, &image, &points, 2.0, Robust::Squares).unwrap_err();
    assert!(matches!(error, GeometryError::MapSize { .. }));
}

#[test]
fn the_depth_prior_has_its_derivatives() {
    let mesh = small();
    let points: Vec<_> = surface_points(&mesh)
        .into_iter()
        .map(|point| PointDepth {
            point,
            depth: 290.0 + point.face as f64,
            deviation: 8.0,
        })
        .collect();
    for robust in [Robust::Squares, Robust::Cauchy(0.5)] {
        let term = DepthPrior::new(&mesh, &points, 2.0, robust).unwrap();
        finite_differences(&term, &deformed(&mesh), STEP_MM, true);
    }
}

#[test]
fn isometry_has_its_derivatives_and_is_zero_for_a_rigid_motion() {
    let (mesh, scale) = (small(), mean_edge_length(&small()).unwrap());
    let term = Isometry::new(&mesh, 3.0).unwrap();
    finite_differences(&term, &deformed(&mesh), STEP_MM, true);
    assert!(term.energy(&rigidly_moved(&mesh)) < 1e-24);
    // Stretched by a tenth: 3 times the sum of (0.1 l / mean l)^2.
    let stretched: Vec<_> = mesh.vertices().iter().map(|v| 1.1 * v).collect();
    let v = mesh.vertices();
    let squares = mesh
        .edges()
        .iter()
        .map(|&[a, b]| (0.1 * v[a].distance(v[b]) / scale).powi(2))
        .sum::<f64>();
    assert!((term.energy(&stretched) / (3.0 * squares) - 1.0).abs() < 1e-12);
}

#[test]
fn the_curvature_of_isometry_is_the_second_difference_of_its_residuals() {
    let mesh = small();
    let isometry = Isometry::new(&mesh, 3.0).unwrap();
    let here = deformed(&mesh);
    let velocity: Vec<DVec3> = (0..here.len())
        .map(|i| DVec3::new((i as f64).sin(), (2.0 * i as f64).cos(), (i as f64 + 0.5).sin()))
        .collect();
    let moved = |by: f64| -> Recorder {
        let there: Vec<DVec3> = here.iter().zip(&velocity).map(|(p, v)| p + by * v).collect();
        Recorder::of(&isometry, &there)
    };
    // h^2 times the fourth derivative over the square of the edges' 40 mm, and rounding / h^2.
    let h = 1e-2;
    let (minus, middle, plus) = (moved(-h), moved(0.0), moved(h));
    let mut numeric = vec![DVec3::ZERO; here.len()];
    for (k, (residual, weight, gradient)) in middle.scalars.iter().enumerate() {
        let second = (plus.scalars[k].0 - 2.0 * residual + minus.scalars[k].0) / (h * h);
        for &(vertex, g) in gradient {
            numeric[vertex] += *weight * second * g;
        }
    }
    let mut claimed = vec![DVec3::ZERO; here.len()];
    isometry.add_curvature(&here, &velocity, &mut claimed);
    let largest = claimed.iter().fold(0.0_f64, |m, c| m.max(c.length()));
    assert!(largest > 0.0);
    for (a, b) in numeric.iter().zip(&claimed) {
        assert!((a - b).length() < 1e-4 * largest, "{a} numerically, {b} claimed");
    }
}

#[test]
fn bending_has_its_derivatives_is_zero_for_affine_maps_and_right_for_a_cylinder() {
    let mesh = small();
    let term = Bending::new(&mesh, 1.5).unwrap();
    finite_differences(&term, &deformed(&mesh), STEP_MM, true);
    assert!(term.energy(&rigidly_moved(&mesh)) < 1e-20);
    // On a grid of squares of side h bent to z = k x^2 / 2 only the interior edges along y feel it: each has the
    // coefficients (2, 0, -1, -1), so |sum c p|^2 = (k h^2)^2, and the factor 3 / h^2. 26 x 26 cells
    // make 25 * 26 such edges of 26 * 26 squares.
    let picture = Picture::from_fn(1, 1, |_, _| [0; 3]);
    let sheet = Template::thin_shell(picture, 200.0, 200.0).unwrap();
    assert_eq!(sheet.grid(), Some((27, 27)));
    let curvature = 1.0 / 500.0;
    let bend = |v: &DVec3| v.with_z(0.5 * curvature * v.x * v.x);
    let bent: Vec<_> = sheet.mesh().vertices().iter().map(bend).collect();
    let energy = Bending::new(sheet.mesh(), 1.0).unwrap().energy(&bent);
    let expected = 3.0 * 25.0 / 26.0 * (curvature * 200.0_f64).powi(2);
    assert!((energy / expected - 1.0).abs() < 1e-9, "{energy} {expected}");
}

#[test]
fn measurements_that_cannot_be_are_refused_and_holes_are_left_out() {
    let mesh = small();
    let point = |face, w| SurfacePoint {
        face,
        barycentric: [w, 1.0 - w, 0.0],
    };
    let image = |point, x, weight| ImagePoint {
        point,
        pixel: DVec2::new(x, 10.0),
        weight,
    };
    let points = [
        image(point(0, 0.5), f64::NAN, 1.0),
        image(point(1, f64::NAN), 1.0, 1.0),
        image(point(2, 0.5), 1.0, 1.0),
        // The mesh has 24 faces.
        image(point(24, 0.5), 1.0, 1.0),
    ];
    let residuals = |term: &dyn Energy| Recorder::of(term, &deformed(&mesh)).scalars.len();
    let kept = Reprojection::new(&mesh, &camera(), &points, Robust::Squares).unwrap();
    assert_eq!(residuals(&kept), 2, "two coordinates of one point");
    let refused = |points: &[ImagePoint], robust| Reprojection::new(&mesh, &camera(), points, robust).unwrap_err();
    for (weight, robust) in [
        (-1.0, Robust::Squares),
        (f64::NAN, Robust::Squares),
        (1.0, Robust::Cauchy(0.0)),
    ] {
        let error = refused(&[image(point(0, 0.5), 1.0, weight)], robust);
        assert!(
            matches!(
                error,
                GeometryError::Weight {
                    term: "reprojection",
                    ..
                }
            ),
            "{error}"
        );
    }
    let depth = |depth, deviation| PointDepth {
        point: point(0, 0.5),
        depth,
        deviation,
    };
    let prior = |d| DepthPrior::new(&mesh, &[d], 1.0, Robust::Squares);
    assert_eq!(residuals(&prior(depth(f64::NAN, 1.0)).unwrap()), 0);
    assert!(matches!(prior(depth(1.0, 0.0)), Err(GeometryError::Weight { .. })));
    assert!(matches!(Isometry::new(&mesh, -1.0), Err(GeometryError::Weight { .. })));
    assert!(matches!(
        Bending::new(&mesh, f64::NAN),
        Err(GeometryError::Weight { .. })
    ));
}

#[test]
fn degenerate_faces_leave_every_term_finite() {
    // Two corners in one place, three on a line, a face that names one vertex three times.
    let vertices = vec![
        DVec3::ZERO,
        DVec3::new(10.0, 0.0, 0.0),
        DVec3::new(0.0, 10.0, 0.0),
        DVec3::ZERO,
        DVec3::new(20.0, 0.0, 0.0),
    ];
    let faces = vec![[0, 1, 2], [0, 3, 1], [0, 1, 4], [2, 2, 2]];
    let mesh = TriangleMesh::new(vertices, vec![DVec2::ZERO; 5], faces).unwrap();
    let terms: [&dyn Energy; 2] = [&Isometry::new(&mesh, 1.0).unwrap(), &Bending::new(&mesh, 1.0).unwrap()];
    for term in terms {
        assert!(term.energy(mesh.vertices()) < 1e-20, "{}", term.name());
        let recorded = Recorder::of(term, mesh.vertices());
        let finite = recorded
            .scalars
            .iter()
            .all(|(r, w, g)| (r + w).is_finite() && g.iter().all(|g| g.1.is_finite()))
            && recorded
                .vectors
                .iter()
                .all(|(r, w, c)| r.is_finite() && w.is_finite() && c.iter().all(|c| c.1.is_finite()));
        assert!(finite, "{}", term.name());
    }
}
