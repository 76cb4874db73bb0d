//! The mesh solver on shapes whose answer is known.

use crate::shapes::{PointData, bent, coarse_sheet, normals, pose, rmse, sheet};
use deepsft_geometry::glam::{DQuat, DVec2, DVec3};
use deepsft_geometry::solver::{
    Bending, ContrastNormalizedImage, DepthPrior, Energy, ImagePoint, Isometry, MeshSolver, PhotoConsistency,
    PointDepth, Reprojection, Robust, Solution, SolveOptions, SurfacePoint, TexturePoint, mean_edge_length,
};
use deepsft_geometry::{Camera, GeometryError, Picture, RigidMotion, TriangleMesh, VertexPoint};

/// The paper's Realsense at the canonical width, with a lens.
fn camera() -> Camera {
    Camera::pinhole((480, 270), DVec2::splat(380.0), DVec2::new(240.0, 135.0))
        .unwrap()
        .with_distortion([-0.05, 0.01, 0.001, -0.001, 0.0])
        .unwrap()
}

fn points(truth: &[DVec3], every: usize) -> Vec<VertexPoint> {
    (0..truth.len())
        .step_by(every)
        .map(|vertex| VertexPoint {
            vertex,
            p_camera: truth[vertex],
            weight: 1.0,
        })
        .collect()
}

/// The centres of the faces as the camera sees them on `truth`.
fn image_points(mesh: &TriangleMesh, truth: &[DVec3], weight: f64) -> Vec<ImagePoint> {
    let third = 1.0 / 3.0;
    let seen = |(face, &[a, b, c]): (usize, &[usize; 3])| ImagePoint {
        point: SurfacePoint {
            face,
            barycentric: [third; 3],
        },
        pixel: camera().project((truth[a] + truth[b] + truth[c]) / 3.0).unwrap(),
        weight,
    };
    mesh.faces().iter().enumerate().map(seen).collect()
}

fn aligned(mesh: &TriangleMesh, points: &[VertexPoint]) -> Vec<DVec3> {
    let v = mesh.vertices();
    let pairs = points.iter().map(|p| (v[p.vertex], p.p_camera, 1.0));
    let motion = RigidMotion::align(pairs, RigidMotion::IDENTITY);
    v.iter().map(|&p| motion.apply(p)).collect()
}

/// Solves with `terms` and an isometry that gets stiffer in steps: a stiff sheet far from its shape
/// creeps along a narrow curved valley, a soft one gets there first.
fn solve_stiffening(
    solver: &mut MeshSolver,
    mesh: &TriangleMesh,
    terms: &[&dyn Energy],
    start: &[DVec3],
) -> Vec<Solution> {
    let mut solutions: Vec<Solution> = Vec::new();
    for weight in [1.0, 10.0, 100.0, 1e3] {
        let isometry = Isometry::new(mesh, weight).unwrap();
        let terms: Vec<&dyn Energy> = terms.iter().copied().chain([&isometry as &dyn Energy]).collect();
        let from = solutions.last().map_or(start, |s| &s.vertices);
        solutions.push(solver.solve(&terms, from, &SolveOptions::default()).unwrap());
    }
    solutions
}

/// A small repeatable disturbance of each vertex, within +-1 along each axis.
fn wobble(i: usize) -> DVec3 {
    let wave = |k: f64| (k * (i as f64 + 1.0)).sin();
    DVec3::new(wave(1.7), wave(2.3), wave(3.1))
}

#[test]
fn an_isometrically_bent_sheet_is_recovered_exactly_from_noiseless_points() {
    let mesh = sheet();
    let scale = mean_edge_length(&mesh).unwrap();
    let isometry = Isometry::new(&mesh, 100.0).unwrap();
    let mut solver = MeshSolver::new(&mesh, &[&isometry]).unwrap();
    for turn in [0.5, 2.0] {
        let truth = bent(&mesh, |s| turn * s);
        let seen = points(&truth, 1);
        let data = PointData::new(scale, &seen);
        let solution = solver
            .solve(&[&data, &isometry], &aligned(&mesh, &seen), &SolveOptions::default())
            .unwrap();
        println!(
            "turn {turn}: {} iterations, {:e} mm",
            solution.iterations,
            rmse(&solution.vertices, &truth, |_| true)
        );
        assert!(solution.converged);
        assert!(
            solution.initial_energy > 10.0 && solution.final_energy < 1e-12,
            "{}",
            solution.final_energy
        );
        // Every residual is zero at the truth: the tolerance is that of the last step.
        assert!(rmse(&solution.vertices, &truth, |_| true) < 1e-5);
        let flipped = normals(&mesh, &solution.vertices)
            .zip(normals(&mesh, &truth))
            .filter(|(a, b)| a.dot(*b) <= 0.0);
        assert_eq!(flipped.count(), 0);
    }
}

#[test]
fn a_stiff_sheet_follows_a_small_bend_in_one_step() {
    // From one bend to a slightly tighter one, as between two frames of a video. By its tangent alone the sheet would
    // stretch, and damped as its stiffness asks it hardly moves.
    let mesh = sheet();
    let scale = mean_edge_length(&mesh).unwrap();
    let (start, truth) = (bent(&mesh, |s| 1.6 * s), bent(&mesh, |s| 1.7 * s));
    let data = PointData::new(scale, &points(&truth, 1));
    let isometry = Isometry::new(&mesh, 1e4).unwrap();
    let bending = Bending::new(&mesh, 1.0).unwrap();
    let mut solver = MeshSolver::new(&mesh, &[&isometry, &bending]).unwrap();
    let mut energy = |max_iterations: usize, first_damping: f64| {
        let options = SolveOptions {
            max_iterations,
            first_damping,
            ..SolveOptions::default()
        };
        let solution = solver.solve(&[&data, &isometry, &bending], &start, &options).unwrap();
        solution.final_energy
    };
    let least = energy(50, 1e-3);
    assert!(energy(1, 1e-6) < 1.001 * least, "{} of {least}", energy(1, 1e-6));
    assert!(energy(1, 1e-3) > 1.5 * least, "{} of {least}", energy(1, 1e-3));
}

#[test]
fn a_plane_is_recovered_from_its_image_and_isometry_from_a_perturbed_start() {
    let mesh = sheet();
    let truth: Vec<DVec3> = mesh.vertices().iter().map(|&v| pose(v)).collect();
    let bending = Bending::new(&mesh, 1.0).unwrap();
    let image = Reprojection::new(&mesh, &camera(), &image_points(&mesh, &truth, 1.0), Robust::Squares).unwrap();
    let mut solver = MeshSolver::new(&mesh, &[&bending]).unwrap();
    // 30 mm too far, turned by 11 degrees, each vertex off by up to 5 mm along each axis.
    let turn = DQuat::from_axis_angle(DVec3::new(1.0, 1.0, 0.3).normalize(), 0.2);
    let about = DVec3::new(20.0, -10.0, 500.0);
    let start: Vec<DVec3> = (0..truth.len())
        .map(|i| turn * (truth[i] - about) + about + 30.0 * DVec3::Z + 5.0 * wobble(i))
        .collect();
    let solutions = solve_stiffening(&mut solver, &mesh, &[&image, &bending], &start);
    for s in &solutions {
        println!(
            "plane: {} iterations, converged {}, {:e} mm",
            s.iterations,
            s.converged,
            rmse(&s.vertices, &truth, |_| true)
        );
    }
    let Solution {
        vertices, converged, ..
    } = solutions.last().unwrap();
    assert!(converged);
    // A plane has no residual at all; what stays is the step tolerance on the weakest direction (depth).
    assert!(rmse(vertices, &truth, |_| true) < 0.01);
}

#[test]
fn a_bent_sheet_is_recovered_from_its_image_with_a_tenth_of_wrong_registrations() {
    let mesh = coarse_sheet();
    let truth = bent(&mesh, |s| 1.2 * s);
    let mut seen = image_points(&mesh, &truth, 1.0);
    for (k, point) in seen.iter_mut().enumerate().filter(|(k, _)| k % 10 == 3) {
        point.pixel += DVec2::new(40.0, -30.0) * if k % 20 == 3 { 1.0 } else { -0.7 };
    }
    let bending = Bending::new(&mesh, 0.1).unwrap();
    let mut solver = MeshSolver::new(&mesh, &[&bending]).unwrap();
    let start = aligned(&mesh, &points(&truth, 1));
    let [robust, squares] = [Robust::Cauchy(2.0), Robust::Squares].map(|robust| {
        let image = Reprojection::new(&mesh, &camera(), &seen, robust).unwrap();
        let solutions = solve_stiffening(&mut solver, &mesh, &[&image, &bending], &start);
        for s in &solutions {
            println!(
                "{robust:?}: {} iterations, converged {}, {} mm",
                s.iterations,
                s.converged,
                rmse(&s.vertices, &truth, |_| true)
            );
        }
        rmse(&solutions[3].vertices, &truth, |_| true)
    });
    println!(
        "wrong registrations: Cauchy {robust} mm, squares {squares} mm, start {} mm",
        rmse(&start, &truth, |_| true)
    );
    assert!(robust < 1.0 && robust < 0.2 * squares, "{robust} {squares}");
}

/// What the camera sees of the posed flat sheet: a smooth print, all grey values times `gain`.
fn photograph(gain: f64) -> Picture {
    let (origin, x, y) = (pose(DVec3::ZERO), pose(DVec3::X), pose(DVec3::Y));
    let (x, y) = (x - origin, y - origin);
    let normal = x.cross(y);
    Picture::from_fn(480, 270, |column, row| {
        let ray = camera()
            .ray_from_pixel(DVec2::new(column as f64 + 0.5, row as f64 + 0.5))
            .extend(1.0);
        let p = ray * (origin.dot(normal) / ray.dot(normal)) - origin;
        let (a, b) = (p.dot(x), p.dot(y));
        if a.abs() > 148.5 || b.abs() > 105.0 {
            return [(gain * 30.0) as u8; 3];
        }
        let print =
            (a / 7.0 + (b / 13.0).sin()).sin() + (b / 8.0 + (a / 17.0).cos()).sin() + (a / 23.0 - b / 19.0).cos();
        [(gain * (120.0 + 35.0 * print)) as u8; 3]
    })
}

#[test]
fn photo_consistency_brings_a_sheet_that_is_pixels_off_onto_its_image_in_other_light() {
    let mesh = coarse_sheet();
    let truth: Vec<DVec3> = mesh.vertices().iter().map(|&v| pose(v)).collect();
    // 3 to 6 px off sideways, 10 mm too far, each vertex for itself up to 1.5 mm.
    let start: Vec<_> = (0..truth.len())
        .map(|i| truth[i] + DVec3::new(5.0, -4.0, 10.0) + 1.5 * wobble(i))
        .collect();
    let bending = Bending::new(&mesh, 1.0).unwrap();
    let isometry = Isometry::new(&mesh, 1e3).unwrap();
    let mut solver = MeshSolver::new(&mesh, &[&bending]).unwrap();
    let (bright, dark) = (photograph(1.0), photograph(0.6));
    let mut vertices = start.clone();
    for blur in [4.0, 2.0, 1.0] {
        let [bright, dark] = [&bright, &dark].map(|p| ContrastNormalizedImage::new(p, blur, 8.0));
        let mut points = Vec::new();
        for (face, corners) in mesh.faces().iter().enumerate() {
            for k in 0..15 {
                let (a, b) = (f64::from(k % 5) / 5.0 + 0.1, f64::from(k / 5) / 3.0 + 0.1);
                let (a, b) = if a + b > 1.0 { (1.0 - a, 1.0 - b) } else { (a, b) };
                let barycentric = [1.0 - a - b, a, b];
                let p = (0..3).map(|c| barycentric[c] * truth[corners[c]]).sum();
                // The template as it would be scanned in good light; two corners lie outside the image.
                if let Some((value, _)) = bright.sample(camera().project(p).unwrap()) {
                    let point = SurfacePoint { face, barycentric };
                    points.push(TexturePoint { point, value });
                }
            }
        }
        let image = PhotoConsistency::new(&mesh, &camera(), &dark, &points, 1.0, Robust::Cauchy(0.8)).unwrap();
        let solution = solver
            .solve(&[&image, &isometry, &bending], &vertices, &SolveOptions::default())
            .unwrap();
        println!(
            "blur {blur}: {} iterations, converged {}, {} mm",
            solution.iterations,
            solution.converged,
            rmse(&solution.vertices, &truth, |_| true)
        );
        vertices = solution.vertices;
    }
    // A fifth of a pixel sideways is 0.25 mm at 500 mm; depth, which only isometry tells, a few times that. The image
    // is bilinear between pixels and rounded to bytes, so the truth is not exactly the minimum.
    assert!(rmse(&start, &truth, |_| true) > 10.0);
    assert!(rmse(&vertices, &truth, |_| true) < 1.0);
    // Of the vertices that are in the image.
    let squares: Vec<f64> = (truth.iter().zip(&vertices))
        .map(|(t, v)| (camera().project(*t).unwrap(), camera().project(*v).unwrap()))
        .filter(|(t, _)| t.cmpgt(DVec2::ZERO).all() && t.cmplt(DVec2::new(480.0, 270.0)).all())
        .map(|(t, v)| t.distance_squared(v))
        .collect();
    let pixels = (squares.iter().sum::<f64>() / squares.len() as f64).sqrt();
    println!("photo-consistency: {pixels} px");
    assert!(pixels < 0.2, "{pixels}");
}

#[test]
fn a_depth_prior_settles_how_far_a_sheet_of_unknown_size_is() {
    // Reprojection alone cannot tell a near small sheet from a far large one; isometry is left out.
    let mesh = sheet();
    let truth = bent(&mesh, |s| s);
    let seen = image_points(&mesh, &truth, 1.0);
    let depths = mesh.faces().iter().zip(&seen).map(|(f, p)| PointDepth {
        point: p.point,
        depth: f.iter().map(|&i| truth[i].z).sum::<f64>() / 3.0,
        deviation: 10.0,
    });
    let depths: Vec<_> = depths.collect();
    let image = Reprojection::new(&mesh, &camera(), &seen, Robust::Squares).unwrap();
    let prior = DepthPrior::new(&mesh, &depths, 1.0, Robust::Cauchy(3.0)).unwrap();
    let bending = Bending::new(&mesh, 1e-4).unwrap();
    let mut solver = MeshSolver::new(&mesh, &[&bending]).unwrap();
    let start: Vec<_> = truth.iter().map(|p| p * 1.1).collect();
    let solution = solver
        .solve(&[&image, &prior, &bending], &start, &SolveOptions::default())
        .unwrap();
    let error = rmse(&solution.vertices, &truth, |_| true);
    println!("depth prior: {error} mm, {:?}", solution.iterations);
    assert!(solution.converged && error < 0.5, "{error}");
}

#[test]
fn metres_and_millimetres_give_the_same_shape_for_all_terms_together() {
    let mesh = coarse_sheet();
    let truth = bent(&mesh, |s| 1.2 * s);
    let solve = |unit: f64| {
        let rest = mesh.vertices().iter().map(|v| v * unit).collect();
        let mesh = mesh.with_vertices(rest).unwrap();
        let truth: Vec<DVec3> = truth.iter().map(|p| p * unit).collect();
        let scale = mean_edge_length(&mesh).unwrap();
        let mut image = image_points(&mesh, &truth, 1.0);
        image
            .iter_mut()
            .enumerate()
            .for_each(|(i, p)| p.pixel += 2.0 * wobble(i).truncate());
        let depths = image.iter().map(|p| PointDepth {
            point: p.point,
            depth: 505.0 * unit,
            deviation: 50.0 * unit,
        });
        let depths: Vec<_> = depths.collect();
        let noisy: Vec<DVec3> = (0..truth.len()).map(|i| truth[i] + 3.0 * unit * wobble(i)).collect();
        let data = PointData::new(scale, &points(&noisy, 5));
        let image = Reprojection::new(&mesh, &camera(), &image, Robust::Cauchy(3.0)).unwrap();
        let depth = DepthPrior::new(&mesh, &depths, 0.1, Robust::Cauchy(1.0)).unwrap();
        let isometry = Isometry::new(&mesh, 10.0).unwrap();
        let bending = Bending::new(&mesh, 0.1).unwrap();
        let mut solver = MeshSolver::new(&mesh, &[&isometry, &bending]).unwrap();
        let start = aligned(&mesh, &points(&truth, 1));
        let terms: [&dyn Energy; 5] = [&data, &image, &depth, &isometry, &bending];
        let options = SolveOptions {
            max_iterations: 300,
            energy_tolerance: 1e-13,
            ..Default::default()
        };
        solver.solve(&terms, &start, &options).unwrap()
    };
    let (mm, m) = (solve(1.0), solve(1e-3));
    assert!(mm.converged && m.converged, "{mm:?}");
    let (a, b) = (mm.final_energy, m.final_energy);
    assert!(a > 0.0 && (a / b - 1.0).abs() < 1e-4, "{a} {b}");
    let back: Vec<DVec3> = m.vertices.iter().map(|p| p * 1e3).collect();
    println!(
        "all terms: {} and {} iterations, {:e} mm apart",
        mm.iterations,
        m.iterations,
        rmse(&back, &mm.vertices, |_| true)
    );
    // Both stop within the step tolerance of one minimum.
    assert!(rmse(&back, &mm.vertices, |_| true) < 1e-3);
}

#[test]
fn a_solve_that_runs_out_of_iterations_says_so() {
    let mesh = sheet();
    let truth = bent(&mesh, |s| 2.0 * s);
    let scale = mean_edge_length(&mesh).unwrap();
    let (isometry, seen) = (Isometry::new(&mesh, 100.0).unwrap(), points(&truth, 1));
    let data = PointData::new(scale, &seen);
    let options = SolveOptions {
        max_iterations: 1,
        ..Default::default()
    };
    let mut solver = MeshSolver::new(&mesh, &[]).unwrap();
    let solution = solver
        .solve(&[&data, &isometry], &aligned(&mesh, &seen), &options)
        .unwrap();
    assert!(!solution.converged && solution.iterations == 1);
    assert!(solution.final_energy < solution.initial_energy);
    // The last frame's mesh as the start: one or two steps are enough.
    let warm = solver
        .solve(&[&data, &isometry], &truth, &SolveOptions::default())
        .unwrap();
    assert!(warm.converged && warm.iterations <= 2, "{}", warm.iterations);
}

#[test]
fn starts_and_terms_that_do_not_fit_are_refused() {
    let mesh = sheet();
    let n = mesh.vertices().len();
    let (isometry, bending) = (Isometry::new(&mesh, 1.0).unwrap(), Bending::new(&mesh, 1.0).unwrap());
    let mut solver = MeshSolver::new(&mesh, &[]).unwrap();
    let options = SolveOptions::default();
    assert_eq!(
        solver.solve(&[&isometry], &[DVec3::ZERO], &options).unwrap_err(),
        GeometryError::StartLength { actual: 1, expected: n }
    );
    assert_eq!(
        solver.solve(&[&bending], mesh.vertices(), &options).unwrap_err(),
        GeometryError::Coupling("bending")
    );
    let nan = vec![DVec3::NAN; n];
    assert!(matches!(
        solver.solve(&[&isometry], &nan, &options),
        Err(GeometryError::StartEnergy { term: "isometry", .. })
    ));
}

#[test]
fn a_start_partly_behind_the_camera_is_no_error() {
    let mesh = sheet();
    let truth: Vec<DVec3> = mesh.vertices().iter().map(|&v| pose(v)).collect();
    let points = image_points(&mesh, &truth, 1.0);
    let image = Reprojection::new(&mesh, &camera(), &points, Robust::Squares).unwrap();
    let isometry = Isometry::new(&mesh, 1e4).unwrap();
    let mut solver = MeshSolver::new(&mesh, &[]).unwrap();
    // The twentieth that is nearest is behind it.
    let mut depths: Vec<f64> = truth.iter().map(|v| v.z).collect();
    depths.sort_by(f64::total_cmp);
    let near = DVec3::Z * depths[depths.len() / 20];
    let start: Vec<DVec3> = truth.iter().map(|v| v - near).collect();
    let solution = solver
        .solve(&[&image, &isometry], &start, &SolveOptions::default())
        .unwrap();
    assert!(solution.initial_energy.is_finite() && solution.final_energy < 0.5 * solution.initial_energy);
}
