//! Levenberg-Marquardt over the vertices of a template.

use super::energy::{Energy, mean_edge_length};
use super::normal_equations::NormalEquations;
use crate::error::{GeometryError, Result, check_start};
use crate::mesh::TriangleMesh;
use glam::DVec3;

/// Damping below which there is none in effect: keeps a singular system solvable at the price of 1e-9
/// of a step where it is not.
const MIN_DAMPING: f64 = 1e-9;

/// Damping beyond which no step is worth trying.
const MAX_DAMPING: f64 = 1e12;

/// Damping up to which a short step or a small decrease means that the minimum is near.
const TRUSTED_DAMPING: f64 = 1.0;

/// Decrease that a step foretells, as a fraction of the energy, up to which the minimum is near.
const NEAR: f64 = 0.01;

/// Most of the acceleration as a multiple of the step (the 0.75 of Transtrum and Sethna).
const MAX_ACCELERATION: f64 = 0.75;

/// When to stop.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SolveOptions {
    /// Accepted steps at most. Default 50; a warm start in video needs one to three.
    pub max_iterations: usize,
    /// Converged when no vertex moves further than this fraction of the mean edge length. Default 1e-6 (a
    /// hundred-thousandth of a millimetre on a sheet of paper).
    pub step_tolerance: f64,
    /// Converged when a step lowers the energy by less than this fraction. Default 1e-9.
    pub energy_tolerance: f64,
    /// First damping, as a fraction of the diagonal of J^T W J (Marquardt's scaling: steps do not depend on units).
    /// Default 1e-3. A stiff term raises the diagonal and with it the damping of the soft motions that it leaves
    /// open: a start that is near its minimum wants much less.
    pub first_damping: f64,
    /// Whether a step near the minimum that is too long is first tried at half its length. Damping it more would cost
    /// a factorisation. For starts that are near their minimum. Default false.
    pub halving: bool,
}

impl Default for SolveOptions {
    fn default() -> Self {
        Self {
            max_iterations: 50,
            step_tolerance: 1e-6,
            energy_tolerance: 1e-9,
            first_damping: 1e-3,
            halving: false,
        }
    }
}

/// What a solve gives.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct Solution {
    /// Vertex positions, in the frame and unit of the start.
    pub vertices: Vec<DVec3>,
    /// Whether a tolerance was met. Otherwise the iterations ran out, or no damping gave a step that
    /// lowers the energy.
    pub converged: bool,
    /// Accepted steps.
    pub iterations: usize,
    /// Sum of the terms' energies at the start.
    pub initial_energy: f64,
    /// Sum of the terms' energies at the result.
    pub final_energy: f64,
}

/// Vertices and the energy of each term there.
type Shape = (Vec<DVec3>, Vec<f64>);

/// Damping by Nielsen's rule (Madsen, Nielsen and Tingleff 2004): less the better the model foretold the
/// decrease, more and faster more at every failure.
struct Damping {
    fraction: f64,
    growth: f64,
}

impl Damping {
    fn lower(&mut self, gain: f64) {
        // A tenth instead of Nielsen's third: most of our problems are nearly linear near their start.
        let factor = (1.0 - (2.0 * gain - 1.0).powi(3)).clamp(0.1, 2.0);
        self.fraction = (self.fraction * factor).max(MIN_DAMPING);
        self.growth = 2.0;
    }

    fn raise(&mut self) {
        self.fraction *= self.growth;
        self.growth *= 2.0;
    }
}

/// Minimises sums of [`Energy`] terms over the n vertices of one template (3n unknowns) by
/// Levenberg-Marquardt with sparse Cholesky. The symbolic work is done once, in [`new`](Self::new); every
/// [`solve`](Self::solve) after it only factorises numbers, whatever is measured in that frame.
///
/// ```
/// use deepsft_geometry::solver::{DepthPrior, Isometry, MeshSolver, PointDepth, Robust, SolveOptions, SurfacePoint};
/// use deepsft_geometry::{Picture, Template, glam::DVec3};
/// let template = Template::thin_shell(Picture::from_fn(1, 1, |_, _| [0; 3]), 297.0, 210.0)?;
/// let mesh = template.mesh();
/// let isometry = Isometry::new(mesh, 1.0)?;
/// let mut solver = MeshSolver::new(mesh, &[&isometry])?;
/// // Every corner of every face is half a metre in front of the camera.
/// let corner = |k: usize| PointDepth {
///     point: SurfacePoint { face: k / 3, barycentric: [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]][k % 3] },
///     depth: 500.0,
///     deviation: 1.0,
/// };
/// let depths: Vec<_> = (0..3 * mesh.faces().len()).map(corner).collect();
/// let depths = DepthPrior::new(mesh, &depths, 1.0, Robust::Squares)?;
/// let solution = solver.solve(&[&depths, &isometry], mesh.vertices(), &SolveOptions::default())?;
/// assert!(solution.converged);
/// assert!((solution.vertices[0].z - 500.0).abs() < 1e-6);
/// # Ok::<(), deepsft_geometry::GeometryError>(())
/// ```
#[derive(Debug)]
pub struct MeshSolver {
    equations: NormalEquations,
    /// Mean edge length.
    scale: f64,
}

impl MeshSolver {
    /// Prepares for the vertices of `template`. Terms over single vertices, edges and faces are always
    /// provided for; `structure` are terms that couple more (bending).
    ///
    /// # Errors
    /// [`GeometryError::MeshWithoutExtent`] for a mesh without an edge of positive length.
    pub fn new(template: &TriangleMesh, structure: &[&dyn Energy]) -> Result<Self> {
        let mut pairs = template.edges();
        for term in structure {
            term.stencils(&mut |stencil| {
                for (k, &a) in stencil.iter().enumerate() {
                    pairs.extend(stencil[k + 1..].iter().map(|&b| [a, b]));
                }
            });
        }
        Self::of_pairs(template.vertices().len(), pairs, mean_edge_length(template)?)
    }

    /// Prepares for points of which residuals couple `pairs`. `scale` is a length beside which a step is short.
    pub(crate) fn of_pairs(points: usize, pairs: Vec<[usize; 2]>, scale: f64) -> Result<Self> {
        let equations = NormalEquations::new(points, pairs)?;
        Ok(Self { equations, scale })
    }

    /// Minimises the sum of `terms` from `start`, one position a vertex. That is the rest shape moved to where the
    /// object is, or the last frame's result.
    ///
    /// # Errors
    /// [`GeometryError::StartLength`] when `start` does not have the template's vertices,
    /// [`GeometryError::StartEnergy`] when a term's energy is not finite there,
    /// [`GeometryError::Coupling`] when a term couples vertices that the solver was not prepared for.
    ///
    /// # Panics
    /// With a term of another template, whose vertices are not there.
    pub fn solve(&mut self, terms: &[&dyn Energy], start: &[DVec3], options: &SolveOptions) -> Result<Solution> {
        check_start(start, self.equations.gradient.len())?;
        let initial: Vec<f64> = terms.iter().map(|t| t.energy(start)).collect();
        if let Some((term, &energy)) = terms.iter().zip(&initial).find(|(_, e)| !e.is_finite()) {
            return Err(GeometryError::StartEnergy {
                term: term.name(),
                energy,
            });
        }
        let mut here = (start.to_vec(), initial.clone());
        let fraction = options.first_damping.max(MIN_DAMPING);
        let mut damping = Damping { fraction, growth: 2.0 };
        let (mut converged, mut iterations) = (false, 0);
        while !converged && iterations < options.max_iterations {
            self.linearize(terms, &here.0)?;
            let (lower, settled) = self.iterate(terms, &here, &mut damping, options);
            converged = settled;
            let Some(there) = lower else { break };
            iterations += 1;
            here = there;
        }
        let (vertices, reached) = here;
        Ok(Solution {
            vertices,
            converged,
            iterations,
            initial_energy: initial.iter().sum(),
            final_energy: reached.iter().sum(),
        })
    }

    /// One accepted step of the linearised problem, with as much damping as it takes, and whether it settles the problem. `None` where no
    /// damping lowers the energy: settled within the tolerances, else stuck.
    fn iterate(
        &mut self,
        terms: &[&dyn Energy],
        (vertices, energies): &Shape,
        damping: &mut Damping,
        options: &SolveOptions,
    ) -> (Option<Shape>, bool) {
        let energy: f64 = energies.iter().sum();
        while damping.fraction <= MAX_DAMPING {
            let added = self.added(damping.fraction);
            if self.equations.factorize(&added).is_ok() {
                let step = self.equations.step();
                let longest = step.iter().fold(0.0_f64, |m, s| m.max(s.length()));
                let foretold: f64 = (step.iter().zip(&self.equations.gradient).zip(&added))
                    .map(|((s, g), a)| s.dot(*a * *s - *g))
                    .sum();
                let there = self.accelerated(terms, vertices, &step);
                let reached: Vec<f64> = terms.iter().map(|t| t.energy(&there)).collect();
                let decrease = energy - reached.iter().sum::<f64>();
                // A step that is short because it is damped says nothing.
                let settled = damping.fraction <= TRUSTED_DAMPING
                    && (longest <= options.step_tolerance * self.scale
                        || foretold.max(decrease) <= options.energy_tolerance * energy);
                if decrease > 0.0 {
                    damping.lower(decrease / foretold.max(f64::MIN_POSITIVE));
                    return (Some((there, reached)), settled);
                }
                if settled {
                    return (None, true);
                }
                if options.halving && foretold <= NEAR * energy {
                    let half: Vec<_> = vertices.iter().zip(&there).map(|(a, b)| a.midpoint(*b)).collect();
                    let reached: Vec<f64> = terms.iter().map(|t| t.energy(&half)).collect();
                    if energy > reached.iter().sum::<f64>() {
                        return (Some((half, reached)), false);
                    }
                }
            }
            damping.raise();
        }
        (None, false)
    }

    /// Where the step leads on the curved path: with geodesic acceleration (Transtrum and Sethna 2012, *Improvements to the
    /// Levenberg-Marquardt algorithm for nonlinear least-squares minimization*), for the price of one more
    /// back-substitution. A stiff sheet that is bent by its tangent alone stretches, and creeps.
    fn accelerated(&mut self, terms: &[&dyn Energy], vertices: &[DVec3], step: &[DVec3]) -> Vec<DVec3> {
        let mut curvature = vec![DVec3::ZERO; vertices.len()];
        for term in terms {
            term.add_curvature(vertices, step, &mut curvature);
        }
        let acceleration = self.equations.step_against(&curvature);
        let length = |v: &[DVec3]| v.iter().map(|v| v.length_squared()).sum::<f64>().sqrt();
        // Where the second order is no longer small beside the first the series says nothing.
        let fraction = (MAX_ACCELERATION * length(step) / length(&acceleration).max(f64::MIN_POSITIVE)).min(1.0);
        let path = vertices.iter().zip(step).zip(&acceleration);
        path.map(|((v, s), a)| v + s + 0.5 * fraction * a).collect()
    }

    /// The normal equations of `terms` at `vertices`, factorised. `None` where they are singular.
    pub(crate) fn factorized(&mut self, terms: &[&dyn Energy], vertices: &[DVec3]) -> Option<&mut NormalEquations> {
        self.linearize(terms, vertices).ok()?;
        self.equations.factorize(&self.added(MIN_DAMPING)).ok()?;
        Some(&mut self.equations)
    }

    fn linearize(&mut self, terms: &[&dyn Energy], vertices: &[DVec3]) -> Result<()> {
        self.equations.clear();
        for term in terms {
            term.linearize(vertices, &mut self.equations);
            if self.equations.outside {
                return Err(GeometryError::Coupling(term.name()));
            }
        }
        Ok(())
    }

    /// What damping adds to the diagonal. A coordinate that no residual touches stays where it is.
    fn added(&self, damping: f64) -> Vec<DVec3> {
        let unit = 1.0 / (self.scale * self.scale);
        let one = |d: f64| if d > 0.0 { damping * d } else { unit };
        let diagonal = self.equations.diagonal();
        diagonal.map(|d| DVec3::new(one(d.x), one(d.y), one(d.z))).collect()
    }
}
