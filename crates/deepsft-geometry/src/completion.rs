//! ARAP completion: the whole mesh from its visible vertices.

use crate::rigid_alignment::RigidMotion;
use crate::rotation::nearest_rotation;
use crate::solver::arap_prior::{ArapPrior, CellEnergy, Rotations};
use crate::solver::checked::{check_weight, vertex_in};
use crate::solver::cholesky::SparseCholesky;
use crate::solver::{LengthScale, PAPER_ARAP_WEIGHT, PAPER_SMOOTHNESS_WEIGHT, VertexPoint};
use crate::{GeometryError, TriangleMesh};
use glam::{DMat3, DQuat, DVec3};
use std::collections::VecDeque;

/// Pairs of (step, change of gradient) that the quasi-Newton direction remembers. Beyond 5 the count of
/// iterations no longer falls (Liu et al. 2017 find the same).
const MEMORY: usize = 5;

/// Halvings of a step that does not lower the energy before the search is given up.
const HALVINGS: usize = 12;

/// Share of the linear decrease that a step must reach (Armijo's rule; the usual 1e-4).
const SUFFICIENT_DECREASE: f64 = 1e-4;

/// Weights and limits of ARAP completion.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CompletionOptions {
    /// Weight of E_arap. Default 20, as in the paper. More keeps the template's shape against noise.
    pub arap_weight: f64,
    /// Weight of E_smooth. Default 0.005, as in the paper.
    pub smoothness_weight: f64,
    /// Iterations at most. Default 9: the paper's "fewer than 10".
    pub max_iterations: usize,
    /// Converged when no vertex moves further than this share of the mean edge length. Default 1e-3: a
    /// hundredth of a millimetre on a sheet of paper.
    pub step_tolerance: f64,
}

impl Default for CompletionOptions {
    fn default() -> Self {
        Self {
            arap_weight: PAPER_ARAP_WEIGHT,
            smoothness_weight: PAPER_SMOOTHNESS_WEIGHT,
            max_iterations: 9,
            step_tolerance: 1e-3,
        }
    }
}

/// The terms of the completion's energy, without their weights, in the template's unit of length squared.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct CompletionEnergy {
    /// E_data: sum of w |p_i - x_i|^2 over visible vertices.
    pub data: f64,
    /// E_arap.
    pub arap: f64,
    /// E_smooth.
    pub smoothness: f64,
}

/// How a completion went.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CompletionReport {
    /// Whether the last step was within the tolerance.
    pub converged: bool,
    /// Iterations done.
    pub iterations: usize,
    /// Different vertices with a usable point.
    pub visible_vertices: usize,
    /// Points left out because they are not finite.
    pub ignored_points: usize,
    /// Connected components of the mesh.
    pub components: usize,
    /// Components without a visible vertex: placed by the rigid motion of the others, not measured.
    pub unseen_components: usize,
    /// Components with fewer than three visible vertices that are not on one line: their turn is
    /// partly or wholly that of the others (or of the start), not measured.
    pub unoriented_components: usize,
    /// Energies at the rigid alignment.
    pub initial_energy: CompletionEnergy,
    /// Energies of the result.
    pub final_energy: CompletionEnergy,
}

/// A completed mesh.
#[derive(Clone, Debug, PartialEq)]
pub struct Completion {
    /// All vertices, camera frame, in the template's unit.
    pub vertices: Vec<DVec3>,
    /// How it went.
    pub report: CompletionReport,
}

/// ARAP shape completion, the paper's section of that name: the mesh that minimises
/// E = E_data + 20 E_arap + 0.005 E_smooth, where E_data ties visible vertices to their 3D points. It
/// recovers what is hidden; it does not improve what is seen.
///
/// The three coordinates share one n x n matrix, whose symbolic factorisation is done once a template and
/// holds for every set of visible vertices. Each frame is one numeric factorisation, then local
/// rotations and a solve an iteration (Sorkine and Alexa 2007), the steps sharpened by L-BFGS on
/// that matrix (Liu et al. 2017, *Quasi-Newton Methods for Real-Time Simulation of Hyperelastic
/// Materials*), so that far hidden parts arrive within the iterations the paper allows. The energy never
/// rises. Lengths may be in any unit; the result is the same.
///
/// Starts from the rigid alignment of the rest shape, or of the last frame's mesh, with the
/// visible points, component by component; without a last frame the rotations of the visible part are then
/// extended into the hidden one. What the points leave open is taken from elsewhere and
/// reported:
///
/// * one visible vertex: the shape moves there without turning; with several on one line it turns
///   as little as it can;
/// * a component without a visible vertex follows the rigid motion of all visible vertices;
/// * faces without area hold their vertices together weakly; points that are not finite are as if hidden.
///
/// ```
/// use deepsft_geometry::solver::VertexPoint;
/// use deepsft_geometry::{ArapCompletion, CompletionOptions, Picture, Template, glam::DVec3};
/// let template = Template::thin_shell(Picture::from_fn(1, 1, |_, _| [0; 3]), 297.0, 210.0)?;
/// let mesh = template.mesh();
/// let mut completion = ArapCompletion::new(mesh, CompletionOptions::default())?;
/// // The left half is seen.
/// let seen = |(vertex, p): (usize, &DVec3)| VertexPoint { vertex, p_camera: *p + 500.0 * DVec3::Z, weight: 1.0 };
/// let points: Vec<_> = mesh.vertices().iter().enumerate().map(seen).filter(|p| p.p_camera.x < 0.0).collect();
/// let whole = completion.complete(&points, None)?;
/// assert!(whole.report.converged);
/// assert!(whole.vertices.iter().all(|p| (p.z - 500.0).abs() < 1e-6));
/// # Ok::<(), deepsft_geometry::GeometryError>(())
/// ```
#[derive(Debug)]
pub struct ArapCompletion {
    rest: Vec<DVec3>,
    prior: ArapPrior,
    /// Component of each vertex.
    component: Vec<usize>,
    components: usize,
    cholesky: SparseCholesky,
    /// The matrix without data, in the pattern's order.
    stiffness: Vec<f64>,
    scale: LengthScale,
    options: CompletionOptions,
}

/// Visible vertices of one frame: weight (0 when hidden) and weighted mean point of each vertex.
struct Visible {
    weights: Vec<f64>,
    points: Vec<DVec3>,
    ignored: usize,
}

/// Energies, half the gradient of the weighted sum, and the weighted sum.
struct Evaluation {
    energy: CompletionEnergy,
    total: f64,
    gradient: Vec<DVec3>,
}

impl ArapCompletion {
    /// Prepares for `template` (the rest shape; vertices on a texture seam welded, or the halves will part).
    ///
    /// # Errors
    /// [`GeometryError::MeshWithoutExtent`] for a mesh without an edge of positive length,
    /// [`GeometryError::Weight`] for an ARAP weight that is not positive or a smoothness weight that is
    /// negative.
    pub fn new(template: &TriangleMesh, options: CompletionOptions) -> Result<Self, GeometryError> {
        crate::solver::checked::check_scale("arap", options.arap_weight)?;
        check_weight("smoothness", options.smoothness_weight)?;
        let scale = LengthScale::of(template)?;
        let prior = ArapPrior::new(template, options.arap_weight, options.smoothness_weight);
        let (component, components) = connected_components(&prior);
        // E_smooth is at most E_arap, so this matrix bounds the Hessian of both from above.
        let stiffness_weight = 2.0 * (options.arap_weight + options.smoothness_weight);
        let (mut starts, mut rows, mut stiffness) = (vec![0], vec![], vec![]);
        for i in 0..prior.vertices() {
            rows.push(i);
            stiffness.push(stiffness_weight * prior.degree(i));
            for (j, weight) in prior.neighbours(i).filter(|n| n.0 > i) {
                rows.push(j);
                stiffness.push(-stiffness_weight * weight);
            }
            starts.push(rows.len());
        }
        Ok(Self {
            rest: template.vertices().to_vec(),
            component,
            components,
            cholesky: SparseCholesky::new(starts, rows)?,
            stiffness,
            scale,
            options,
            prior,
        })
    }

    /// Completes the mesh from the `points` of one frame, in any order; several on one vertex are averaged.
    /// `start` is the last frame's mesh, if there is one: its shape is aligned to the new points.
    ///
    /// # Errors
    /// [`GeometryError::NoVisibleVertex`] when no point is finite and of positive weight: nothing says where
    /// the object is. [`GeometryError::VertexIndex`], [`GeometryError::Weight`] for points that cannot be,
    /// [`GeometryError::StartLength`], [`GeometryError::VertexNotFinite`] for such a start,
    /// [`GeometryError::Singular`] when weights differ so much (by 1e15) that the matrix cannot be factorised.
    pub fn complete(&mut self, points: &[VertexPoint], start: Option<&[DVec3]>) -> Result<Completion, GeometryError> {
        let visible = self.visible(points)?;
        let from = self.checked_start(start)?;
        let (mut vertices, unoriented) = self.align(from, &visible);
        let mut rotations = vec![DQuat::IDENTITY; vertices.len()];
        let mut here = self.evaluate(&vertices, Rotations::BestFrom(&mut rotations), &visible);
        let initial_energy = here.energy;
        let extended = match start {
            Some(_) => None,
            None => Some(self.extended_rotations(&visible, &rotations)?),
        };
        let (holds, unseen) = self.tie_components(visible.weights.clone());
        self.factorize(&holds)?;
        if let Some(extended) = extended {
            let held = self.evaluate(&vertices, Rotations::Held(&extended), &visible);
            let step = self.direction(&held.gradient, &VecDeque::new());
            let candidate: Vec<DVec3> = vertices.iter().zip(&step).map(|(v, s)| v + s).collect();
            rotations = extended;
            let there = self.evaluate(&candidate, Rotations::BestFrom(&mut rotations), &visible);
            if there.total < here.total {
                (vertices, here) = (candidate, there);
            }
        }
        let mut memory = VecDeque::new();
        let (mut converged, mut iterations) = (false, 0);
        while !converged && iterations < self.options.max_iterations {
            iterations += 1;
            let mut step = self.direction(&here.gradient, &memory);
            let mut reached = None;
            for _ in 0..HALVINGS {
                let candidate: Vec<DVec3> = vertices.iter().zip(&step).map(|(v, s)| v + s).collect();
                let there = self.evaluate(&candidate, Rotations::BestFrom(&mut rotations), &visible);
                // The gradient is half that of the energy.
                let slope = 2.0 * dot(&step, &here.gradient);
                if there.total <= here.total + SUFFICIENT_DECREASE * slope {
                    reached = Some((candidate, there));
                    break;
                }
                if longest(&step) <= self.options.step_tolerance * self.scale.get() {
                    break;
                }
                step.iter_mut().for_each(|s| *s *= 0.5);
            }
            converged = longest(&step) <= self.options.step_tolerance * self.scale.get();
            let Some((candidate, there)) = reached else {
                break;
            };
            let change: Vec<DVec3> = there.gradient.iter().zip(&here.gradient).map(|(a, b)| a - b).collect();
            if dot(&step, &change) > 0.0 {
                memory.truncate(MEMORY - 1);
                memory.push_front((step, change));
            }
            (vertices, here) = (candidate, there);
        }
        let report = CompletionReport {
            converged,
            iterations,
            visible_vertices: visible.weights.iter().filter(|&&w| w > 0.0).count(),
            ignored_points: visible.ignored,
            components: self.components,
            unseen_components: unseen,
            unoriented_components: unoriented,
            initial_energy,
            final_energy: here.energy,
        };
        Ok(Completion { vertices, report })
    }

    fn visible(&self, points: &[VertexPoint]) -> Result<Visible, GeometryError> {
        let n = self.rest.len();
        let mut visible = Visible {
            weights: vec![0.0; n],
            points: vec![DVec3::ZERO; n],
            ignored: 0,
        };
        for point in points {
            vertex_in(point.vertex, n)?;
            check_weight("point data", point.weight)?;
            if point.p_camera.is_finite() {
                visible.weights[point.vertex] += point.weight;
                visible.points[point.vertex] += point.weight * point.p_camera;
            } else {
                visible.ignored += 1;
            }
        }
        for (sum, &weight) in visible.points.iter_mut().zip(&visible.weights) {
            if weight > 0.0 {
                *sum /= weight;
            }
        }
        if visible.weights.iter().all(|&w| w <= 0.0) {
            return Err(GeometryError::NoVisibleVertex {
                ignored: visible.ignored,
            });
        }
        Ok(visible)
    }

    fn checked_start<'a>(&'a self, start: Option<&'a [DVec3]>) -> Result<&'a [DVec3], GeometryError> {
        let Some(start) = start else {
            return Ok(&self.rest);
        };
        if start.len() != self.rest.len() {
            return Err(GeometryError::StartLength {
                actual: start.len(),
                expected: self.rest.len(),
            });
        }
        match start.iter().position(|p| !p.is_finite()) {
            Some(vertex) => Err(GeometryError::VertexNotFinite { vertex }),
            None => Ok(start),
        }
    }

    /// `from` moved rigidly onto the visible points, each component by itself, and the number of
    /// components whose orientation that leaves open.
    fn align(&self, from: &[DVec3], visible: &Visible) -> (Vec<DVec3>, usize) {
        let pairs = |of: Option<usize>| {
            (0..from.len())
                .filter(move |&i| visible.weights[i] > 0.0 && of.is_none_or(|c| c == self.component[i]))
                .map(|i| (from[i], visible.points[i], visible.weights[i]))
        };
        let whole = RigidMotion::align(pairs(None), RigidMotion::IDENTITY);
        if self.components == 1 {
            let moved = from.iter().map(|&p| whole.apply(p)).collect();
            return (moved, usize::from(!spans_a_plane(pairs(None).map(|p| p.0))));
        }
        // One pass sorts the visible vertices by component: there may be many.
        let mut members: Vec<Vec<(DVec3, DVec3, f64)>> = vec![Vec::new(); self.components];
        for i in (0..from.len()).filter(|&i| visible.weights[i] > 0.0) {
            members[self.component[i]].push((from[i], visible.points[i], visible.weights[i]));
        }
        let motions: Vec<RigidMotion> = members
            .iter()
            .map(|m| RigidMotion::align(m.iter().copied(), whole))
            .collect();
        let open = members.iter().filter(|m| !spans_a_plane(m.iter().map(|p| p.0))).count();
        let moved = from
            .iter()
            .zip(&self.component)
            .map(|(&p, &c)| motions[c].apply(p))
            .collect();
        (moved, open)
    }

    /// What holds each vertex in place (its part of the diagonal), completed so that each component has something,
    /// and the number of components that had nothing. One vertex of each of those is tied to where it
    /// is, which is where ARAP wants it anyway.
    fn tie_components(&self, mut holds: Vec<f64>) -> (Vec<f64>, usize) {
        let mut tied = vec![false; self.components];
        for (i, &hold) in holds.iter().enumerate() {
            tied[self.component[i]] |= hold > 0.0;
        }
        let mut loose = 0;
        for (i, &component) in self.component.iter().enumerate() {
            if !tied[component] {
                tied[component] = true;
                loose += 1;
                holds[i] = self.options.arap_weight;
            }
        }
        (holds, loose)
    }

    /// Factorises the matrix for what `holds` the vertices.
    fn factorize(&mut self, holds: &[f64]) -> Result<(), GeometryError> {
        let mut values = self.stiffness.clone();
        for (i, hold) in holds.iter().enumerate() {
            values[self.cholesky.column_starts()[i]] += hold;
        }
        if self.cholesky.factorize(&values) {
            Ok(())
        } else {
            Err(GeometryError::Singular {
                unknowns: self.rest.len(),
            })
        }
    }

    /// A first guess of all rotations: where visible neighbours show a cell's rotation it is taken, and the
    /// hidden part continues it as a harmonic function does. (Local rotations alone carry a bend into
    /// the hidden part by one ring of vertices an iteration.) `rigid` stands where nothing is shown.
    fn extended_rotations(&mut self, visible: &Visible, rigid: &[DQuat]) -> Result<Vec<DQuat>, GeometryError> {
        let mut rotations = rigid.to_vec();
        let mut holds = vec![0.0; rotations.len()];
        for i in 0..rotations.len() {
            if let Some(rotation) = self.shown_rotation(i, visible, rigid[i]) {
                rotations[i] = rotation;
                // As stiff as the cell itself: what is seen is smoothed over about one edge.
                holds[i] = self.stiffness[self.cholesky.column_starts()[i]];
            }
        }
        let (holds, _) = self.tie_components(holds);
        self.factorize(&holds)?;
        let mut matrices = vec![DMat3::ZERO; rotations.len()];
        for axis in 0..3 {
            let column = |(r, hold): (&DQuat, &f64)| *hold * DMat3::from_quat(*r).col(axis);
            let held: Vec<DVec3> = rotations.iter().zip(&holds).map(column).collect();
            for (matrix, column) in matrices.iter_mut().zip(self.solve(&held)) {
                *matrix.col_mut(axis) = column;
            }
        }
        for (rotation, matrix) in rotations.iter_mut().zip(matrices) {
            *rotation = nearest_rotation(matrix, *rotation);
        }
        Ok(rotations)
    }

    /// The rotation of cell `i` as its visible edges show it; `None` unless they span a plane at rest.
    fn shown_rotation(&self, i: usize, visible: &Visible, guess: DQuat) -> Option<DQuat> {
        if visible.weights[i] <= 0.0 {
            return None;
        }
        let mut covariance = DMat3::ZERO;
        let (mut first, mut spans) = (DVec3::ZERO, false);
        for (j, weight) in self.prior.neighbours(i).filter(|n| visible.weights[n.0] > 0.0) {
            let q = self.rest[i] - self.rest[j];
            let e = weight * (visible.points[i] - visible.points[j]);
            covariance += DMat3::from_cols(e * q.x, e * q.y, e * q.z);
            spans |= first.cross(q).length_squared() > 0.01 * first.length_squared() * q.length_squared();
            if first == DVec3::ZERO {
                first = q;
            }
        }
        spans.then(|| nearest_rotation(covariance, guess))
    }

    fn evaluate(&self, vertices: &[DVec3], rotations: Rotations<'_>, visible: &Visible) -> Evaluation {
        let mut data = 0.0;
        let mut gradient: Vec<DVec3> = vertices
            .iter()
            .zip(visible.weights.iter().zip(&visible.points))
            .map(|(p, (&weight, point))| {
                let residual = if weight > 0.0 { p - point } else { DVec3::ZERO };
                data += weight * residual.length_squared();
                weight * residual
            })
            .collect();
        let CellEnergy { arap, smoothness } = self.prior.add_gradient(vertices, rotations, &mut gradient);
        Evaluation {
            energy: CompletionEnergy { data, arap, smoothness },
            total: data + self.prior.arap * arap + self.prior.smoothness * smoothness,
            gradient,
        }
    }

    /// The quasi-Newton step: L-BFGS's two loops around a solve with the factorised matrix.
    fn direction(&mut self, gradient: &[DVec3], memory: &VecDeque<(Vec<DVec3>, Vec<DVec3>)>) -> Vec<DVec3> {
        let mut q: Vec<DVec3> = gradient.iter().map(|g| -*g).collect();
        let mut alphas = Vec::with_capacity(MEMORY);
        for (step, change) in memory {
            let alpha = dot(step, &q) / dot(step, change);
            add_scaled(&mut q, -alpha, change);
            alphas.push(alpha);
        }
        let mut direction = self.solve(&q);
        for ((step, change), alpha) in memory.iter().zip(alphas).rev() {
            let beta = dot(change, &direction) / dot(step, change);
            add_scaled(&mut direction, alpha - beta, step);
        }
        direction
    }

    fn solve(&mut self, right_hand_side: &[DVec3]) -> Vec<DVec3> {
        let n = right_hand_side.len();
        let mut columns = vec![0.0; 3 * n];
        for (i, r) in right_hand_side.iter().enumerate() {
            (columns[i], columns[n + i], columns[2 * n + i]) = (r.x, r.y, r.z);
        }
        self.cholesky.solve(&mut columns);
        (0..n)
            .map(|i| DVec3::new(columns[i], columns[n + i], columns[2 * n + i]))
            .collect()
    }
}

fn dot(a: &[DVec3], b: &[DVec3]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a.dot(*b)).sum()
}

fn add_scaled(to: &mut [DVec3], factor: f64, what: &[DVec3]) {
    to.iter_mut().zip(what).for_each(|(t, w)| *t += factor * *w);
}

fn longest(step: &[DVec3]) -> f64 {
    step.iter().fold(0.0_f64, |m, s| m.max(s.length()))
}

/// Whether points are not all on one line: their farthest distance from the line through the two far ones
/// is above 1e-6 of its length.
fn spans_a_plane(points: impl Iterator<Item = DVec3> + Clone) -> bool {
    let Some(first) = points.clone().next() else {
        return false;
    };
    let far = points.clone().map(|p| p - first).fold(DVec3::ZERO, |m, d| {
        if d.length_squared() > m.length_squared() { d } else { m }
    });
    let length = far.length_squared();
    length > 0.0
        && points
            .map(|p| (p - first).cross(far).length())
            .any(|area| area > 1e-6 * length)
}

/// Component of each vertex and their number; a vertex without edges is one of its own.
fn connected_components(prior: &ArapPrior) -> (Vec<usize>, usize) {
    let mut component = vec![usize::MAX; prior.vertices()];
    let mut count = 0;
    let mut open = Vec::new();
    for first in 0..prior.vertices() {
        if component[first] != usize::MAX {
            continue;
        }
        component[first] = count;
        open.push(first);
        while let Some(i) = open.pop() {
            for (j, _) in prior.neighbours(i) {
                if component[j] == usize::MAX {
                    component[j] = count;
                    open.push(j);
                }
            }
        }
        count += 1;
    }
    (component, count)
}
