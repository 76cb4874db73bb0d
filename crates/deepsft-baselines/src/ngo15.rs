//! NGO15: a Laplacian mesh from sparse matches.
//!
//! D. T. Ngo, J. Ostlund, P. Fua, *Template-Based Monocular 3D Shape Recovery Using Laplacian Meshes*, PAMI 38(1), 2016 (online 2015), on
//! J. Ostlund, A. Varol, D. T. Ngo, P. Fua, *Laplacian Meshes for Monocular 3D Shape Recovery*, ECCV 2012.
//!
//! # Equations
//!
//! The rows of A say of two neighbouring faces of the rest mesh how their corners depend on each other: |A x|^2 is 0 for the rest shape and
//! whatever is affine to it. The vertices x that follow control vertices c with the least |A x|^2 are P c. A match of the surface point with
//! barycentric coordinates b and the ray (s, t, 1) gives two rows of M:
//!
//! ```text
//! sum_k b_k (X_k - s Z_k) = 0,   sum_k b_k (Y_k - t Z_k) = 0
//! ```
//!
//! 1. c of unit length with the least |M P c|^2 + w^2 |A P c|^2: an eigenvector. Its scale is that of the edges.
//! 2. Matches further than a radius from where the mesh has them are rejected, radius and w are halved, and so on: outliers go while the
//!    mesh is stiff.
//! 3. Then the reprojection error of what is left, with the same regularisation, under constant edge lengths, by Gauss-Newton steps.
//!
//! # Where we had to decide
//!
//! * DeepSfT names *Dense Image Registration and Deformable Surface Reconstruction in Presence of Occlusions and Minimal Texture* (Ngo, Park,
//!   Jorstad, Crivellaro, Yoo, Fua, ICCV 2015), which goes on from this method with dense registration. Its code is not public any more; this
//!   is the part of it that needs no start.
//! * A is that of the quadratic bending energy of `deepsft-geometry`: the same dependences of four corners, scaled to be without unit.
//! * Matches are those of our features, where the article has SIFT or Ferns: the 120 clearest, so that most are right.
//! * Edges are held on both sides: under `not longer` alone the nearer, smaller mesh explains the image as well. The constraints are a stiff
//!   penalty, because the solver has no others.

use crate::frame::{Correspondence, at_least};
use crate::reduced::{Reduced, expanded};
use anyhow::{Context, Result};
use deepsft_geometry::fitting::{GridInterpolation, SurfaceLocator};
use deepsft_geometry::glam::DVec3;
use deepsft_geometry::solver::{
    Bending, Energy, Isometry, MeshSolver, Reprojection, ResidualSink, Robust, SolveOptions, SurfacePoint,
};
use deepsft_geometry::{Camera, Template, TriangleMesh};
use faer::linalg::solvers::Solve;
use faer::{Mat, Side};

/// How much larger cells are than those of the template's mesh: about 130 vertices.
const COARSER: usize = 3;

/// Control vertices along both sides.
const CONTROLS: usize = 6;

/// Pixels within which matches are kept, and w, at the beginning and after each halving.
const RADIUS_PX: f64 = 64.0;
const REGULARISATION: f64 = 8.0;
const HALVINGS: usize = 5;

/// Fewest matches that determine a mesh.
const FEWEST: usize = 12;

/// Weight of edge lengths beside a match, whose residual is in pixels.
const ISOMETRY: f64 = 1e6;

/// Weight of the regularisation in the last step, per match.
const LAST_BENDING: f64 = 2e-3;

const STEPS: usize = 60;

/// The method for one sheet.
pub struct Ngo15 {
    coarse: Template,
    to_template: GridInterpolation,
    locator: SurfaceLocator,
    /// P: a row per vertex, a column per control vertex.
    projection: Mat<f64>,
    /// (A P)^T (A P).
    regularisation: Mat<f64>,
    isometry: Isometry,
    solver: MeshSolver,
}

/// A match and its point on the mesh.
type Observed = (SurfacePoint, Correspondence);

/// The square of A: a row and a column per vertex.
struct Laplacian(Mat<f64>);

impl ResidualSink for Laplacian {
    fn scalar(&mut self, _: f64, _: f64, _: &[(usize, DVec3)]) {}

    fn vector(&mut self, _: DVec3, weight: f64, coefficients: &[(usize, f64)]) {
        let row = || coefficients.iter().map(|&(v, c)| (v, weight.sqrt() * c));
        for (a, wa) in row() {
            row().for_each(|(b, wb)| self.0[(a, b)] += wa * wb);
        }
    }
}

/// P: the vertices with the least |A x|^2 among those with the control vertices `controls`.
fn projection(laplacian: &Mat<f64>, controls: &[usize]) -> Result<Mat<f64>> {
    let n = laplacian.nrows();
    let free: Vec<usize> = (0..n).filter(|v| !controls.contains(v)).collect();
    let within = Mat::from_fn(free.len(), free.len(), |i, j| laplacian[(free[i], free[j])]);
    let mut solved = Mat::from_fn(free.len(), controls.len(), |i, k| -laplacian[(free[i], controls[k])]);
    let factor = within.llt(Side::Lower).ok();
    let factor = factor.context("the control vertices leave others open")?;
    factor.solve_in_place(solved.as_mut());
    let mut projection = Mat::zeros(n, controls.len());
    controls.iter().enumerate().for_each(|(k, &v)| projection[(v, k)] = 1.0);
    for (i, &v) in free.iter().enumerate() {
        (0..controls.len()).for_each(|k| projection[(v, k)] = solved[(i, k)]);
    }
    Ok(projection)
}

impl Ngo15 {
    /// Prepares what does not depend on the frame, with 6 x 6 control vertices.
    /// Fails for a template that is no sheet.
    pub fn new(template: &Template) -> Result<Self> {
        let coarse = template.coarser(COARSER)?;
        let mesh = coarse.mesh();
        let (columns, rows) = coarse.grid().context("the template is no sheet")?;
        let spread = |count: usize| (0..CONTROLS).map(move |k| (k * (count - 1) + (CONTROLS - 1) / 2) / (CONTROLS - 1));
        let controls = spread(rows).flat_map(|j| spread(columns).map(move |i| j * columns + i));
        let mut controls: Vec<usize> = controls.collect();
        controls.dedup();
        let n = mesh.vertices().len();
        let mut laplacian = Laplacian(Mat::zeros(n, n));
        Bending::new(mesh, 1.0)?.linearize(mesh.vertices(), &mut laplacian);
        let projection = projection(&laplacian.0, &controls)?;
        let isometry = Isometry::new(mesh, ISOMETRY)?;
        // The solver couples what the terms say: of a mesh of the control vertices it takes the lengths that steps are compared with.
        let faces = (2..controls.len()).map(|k| [k - 2, k - 1, k]).collect();
        let uv = controls.iter().map(|&v| mesh.texture_coordinates()[v]).collect();
        let nodes = TriangleMesh::new(controls.iter().map(|&v| mesh.vertices()[v]).collect(), uv, faces)?;
        let reduced = Reduced {
            term: &isometry,
            projection: &projection,
        };
        Ok(Self {
            solver: MeshSolver::new(&nodes, &[&reduced])?,
            to_template: GridInterpolation::cubic(&coarse, template.mesh())?,
            locator: SurfaceLocator::new(mesh),
            regularisation: projection.transpose() * &laplacian.0 * &projection,
            coarse,
            projection,
            isometry,
        })
    }

    /// Reconstructs the vertices of the template's mesh (mm, camera frame) from `matches`, right and wrong ones.
    /// Fails when fewer than 12 matches agree on a mesh.
    pub fn reconstruct(&mut self, matches: &[Correspondence], camera: &Camera) -> Result<Vec<DVec3>> {
        let size_mm = self.coarse.size_mm();
        let observed = |seen: &Correspondence| Some((self.locator.locate(seen.uv(size_mm))?, *seen));
        let all: Vec<Observed> = matches.iter().filter_map(observed).collect();
        let (mut kept, mut controls) = (all.clone(), Vec::new());
        for halving in 0..HALVINGS {
            at_least(kept.len(), FEWEST, "matches agree")?;
            let scale = 0.5_f64.powi(halving as i32);
            controls = self.linear(&kept, REGULARISATION * scale)?;
            let vertices = expanded(&self.projection, &controls);
            let is_near = |observed: &&Observed| self.error_px(observed, camera, &vertices) < RADIUS_PX * scale;
            kept = all.iter().filter(is_near).copied().collect();
        }
        at_least(kept.len(), FEWEST, "matches agree")?;
        let vertices = self.constrained(&kept, camera, &controls)?;
        Ok(self.to_template.apply(&vertices))
    }

    /// Pixels between a match and where the mesh has it.
    fn error_px(&self, (point, seen): &Observed, camera: &Camera, vertices: &[DVec3]) -> f64 {
        let projected = camera.project(point.position(self.coarse.mesh().faces(), vertices));
        projected.map_or(f64::INFINITY, |pixel| pixel.distance(seen.pixel))
    }

    /// Step 1: the control vertices of the linear problem, scaled to the mesh.
    fn linear(&self, observed: &[Observed], regularisation: f64) -> Result<Vec<DVec3>> {
        let count = self.projection.ncols();
        let mut square = Mat::<f64>::zeros(3 * count, 3 * count);
        let mut row = vec![[0.0; 2]; 3 * count];
        for (point, seen) in observed {
            let corners = self.coarse.mesh().faces()[point.face].into_iter();
            let corners = corners.zip(point.barycentric);
            for k in 0..count {
                let weight: f64 = corners.clone().map(|(v, b)| b * self.projection[(v, k)]).sum();
                row[3 * k] = [weight, 0.0];
                row[3 * k + 1] = [0.0, weight];
                row[3 * k + 2] = [-weight * seen.ray.x, -weight * seen.ray.y];
            }
            for (i, a) in row.iter().enumerate() {
                for (j, b) in row[..=i].iter().enumerate() {
                    square[(i, j)] += (a[0] * b[0] + a[1] * b[1]) / observed.len() as f64;
                }
            }
        }
        for i in 0..count {
            for k in 0..=i {
                let weight = regularisation * regularisation * self.regularisation[(i, k)];
                (0..3).for_each(|axis| square[(3 * i + axis, 3 * k + axis)] += weight);
            }
        }
        let eigen = square.self_adjoint_eigen(Side::Lower).ok();
        let eigen = eigen.context("the linear problem has no solution")?;
        // Eigenvalues ascend.
        let vector = eigen.U().col(0);
        let control = |k: usize| DVec3::from([0, 1, 2].map(|axis| vector[3 * k + axis]));
        let controls: Vec<DVec3> = (0..count).map(control).collect();
        let scale = self.scale(&controls);
        Ok(controls.into_iter().map(|control| scale * control).collect())
    }

    /// By what a solution up to scale is multiplied so that its edges have their lengths on average, before the camera.
    fn scale(&self, controls: &[DVec3]) -> f64 {
        let (rest, vertices) = (self.coarse.mesh().vertices(), expanded(&self.projection, controls));
        let (mut product, mut square) = (0.0, 0.0);
        for [a, b] in self.coarse.mesh().edges() {
            let length = vertices[a].distance(vertices[b]);
            product += length * rest[a].distance(rest[b]);
            square += length * length;
        }
        let before = vertices.iter().map(|p| p.z).sum::<f64>().signum();
        before * product / square
    }

    /// Step 3: the mesh under constant edge lengths.
    fn constrained(&mut self, observed: &[Observed], camera: &Camera, start: &[DVec3]) -> Result<Vec<DVec3>> {
        let points: Vec<_> = observed.iter().map(|(point, seen)| seen.image_point(*point)).collect();
        let mesh = self.coarse.mesh();
        let data = Reprojection::new(mesh, camera, &points, Robust::Squares)?;
        let bending = Bending::new(mesh, LAST_BENDING * observed.len() as f64)?;
        let terms: [&dyn Energy; 3] = [&data, &bending, &self.isometry];
        let projection = &self.projection;
        let terms = terms.map(|term| Reduced { term, projection });
        let options = SolveOptions {
            max_iterations: STEPS,
            first_damping: 1e-6,
            ..SolveOptions::default()
        };
        let solution = self.solver.solve(&[&terms[0], &terms[1], &terms[2]], start, &options)?;
        Ok(expanded(&self.projection, &solution.vertices))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::frame::tests::{correspondences, cylinder, mean_error, template};
    use deepsft_geometry::glam::DVec2;
    use deepsft_geometry::training_camera;

    fn error_mm(method: &mut Ngo15, matches: &[Correspondence], truth: impl Fn(DVec2) -> DVec3) -> f64 {
        mean_error(&method.reconstruct(matches, &training_camera()).unwrap(), truth)
    }

    #[test]
    fn a_rigid_sheet_is_exact_and_two_fifths_of_wrong_matches_change_nothing() {
        // So large a radius that the sheet is flat to 1e-6 mm.
        let truth = |place: DVec2| cylinder(place, 1e10, 0.5) + DVec3::Z * 500.0;
        let mut method = Ngo15::new(&template()).unwrap();
        let mut matches = correspondences(&truth, 15);
        let exact = error_mm(&mut method, &matches, truth);
        assert!(exact < 1e-3, "{exact}");
        let places: Vec<DVec2> = matches.iter().map(|m| m.place).collect();
        for k in (0..matches.len()).filter(|k| k % 5 < 2) {
            matches[k].place = places[(k * 97 + 31) % places.len()];
        }
        let robust = error_mm(&mut method, &matches, truth);
        assert!(robust < 1.0, "{robust}");
    }

    #[test]
    fn a_noise_free_isometric_mesh_is_recovered() {
        let truth = |place: DVec2| cylinder(place, 130.0, 0.5) + DVec3::Z * 500.0;
        let mut method = Ngo15::new(&template()).unwrap();
        let error = error_mm(&mut method, &correspondences(&truth, 25), truth);
        // Chords of 31 mm on a radius of 130 mm are 31^2 / (8 * 130) = 0.9 mm off the arc.
        assert!(error < 2.0, "{error}");
    }
}
