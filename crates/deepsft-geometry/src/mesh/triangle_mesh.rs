//! Triangle meshes with texture coordinates, and the sides of their faces.

use crate::error::TemplateError;
use glam::{DVec2, DVec3};

/// A side of a face. Sides sort by their edge, then by face and corner.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct Side {
    /// Its vertices, the smaller first.
    pub edge: [usize; 2],
    /// The face.
    pub face: usize,
    /// The corner of the face at which it begins, 0 to 2.
    pub corner: usize,
}

impl Side {
    /// Lists the sides of all `faces`, sorted: those of one edge stand together.
    pub fn of(faces: &[[usize; 3]]) -> Vec<Self> {
        let side = |corner: usize, [a, b]: [usize; 2], face: usize| Self {
            edge: [a.min(b), a.max(b)],
            face,
            corner,
        };
        let of_face = |(face, &[a, b, c]): (usize, &[usize; 3])| {
            [side(0, [a, b], face), side(1, [b, c], face), side(2, [c, a], face)]
        };
        let mut sides: Vec<_> = faces.iter().enumerate().flat_map(of_face).collect();
        sides.sort_unstable();
        sides
    }

    /// Groups sorted sides by their edge.
    pub fn by_edge(sides: &[Self]) -> impl Iterator<Item = &[Self]> {
        sides.chunk_by(|a, b| a.edge == b.edge)
    }

    /// Gives the corners of its face, those of the side first, in the order of the face.
    pub fn corners(&self, faces: &[[usize; 3]]) -> [usize; 3] {
        let mut corners = faces[self.face];
        corners.rotate_left(self.corner);
        corners
    }

    /// Whether the face goes from the smaller vertex to the larger.
    pub fn is_forward(&self, faces: &[[usize; 3]]) -> bool {
        self.corners(faces)[0] == self.edge[0]
    }
}

/// A triangle mesh with one texture coordinate per vertex. A vertex on a seam between two charts of
/// the texture stands in the mesh once for each chart.
#[derive(Clone, Debug, PartialEq)]
pub struct TriangleMesh {
    vertices: Vec<DVec3>,
    texture_coordinates: Vec<DVec2>,
    faces: Vec<[usize; 3]>,
}

impl TriangleMesh {
    /// Checks and takes vertices (mm), texture coordinates and faces. Texture coordinates are (u, v) in the unit
    /// square, v down; faces are vertex indices, counter-clockwise seen from the front.
    ///
    /// # Errors
    /// [`TemplateError`] when the arrays differ in length, a number is not finite or a face names a
    /// vertex that is not there.
    pub fn new(
        vertices: Vec<DVec3>,
        texture_coordinates: Vec<DVec2>,
        faces: Vec<[usize; 3]>,
    ) -> Result<Self, TemplateError> {
        if vertices.len() != texture_coordinates.len() {
            return Err(TemplateError::TextureCoordinates {
                actual: texture_coordinates.len(),
                expected: vertices.len(),
            });
        }
        let is_finite = |i: &usize| vertices[*i].is_finite() && texture_coordinates[*i].is_finite();
        if let Some(vertex) = (0..vertices.len()).find(|i| !is_finite(i)) {
            return Err(TemplateError::VertexNotFinite(vertex));
        }
        for (face, corners) in faces.iter().enumerate() {
            if let Some(&vertex) = corners.iter().find(|&&v| v >= vertices.len()) {
                return Err(TemplateError::FaceIndex {
                    face,
                    vertex,
                    vertices: vertices.len(),
                });
            }
        }
        Ok(Self {
            vertices,
            texture_coordinates,
            faces,
        })
    }

    /// Vertex positions, mm, in the frame the owner names.
    pub fn vertices(&self) -> &[DVec3] {
        &self.vertices
    }

    /// Texture coordinates, one per vertex.
    pub fn texture_coordinates(&self) -> &[DVec2] {
        &self.texture_coordinates
    }

    /// Faces as vertex indices.
    pub fn faces(&self) -> &[[usize; 3]] {
        &self.faces
    }

    /// The undirected edges, each once, smaller index first, sorted.
    pub fn edges(&self) -> Vec<[usize; 2]> {
        let mut edges: Vec<_> = Side::of(&self.faces).iter().map(|side| side.edge).collect();
        edges.dedup();
        edges
    }

    /// The sides that only one face has, and that face's third vertex.
    pub(crate) fn border(&self) -> Vec<[usize; 3]> {
        let sides = Side::of(&self.faces);
        let alone = Side::by_edge(&sides).filter(|sides| sides.len() == 1).flatten();
        alone.map(|side| side.corners(&self.faces)).collect()
    }

    /// Vertex normals of the front for other vertex positions: area-weighted means of the faces around each.
    pub fn normals_at(&self, vertices: &[DVec3]) -> Vec<DVec3> {
        let mut normals = vec![DVec3::ZERO; vertices.len()];
        for &[a, b, c] in &self.faces {
            let normal = (vertices[b] - vertices[a]).cross(vertices[c] - vertices[a]);
            for v in [a, b, c] {
                normals[v] += normal;
            }
        }
        normals.into_iter().map(|n| n.normalize_or(DVec3::NEG_Z)).collect()
    }

    /// Of a face: the derivatives of its points by u and by v, (b - a) x (c - a) in space, and twice its area in the texture, with sign. `None`
    /// where it has no area in the texture.
    pub(crate) fn texture_derivatives(&self, face: [usize; 3]) -> Option<([DVec3; 2], DVec3, f64)> {
        let [a, b, c] = face.map(|v| self.vertices[v]);
        let [p, q, r] = face.map(|v| self.texture_coordinates[v]);
        let (e, f, s, t) = (b - a, c - a, q - p, r - p);
        let area = s.perp_dot(t);
        let derivatives = [(e * t.y - f * s.y) / area, (f * s.x - e * t.x) / area];
        (area != 0.0).then_some((derivatives, e.cross(f), area))
    }

    /// The same faces and texture coordinates on other vertex positions.
    ///
    /// # Errors
    /// [`TemplateError`] when the number of vertices differs or a position is not finite.
    pub fn with_vertices(&self, vertices: Vec<DVec3>) -> Result<Self, TemplateError> {
        Self::new(vertices, self.texture_coordinates.clone(), self.faces.clone())
    }
}
