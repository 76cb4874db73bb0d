//! One view of the sheet, and what it says of the camera, whose unknowns are numbers that can be solved for.

use crate::camera::{Camera, Lens};
use crate::error::Result;
use crate::fitting::measurements::Observation;
use crate::fitting::mesh_fitter::{FitRound, MeshFitter};
use crate::image::GreyImage;
use crate::solver::{Energy, Isometry, PhotoConsistency};
use glam::{DMat4, DVec2, DVec3, DVec4};

/// Correlation around a vertex below which something else is seen there.
const HIDDEN: f64 = 0.4;

/// Pixels of the canonical image beside the silhouette that are not compared.
const MARGIN_PX: usize = 2;

/// What is solved for with the meshes: four numbers of the camera, and the template's aspect.
pub(super) const PARAMETERS: usize = 5;

/// The place of the template's aspect among them: ln of how much wider the print is, beside its height, than it was said to be.
pub(super) const ASPECT: usize = 4;

#[derive(Debug)]
pub(super) struct View {
    /// As they were taken, from 1.
    pub(super) number: usize,
    pub(super) fits: usize,
    pub(super) image: GreyImage,
    /// The coarse mesh as it was tracked, camera frame, mm.
    tracked: Vec<DVec3>,
    /// As it is before the camera that is solved for.
    pub(super) vertices: Vec<DVec3>,
    /// How the image confirms each of them; all of them before the first fit.
    confidence: Vec<f32>,
    /// How the vertices move with the parameters.
    sensitivities: [Vec<DVec3>; PARAMETERS],
    pub(super) reduced: Reduced,
    pub(super) energy: f64,
}

/// The normal equations of the parameters after the mesh has been eliminated (the Schur complement): rows of the Hessian, each with the
/// gradient at its end.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Reduced([[f64; PARAMETERS + 1]; PARAMETERS]);

impl Reduced {
    /// Nothing is known.
    const NOTHING: Self = Self([[0.0; PARAMETERS + 1]; PARAMETERS]);

    /// Each parameter is known with an `information`, and is `off` from what is known.
    pub(super) fn prior(information: [f64; PARAMETERS], off: [f64; PARAMETERS]) -> Self {
        let mut prior = Self::NOTHING;
        for (k, row) in prior.0.iter_mut().enumerate() {
            (row[k], row[PARAMETERS]) = (information[k], information[k] * off[k]);
        }
        prior
    }

    pub(super) fn add(&mut self, other: &Self) {
        let entries = self.0.as_flattened_mut().iter_mut();
        entries
            .zip(other.0.as_flattened())
            .for_each(|(sum, entry)| *sum += entry);
    }

    /// The step of all parameters to the minimum, and the covariances of the camera's four. The aspect is known beforehand, so that it
    /// can be eliminated.
    pub(super) fn solve(&self) -> ([f64; PARAMETERS], DMat4) {
        let aspect = self.0[ASPECT];
        let eliminated = self.0.map(|row| {
            let fraction = row[ASPECT] / aspect[ASPECT];
            std::array::from_fn::<_, { PARAMETERS + 1 }, _>(|l| row[l] - fraction * aspect[l])
        });
        let [x, y, z, w] = [0, 1, 2, 3].map(|k| DVec4::from_slice(&eliminated[k]));
        let gradient = DVec4::from_array([0, 1, 2, 3].map(|k| eliminated[k][PARAMETERS]));
        let covariance = DMat4::from_cols(x, y, z, w).inverse();
        let camera = -(covariance * gradient);
        let stretch = -(aspect[PARAMETERS] + DVec4::from_slice(&aspect).dot(camera)) / aspect[ASPECT];
        ([camera.x, camera.y, camera.z, camera.w, stretch], covariance)
    }
}

impl View {
    pub(super) fn new(number: usize, image: GreyImage, tracked: Vec<DVec3>, vertices: Vec<DVec3>) -> Self {
        Self {
            number,
            fits: 0,
            image,
            confidence: vec![1.0; vertices.len()],
            tracked,
            vertices,
            sensitivities: Default::default(),
            reduced: Reduced::NOTHING,
            energy: f64::INFINITY,
        }
    }

    /// Begins anew with the mesh as it was tracked.
    pub(super) fn begin(&mut self) {
        self.vertices.clone_from(&self.tracked);
        self.confidence.fill(1.0);
        (self.reduced, self.sensitivities) = (Reduced::NOTHING, Default::default());
        (self.energy, self.fits) = (f64::INFINITY, 0);
    }

    /// Mean way of the vertices to `others`, as both were tracked, mm.
    pub(super) fn motion_from(&self, others: &[DVec3]) -> f64 {
        let ways = self.tracked.iter().zip(others).map(|(a, b)| a.distance(*b));
        ways.sum::<f64>() / others.len().max(1) as f64
    }

    /// Information on ln f in this view and the `prior`; without end before it was fitted.
    pub(super) fn information(&self, mut prior: Reduced) -> f64 {
        if self.reduced == Reduced::NOTHING {
            return f64::INFINITY;
        }
        prior.add(&self.reduced);
        let (_, covariance) = prior.solve();
        covariance.x_axis.x.recip()
    }

    /// Fits the mesh before `camera`, and finds out what the view says of the parameters: nothing where the sheet is not seen.
    pub(super) fn fit(&mut self, fitter: &mut MeshFitter, camera: &Camera, (blur, steps): (f32, usize)) -> Result<()> {
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
                let equations = isometric.factorized(&[term as &dyn Energy], fitted)?;
                let sensitivities = coupling.each_ref().map(|column| equations.step_against(column));
                Some((coupling, reduced, sensitivities, equations.step()))
            },
        )?;
        self.fits += 1;
        self.energy = fitted.energy;
        self.vertices = fitted.vertices;
        self.confidence = fitted.correlation.confidence;
        (self.reduced, self.sensitivities) = (Reduced::NOTHING, Default::default());
        if let Some((coupling, mut reduced, sensitivities, step)) = linearized {
            let dot = |a: &[DVec3], b: &[DVec3]| a.iter().zip(b).map(|(a, b)| a.dot(*b)).sum::<f64>();
            for (k, coupling) in coupling.iter().enumerate() {
                reduced.0[k][PARAMETERS] += dot(coupling, &step);
                for (l, sensitivity) in sensitivities.iter().enumerate() {
                    reduced.0[l][k] += dot(coupling, sensitivity);
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
                *vertex += step * *sensitivity;
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
            own.0[k][PARAMETERS] += at.weight * at.residual * gradient[k];
            for (l, other) in gradient.iter().enumerate() {
                own.0[k][l] += at.weight * gradient[k] * other;
            }
            for (vertex, vertex_gradient) in at.vertex_gradients {
                column[vertex] += at.weight * gradient[k] * vertex_gradient;
            }
        }
    });
    isometry.linearize_aspect(vertices, |residual, weight, derivative, vertex_gradients| {
        own.0[ASPECT][PARAMETERS] += weight * residual * derivative;
        own.0[ASPECT][ASPECT] += weight * derivative * derivative;
        for (vertex, vertex_gradient) in vertex_gradients {
            coupling[ASPECT][vertex] += weight * derivative * vertex_gradient;
        }
    });
    (coupling, own)
}

/// The derivative of where `camera` shows a point (camera frame) with respect to its parameters (ln f, cx / f, cy / f, k1), pixels.
pub(super) fn pixel_gradients(camera: &Camera, p_camera: DVec3) -> [DVec2; 4] {
    let focal = camera.focal();
    let ray = p_camera.truncate() / p_camera.z;
    let from_centre = camera.pixel_from_ray(ray).unwrap_or_default() - camera.principal_point();
    [
        from_centre,
        DVec2::new(focal.x, 0.0),
        DVec2::new(0.0, focal.y),
        focal * ray * ray.length_squared(),
    ]
}

/// What changes from `from` to `camera`, in the same parameters.
pub(super) fn between(from: &Camera, camera: &Camera) -> DVec4 {
    let shift = (camera.principal_point() - from.principal_point()) / from.focal();
    DVec4::new(
        (camera.focal().x / from.focal().x).ln(),
        shift.x,
        shift.y,
        distortion(camera)[0] - distortion(from)[0],
    )
}

/// The camera after a `step` in these parameters. A fisheye lens stays as it is.
pub(super) fn stepped(camera: &Camera, step: DVec4) -> Result<Camera> {
    let focal = camera.focal() * step.x.exp();
    let centre = camera.principal_point() + camera.focal() * DVec2::new(step.y, step.z);
    let pinhole = Camera::pinhole(camera.size(), focal, centre)?;
    if let Lens::Fisheye(coefficients) = camera.lens() {
        return pinhole.with_fisheye(coefficients);
    }
    let [k1, k2, p1, p2, k3] = distortion(camera);
    pinhole.with_distortion([k1 + step.w, k2, p1, p2, k3])
}

/// The polynomial's coefficients; zeros for other lenses.
fn distortion(camera: &Camera) -> [f64; 5] {
    match camera.lens() {
        Lens::Polynomial(coefficients) => coefficients,
        Lens::Pinhole | Lens::Fisheye(_) => [0.0; 5],
    }
}
