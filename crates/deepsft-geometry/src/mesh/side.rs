//! The sides of faces, and which of them are one edge.

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
