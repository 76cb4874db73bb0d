//! What the network should predict for a frame: (u, v, d) at the centre of every cell, or (x, y, d, z) of rest positions.
//!
//! A cell's target is an affine fit of the true maps over the visible pixels of the 3 x 3 cells
//! around it, read at the cell's centre. So cells that the object's edge or an occluder cuts are
//! taught the surface's own value at their centre, and so are cells just outside: bilinear
//! up-sampling is then right up to the last visible pixel. Cells without enough pixels, and those
//! across a fold (where no affine function fits), do not count.

use deepsft::DepthRange;
use deepsft_geometry::glam::{DMat3, DVec3, DVec4};
use deepsft_geometry::{Maps, RestSurface};
use deepsft_network::PIXELS_PER_CELL;

/// Fewest visible pixels around a cell that the object covers.
const MIN_INSIDE: f64 = 12.0;
/// Fewest visible pixels around a cell that it does not.
const MIN_OUTSIDE: f64 = 40.0;
/// Largest RMS residual of the fit, of each coordinate, that counts as one smooth surface.
const LARGEST_RESIDUAL: f64 = 0.012;
/// Weight of a cell that only its neighbours support.
const OUTSIDE_WEIGHT: f32 = 0.5;
/// Damping of the slopes, as a fraction of the number of pixels times one pixel squared.
const SLOPE_DAMPING: f64 = 0.005;

/// Targets of the cells of one frame, row-major, `columns` x `rows`.
pub struct CellTargets {
    /// Cells across.
    pub columns: usize,
    /// Cells down.
    pub rows: usize,
    /// (u, v, d) at the cell's centre, or (x, y, d, z).
    pub coordinates: Vec<[f32; 4]>,
    /// 1 where the object is seen in the cell, less beside it, 0 where nothing is known.
    pub weight: Vec<f32>,
}

/// Sums over the visible pixels of a cell, of w = (1, x, y), positions in pixels from the frame's corner, and the values q.
#[derive(Clone, Copy)]
struct Moments {
    /// Of w w'.
    places: DMat3,
    /// Of q w'.
    values: [DVec4; 3],
    /// Of the squares of q.
    squares: DVec4,
}

impl Moments {
    /// Of no pixels. (The default of a matrix is the identity.)
    const NONE: Self = Self {
        places: DMat3::ZERO,
        values: [DVec4::ZERO; 3],
        squares: DVec4::ZERO,
    };

    fn add_pixel(&mut self, x: f64, y: f64, q: DVec4) {
        let w = DVec3::new(1.0, x, y);
        self.places += DMat3::from_cols(w, w * x, w * y);
        for (sum, weight) in self.values.iter_mut().zip(w.to_array()) {
            *sum += q * weight;
        }
        self.squares += q * q;
    }

    fn add(&mut self, other: &Self) {
        self.places += other.places;
        for (sum, other) in self.values.iter_mut().zip(other.values) {
            *sum += other;
        }
        self.squares += other.squares;
    }

    /// Number of pixels.
    fn n(&self) -> f64 {
        self.places.x_axis.x
    }

    /// Affine fit of each q read at (`cx`, `cy`), and the largest RMS residual.
    fn fit_at(&self, cx: f64, cy: f64) -> ([f32; 4], f64) {
        let n = self.n();
        let (mx, my) = (self.places.x_axis.y / n, self.places.x_axis.z / n);
        let damping = SLOPE_DAMPING * n;
        let a = self.places.y_axis.y - n * mx * mx + damping;
        let b = self.places.y_axis.z - n * mx * my;
        let c = self.places.z_axis.z - n * my * my + damping;
        let determinant = a * c - b * b;
        let mean = self.values[0] / n;
        let (sx, sy) = (self.values[1] - mean * (n * mx), self.values[2] - mean * (n * my));
        let (gx, gy) = ((sx * c - sy * b) / determinant, (sy * a - sx * b) / determinant);
        let values = mean + gx * (cx - mx) + gy * (cy - my);
        let spread = self.squares - mean * mean * n;
        let variance = ((spread - gx * sx - gy * sy) / n).max_element();
        (values.as_vec4().to_array(), variance.max(0.0).sqrt())
    }
}

impl CellTargets {
    /// Targets of the window of `columns` x `rows` cells whose corner is at pixel (`left`, `top`);
    /// pixels outside the maps count as outside the object. With a `surface` the targets are rest positions.
    pub fn of_window(
        truth: &Maps,
        range: DepthRange,
        surface: Option<&RestSurface>,
        (left, top): (usize, usize),
        (columns, rows): (usize, usize),
    ) -> Self {
        let cell = PIXELS_PER_CELL;
        let mut moments = vec![Moments::NONE; columns * rows];
        for y in 0..(rows * cell).min(truth.size().height.saturating_sub(top)) {
            for x in 0..(columns * cell).min(truth.size().width.saturating_sub(left)) {
                let pixel = (top + y) * truth.size().width + left + x;
                if !truth.inside(pixel) {
                    continue;
                }
                let uv = truth.uv(pixel);
                let position = match surface {
                    Some(surface) => surface.position(uv),
                    None => Some(uv.extend(0.0)),
                };
                if let Some(DVec3 { x: a, y: b, z: c }) = position {
                    let d = range.normalise(f64::from(truth.depth()[pixel]));
                    let coordinates = DVec4::new(a, b, d, c);
                    moments[(y / cell) * columns + x / cell].add_pixel(x as f64 + 0.5, y as f64 + 0.5, coordinates);
                }
            }
        }
        let mut coordinates = vec![[0.0; 4]; columns * rows];
        let mut weight = vec![0.0; columns * rows];
        for row in 0..rows {
            for column in 0..columns {
                let i = row * columns + column;
                let mut around = Moments::NONE;
                for r in row.saturating_sub(1)..(row + 2).min(rows) {
                    for c in column.saturating_sub(1)..(column + 2).min(columns) {
                        around.add(&moments[r * columns + c]);
                    }
                }
                let inside = moments[i].n() > 0.0;
                if around.n() < if inside { MIN_INSIDE } else { MIN_OUTSIDE } {
                    continue;
                }
                let centre = |k: usize| (k as f64 + 0.5) * cell as f64;
                let (values, residual) = around.fit_at(centre(column), centre(row));
                if residual <= LARGEST_RESIDUAL {
                    coordinates[i] = values;
                    weight[i] = if inside { 1.0 } else { OUTSIDE_WEIGHT };
                }
            }
        }
        Self {
            columns,
            rows,
            coordinates,
            weight,
        }
    }

    /// Targets of the coarse cells, two by two of these: the weighted mean of the four and the mean
    /// weight, row-major.
    pub fn coarse(&self) -> Vec<([f32; 4], f32)> {
        let (columns, rows) = (self.columns / 2, self.rows / 2);
        (0..columns * rows)
            .map(|i| {
                let corner = 2 * (i / columns) * self.columns + 2 * (i % columns);
                let four = [corner, corner + 1, corner + self.columns, corner + self.columns + 1];
                let weight: f32 = four.iter().map(|&j| self.weight[j]).sum();
                if weight <= 0.0 {
                    return ([0.0; 4], 0.0);
                }
                let sum = |k: usize| {
                    four.iter()
                        .map(|&j| self.weight[j] * self.coordinates[j][k])
                        .sum::<f32>()
                };
                (std::array::from_fn(|k| sum(k) / weight), weight / 4.0)
            })
            .collect()
    }
}

/// Writes the soft target of coordinate `t` over `bins` bins with centres k / (bins - 1): the two
/// around it divide one by nearness. `set(k, fraction)` is called for each; t is clamped to 0..=1.
pub fn two_bins(t: f32, bins: usize, mut set: impl FnMut(usize, f32)) {
    let at = t.clamp(0.0, 1.0) * (bins - 1) as f32;
    let low = (at as usize).min(bins - 2);
    let fraction = at - low as f32;
    set(low, 1.0 - fraction);
    set(low + 1, fraction);
}

#[cfg(test)]
#[path = "../../tests/common/charts.rs"]
mod charts;

#[cfg(test)]
mod tests {
    use super::charts::{in_texture, two_charts};
    use super::*;
    use deepsft_geometry::Picture;
    use deepsft_geometry::glam::DVec2;

    const RANGE: DepthRange = DepthRange {
        near_mm: 100.0,
        far_mm: 1000.0,
    };

    /// u = x / 100, v = y / 200, depth constant, visible left of column `edge`.
    fn slope(edge: usize) -> Maps {
        let mut maps = Maps::empty((64, 32));
        for y in 0..32 {
            for x in 0..edge {
                maps.set(y * 64 + x, 400.0, [(x as f32 + 0.5) / 100.0, (y as f32 + 0.5) / 200.0]);
            }
        }
        maps
    }

    #[test]
    fn an_affine_map_is_read_at_the_centres_also_where_the_edge_cuts_a_cell_and_beside_it() {
        let cells = CellTargets::of_window(&slope(35), RANGE, None, (0, 0), (8, 4));
        for (column, weight) in [(0, 1.0), (3, 1.0), (4, 1.0), (5, OUTSIDE_WEIGHT), (6, 0.0)] {
            let i = 8 + column;
            assert_eq!(cells.weight[i], weight, "column {column}");
            if weight > 0.0 {
                let [u, v, d, _] = cells.coordinates[i];
                assert!(
                    (u - (column as f32 * 8.0 + 4.0) / 100.0).abs() < 4e-3,
                    "column {column}: {u}"
                );
                assert!((v - 12.0 / 200.0).abs() < 2e-3);
                // ln 4 / ln 10
                assert!((d - 0.602_06).abs() < 1e-4);
            }
        }
    }

    #[test]
    fn a_window_reads_the_same_surface_from_its_own_corner() {
        let cells = CellTargets::of_window(&slope(64), RANGE, None, (13, 5), (4, 2));
        assert!((cells.coordinates[5][0] - (13.0 + 12.0) / 100.0).abs() < 1e-4);
        assert!((cells.coordinates[5][1] - (5.0 + 12.0) / 200.0).abs() < 1e-4);
    }

    #[test]
    fn a_tear_in_the_map_is_not_taught() {
        let mut maps = slope(64);
        for y in 0..32 {
            for x in 20..64 {
                maps.set(y * 64 + x, 600.0, [0.9, 0.5]);
            }
        }
        let cells = CellTargets::of_window(&maps, RANGE, None, (0, 0), (8, 4));
        assert_eq!(cells.weight[8 + 2], 0.0);
        assert_eq!(cells.weight[8 + 6], 1.0);
    }

    #[test]
    fn cells_beside_a_seam_are_taught_rest_positions_that_go_on() {
        let template = two_charts(Picture::from_fn(4, 4, |_, _| [0; 3]), DVec2::new(200.0, 100.0));
        let surface = RestSurface::new(&template);
        // Pixel (x, y) shows the point (3 x, 3 y) mm of the sheet: the seam is between the columns 32 and 33.
        let mut maps = Maps::empty((64, 32));
        for y in 0..32 {
            for x in 0..64 {
                let at = DVec2::new((x as f64 + 0.5) * 3.0 / 200.0, (y as f64 + 0.5) * 3.0 / 100.0);
                maps.set(y * 64 + x, 400.0, in_texture(at).as_vec2().to_array());
            }
        }
        let without = CellTargets::of_window(&maps, RANGE, None, (0, 0), (8, 4));
        assert_eq!((without.weight[8 + 3], without.weight[8 + 4]), (0.0, 0.0));
        let cells = CellTargets::of_window(&maps, RANGE, Some(&surface), (0, 0), (8, 4));
        for column in 0..8 {
            assert_eq!(cells.weight[8 + column], 1.0, "column {column}");
            // The cube is as long as the sheet, whose middle is its own.
            let [x, y, _, z] = cells.coordinates[8 + column];
            let expected = [
                (column as f32 * 8.0 + 4.0) * 3.0 / 200.0,
                0.5 + (36.0 - 50.0) / 200.0,
                0.5,
            ];
            let off = [x, y, z].into_iter().zip(expected).map(|(a, b)| (a - b).abs());
            assert!(off.fold(0.0, f32::max) < 4e-3, "column {column}: {x} {y} {z}");
        }
        // The coarse cell of the columns 4 and 5, the two rows from the top.
        let (coarse, weight) = cells.coarse()[2];
        assert!(
            (coarse[0] - 40.0 * 3.0 / 200.0).abs() < 4e-3 && weight == 1.0,
            "{coarse:?}"
        );
    }

    #[test]
    fn two_bins_divide_by_nearness_and_mean_the_coordinate() {
        for t in [0.0, 0.13, 0.5, 0.99, 1.0] {
            let (mut sum, mut mean) = (0.0, 0.0);
            two_bins(t, 24, |k, fraction| {
                sum += fraction;
                mean += fraction * k as f32 / 23.0;
            });
            assert!((sum - 1.0).abs() < 1e-6 && (mean - t).abs() < 1e-5);
        }
    }
}
