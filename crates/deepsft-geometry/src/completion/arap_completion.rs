//! The completion of one frame: its limits, what it gives, and how.

use super::stiffness::{QuasiNewton, Stiffness, dot};
use super::visible_points::{Components, VertexPoint, Visible, extended_rotations};
use crate::error::{GeometryError, TemplateError, check_start};
use crate::mesh::{TriangleMesh, Welding};
use crate::solver::arap_cells::{ArapCells, Rotations};
use crate::solver::mean_edge_length;
use glam::{DQuat, DVec3};

/// The terms of the completion's energy, without their weights, in the template's unit of length squared.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[non_exhaustive]
pub struct CompletionEnergy {
    /// E_data: sum of w |p_i - x_i|^2 over visible vertices.
    pub data: f64,
    /// E_arap.
    pub arap: f64,
    /// E_smooth.
    pub smoothness: f64,
}

/// A completed mesh, and how its completion went.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct Completion {
    /// All vertices, camera frame, in the template's unit.
    pub vertices: Vec<DVec3>,
    /// Whether the last step was within the tolerance.
    pub converged: bool,
    /// Iterations done.
    pub iterations: usize,
    /// Energies at the rigid alignment.
    pub initial_energy: CompletionEnergy,
    /// Energies of the result.
    pub final_energy: CompletionEnergy,
}

/// Limits of ARAP completion.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CompletionOptions {
    /// Iterations at most. Default 9: the paper's "fewer than 10".
    pub max_iterations: usize,
    /// Converged when no vertex moves further than this fraction of the mean edge length. Default 1e-3: a
    /// hundredth of a millimetre on a sheet of paper.
    pub step_tolerance: f64,
}

impl Default for CompletionOptions {
    fn default() -> Self {
        Self {
            max_iterations: 9,
            step_tolerance: 1e-3,
        }
    }
}

/// Weights of E_arap and E_smooth, as in the paper.
const ARAP: f64 = 20.0;
const SMOOTHNESS: f64 = 0.005;

/// Halvings of a step that does not lower the energy before the search is given up.
const HALVINGS: usize = 12;

/// Fraction of the linear decrease that a step must reach (Armijo's rule; the usual 1e-4).
const SUFFICIENT_DECREASE: f64 = 1e-4;

/// As-rigid-as-possible (ARAP) shape completion, the paper's section of that name. The mesh minimises E = E_data + 20
/// E_arap + 0.005 E_smooth, where E_data ties visible vertices to their 3D points. It recovers what is hidden; it
/// does not improve what is seen.
///
/// The three coordinates share one n x n matrix, whose symbolic factorisation is done once per template and
/// holds for every set of visible vertices. Each frame is one numeric factorisation, then local
/// rotations and a solve per iteration (Sorkine and Alexa 2007), the steps sharpened by L-BFGS on
/// that matrix (Liu et al. 2017, *Quasi-Newton Methods for Real-Time Simulation of Hyperelastic
/// Materials*), so that far hidden parts arrive within the iterations the paper allows. The energy never
/// rises. Lengths may be in any unit; the result is the same.
///
/// Starts from the rigid alignment of the rest shape, or of the last frame's mesh, with the
/// visible points, component by component; without a last frame the rotations of the visible part are then
/// extended into the hidden one. What the points leave open is taken from elsewhere:
///
/// * one visible vertex: the shape moves there without turning; with several on one line it turns
///   as little as it can;
/// * a component without a visible vertex follows the rigid motion of all visible vertices;
/// * faces without area hold their vertices together weakly; points that are not finite are as if hidden.
///
/// Texture seams do not tear: the vertices of a seam that stand in the mesh once for each chart are
/// solved as one ([`Welding`]).
///
/// ```
/// use deepsft_geometry::{ArapCompletion, CompletionOptions, Picture, Template, VertexPoint, glam::DVec3};
/// let template = Template::thin_shell(Picture::from_fn(1, 1, |_, _| [0; 3]), 297.0, 210.0)?;
/// let mesh = template.mesh();
/// let mut completion = ArapCompletion::new(mesh, CompletionOptions::default())?;
/// // The left half is seen.
/// let seen = |(vertex, p): (usize, &DVec3)| VertexPoint { vertex, p_camera: *p + 500.0 * DVec3::Z, weight: 1.0 };
/// let points: Vec<_> = mesh.vertices().iter().enumerate().map(seen).filter(|p| p.p_camera.x < 0.0).collect();
/// let whole = completion.complete(&points, None)?;
/// assert!(whole.converged);
/// assert!(whole.vertices.iter().all(|p| (p.z - 500.0).abs() < 1e-6));
/// # Ok::<(), deepsft_geometry::GeometryError>(())
/// ```
#[derive(Debug)]
pub struct ArapCompletion {
    welding: Welding,
    prior: ArapCells,
    components: Components,
    matrix: Stiffness,
    /// Mean edge length.
    scale: f64,
    options: CompletionOptions,
}

/// A shape with its energies, the weighted sum of them, and half the gradient of that sum.
struct Shape {
    vertices: Vec<DVec3>,
    gradient: Vec<DVec3>,
    energy: CompletionEnergy,
    total: f64,
}

impl Shape {
    fn at(vertices: Vec<DVec3>) -> Self {
        Self {
            gradient: vec![DVec3::ZERO; vertices.len()],
            vertices,
            energy: CompletionEnergy::default(),
            total: 0.0,
        }
    }

    /// Moves to `fraction` of `step` away from `from`; the energies are those of the old place until evaluated.
    fn move_to(&mut self, from: &Self, fraction: f64, step: &[DVec3]) {
        for ((to, from), step) in self.vertices.iter_mut().zip(&from.vertices).zip(step) {
            *to = *from + fraction * *step;
        }
    }
}

impl ArapCompletion {
    /// Prepares for `template`, the rest shape.
    ///
    /// # Errors
    /// [`GeometryError::MeshWithoutExtent`] for a mesh without an edge of positive length.
    pub fn new(template: &TriangleMesh, options: CompletionOptions) -> Result<Self, GeometryError> {
        let scale = mean_edge_length(template)?;
        let welding = Welding::of(template)?;
        let prior = ArapCells::new(welding.mesh(), ARAP, SMOOTHNESS);
        // E_smooth is at most E_arap, so this matrix bounds the Hessian of both from above.
        let matrix = Stiffness::new(&prior, 2.0 * (ARAP + SMOOTHNESS))?;
        Ok(Self {
            welding,
            components: Components::of(&prior),
            prior,
            matrix,
            scale,
            options,
        })
    }

    /// Completes the mesh from the visible `points` of one frame, in any order. Several on one vertex, or on the
    /// copies of one vertex on a seam, are averaged. `start` is the last frame's mesh, if there is one: its shape is
    /// aligned to the new points.
    ///
    /// # Errors
    /// [`GeometryError::NoVisibleVertex`] when no point is finite, of a vertex and of positive weight: nothing says where
    /// the object is. [`GeometryError::Weight`] for weights that cannot be,
    /// [`GeometryError::StartLength`], [`TemplateError::VertexNotFinite`] for such a start,
    /// [`GeometryError::Singular`] when weights differ so much (by 1e15) that the matrix cannot be factorised.
    pub fn complete(&mut self, points: &[VertexPoint], start: Option<&[DVec3]>) -> Result<Completion, GeometryError> {
        let visible = Visible::of(points, &self.welding)?;
        let from = start.map(|start| self.checked_start(start)).transpose()?;
        let from = from.as_deref().unwrap_or(self.welding.mesh().vertices());
        let vertices = self.components.align(from, &visible.points, &visible.weights);
        let mut rotations = vec![DQuat::IDENTITY; vertices.len()];
        let mut here = Shape::at(vertices);
        self.evaluate(&mut here, Rotations::First(&mut rotations), &visible);
        let mut there = Shape::at(here.vertices.clone());
        let initial_energy = here.energy;
        let mut step = vec![DVec3::ZERO; rotations.len()];
        let mut quasi_newton = QuasiNewton::default();

        let (prior, matrix, components) = (&self.prior, &mut self.matrix, &self.components);
        let extended = match start {
            Some(_) => None,
            None => Some(extended_rotations(prior, matrix, components, &visible, &rotations)?),
        };
        let holds = self.components.tie(visible.weights.clone(), ARAP);
        self.matrix.factorize(&holds)?;
        if let Some(mut extended) = extended {
            // With the rotations held the energy is quadratic: one step leads to its minimum.
            self.evaluate(&mut there, Rotations::Held(&extended), &visible);
            quasi_newton.direction(&mut self.matrix, &there.gradient, &mut step);
            there.move_to(&here, 1.0, &step);
            self.evaluate(&mut there, Rotations::BestFrom(&mut extended), &visible);
            if there.total < here.total {
                std::mem::swap(&mut here, &mut there);
                rotations = extended;
            }
        }

        let tolerance = self.options.step_tolerance * self.scale;
        let (mut converged, mut iterations) = (false, 0);
        while !converged && iterations < self.options.max_iterations {
            iterations += 1;
            quasi_newton.direction(&mut self.matrix, &here.gradient, &mut step);
            // The gradient is half that of the energy.
            let slope = 2.0 * dot(&step, &here.gradient);
            let longest = step.iter().map(|s| s.length_squared()).fold(0.0, f64::max).sqrt();
            let (mut fraction, mut lower) = (1.0, false);
            for _ in 0..HALVINGS {
                there.move_to(&here, fraction, &step);
                self.evaluate(&mut there, Rotations::BestFrom(&mut rotations), &visible);
                lower = there.total <= here.total + SUFFICIENT_DECREASE * fraction * slope;
                if lower || fraction * longest <= tolerance {
                    break;
                }
                fraction *= 0.5;
            }
            converged = fraction * longest <= tolerance;
            if !lower {
                break;
            }
            quasi_newton.remember(&step, fraction, &here.gradient, &there.gradient);
            std::mem::swap(&mut here, &mut there);
        }
        Ok(Completion {
            vertices: self.welding.split(&here.vertices),
            converged,
            iterations,
            initial_energy,
            final_energy: here.energy,
        })
    }

    fn checked_start(&self, start: &[DVec3]) -> Result<Vec<DVec3>, GeometryError> {
        check_start(start, self.welding.vertices())?;
        match start.iter().position(|p| !p.is_finite()) {
            Some(vertex) => Err(TemplateError::VertexNotFinite(vertex).into()),
            None => Ok(self.welding.weld(start)),
        }
    }

    fn evaluate(&self, shape: &mut Shape, rotations: Rotations<'_>, visible: &Visible) {
        let mut energy = CompletionEnergy::default();
        let seen = visible.weights.iter().zip(&visible.points);
        for ((gradient, p), (&weight, point)) in shape.gradient.iter_mut().zip(&shape.vertices).zip(seen) {
            // A hidden vertex has the point 0 and the weight 0.
            let residual = p - point;
            *gradient = weight * residual;
            energy.data += weight * residual.length_squared();
        }
        [energy.arap, energy.smoothness] = self.prior.add_gradient(&shape.vertices, rotations, &mut shape.gradient);
        shape.total = energy.data + self.prior.arap * energy.arap + self.prior.smoothness * energy.smoothness;
        shape.energy = energy;
    }
}
