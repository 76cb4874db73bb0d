//! CH17R: the non-linear refinement of a closed-form solution.
//!
//! F. Brunet, A. Bartoli, R. Hartley, *Monocular Template-Based 3D Surface Reconstruction: Convex Inextensible and Nonconvex Isometric
//! Methods*, CVIU 125, 2014, section 5. The authors of CH17 refine with it, and DeepSfT calls the result CH17R.
//!
//! # Equations
//!
//! The surface phi minimises by Levenberg-Marquardt, from the closed-form solution,
//!
//! ```text
//! sum_i |pi(phi(p_i)) - q_i|^2 + a sum_j |J_phi^T J_phi - I|^2 (p_j) + b integral |D^2 phi|^2
//! ```
//!
//! # Where we had to decide
//!
//! * Brunet's phi is a B-spline. Ours is the template's mesh, with the solver of `deepsft-geometry`: lengths of edges along the sides and the
//!   diagonals of the cells stand for the metric tensor.
//! * Weights are those of our own fit ([`IsometricMesh`]), for residuals in pixels. The article chooses its own by cross-validation.
//! * Squares, no robust cost: "statistically optimal" is said of noise without outliers.

use crate::frame::Correspondence;
use anyhow::Result;
use deepsft_geometry::fitting::{IsometricMesh, Stiffness};
use deepsft_geometry::glam::{DVec2, DVec3};
use deepsft_geometry::solver::{ImagePoint, Reprojection, Robust};
use deepsft_geometry::{Camera, Template};

/// Most correspondences that are taken, spread over all.
const MOST: usize = 3000;

/// Accepted steps.
const STEPS: usize = 60;

/// A vertex of the start that is nearer than this is put there, mm: what CH17 says of hidden parts is wild.
const NEAREST_MM: f64 = 50.0;

/// The refinement of one sheet.
pub struct Ch17r {
    mesh: IsometricMesh,
    size_mm: DVec2,
}

impl Ch17r {
    /// Prepares what does not depend on the frame.
    /// Fails for a template without extent.
    pub fn new(template: &Template) -> Result<Self> {
        let mesh = template.mesh();
        Ok(Self {
            mesh: IsometricMesh::new(mesh.clone(), mesh)?,
            size_mm: template.size_mm(),
        })
    }

    /// Refines the vertices `start` (mm, camera frame) so that `seen` project to their pixels and edges keep their lengths.
    /// Fails where a correspondence of the start lies behind the camera.
    pub fn refine(&mut self, seen: &[Correspondence], camera: &Camera, start: &[DVec3]) -> Result<Vec<DVec3>> {
        let step = seen.len().div_ceil(MOST).max(1);
        let point = |seen: &Correspondence| {
            let point = self.mesh.locator.locate(seen.uv(self.size_mm))?;
            Some(seen.image_point(point))
        };
        let points: Vec<ImagePoint> = seen.iter().step_by(step).filter_map(point).collect();
        let data = Reprojection::new(&self.mesh.mesh, camera, &points, Robust::Squares)?;
        let before_camera = |p: &DVec3| p.with_z(if p.z < NEAREST_MM { NEAREST_MM } else { p.z });
        let start: Vec<DVec3> = start.iter().map(before_camera).collect();
        let solution = self.mesh.solve(Stiffness::WHOLE, &[&data], &start, STEPS, true)?;
        Ok(solution.vertices)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::frame::tests::{correspondences, cylinder, mean_error, template, vertices_on};
    use deepsft_geometry::training_camera;

    #[test]
    fn a_bent_sheet_whose_distances_are_wrong_comes_back_to_the_truth() {
        let truth = |place: DVec2| cylinder(place, 130.0, 0.5) + DVec3::Z * 500.0;
        // At the same pixels, 6 % off and wavy.
        let vertices = vertices_on(truth).into_iter().enumerate();
        let wavy = |(k, p): (usize, DVec3)| p * (1.06 + 0.01 * (k as f64 / 5.0).sin());
        let start: Vec<DVec3> = vertices.map(wavy).collect();
        assert!(mean_error(&start, truth) > 25.0);
        let mut method = Ch17r::new(&template()).unwrap();
        let refined = method.refine(&correspondences(&truth, 60), &training_camera(), &start);
        let error = mean_error(&refined.unwrap(), truth);
        // Chords of 10 mm on a radius of 130 mm are 0.1 mm off the arc; bending pulls a little.
        assert!(error < 1.0, "{error}");
    }
}
