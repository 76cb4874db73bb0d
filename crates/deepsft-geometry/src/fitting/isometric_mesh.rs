//! A mesh of the sheet under isometry and bending.

use crate::error::GeometryError;
use crate::mesh::{SurfaceLocator, TriangleMesh};
use crate::solver::{Bending, Energy, Isometry, MeshSolver, Solution, SolveOptions};
use glam::{DMat3, DVec3};

/// Fractions of the weight of isometry: of a sheet that stretches as the image wants it, of crumpled paper, whose cells shrink, of folded
/// paper, and of a smooth sheet. A mesh far from its place is solved with the last three in turn, by continuation.
const STIFFNESSES: [f64; 4] = [1e-4, 0.01, 0.1, 1.0];

/// Which fraction of the weight of isometry a mesh is solved with, an index of the list above.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Stiffness(usize);

impl Stiffness {
    /// The whole weight.
    pub(crate) const WHOLE: Self = Self(STIFFNESSES.len() - 1);

    /// Hardly any: what a mesh shows in the image is then its registration and nothing else.
    pub(crate) const FREE: Self = Self(0);

    /// Those of paper, the stiffest first.
    pub(crate) fn from_stiff_to_soft() -> impl Iterator<Item = Self> {
        (1..STIFFNESSES.len()).rev().map(Self)
    }
}

/// First damping of the solver. Isometry is thousands of times as stiff as the image is: with the usual 1e-3 of the
/// diagonal the sheet would hardly bend in the two steps that a frame of a video has.
const FIRST_DAMPING: f64 = 1e-6;

/// A mesh under isometry and bending, with everything that is solved on it and does not depend on the frame.
#[derive(Debug)]
pub struct IsometricMesh {
    /// The rest mesh.
    pub mesh: TriangleMesh,
    /// Finds its points by their texture position.
    pub locator: SurfaceLocator,
    /// Sides that are the border: two vertices, and the third of their face.
    pub(super) border: Vec<[usize; 3]>,
    /// Stiffer from one to the next, the last with the whole weight.
    isometry: Vec<Isometry>,
    bending: Bending,
    solver: MeshSolver,
}

impl IsometricMesh {
    /// Prepares a mesh of the sheet. `isometry` is the weight on `reference`, the template's own mesh: strain costs the
    /// same on both. `bending` is the weight of bending.
    ///
    /// # Errors
    /// [`GeometryError`] for a mesh without extent or a weight that is none.
    pub fn new(
        mesh: TriangleMesh,
        reference: &TriangleMesh,
        isometry: f64,
        bending: f64,
    ) -> Result<Self, GeometryError> {
        let weight = isometry * reference.edges().len() as f64 / mesh.edges().len().max(1) as f64;
        let of_stiffness = STIFFNESSES.map(|fraction| Isometry::new(&mesh, fraction * weight));
        let isometry = of_stiffness.into_iter().collect::<Result<Vec<_>, _>>()?;
        let bending = Bending::new(&mesh, bending)?;
        Ok(Self {
            solver: MeshSolver::new(&mesh, &[&isometry[0], &bending])?,
            locator: SurfaceLocator::new(&mesh),
            border: mesh.border(),
            mesh,
            isometry,
            bending,
        })
    }

    /// Minimises `terms`, isometry and bending from `start`. `halving`: as [`SolveOptions::halving`].
    ///
    /// # Errors
    /// As [`MeshSolver::solve`].
    pub fn solve(
        &mut self,
        terms: &[&dyn Energy],
        start: &[DVec3],
        steps: usize,
        halving: bool,
    ) -> Result<Solution, GeometryError> {
        self.solve_with(Stiffness::WHOLE, terms, start, steps, halving)
    }

    /// Minimises the same by continuation from low to full stiffness, for a mesh that may be far from its place: a stiff
    /// sheet moves in tiny steps, a soft one may stretch at first. Returns the vertices.
    ///
    /// # Errors
    /// As [`MeshSolver::solve`].
    pub fn solve_by_continuation(
        &mut self,
        terms: &[&dyn Energy],
        mut vertices: Vec<DVec3>,
        steps: usize,
    ) -> Result<Vec<DVec3>, GeometryError> {
        for stiffness in (1..STIFFNESSES.len()).map(Stiffness) {
            let solved = self.solve_with(stiffness, terms, &vertices, steps, false)?;
            vertices = solved.vertices;
        }
        Ok(vertices)
    }

    /// As [`MeshSolver::sensitivities`], with `terms`, isometry and bending.
    pub(crate) fn sensitivities<const N: usize>(
        &mut self,
        terms: &[&dyn Energy],
        vertices: &[DVec3],
        right_hand_sides: &[Vec<DVec3>; N],
    ) -> Option<([Vec<DVec3>; N], Vec<DVec3>)> {
        let all = with_structure(terms, &self.isometry[Stiffness::WHOLE.0], &self.bending);
        self.solver.sensitivities(&all, vertices, right_hand_sides)
    }

    /// As [`MeshSolver::covariances`], with `terms`, isometry and bending.
    pub(crate) fn covariances(&mut self, terms: &[&dyn Energy], vertices: &[DVec3]) -> Option<Vec<DMat3>> {
        let all = with_structure(terms, &self.isometry[Stiffness::WHOLE.0], &self.bending);
        self.solver.covariances(&all, vertices)
    }

    /// As [`IsometricMesh::solve`], with this stiffness.
    pub(crate) fn solve_with(
        &mut self,
        stiffness: Stiffness,
        terms: &[&dyn Energy],
        start: &[DVec3],
        steps: usize,
        halving: bool,
    ) -> Result<Solution, GeometryError> {
        let options = SolveOptions {
            max_iterations: steps,
            step_tolerance: 1e-3,
            energy_tolerance: 1e-4,
            first_damping: FIRST_DAMPING,
            halving,
        };
        let all = with_structure(terms, &self.isometry[stiffness.0], &self.bending);
        self.solver.solve(&all, start, &options)
    }
}

fn with_structure<'a>(terms: &[&'a dyn Energy], isometry: &'a Isometry, bending: &'a Bending) -> Vec<&'a dyn Energy> {
    [terms, &[isometry, bending]].concat()
}
