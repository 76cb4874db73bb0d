//! The filter transform: filters at the points.

/// Side of the tiles that are usual, of what they read, and the number of points.
pub(crate) const TILE: usize = 4;
pub(crate) const READ: usize = TILE + 2;
pub(crate) const POINTS: usize = READ * READ;

/// Takes a filter's row to the points, for tiles of 4.
const G4: [[f64; 3]; READ] = [
    [1.0 / 4.0, 0.0, 0.0],
    [-1.0 / 6.0, -1.0 / 6.0, -1.0 / 6.0],
    [-1.0 / 6.0, 1.0 / 6.0, -1.0 / 6.0],
    [1.0 / 24.0, 1.0 / 12.0, 1.0 / 6.0],
    [1.0 / 24.0, -1.0 / 12.0, 1.0 / 6.0],
    [0.0, 0.0, 1.0],
];

/// The same for tiles of 2.
const G2: [[f64; 3]; 4] = [[1.0, 0.0, 0.0], [0.5, 0.5, 0.5], [0.5, -0.5, 0.5], [0.0, 0.0, 1.0]];

/// A filter of 3 x 3 at a point of tiles of 2 or 4: G g G^T.
pub(crate) fn filter_at_point(tile: usize, filter: [[f64; 3]; 3], point: usize) -> f32 {
    let g = if tile == 2 { &G2[..] } else { &G4[..] };
    let dot = |a: [f64; 3], b: [f64; 3]| a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
    let column = filter.map(|row| dot(g[point % g.len()], row));
    dot(g[point / g.len()], column) as f32
}
