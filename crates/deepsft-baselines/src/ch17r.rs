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
#[derive(Debug)]
pub struct Ch17r {
    mesh: IsometricMesh,
    size_mm: DVec2,
}

impl Ch17r {
    /// Prepares what does not depend on the frame.
    ///
    /// # Errors
    /// For a template without extent.
    pub fn new(template: &Template) -> Result<Self> {
        let mesh = template.mesh();
        Ok(Self {
            mesh: IsometricMesh::new(mesh.clone(), mesh)?,
            size_mm: template.size_mm(),
        })
    }

    /// Refines the vertices `start` (mm, camera frame) so that `seen` project to their pixels and edges keep their lengths.
    ///
    /// # Errors
    /// Where a correspondence of the start lies behind the camera.
    pub fn refine(&mut self, seen: &[Correspondence], camera: &Camera, start: &[DVec3]) -> Result<Vec<DVec3>> {
        let step = seen.len().div_ceil(MOST).max(1);
        let point = |seen: &Correspondence| {
            let point = self
                .mesh
                .locator
                .locate((seen.place / self.size_mm).clamp(DVec2::ZERO, DVec2::ONE))?;
            Some(ImagePoint {
                point,
                pixel: seen.pixel,
                weight: 1.0,
            })
        };
        let points: Vec<ImagePoint> = seen.iter().step_by(step).filter_map(point).collect();
        let data = Reprojection::new(&self.mesh.mesh, camera, &points, Robust::Squares)?;
        let before_camera = |p: &DVec3| match p.z < NEAREST_MM {
            true => p.truncate().extend(NEAREST_MM),
            false => *p,
        };
        let start: Vec<DVec3> = start.iter().map(before_camera).collect();
        Ok(self
            .mesh
            .solve(Stiffness::WHOLE, &[&data], &start, STEPS, true)?
            .vertices)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::frame::tests::{SIZE_MM, correspondences, cylinder};
    use deepsft_geometry::{Picture, training_camera};

    #[test]
    fn a_bent_sheet_whose_distances_are_wrong_comes_back_to_the_truth() {
        let template = Template::thin_shell(Picture::from_fn(1, 1, |_, _| [0; 3]), SIZE_MM.x, SIZE_MM.y).unwrap();
        let truth = |place: DVec2| cylinder(place, 130.0, 0.5) + DVec3::Z * 500.0;
        let vertices: Vec<DVec3> = (template.mesh().texture_coordinates().iter())
            .map(|uv| truth(*uv * SIZE_MM))
            .collect();
        let error = |got: &[DVec3]| {
            let sum: f64 = got.iter().zip(&vertices).map(|(a, b)| a.distance(*b)).sum();
            sum / vertices.len() as f64
        };
        // At the same pixels, 6 % off and wavy.
        let start: Vec<DVec3> = (vertices.iter().enumerate())
            .map(|(k, p)| *p * (1.06 + 0.01 * (k as f64 / 5.0).sin()))
            .collect();
        assert!(error(&start) > 25.0);
        let mut method = Ch17r::new(&template).unwrap();
        let refined = method
            .refine(&correspondences(&truth, 60), &training_camera(), &start)
            .unwrap();
        // Chords of 10 mm on a radius of 130 mm are 0.1 mm off the arc; bending pulls a little.
        assert!(error(&refined) < 1.0, "{}", error(&refined));
    }
}
