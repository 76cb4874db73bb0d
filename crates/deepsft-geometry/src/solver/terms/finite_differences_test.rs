//! Finite differences of every term, and what each is zero for.

use crate::camera::Camera;
use crate::error::GeometryError;
use crate::image::Picture;
use crate::mesh::{Template, TriangleMesh};
use crate::solver::energy::check::{Recorder, finite_differences};
use crate::solver::*;
use glam::{DQuat, DVec2, DVec3};

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
    Camera::pinhole(640, 480, 500.0, 510.0, 322.0, 239.0)
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
fn point_data_has_its_derivatives() {
    let (mesh, scale) = (small(), LengthScale::of(&small()).unwrap());
    let vertices = deformed(&mesh);
    let points: Vec<_> = (0..20)
        .step_by(3)
        .map(|vertex| VertexPoint {
            vertex,
            p_camera: vertices[vertex] + DVec3::new(1.0, -2.0, 0.1 * vertex as f64),
            weight: 0.5 + vertex as f64,
        })
        .collect();
    let term = PointData::new(&mesh, scale, &points).unwrap();
    finite_differences(&term, &vertices, STEP_MM, true);
}

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
    for robust in [Robust::Squares, Robust::Huber(3.0), Robust::Cauchy(3.0)] {
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
    let image = NormalizedImage::new(&picture, 2.0, 8.0);
    let points: Vec<_> = surface_points(&mesh)
        .into_iter()
        .map(|point| TexturePoint { point, value: 0.3 })
        .collect();
    for robust in [Robust::Squares, Robust::Huber(0.5), Robust::Cauchy(0.8)] {
        let term = PhotoConsistency::new(&mesh, &camera(), &image, &points, 2.0, robust).unwrap();
        // 1e-5 mm is 2e-5 px: no sample crosses from one pixel's bilinear patch into the next.
        finite_differences(&term, &deformed(&mesh), 1e-5, false);
    }
    let other = Camera::pinhole(480, 270, 380.0, 380.0, 240.0, 135.0).unwrap();
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
    for robust in [Robust::Squares, Robust::Huber(0.5), Robust::Cauchy(0.5)] {
        let term = DepthPrior::new(&mesh, &points, 2.0, robust).unwrap();
        finite_differences(&term, &deformed(&mesh), STEP_MM, true);
    }
}

#[test]
fn isometry_has_its_derivatives_and_is_zero_for_a_rigid_motion() {
    let (mesh, scale) = (small(), LengthScale::of(&small()).unwrap());
    let term = Isometry::new(&mesh, scale, 3.0).unwrap();
    finite_differences(&term, &deformed(&mesh), STEP_MM, true);
    assert!(term.energy(&rigidly_moved(&mesh)) < 1e-24);
    // Stretched by a tenth: 3 times the sum of (0.1 l / mean l)^2.
    let stretched: Vec<_> = mesh.vertices().iter().map(|v| 1.1 * v).collect();
    let v = mesh.vertices();
    let squares = mesh
        .edges()
        .iter()
        .map(|&[a, b]| (0.1 * v[a].distance(v[b]) / scale.get()).powi(2))
        .sum::<f64>();
    assert!((term.energy(&stretched) / (3.0 * squares) - 1.0).abs() < 1e-12);
}

#[test]
fn the_curvature_of_isometry_is_the_second_difference_of_its_residuals() {
    let mesh = small();
    let scale = LengthScale::of(&mesh).unwrap();
    let isometry = Isometry::new(&mesh, scale, 3.0).unwrap();
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
fn arap_and_smoothness_have_their_derivatives_and_are_zero_for_a_rigid_motion() {
    let (mesh, scale) = (small(), LengthScale::of(&small()).unwrap());
    for (arap, smoothness) in [(20.0, 0.0), (20.0, 0.005), (1.0, 5.0)] {
        let term = Arap::new(&mesh, scale, arap, smoothness).unwrap();
        // The Jacobian holds the rotations, so only the gradient is that of the energy.
        finite_differences(&term, &deformed(&mesh), STEP_MM, false);
        assert!(term.energy(&rigidly_moved(&mesh)) < 1e-20);
    }
}

#[test]
fn smoothness_is_never_more_than_arap() {
    let (mesh, scale) = (small(), LengthScale::of(&small()).unwrap());
    let vertices = deformed(&mesh);
    let both = Arap::new(&mesh, scale, 1.0, 1.0).unwrap().energy(&vertices);
    let arap = Arap::new(&mesh, scale, 1.0, 0.0).unwrap().energy(&vertices);
    assert!(arap > 0.0 && both <= 2.0 * arap * 1.2, "{both} {arap}");
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
fn measurements_that_cannot_be_are_refused_and_holes_are_counted() {
    let (mesh, scale) = (small(), LengthScale::of(&small()).unwrap());
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
    ];
    assert_eq!(
        Reprojection::new(&mesh, &camera(), &points, Robust::Squares)
            .unwrap()
            .ignored(),
        2
    );
    let refused = |points: &[ImagePoint], robust| Reprojection::new(&mesh, &camera(), points, robust).unwrap_err();
    assert_eq!(
        refused(&[image(point(24, 0.5), 1.0, 1.0)], Robust::Squares),
        GeometryError::FaceOutOfRange { face: 24, faces: 24 }
    );
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
    assert_eq!(prior(depth(f64::NAN, 1.0)).unwrap().ignored(), 1);
    assert!(matches!(prior(depth(1.0, 0.0)), Err(GeometryError::Weight { .. })));
    assert!(matches!(
        Isometry::new(&mesh, scale, -1.0),
        Err(GeometryError::Weight { .. })
    ));
    assert!(matches!(
        Bending::new(&mesh, f64::NAN),
        Err(GeometryError::Weight { .. })
    ));
    assert!(matches!(
        Arap::new(&mesh, scale, 1.0, -0.1),
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
    let scale = LengthScale::of(&mesh).unwrap();
    let terms: [&dyn Energy; 3] = [
        &Isometry::new(&mesh, scale, 1.0).unwrap(),
        &Arap::new(&mesh, scale, 20.0, 0.005).unwrap(),
        &Bending::new(&mesh, 1.0).unwrap(),
    ];
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
