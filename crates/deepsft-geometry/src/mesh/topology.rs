//! How the faces of a mesh hang together: joined sets, pieces, texture charts, seams, borders.

use super::triangle_mesh::{Side, TriangleMesh};
use super::welding::Welding;
use crate::error::TemplateError;
use glam::DVec2;
use std::collections::HashSet;
use std::ops::Range;

/// Things 0, 1, 2, ... in sets that can be joined (union-find, ways to the root halved as they are walked): n joins and
/// look-ups take hardly more than n steps.
///
/// ```
/// use deepsft_geometry::DisjointSets;
/// let mut sets = DisjointSets::new(4);
/// sets.join(3, 1);
/// assert_eq!((sets.first(3), sets.first(1), sets.first(2)), (1, 1, 2));
/// ```
#[derive(Clone, Debug, Default)]
pub struct DisjointSets {
    /// A smaller thing of the same set; the set's first has itself.
    parent: Vec<usize>,
}

impl DisjointSets {
    /// `count` things, each a set of its own.
    pub fn new(count: usize) -> Self {
        Self {
            parent: (0..count).collect(),
        }
    }

    /// Adds a thing, a set of its own; gives its number.
    pub fn add(&mut self) -> usize {
        self.parent.push(self.parent.len());
        self.parent.len() - 1
    }

    /// The first (smallest) thing of the set that `thing` is in: equal for things of one set.
    ///
    /// # Panics
    /// When there is no such thing.
    pub fn first(&mut self, mut thing: usize) -> usize {
        while self.parent[thing] != thing {
            self.parent[thing] = self.parent[self.parent[thing]];
            thing = self.parent[thing];
        }
        thing
    }

    /// Numbers the sets in the order of their first things: the number of each thing's set, and how many sets there are.
    pub(crate) fn numbered(&mut self) -> (Vec<usize>, usize) {
        let (mut numbers, mut count) = (Vec::with_capacity(self.parent.len()), 0);
        for thing in 0..self.parent.len() {
            let first = self.first(thing);
            numbers.push(if first == thing { count } else { numbers[first] });
            count += usize::from(first == thing);
        }
        (numbers, count)
    }

    /// Makes the sets of `a` and `b` one.
    ///
    /// # Panics
    /// When there are no such things.
    pub fn join(&mut self, a: usize, b: usize) {
        let (a, b) = (self.first(a), self.first(b));
        self.parent[a.max(b)] = a.min(b);
    }
}

/// Texels along each side of the raster on which [`texture_overlap`] counts.
const OVERLAP_TEXELS: usize = 512;

/// How far inside a triangle, along a row, the middle of a square counts to it, squares: neighbours share their edge.
const INSIDE: f64 = 1e-3;

/// What a template's mesh is made of. Seams are welded first ([`Welding`]), so a point that stands in the mesh once for
/// each chart counts once.
///
/// ```
/// use deepsft_geometry::{Picture, Template, Topology};
/// let sheet = Template::thin_shell(Picture::from_fn(1, 1, |_, _| [0; 3]), 297.0, 210.0)?;
/// let topology = Topology::of(sheet.mesh())?;
/// assert_eq!((topology.pieces, topology.charts, topology.seam_edges), (1, 1, 0));
/// assert_eq!(topology.genus(), None); // it has a border
/// # Ok::<(), deepsft_geometry::GeometryError>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub struct Topology {
    /// Connected pieces of the surface.
    pub pieces: usize,
    /// Connected pieces of the texture.
    pub charts: usize,
    /// Edges along which two charts, or two sides of one, are sewn together.
    pub seam_edges: usize,
    /// Edges with a face on one side only: 0 for a closed surface.
    pub border_edges: usize,
    /// Edges of more than two faces.
    pub non_manifold_edges: usize,
    /// Vertices - edges + faces.
    pub euler_characteristic: i64,
}

impl Topology {
    /// Takes `mesh`, which has its rest shape, apart.
    ///
    /// # Errors
    /// [`TemplateError::FaceOrientation`] where two faces with an edge in common, and no third, have their fronts on
    /// different sides.
    pub fn of(mesh: &TriangleMesh) -> Result<Self, TemplateError> {
        let welding = Welding::of(mesh)?;
        let welded = welding.mesh();
        let sides = Side::of(welded.faces());
        let (mut edges, mut seam_edges, mut border_edges, mut non_manifold_edges) = (0, 0, 0, 0);
        for around in Side::by_edge(&sides) {
            edges += 1;
            match around {
                [_] => border_edges += 1,
                [one, other] => {
                    if one.is_forward(welded.faces()) == other.is_forward(welded.faces()) {
                        return Err(TemplateError::FaceOrientation(one.face, other.face));
                    }
                    // They run opposite ways.
                    let ([a, b, _], [c, d, _]) = (one.corners(mesh.faces()), other.corners(mesh.faces()));
                    seam_edges += usize::from([a, b] != [d, c]);
                }
                _ => non_manifold_edges += 1,
            }
        }
        let vertices = welded.vertices().len() as i64;
        Ok(Self {
            pieces: pieces(welded),
            charts: pieces(mesh),
            seam_edges,
            border_edges,
            non_manifold_edges,
            euler_characteristic: vertices - edges + mesh.faces().len() as i64,
        })
    }

    /// Genus of a closed manifold surface in one piece (0: a ball, 1: a ring). `None` for any other.
    pub fn genus(&self) -> Option<u64> {
        let closed = self.pieces == 1 && self.border_edges == 0 && self.non_manifold_edges == 0;
        let doubled = 2 - self.euler_characteristic;
        (closed && doubled >= 0 && doubled % 2 == 0).then_some(doubled.unsigned_abs() / 2)
    }
}

/// Number of sets of faces that hang together by vertices.
fn pieces(mesh: &TriangleMesh) -> usize {
    let mut sets = DisjointSets::new(mesh.vertices().len());
    for &[a, b, c] in mesh.faces() {
        sets.join(a, b);
        sets.join(a, c);
    }
    let firsts: HashSet<usize> = mesh.faces().iter().map(|face| sets.first(face[0])).collect();
    firsts.len()
}

/// Fraction of the used texture that belongs to more than one face: 0 where every place of the texture is one place of the
/// surface. Measured at the centres of 512 x 512 texels.
pub(super) fn texture_overlap(mesh: &TriangleMesh) -> f64 {
    let side = OVERLAP_TEXELS as f64;
    // The last bit says that a face uses a texel, the one before it that another does too.
    let mut uses = vec![0_u8; OVERLAP_TEXELS * OVERLAP_TEXELS];
    for face in mesh.faces() {
        rows_within(face.map(|v| mesh.texture_coordinates()[v] * side), |row, columns| {
            // Texture coordinates pass the border by rounding only.
            let row = uses[row as usize * OVERLAP_TEXELS..][..OVERLAP_TEXELS]
                .get_mut(columns.start as usize..columns.end as usize);
            for uses in row.into_iter().flatten() {
                *uses |= *uses << 1 | 1;
            }
        });
    }
    // No sum can wrap, and without a check of that the loop is one of vectors.
    let count = |bit: u8| {
        uses.iter()
            .fold(0_u32, |sum, uses| sum.wrapping_add(u32::from(uses & bit != 0)))
    };
    f64::from(count(2)) / f64::from(count(1).max(1))
}

/// Calls `each` with the rows of squares of side 1, and the range of columns in them, whose middles are inside a triangle.
pub fn rows_within([a, b, c]: [DVec2; 3], mut each: impl FnMut(i64, Range<i64>)) {
    // Middles lie at whole numbers plus one half.
    let range = |low: f64, high: f64| (low - 0.5).ceil() as i64..(high - 0.5).floor() as i64 + 1;
    for row in range(a.y.min(b.y).min(c.y), a.y.max(b.y).max(c.y)) {
        let y = row as f64 + 0.5;
        let (mut low, mut high) = (f64::INFINITY, f64::NEG_INFINITY);
        for [p, q] in [[a, b], [b, c], [c, a]] {
            if (p.y <= y) != (q.y <= y) {
                let x = p.x + (y - p.y) / (q.y - p.y) * (q.x - p.x);
                (low, high) = (low.min(x), high.max(x));
            }
        }
        let columns = range(low + INSIDE, high - INSIDE);
        if !columns.is_empty() {
            each(row, columns);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn charts_on_one_another_are_counted_and_not_the_texels_on_the_edges_of_neighbours() {
        let overlap = |uv: &[(f64, f64)], faces: [[usize; 3]; 2]| {
            let uv: Vec<DVec2> = uv.iter().copied().map(DVec2::from).collect();
            let points = uv.iter().map(|uv| uv.extend(0.0)).collect();
            texture_overlap(&TriangleMesh::new(points, uv, faces.to_vec()).unwrap())
        };
        // The diagonal goes through the centres of 512 texels.
        let square = [(0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (0.0, 1.0)];
        assert_eq!(overlap(&square, [[0, 1, 2], [0, 2, 3]]), 0.0);
        // Two triangles, each a chart of its own: the second apart from the first, then over it, shifted by half a side along u. They
        // share a triangle of half the side: 1/4 of each, 1/7 of what is covered.
        let mut charts = [(0.0, 0.0), (0.4, 0.0), (0.0, 0.4), (0.6, 0.6), (1.0, 0.6), (0.6, 1.0)];
        assert_eq!(overlap(&charts, [[0, 1, 2], [3, 4, 5]]), 0.0);
        charts[3..].copy_from_slice(&[(0.2, 0.0), (0.6, 0.0), (0.2, 0.4)]);
        let shared = overlap(&charts, [[0, 1, 2], [3, 4, 5]]);
        // Along the borders of 205 texels a texel more or less: 1 %.
        assert!((shared - 1.0 / 7.0).abs() < 0.01, "{shared}");
    }
}
