//! Which vertices of a mesh are one point of its surface.

use super::triangle_mesh::TriangleMesh;
use crate::error::TemplateError;
use glam::DVec3;
use std::collections::HashMap;

/// A mesh whose texture seams are welded. A point on a seam stands in the mesh once for each chart and in the
/// geometry once. Solvers move *welded* vertices, textures and renderers keep those of the mesh.
///
/// Two vertices are one point when they have exactly the same rest position and both lie on a border of
/// their charts (an edge with one face): seams do, and surfaces that touch in their interior are not glued.
///
/// [`mesh`](Self::mesh) has the faces of the original in the original order, so a
/// [`SurfacePoint`](crate::solver::SurfacePoint) means the same on both and any term of the mesh solver can be
/// built on it.
///
/// ```
/// use deepsft_geometry::glam::{DVec2, DVec3};
/// use deepsft_geometry::{TriangleMesh, Welding};
/// // Two triangles side by side, each a chart of its own: the edge between them stands there twice.
/// let points = [(0, 0), (1, 0), (0, 1), (1, 0), (1, 1), (0, 1)].map(|(x, y)| DVec3::new(x.into(), y.into(), 0.0));
/// let mesh = TriangleMesh::new(points.to_vec(), vec![DVec2::ZERO; 6], vec![[0, 2, 1], [3, 5, 4]])?;
/// let welding = Welding::of(&mesh)?;
/// assert_eq!(welding.mesh().vertices().len(), 4);
/// assert_eq!(welding.welded(3), Some(1));
/// assert_eq!(welding.split(welding.mesh().vertices()), mesh.vertices());
/// # Ok::<(), deepsft_geometry::GeometryError>(())
/// ```
#[derive(Clone, Debug)]
pub struct Welding {
    /// Welded vertex of each vertex of the mesh.
    welded: Vec<usize>,
    /// One vertex of the mesh for each welded vertex: the first.
    first: Vec<usize>,
    mesh: TriangleMesh,
}

impl Welding {
    /// Welds the seams of `mesh`, which has its rest shape.
    ///
    /// # Errors
    /// None for a mesh that exists; the type is that of [`TriangleMesh::new`].
    pub fn of(mesh: &TriangleMesh) -> Result<Self, TemplateError> {
        let positions = mesh.vertices();
        let mut is_border = vec![false; positions.len()];
        for [a, b, _] in mesh.border() {
            (is_border[a], is_border[b]) = (true, true);
        }
        let mut at_position: HashMap<[u64; 3], usize> = HashMap::new();
        let mut welded = Vec::with_capacity(positions.len());
        let mut first = Vec::with_capacity(positions.len());
        for (vertex, position) in positions.iter().enumerate() {
            let new = first.len();
            let point = if is_border[vertex] {
                // Adding 0 makes one of 0 and -0.
                let key = (*position + DVec3::ZERO).to_array().map(f64::to_bits);
                *at_position.entry(key).or_insert(new)
            } else {
                new
            };
            if point == new {
                first.push(vertex);
            }
            welded.push(point);
        }
        let faces = mesh.faces().iter().map(|face| face.map(|v| welded[v])).collect();
        let of_first = |vertex: &usize| (positions[*vertex], mesh.texture_coordinates()[*vertex]);
        let (vertices, texture_coordinates) = first.iter().map(of_first).unzip();
        Ok(Self {
            mesh: TriangleMesh::new(vertices, texture_coordinates, faces)?,
            welded,
            first,
        })
    }

    /// The welded mesh. Its texture coordinates on seams are those of one of the charts: do not draw with them.
    pub fn mesh(&self) -> &TriangleMesh {
        &self.mesh
    }

    /// Number of vertices of the original mesh.
    pub fn vertices(&self) -> usize {
        self.welded.len()
    }

    /// The welded vertex of a vertex of the original mesh; `None` when there is no such vertex.
    pub fn welded(&self, vertex: usize) -> Option<usize> {
        self.welded.get(vertex).copied()
    }

    /// One of the vertices of the original mesh that are the welded vertex `welded`; `None` when there is none.
    pub fn first(&self, welded: usize) -> Option<usize> {
        self.first.get(welded).copied()
    }

    /// From one value per vertex of the original mesh to one per welded vertex: that of the first chart.
    pub fn weld<T: Copy>(&self, of_mesh: &[T]) -> Vec<T> {
        self.first.iter().map(|&vertex| of_mesh[vertex]).collect()
    }

    /// From one value per welded vertex to one per vertex of the original mesh.
    pub fn split<T: Copy>(&self, of_welded: &[T]) -> Vec<T> {
        self.welded.iter().map(|&point| of_welded[point]).collect()
    }
}
