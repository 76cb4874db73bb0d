//! One view of the sheet, and what it says of the camera.

use super::camera_parameters::pixel_gradients;
use crate::camera::Camera;
use crate::error::GeometryError;
use crate::fitting::mesh_fitter::{FitRound, MeshFitter};
use crate::fitting::observation::Observation;
use crate::image::GreyImage;
use crate::solver::{Energy, PhotoConsistency};
use glam::{DMat4, DVec3, DVec4};

/// Correlation around a vertex below which something else is seen there.
const HIDDEN: f64 = 0.4;

/// Pixels of the canonical image beside the silhouette that are not compared.
const MARGIN_PX: usize = 2;

/// An image and the mesh in it.
#[derive(Debug)]
pub(super) struct View {
    pub(super) image: GreyImage,
    /// The coarse mesh as it was tracked, camera frame, mm.
    tracked: Vec<DVec3>,
    /// As it is before the camera that is solved for.
    pub(super) vertices: Vec<DVec3>,
    /// How the image confirms each of them; all of them before the first fit.
    confidence: Vec<f32>,
    /// How the vertices move with the camera's parameters.
    sensitivities: [Vec<DVec3>; 4],
    /// What it says of the camera.
    pub(super) reduced: Reduced,
    /// What was left of the fit's energy.
    pub(super) energy: f64,
}

/// The camera's normal equations after the mesh has been eliminated (the Schur complement).
#[derive(Clone, Copy, Debug)]
pub(super) struct Reduced {
    pub(super) hessian: DMat4,
    pub(super) gradient: DVec4,
}

impl Reduced {
    /// Nothing is known of the camera. (A matrix's own default is the identity.)
    const NOTHING: Self = Self {
        hessian: DMat4::ZERO,
        gradient: DVec4::ZERO,
    };
}

impl View {
    pub(super) fn new(image: GreyImage, tracked: Vec<DVec3>, vertices: Vec<DVec3>) -> Self {
        Self {
            image,
            confidence: vec![1.0; vertices.len()],
            tracked,
            vertices,
            sensitivities: Default::default(),
            reduced: Reduced::NOTHING,
            energy: f64::INFINITY,
        }
    }

    /// Mean way of the vertices to `others`, as both were tracked, mm.
    pub(super) fn motion_from(&self, others: &[DVec3]) -> f64 {
        let ways = self.tracked.iter().zip(others).map(|(a, b)| a.distance(*b));
        ways.sum::<f64>() / others.len().max(1) as f64
    }

    /// Information on ln f in this view and the `prior`; without end before it was fitted.
    pub(super) fn information(&self, prior: DVec4) -> f64 {
        if self.reduced.hessian == DMat4::ZERO {
            return f64::INFINITY;
        }
        let hessian = self.reduced.hessian + DMat4::from_diagonal(prior);
        hessian.inverse().x_axis.x.recip()
    }

    /// Fits the mesh before `camera`, and finds out what the view says of it: nothing where the sheet is not seen.
    pub(super) fn fit(
        &mut self,
        fitter: &mut MeshFitter,
        camera: &Camera,
        (blur, steps): (f32, usize),
    ) -> Result<(), GeometryError> {
        let round = FitRound {
            margin: MARGIN_PX,
            is_near: true,
            trusted: Some((&self.confidence, HIDDEN)),
            ..FitRound::new(blur, steps)
        };
        let observation = Observation::new(&self.image, camera)?;
        let (fitted, linearized) = fitter.round_and(
            observation,
            &self.vertices,
            &round,
            &[],
            |isometric, (term, _), fitted| {
                let (coupling, reduced) = linearized(term, camera, fitted);
                let solved = isometric.sensitivities(&[term as &dyn Energy], fitted, &coupling)?;
                Some((coupling, reduced, solved))
            },
        )?;
        self.energy = fitted.energy;
        self.vertices = fitted.vertices;
        self.confidence = fitted.correlation.confidence;
        (self.reduced, self.sensitivities) = (Reduced::NOTHING, Default::default());
        if let Some((coupling, mut reduced, (sensitivities, step))) = linearized {
            let dot = |a: &[DVec3], b: &[DVec3]| a.iter().zip(b).map(|(a, b)| a.dot(*b)).sum::<f64>();
            for (k, coupling) in coupling.iter().enumerate() {
                reduced.gradient[k] += dot(coupling, &step);
                for (l, sensitivity) in sensitivities.iter().enumerate() {
                    reduced.hessian.col_mut(l)[k] -= dot(coupling, sensitivity);
                }
            }
            self.reduced = reduced;
            self.sensitivities = sensitivities;
        }
        Ok(())
    }

    /// Takes the mesh along where the camera changes by `step`.
    pub(super) fn follow(&mut self, step: DVec4) {
        for (sensitivity, step) in self.sensitivities.iter().zip(step.to_array()) {
            for (vertex, sensitivity) in self.vertices.iter_mut().zip(sensitivity) {
                *vertex -= step * *sensitivity;
            }
        }
    }
}

/// J_x^T W J_c, one column for each of the camera's parameters, and J_c^T W J_c and J_c^T W r.
fn linearized(term: &PhotoConsistency<'_>, camera: &Camera, vertices: &[DVec3]) -> ([Vec<DVec3>; 4], Reduced) {
    let mut coupling: [Vec<DVec3>; 4] = std::array::from_fn(|_| vec![DVec3::ZERO; vertices.len()]);
    let mut own = Reduced::NOTHING;
    term.linearize_pixels(vertices, |at| {
        let gradients = pixel_gradients(camera, at.p_camera);
        let gradient = DVec4::from_array(gradients.map(|pixel| pixel.dot(at.pixel_gradient)));
        own.gradient += at.weight * at.residual * gradient;
        for (k, column) in coupling.iter_mut().enumerate() {
            *own.hessian.col_mut(k) += at.weight * gradient[k] * gradient;
            for (vertex, vertex_gradient) in at.vertex_gradients {
                column[vertex] += at.weight * gradient[k] * vertex_gradient;
            }
        }
    });
    (coupling, own)
}
