//! Camera and poses together, by Levenberg-Marquardt on the distances in the image.

use crate::camera_model::CameraModel;
use crate::correspondence::Correspondence;
use deepsft_geometry::glam::{DQuat, DVec2, DVec3};
use deepsft_geometry::solver::Robust;
use deepsft_geometry::{Camera, RigidMotion};
use faer::linalg::solvers::{DenseSolveCore, Solve};
use faer::{Mat, Side};

/// Steps at most; from a start that is any good ten are enough.
const STEPS: usize = 200;

/// A step that lowers the cost by less than this fraction is the last.
const SETTLED: f64 = 1e-12;

/// Unknowns of a pose.
const POSE: usize = 6;

/// A camera and the pose of the target in each view that is used.
#[derive(Clone)]
pub struct Solution {
    pub camera: Camera,
    /// The number of the view, and the motion from the target's frame (z = 0) to the camera's.
    pub poses: Vec<(usize, RigidMotion)>,
}

impl Solution {
    /// Computed pixel less seen one; `None` where the point has no pixel.
    pub fn residual(&self, pose: &RigidMotion, seen: &Correspondence) -> Option<DVec2> {
        let computed = self.camera.project(pose.apply(seen.place_mm.extend(0.0)))?;
        Some(computed - seen.pixel)
    }
}

/// What is minimised: the distances of points in several views (pixels), the long ones counting less.
#[derive(Clone)]
pub struct Adjustment {
    pub model: CameraModel,
    /// The index of the pose in the solution, and the point.
    pub points: Vec<(usize, Correspondence)>,
    pub robust: Robust,
}

impl Adjustment {
    /// Cauchy's robust sum; infinite where a point has no pixel.
    fn cost(&self, solution: &Solution) -> f64 {
        let cost = |(pose, seen): &(usize, Correspondence)| {
            let residual = solution.residual(&solution.poses[*pose].1, seen);
            residual.map_or(f64::INFINITY, |r| self.robust.rho(r.length_squared()))
        };
        self.points.iter().map(cost).sum()
    }

    /// The normal equations at `solution`: J^T W J and -J^T W r, the camera's parameters first.
    fn equations(&self, solution: &Solution) -> (Mat<f64>, Mat<f64>) {
        let camera_count = self.model.names().len();
        let count = camera_count + POSE * solution.poses.len();
        let mut matrix = Mat::<f64>::zeros(count, count);
        let mut vector = Mat::<f64>::zeros(count, 1);
        for &(view, point) in &self.points {
            let pose = &solution.poses[view].1;
            let turned = pose.rotation * point.place_mm.extend(0.0);
            let p_camera = turned + pose.translation;
            let Some((seen, [x, y])) = solution.camera.project_with_gradients(p_camera) else {
                continue;
            };
            let residual = seen - point.pixel;
            let weight = self.robust.weight(residual.length_squared());
            let ray = p_camera.truncate() / p_camera.z;
            let of_camera = self.model.gradients(&solution.camera, ray, seen);
            let mut row: Vec<(usize, DVec2)> = of_camera.into_iter().enumerate().collect();
            let first = camera_count + POSE * view;
            let (turn_x, turn_y) = (turned.cross(x), turned.cross(y));
            row.extend((0..3).map(|k| (first + k, DVec2::new(turn_x[k], turn_y[k]))));
            row.extend((0..3).map(|k| (first + 3 + k, DVec2::new(x[k], y[k]))));
            for &(i, a) in &row {
                vector[(i, 0)] -= weight * a.dot(residual);
                for &(j, b) in &row {
                    matrix[(i, j)] += weight * a.dot(b);
                }
            }
        }
        (matrix, vector)
    }

    fn stepped(&self, solution: &Solution, step: &Mat<f64>) -> Option<Solution> {
        let mut values = self.model.values(&solution.camera);
        for (i, value) in values.iter_mut().enumerate() {
            *value += step[(i, 0)];
        }
        let camera = self.model.camera(&values, solution.camera.size()).ok()?;
        let moved = |(index, (view, pose)): (usize, &(usize, RigidMotion))| {
            let at = |k: usize| step[(values.len() + POSE * index + k, 0)];
            let moved = RigidMotion {
                rotation: (DQuat::from_scaled_axis(DVec3::new(at(0), at(1), at(2))) * pose.rotation).normalize(),
                translation: pose.translation + DVec3::new(at(3), at(4), at(5)),
            };
            (*view, moved)
        };
        let poses = solution.poses.iter().enumerate().map(moved).collect();
        Some(Solution { camera, poses })
    }

    /// The solution near `start`.
    pub fn solve(&self, start: Solution) -> Solution {
        let mut here = start;
        let mut cost = self.cost(&here);
        let mut damping = 1e-3;
        let mut equations = self.equations(&here);
        for _ in 0..STEPS {
            let mut matrix = equations.0.clone();
            for i in 0..matrix.nrows() {
                matrix[(i, i)] *= 1.0 + damping;
            }
            let step = matrix.llt(Side::Lower).ok().map(|factors| factors.solve(&equations.1));
            let there = step.and_then(|step| self.stepped(&here, &step));
            let lower = there.map(|there| (self.cost(&there), there));
            let lower = lower.filter(|(lower, _)| *lower < cost);
            let Some((lower, there)) = lower else {
                damping *= 10.0;
                if damping > 1e12 {
                    break;
                }
                continue;
            };
            let settled = cost - lower < SETTLED * cost;
            (cost, here) = (lower, there);
            if settled {
                break;
            }
            equations = self.equations(&here);
            damping = (damping / 10.0).max(1e-12);
        }
        here
    }

    /// Standard deviations of the camera's parameters for residuals of the deviation `sigma_px` in each coordinate. `None` where the
    /// views leave a parameter open.
    pub fn deviations(&self, solution: &Solution, sigma_px: f64) -> Option<Vec<f64>> {
        let (matrix, _) = self.equations(solution);
        // Scaled to a diagonal of ones, the units of the unknowns do not matter.
        let scale: Vec<f64> = (0..matrix.nrows()).map(|i| matrix[(i, i)].sqrt().recip()).collect();
        let scaled = Mat::from_fn(matrix.nrows(), matrix.ncols(), |i, j| {
            matrix[(i, j)] * scale[i] * scale[j]
        });
        let inverse = scaled.llt(Side::Lower).ok()?.inverse();
        let deviation = |i: usize| sigma_px * scale[i] * inverse[(i, i)].sqrt();
        let deviations: Vec<f64> = (0..self.model.names().len()).map(deviation).collect();
        deviations.iter().all(|d| d.is_finite()).then_some(deviations)
    }
}
