//! A template's mesh with what holds its shape: isometry and bending of a sheet, rigidity of a solid.

use super::cage::{Cage, Embedded};
use crate::error::GeometryError;
use crate::mesh::{SurfaceLocator, TriangleMesh, Welding};
use crate::solver::{
    Bending, Energy, Isometry, MeshSolver, NormalEquations, Rigidity, Solution, SolveOptions, mean_edge_length,
};
use glam::{DMat3, DVec3};

/// Weights of isometry and of bending, chosen on synthetic validation frames.
const ISOMETRY: f64 = 1e4;
const BENDING: f64 = 1.0;

/// Fractions of the weight of isometry: of a sheet that stretches as the image wants it, of crumpled paper, whose cells shrink, of folded
/// paper, and of a smooth sheet. A mesh far from its place is solved with the last three in turn, by continuation.
const STIFFNESSES: [f64; 4] = [1e-4, 0.01, 0.1, 1.0];

/// Which fraction of the weight of isometry a mesh is solved with, an index of the list above.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Stiffness(usize);

impl Stiffness {
    /// The whole weight.
    pub const WHOLE: Self = Self(STIFFNESSES.len() - 1);

    /// The next lower one.
    pub(crate) const SOFTER: Self = Self(STIFFNESSES.len() - 2);

    /// Hardly any: what a mesh shows in the image is then its registration and nothing else.
    pub(crate) const FREE: Self = Self(0);

    /// Those of paper, the stiffest first.
    pub(crate) fn from_stiff_to_soft() -> impl Iterator<Item = Self> {
        (1..STIFFNESSES.len()).rev().map(Self)
    }
}

/// Edges of a cage on which a solid's rigidity has the weight that is asked for.
const RIGID_EDGES: f64 = 3000.0;

/// First damping of the solver. Isometry is thousands of times as stiff as the image is: with the usual 1e-3 of the
/// diagonal the sheet would hardly bend in the two steps that a frame of a video has.
const FIRST_DAMPING: f64 = 1e-6;

/// A mesh under isometry and bending, or of a solid, with everything that is solved on it and does not depend on the frame.
#[derive(Debug)]
pub struct IsometricMesh {
    /// The rest mesh. Vertices are those of this mesh everywhere; energy terms are made for those of
    /// [`IsometricMesh::welded`].
    pub mesh: TriangleMesh,
    /// Finds its points by their texture position.
    pub locator: SurfaceLocator,
    /// Sides that are the border: two vertices, and the third of their face.
    pub(super) border: Vec<[usize; 3]>,
    structure: Structure,
    solver: MeshSolver,
}

/// What holds the shape; stiffer from one to the next, the last with the whole weight.
#[derive(Debug)]
enum Structure {
    Sheet(Vec<Isometry>, Bending),
    /// With the points that stand in the mesh several times, at seams of the texture, and are solved once; and what moves them.
    Solid(Vec<Rigidity>, Welding, Cage),
}

impl Structure {
    /// `terms` and those of the structure.
    fn with<'a>(&'a self, Stiffness(stiffness): Stiffness, terms: &[&'a dyn Energy]) -> Vec<&'a dyn Energy> {
        let mut all = terms.to_vec();
        match self {
            Self::Sheet(isometry, bending) => all.extend([&isometry[stiffness] as &dyn Energy, bending]),
            Self::Solid(rigidity, ..) => all.push(&rigidity[stiffness]),
        }
        all
    }
}

impl IsometricMesh {
    /// Prepares a mesh of the sheet. `reference` is the template's own mesh: strain costs the same on both.
    ///
    /// # Errors
    /// [`GeometryError`] for a mesh without extent.
    pub fn new(mesh: TriangleMesh, reference: &TriangleMesh) -> Result<Self, GeometryError> {
        let weight = ISOMETRY * reference.edges().len() as f64 / mesh.edges().len().max(1) as f64;
        let of_stiffness = STIFFNESSES.map(|fraction| Isometry::new(&mesh, fraction * weight));
        let isometry = of_stiffness.into_iter().collect::<Result<Vec<_>, _>>()?;
        let bending = Bending::new(&mesh, BENDING)?;
        Ok(Self {
            solver: MeshSolver::new(&mesh, &[&isometry[0], &bending])?,
            locator: SurfaceLocator::new(&mesh),
            border: mesh.border(),
            mesh,
            structure: Structure::Sheet(isometry, bending),
        })
    }

    /// Prepares the mesh of a template that is no sheet. `rigidity` is the weight on a cage of [`RIGID_EDGES`] edges: deforming
    /// costs the same on finer ones.
    pub(crate) fn solid(mesh: TriangleMesh, rigidity: f64) -> Result<Self, GeometryError> {
        let welding = Welding::of(&mesh)?;
        let cage = Cage::around(welding.mesh());
        let weight = rigidity * RIGID_EDGES / cage.edges.len() as f64;
        let of_stiffness = STIFFNESSES.map(|fraction| Rigidity::new(&cage.nodes, &cage.edges, fraction * weight));
        let rigidity = of_stiffness.into_iter().collect::<Result<Vec<_>, _>>()?;
        let (couplings, scale) = (cage.couplings(welding.mesh()), mean_edge_length(welding.mesh())?);
        let solver = MeshSolver::of_pairs(cage.nodes.len(), couplings, scale)?;
        Ok(Self {
            solver,
            locator: SurfaceLocator::new(&mesh),
            // Where a surface of any shape ends is not looked for.
            border: Vec::new(),
            mesh,
            structure: Structure::Solid(rigidity, welding, cage),
        })
    }

    /// The mesh that is solved: its faces are those of [`IsometricMesh::mesh`], its seams are welded.
    pub fn welded(&self) -> &TriangleMesh {
        match &self.structure {
            Structure::Sheet(..) => &self.mesh,
            Structure::Solid(_, welding, _) => welding.mesh(),
        }
    }

    /// The vertices of [`IsometricMesh::welded`].
    pub(super) fn weld(&self, vertices: &[DVec3]) -> Vec<DVec3> {
        match &self.structure {
            Structure::Sheet(..) => vertices.to_vec(),
            Structure::Solid(_, welding, _) => welding.weld(vertices),
        }
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
            let solved = self.solve(stiffness, terms, &vertices, steps, false)?;
            vertices = solved.vertices;
        }
        Ok(vertices)
    }

    /// Of a sheet: as [`Isometry::set_aspect`].
    pub(crate) fn set_aspect(&mut self, aspect: f64) {
        if let Structure::Sheet(isometry, _) = &mut self.structure {
            isometry.iter_mut().for_each(|isometry| isometry.set_aspect(aspect));
        }
    }

    /// The isometry of a sheet, with its whole weight.
    pub(crate) fn isometry(&self) -> Option<&Isometry> {
        match &self.structure {
            Structure::Sheet(isometry, _) => isometry.last(),
            Structure::Solid(..) => None,
        }
    }

    /// The normal equations of `terms`, isometry and bending at `vertices`, factorised: of a sheet. `None` where they are singular.
    pub(crate) fn factorized(&mut self, terms: &[&dyn Energy], vertices: &[DVec3]) -> Option<&mut NormalEquations> {
        let all = self.structure.with(Stiffness::WHOLE, terms);
        self.solver.factorized(&all, vertices)
    }

    /// The covariances of the vertices with `terms`, isometry and bending. Of a solid, with its rigidity: bounds from above, for the corners
    /// of a vertex's cell are taken to go together.
    pub(crate) fn covariances(&mut self, terms: &[&dyn Energy], vertices: &[DVec3]) -> Option<Vec<DMat3>> {
        let Structure::Solid(_, welding, cage) = &self.structure else {
            return Some(self.factorized(terms, vertices)?.inverse_blocks());
        };
        let embedded: Vec<_> = terms.iter().map(|&term| Embedded { term, cage }).collect();
        let terms: Vec<&dyn Energy> = embedded.iter().map(|term| term as &dyn Energy).collect();
        let all = self.structure.with(Stiffness::WHOLE, &terms);
        let nodes = cage.nodes_of(&welding.weld(vertices));
        let of_nodes = self.solver.factorized(&all, &nodes)?.inverse_blocks();
        Some(welding.split(&cage.interpolated(&of_nodes)))
    }

    /// Minimises `terms`, isometry and bending from `start`. `halving`: as [`SolveOptions::halving`].
    ///
    /// # Errors
    /// As [`MeshSolver::solve`].
    pub fn solve(
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
        let Structure::Solid(_, welding, cage) = &self.structure else {
            return self
                .solver
                .solve(&self.structure.with(stiffness, terms), start, &options);
        };
        let embedded: Vec<_> = terms.iter().map(|&term| Embedded { term, cage }).collect();
        let terms: Vec<&dyn Energy> = embedded.iter().map(|term| term as &dyn Energy).collect();
        let all = self.structure.with(stiffness, &terms);
        let nodes = cage.nodes_of(&welding.weld(start));
        let mut solution = self.solver.solve(&all, &nodes, &options)?;
        solution.vertices = welding.split(&cage.interpolated(&solution.vertices));
        Ok(solution)
    }
}
