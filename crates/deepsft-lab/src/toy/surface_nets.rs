//! A mesh of an implicit surface: naive surface nets (Gibson 1998), then evened out on the surface.

use deepsft_geometry::glam::DVec3;

/// Rounds of evening out.
const ROUNDS: usize = 14;

/// Share of the way to its neighbours' mean that a vertex goes in a round.
const PACE: f64 = 0.5;

/// An implicit surface: a function that is negative inside, with its gradient.
pub(crate) struct Implicit<'a> {
    pub(crate) value: &'a dyn Fn(DVec3) -> f64,
    pub(crate) gradient: &'a dyn Fn(DVec3) -> DVec3,
}

impl Implicit<'_> {
    /// The surface's point near `p`: two steps of Newton's method along the gradient.
    pub(crate) fn onto_surface(&self, mut p: DVec3) -> DVec3 {
        for _ in 0..2 {
            let gradient = (self.gradient)(p);
            p -= gradient * ((self.value)(p) / gradient.length_squared().max(1e-6));
        }
        p
    }

    /// Vertices and triangles (counter-clockwise seen from outside) of the surface between the corners of `bounds`, on a
    /// grid of cells of side `cell`. Each cell that the surface crosses gives a vertex, each crossed edge of the grid two
    /// triangles.
    pub(crate) fn mesh(&self, [low, high]: [DVec3; 2], cell: f64) -> (Vec<DVec3>, Vec<[usize; 3]>) {
        let count = ((high - low) / cell).ceil();
        let size = [count.x as usize + 1, count.y as usize + 1, count.z as usize + 1];
        let at = |i: [usize; 3]| (i[2] * size[1] + i[1]) * size[0] + i[0];
        let position = |i: [usize; 3]| low + cell * DVec3::new(i[0] as f64, i[1] as f64, i[2] as f64);
        let nodes = grid(size);
        let values: Vec<f64> = nodes.iter().map(|&i| (self.value)(position(i))).collect();

        let mut vertex_of_cell = vec![usize::MAX; values.len()];
        let mut vertices = Vec::new();
        for &i in nodes.iter().filter(|i| (0..3).all(|k| i[k] + 1 < size[k])) {
            let (mut sum, mut crossings) = (DVec3::ZERO, 0);
            for (a, b) in cell_edges(i) {
                let (va, vb) = (values[at(a)], values[at(b)]);
                if (va < 0.0) != (vb < 0.0) {
                    sum += position(a).lerp(position(b), va / (va - vb));
                    crossings += 1;
                }
            }
            if crossings > 0 {
                vertex_of_cell[at(i)] = vertices.len();
                vertices.push(sum / f64::from(crossings));
            }
        }

        let mut quads = Vec::new();
        for &i in &nodes {
            for axis in 0..3 {
                let mut next = i;
                next[axis] += 1;
                let (second, third) = ((axis + 1) % 3, (axis + 2) % 3);
                // Nothing crosses the box's own sides.
                if next[axis] >= size[axis] || i[second] == 0 || i[third] == 0 {
                    continue;
                }
                let inside = [values[at(i)] < 0.0, values[at(next)] < 0.0];
                if inside[0] == inside[1] {
                    continue;
                }
                let around = [(1, 1), (0, 1), (0, 0), (1, 0)].map(|(a, b)| {
                    let mut cell = i;
                    cell[second] -= a;
                    cell[third] -= b;
                    vertex_of_cell[at(cell)]
                });
                let quad = if inside[0] {
                    around
                } else {
                    [around[3], around[2], around[1], around[0]]
                };
                quads.push(quad);
            }
        }
        let sides = quads.iter().flat_map(|q| [0, 1, 2, 3].map(|k| [q[k], q[(k + 1) % 4]]));
        let neighbours = neighbours(vertices.len(), sides);
        for _ in 0..ROUNDS {
            vertices = self.evened(&vertices, &neighbours);
        }
        let faces = quads
            .iter()
            .flat_map(|&[a, b, c, d]| {
                // Along the shorter diagonal.
                if vertices[a].distance_squared(vertices[c]) <= vertices[b].distance_squared(vertices[d]) {
                    [[a, b, c], [a, c, d]]
                } else {
                    [[a, b, d], [b, c, d]]
                }
            })
            .collect();
        (vertices, faces)
    }

    /// The vertices after one round of moving along the surface towards the mean of their neighbours.
    pub(crate) fn evened(&self, vertices: &[DVec3], neighbours: &[Vec<usize>]) -> Vec<DVec3> {
        let moved = vertices.iter().zip(neighbours).map(|(&p, around)| {
            let mean = around.iter().map(|&v| vertices[v]).sum::<DVec3>() / around.len().max(1) as f64;
            let normal = (self.gradient)(p).normalize_or_zero();
            let way = mean - p;
            self.onto_surface(p + PACE * (way - normal * way.dot(normal)))
        });
        moved.collect()
    }
}

/// Neighbours of each vertex along directed edges that come in both directions.
pub(crate) fn neighbours(vertices: usize, edges: impl Iterator<Item = [usize; 2]>) -> Vec<Vec<usize>> {
    let mut neighbours = vec![Vec::new(); vertices];
    edges.for_each(|[a, b]| neighbours[a].push(b));
    neighbours
}

fn grid(size: [usize; 3]) -> Vec<[usize; 3]> {
    let mut nodes = Vec::with_capacity(size.iter().product());
    for z in 0..size[2] {
        for y in 0..size[1] {
            nodes.extend((0..size[0]).map(|x| [x, y, z]));
        }
    }
    nodes
}

/// The twelve edges of the cell whose lowest corner is node `i`.
fn cell_edges(i: [usize; 3]) -> impl Iterator<Item = ([usize; 3], [usize; 3])> {
    (0..3).flat_map(move |axis| {
        [(0, 0), (0, 1), (1, 0), (1, 1)].map(|(a, b)| {
            let mut from = i;
            from[(axis + 1) % 3] += a;
            from[(axis + 2) % 3] += b;
            let mut to = from;
            to[axis] += 1;
            (from, to)
        })
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use deepsft_geometry::glam::DVec2;
    use deepsft_geometry::{Topology, TriangleMesh};

    fn mesh_of(value: &dyn Fn(DVec3) -> f64, gradient: &dyn Fn(DVec3) -> DVec3) -> TriangleMesh {
        let implicit = Implicit { value, gradient };
        let (vertices, faces) = implicit.mesh([DVec3::splat(-2.1), DVec3::splat(2.1)], 0.17);
        let count = vertices.len();
        TriangleMesh::new(vertices, vec![DVec2::ZERO; count], faces).unwrap()
    }

    #[test]
    fn a_ball_is_closed_lies_on_the_ball_and_has_its_volume() {
        let ball = mesh_of(&|p| p.length() - 1.5, &|p| p / p.length());
        assert_eq!(Topology::of(&ball).unwrap().genus(), Some(0));
        assert!(ball.vertices().iter().all(|p| (p.length() - 1.5).abs() < 1e-9));
        let v = ball.vertices();
        let volume: f64 = ball
            .faces()
            .iter()
            .map(|&[a, b, c]| v[a].dot(v[b].cross(v[c])) / 6.0)
            .sum();
        // Chords of length h lie h^2 / (8 r) inside on average twice over: 1 % here. Positive: the front is outside.
        let expected = 4.0 / 3.0 * std::f64::consts::PI * 1.5_f64.powi(3);
        assert!((volume / expected - 1.0).abs() < 0.02, "{volume} for {expected}");
    }

    #[test]
    fn a_ring_keeps_its_hole() {
        let value = |p: DVec3| (p.truncate().length() - 1.4).hypot(p.z) - 0.5;
        let gradient = |p: DVec3| {
            let across = p.truncate().length();
            let (out, up) = (across - 1.4, p.z);
            let length = out.hypot(up).max(1e-9);
            (p.truncate() / across.max(1e-9) * (out / length)).extend(up / length)
        };
        assert_eq!(Topology::of(&mesh_of(&value, &gradient)).unwrap().genus(), Some(1));
    }
}
