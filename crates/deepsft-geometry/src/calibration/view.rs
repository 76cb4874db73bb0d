//! One view of the sheet, and what it says of the camera.

use super::camera_parameters::pixel_gradients;
use crate::camera::Camera;
use crate::error::GeometryError;
use crate::fitting::mesh_fitter::{FitRound, MeshFitter};
use crate::fitting::observation::Observation;
use crate::image::GreyImage;
use crate::solver::{Energy, Isometry, PhotoConsistency};
use glam::{DMat4, DVec3, DVec4};

/// Correlation around a vertex below which something else is seen there.
const HIDDEN: f64 = 0.4;

/// Pixels of the canonical image beside the silhouette that are not compared.
const MARGIN_PX: usize = 2;

/// What is solved for with the meshes: four numbers of the camera, and the template's aspect.
pub(super) const PARAMETERS: usize = 5;

/// The place of the template's aspect among them: ln of how much wider the print is, beside its height, than it was said to be.
pub(super) const ASPECT: usize = 4;

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
    /// How the vertices move with the parameters.
    sensitivities: [Vec<DVec3>; PARAMETERS],
    /// What it says of them.
    pub(super) reduced: Reduced,
    /// What was left of the fit's energy.
    pub(super) energy: f64,
}

/// The normal equations of the parameters after the mesh has been eliminated (the Schur complement).
#[derive(Clone, Copy, Debug)]
pub(super) struct Reduced {
    hessian: [[f64; PARAMETERS]; PARAMETERS],
    gradient: [f64; PARAMETERS],
}

impl Reduced {
    /// Nothing is known.
    const NOTHING: Self = Self {
        hessian: [[0.0; PARAMETERS]; PARAMETERS],
        gradient: [0.0; PARAMETERS],
    };

    /// Each parameter is known with an `information`, and is `off` from what is known.
    pub(super) fn prior(information: [f64; PARAMETERS], off: [f64; PARAMETERS]) -> Self {
        let mut prior = Self::NOTHING;
        for k in 0..PARAMETERS {
            prior.hessian[k][k] = information[k];
            prior.gradient[k] = information[k] * off[k];
        }
        prior
    }

    pub(super) fn add(&mut self, other: &Self) {
        for k in 0..PARAMETERS {
            self.gradient[k] += other.gradient[k];
            for l in 0..PARAMETERS {
                self.hessian[k][l] += other.hessian[k][l];
            }
        }
    }

    /// The step of all parameters to the minimum, and the covariances of the camera's four. The aspect is known beforehand, so that it
    /// can be eliminated.
    pub(super) fn solve(&self) -> ([f64; PARAMETERS], DMat4) {
        let [x, y, z, w, aspect] = self.hessian;
        let of_camera = |row: [f64; PARAMETERS]| DVec4::new(row[0], row[1], row[2], row[3]);
        let (coupling, own) = (of_camera(aspect), aspect[ASPECT]);
        let eliminated = |row, k: usize| of_camera(row) - coupling * (coupling[k] / own);
        let hessian = DMat4::from_cols(eliminated(x, 0), eliminated(y, 1), eliminated(z, 2), eliminated(w, 3));
        let gradient = of_camera(self.gradient) - coupling * (self.gradient[ASPECT] / own);
        let covariance = hessian.inverse();
        let camera = -(covariance * gradient);
        let aspect = -(self.gradient[ASPECT] + coupling.dot(camera)) / own;
        ([camera.x, camera.y, camera.z, camera.w, aspect], covariance)
    }
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
    pub(super) fn information(&self, mut prior: Reduced) -> f64 {
        if self.reduced.hessian == Reduced::NOTHING.hessian {
            return f64::INFINITY;
        }
        prior.add(&self.reduced);
        let (_, covariance) = prior.solve();
        covariance.x_axis.x.recip()
    }

    /// Fits the mesh before `camera`, and finds out what the view says of the parameters: nothing where the sheet is not seen.
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
                let (coupling, reduced) = linearized(term, isometric.isometry()?, camera, fitted);
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
                    reduced.hessian[l][k] -= dot(coupling, sensitivity);
                }
            }
            self.reduced = reduced;
            self.sensitivities = sensitivities;
        }
        Ok(())
    }

    /// Takes the mesh along where the parameters change by `step`.
    pub(super) fn follow(&mut self, step: [f64; PARAMETERS]) {
        for (sensitivity, step) in self.sensitivities.iter().zip(step) {
            for (vertex, sensitivity) in self.vertices.iter_mut().zip(sensitivity) {
                *vertex -= step * *sensitivity;
            }
        }
    }
}

/// J_x^T W J_c, one column for each of the parameters, and J_c^T W J_c and J_c^T W r. The camera acts on what is seen, the aspect on the
/// rest lengths.
fn linearized(
    term: &PhotoConsistency<'_>,
    isometry: &Isometry,
    camera: &Camera,
    vertices: &[DVec3],
) -> ([Vec<DVec3>; PARAMETERS], Reduced) {
    let mut coupling: [Vec<DVec3>; PARAMETERS] = std::array::from_fn(|_| vec![DVec3::ZERO; vertices.len()]);
    let mut own = Reduced::NOTHING;
    term.linearize_pixels(vertices, |at| {
        let gradient = pixel_gradients(camera, at.p_camera).map(|pixel| pixel.dot(at.pixel_gradient));
        for (k, column) in coupling[..ASPECT].iter_mut().enumerate() {
            own.gradient[k] += at.weight * at.residual * gradient[k];
            for (l, other) in gradient.iter().enumerate() {
                own.hessian[k][l] += at.weight * gradient[k] * other;
            }
            for (vertex, vertex_gradient) in at.vertex_gradients {
                column[vertex] += at.weight * gradient[k] * vertex_gradient;
            }
        }
    });
    isometry.linearize_aspect(vertices, |residual, weight, derivative, vertex_gradients| {
        own.gradient[ASPECT] += weight * residual * derivative;
        own.hessian[ASPECT][ASPECT] += weight * derivative * derivative;
        for (vertex, vertex_gradient) in vertex_gradients {
            coupling[ASPECT][vertex] += weight * derivative * vertex_gradient;
        }
    });
    (coupling, own)
}
