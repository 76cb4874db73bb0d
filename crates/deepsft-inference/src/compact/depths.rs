//! Depths that follow from the registration of an isometric surface, and what refinement reads of them.
//!
//! The same arithmetic as the network's in training, in the same precision: see `isometric_depth` and `planar_depth` of the crate
//! `deepsft-network` for where it comes from.

use super::cells::{PIXELS_PER_CELL, cells};
use crate::config::{DepthRange, NetworkConfig};
use pulp::{Arch, Simd, WithSimd};

/// Standard deviations of the windows, cells.
pub(super) const REACHES: [f64; 2] = [5.0, 10.0];

/// Unit of the template's coordinates, mm.
pub(super) const UNIT_MM: f64 = 100.0;

/// Damping of the template's covariance, units^2, and of the plane's slopes.
pub(super) const COVARIANCE_DAMPING: f32 = 1e-5;
pub(super) const SLOPE_DAMPING: f32 = 1e-5;

/// Fraction of a window that must be seen for its plane to count half.
pub(super) const HALF_SUPPORT: f32 = 0.01;

/// How much a cell counts, and 23 moments times that.
pub(super) const MOMENTS: usize = 24;

/// Measured depths: the two of the Jacobian, the two of the planes.
pub(super) const MEASURED: usize = 4;

/// Brings departures to the size of the features beside them, and the largest that is read.
pub(super) const DEPARTURE_GAIN: f32 = 10.0;
pub(super) const LARGEST_DEPARTURE: f32 = 2.0;

/// Least normalised log depth that is measured, and the largest.
pub(super) const NORMALISED: [f32; 2] = [-0.5, 1.5];

/// Measures depths of all cells.
#[derive(Debug)]
pub(super) struct DepthMeasure {
    rows: usize,
    columns: usize,
    size_mm: [f32; 2],
    /// Whether the registration is one smooth chart of a sheet: planes are measured of no other.
    is_chart: bool,
    focal: f32,
    near_mm: f32,
    /// ln(far / near).
    span: f32,
    /// The rays (x, y) at z = 1 through the cells' centres.
    rays: Vec<[f32; 2]>,
    /// Gaussian windows of each reach down and across.
    windows: [[Vec<f32>; 2]; 2],
    /// Moments [row, column, moment], and on their way through the windows.
    moments: Vec<f32>,
    down: Vec<f32>,
    turned: Vec<f32>,
    means: Vec<f32>,
}

impl DepthMeasure {
    pub(super) fn new(image: [usize; 2], config: &NetworkConfig) -> Self {
        let [rows, columns] = cells(image);
        let [cx, cy] = config.principal_point;
        let along = |cell: usize, c: f64| (((cell as f64 + 0.5) * PIXELS_PER_CELL as f64 - c) / config.focal) as f32;
        let DepthRange { near_mm, far_mm } = config.depth_range;
        let numbers = vec![0.0; rows * columns * MOMENTS];
        Self {
            rows,
            columns,
            size_mm: config.template_size_mm.map(|side| side as f32),
            is_chart: !config.has_rest_positions(),
            focal: config.focal as f32,
            near_mm: near_mm as f32,
            span: (far_mm / near_mm).ln() as f32,
            rays: (0..rows * columns)
                .map(|cell| [along(cell % columns, cx), along(cell / columns, cy)])
                .collect(),
            windows: REACHES.map(|reach| [gaussian(rows, reach), gaussian(columns, reach)]),
            moments: numbers.clone(),
            down: numbers.clone(),
            turned: numbers.clone(),
            means: numbers,
        }
    }

    /// Normalised log depth of a depth in mm.
    fn normalised(&self, depth_mm: f32) -> f32 {
        let [least, most] = NORMALISED;
        ((depth_mm / self.near_mm).ln() / self.span).clamp(least, most)
    }

    /// Depths measured from the coordinates of all cells, of which `seen` (0..=1) says how much they count.
    pub(super) fn measure(
        &mut self,
        arch: Arch,
        [u, v, d, w]: [&[f32]; 4],
        seen: &[f32],
        measured: &mut [[f32; MEASURED]],
    ) {
        for (cell, measured) in measured.iter_mut().enumerate() {
            let [smallest, largest] = self.isometric([u, v, w], cell);
            *measured = [smallest, largest, d[cell], d[cell]];
        }
        if !self.is_chart {
            return;
        }
        self.take_moments([u, v], seen);
        for k in 0..REACHES.len() {
            self.average(arch, k);
            for (cell, measured) in measured.iter_mut().enumerate() {
                let (row, column) = (cell / self.columns, cell % self.columns);
                let means = &self.means[(column * self.rows + row) * MOMENTS..][..MOMENTS];
                let depth_mm = plane_depth(means, self.rays[cell]) * UNIT_MM as f32;
                let depth = self.normalised(depth_mm.max(1.0));
                let trust = means[0] / (means[0] + HALF_SUPPORT);
                measured[2 + k] = d[cell] + (depth - d[cell]) * trust;
            }
        }
    }

    /// Depths from the smallest and the largest singular value of the registration's Jacobian.
    fn isometric(&self, maps: [&[f32]; 3], cell: usize) -> [f32; 2] {
        let (row, column) = (cell / self.columns, cell % self.columns);
        let across = [column.saturating_sub(1), (column + 1).min(self.columns - 1)].map(|c| row * self.columns + c);
        let down = [row.saturating_sub(1), (row + 1).min(self.rows - 1)].map(|r| r * self.columns + column);
        let slope = |k: usize, [from, to]: [usize; 2]| {
            // z is measured as x is.
            let size_mm = self.size_mm[k % 2];
            (maps[k][to] * size_mm - maps[k][from] * size_mm) / (2 * PIXELS_PER_CELL) as f32
        };
        let [ux, uy, vx, vy] = [slope(0, across), slope(0, down), slope(1, across), slope(1, down)];
        let (mut a, mut b, mut c) = (ux * ux + vx * vx, uy * uy + vy * vy, ux * uy + vx * vy);
        if !self.is_chart {
            let [wx, wy] = [slope(2, across), slope(2, down)];
            (a, b, c) = (a + wx * wx, b + wy * wy, c + wx * wy);
        }
        let half_sum = (a + b) / 2.0;
        let half_gap = (((a - b) / 2.0).powi(2) + c * c).sqrt();
        [half_sum - half_gap, half_sum + half_gap].map(|s| self.normalised(s.max(1e-6).sqrt() * self.focal))
    }

    /// 1, U, V, UU, UV, VV; x times these; y times these; x^2 + y^2 times the last five of them.
    fn take_moments(&mut self, [u, v]: [&[f32]; 2], seen: &[f32]) {
        let [width, height] = self.size_mm.map(|side| (f64::from(side) / UNIT_MM) as f32);
        for (cell, moments) in self.moments.chunks_exact_mut(MOMENTS).enumerate() {
            let (u, v) = ((u[cell] - 0.5) * width, (v[cell] - 0.5) * height);
            let [x, y] = self.rays[cell];
            let powers = [1.0, u, v, u * u, u * v, v * v];
            moments[0] = seen[cell];
            for k in 0..6 {
                moments[1 + k] = powers[k] * seen[cell];
                moments[7 + k] = powers[k] * x * seen[cell];
                moments[13 + k] = powers[k] * y * seen[cell];
            }
            for k in 1..6 {
                moments[18 + k] = (x * x + y * y) * powers[k] * seen[cell];
            }
        }
    }

    /// The means of the moments under the windows of one reach: `means` [column, row, moment].
    fn average(&mut self, arch: Arch, reach: usize) {
        let [down, across] = &self.windows[reach];
        arch.dispatch(WeightedSums {
            weights: down,
            rows: &self.moments,
            out: &mut self.down,
        });
        for (cell, moments) in self.down.chunks_exact(MOMENTS).enumerate() {
            let (row, column) = (cell / self.columns, cell % self.columns);
            self.turned[(column * self.rows + row) * MOMENTS..][..MOMENTS].copy_from_slice(moments);
        }
        arch.dispatch(WeightedSums {
            weights: across,
            rows: &self.turned,
            out: &mut self.means,
        });
        for means in self.means.chunks_exact_mut(MOMENTS) {
            let support = means[0] + 1e-6;
            means[1..].iter_mut().for_each(|mean| *mean /= support);
        }
    }
}

/// Entry (i, j) is the density at i - j of a normal distribution.
pub(super) fn gaussian(length: usize, deviation: f64) -> Vec<f32> {
    let density = |k: usize| {
        let t = ((k / length) as f64 - (k % length) as f64) / deviation;
        ((-t * t / 2.0).exp() / (deviation * (2.0 * std::f64::consts::PI).sqrt())) as f32
    };
    (0..length * length).map(density).collect()
}

/// Row i of `out` is the sum of the rows j of `rows` times the weight (i, j).
struct WeightedSums<'a> {
    weights: &'a [f32],
    rows: &'a [f32],
    out: &'a mut [f32],
}

impl WithSimd for WeightedSums<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        /// Rows of the result that are summed at once, and vectors of each.
        const ROWS: usize = 4;
        const VECTORS: usize = 2;
        let count = self.weights.len().isqrt();
        let length = self.rows.len() / count;
        let lanes = S::F32_LANES;
        let whole = length / (VECTORS * lanes) * VECTORS * lanes;
        for first in (0..count).step_by(ROWS) {
            let row = |r: usize| (first + r).min(count - 1);
            for at in (0..whole).step_by(VECTORS * lanes) {
                let mut sums = [[simd.splat_f32s(0.0); VECTORS]; ROWS];
                for (j, from) in self.rows.chunks_exact(length).enumerate() {
                    let (from, _) = S::as_simd_f32s(&from[at..at + VECTORS * lanes]);
                    for (r, sums) in sums.iter_mut().enumerate() {
                        let weight = simd.splat_f32s(self.weights[row(r) * count + j]);
                        for (sum, &from) in sums.iter_mut().zip(from) {
                            *sum = simd.mul_add_e_f32s(weight, from, *sum);
                        }
                    }
                }
                for (r, sums) in sums.iter().enumerate() {
                    let (to, _) = S::as_mut_simd_f32s(&mut self.out[row(r) * length + at..][..VECTORS * lanes]);
                    to.copy_from_slice(sums);
                }
            }
        }
        // What is left at the rows' ends.
        for i in 0..count {
            for at in whole..length {
                let sum = (0..count).map(|j| self.weights[i * count + j] * self.rows[j * length + at]);
                self.out[i * length + at] = sum.sum();
            }
        }
    }
}

/// Of one coordinate q of the rays: the means of q, q U and q V, their covariances with P = (U, V), and those times the inverse of P's
/// own.
struct Axis {
    means: [f32; 3],
    covariances: [[f32; 2]; 3],
    slopes: [[f32; 2]; 3],
}

/// Depth, in [`UNIT_MM`], at which a ray meets the plane that explains the registration in a window: of the means of the moments, of
/// which the first is skipped.
fn plane_depth(means: &[f32], [ray_x, ray_y]: [f32; 2]) -> f32 {
    let at = |k: usize| means[1 + k];
    let (u, v) = (at(1), at(2));

    // Covariance of P = (U, V), inverted.
    let suu = at(3) - u * u + COVARIANCE_DAMPING;
    let suv = at(4) - u * v;
    let svv = at(5) - v * v + COVARIANCE_DAMPING;
    let determinant = suu * svv - suv * suv;
    let (iuu, iuv, ivv) = (svv / determinant, -suv / determinant, suu / determinant);
    let times_inverse = |[a, b]: [f32; 2]| [a * iuu + b * iuv, a * iuv + b * ivv];
    let dot = |[a, b]: [f32; 2], [c, d]: [f32; 2]| a * c + b * d;

    let axis = |first: usize| {
        let [q, qu, qv, quu, quv, qvv] = [0, 1, 2, 3, 4, 5].map(|k| at(first + k));
        let with = [
            [qu - q * u, qv - q * v],
            [quu - qu * u, quv - qu * v],
            [quv - qv * u, qvv - qv * v],
        ];
        Axis {
            means: [q, qu, qv],
            covariances: with,
            slopes: with.map(times_inverse),
        }
    };
    let (x, y) = (axis(6), axis(12));
    // What the planes explain of the product of moments i and j: (q, q U, q V).
    let explained = |i: usize, j: usize| {
        let of = |axis: &Axis| axis.means[i] * axis.means[j] + dot(axis.covariances[i], axis.slopes[j]);
        of(&x) + of(&y)
    };

    // Normal equations of the slopes g.
    let kuu = at(20) - explained(1, 1) + SLOPE_DAMPING;
    let kuv = at(21) - explained(1, 2);
    let kvv = at(22) - explained(2, 2) + SLOPE_DAMPING;
    let ru = explained(1, 0) - at(18);
    let rv = explained(2, 0) - at(19);
    let determinant = kuu * kvv - kuv * kuv;
    let gu = (kvv * ru - kuv * rv) / determinant;
    let gv = (kuu * rv - kuv * ru) / determinant;

    // The pose: A = (a1, a2) and t, x and y side by side.
    let pose = |axis: &Axis| {
        let [s0, su, sv] = axis.slopes;
        let [q, qu, qv] = axis.means;
        let [a1, a2] = [0, 1].map(|k| s0[k] + gu * su[k] + gv * sv[k]);
        [a1, a2, q + gu * qu + gv * qv - a1 * u - a2 * v]
    };
    let [[a1x, a2x, tx], [a1y, a2y, ty]] = [pose(&x), pose(&y)];
    let lengths = (a1x * a1x + a1y * a1y + gu * gu) * (a2x * a2x + a2y * a2y + gv * gv) + 1e-12;

    // The plane's normal r1 x r2, its scale, and where the ray meets it.
    let normal = [a1y * gv - gu * a2y, gu * a2x - a1x * gv];
    let normal_z = a1x * a2y - a1y * a2x;
    let offset = dot(normal, [tx, ty]) + normal_z;
    let facing = dot(normal, [ray_x, ray_y]) + normal_z;
    offset * facing / (facing * facing + 1e-9) / lengths.sqrt().sqrt()
}

/// How far measured depths lie from the depth found, scaled and bounded.
pub(super) fn departures(measured: &[f32; MEASURED], depth: f32) -> [f32; MEASURED] {
    measured.map(|m| ((m - depth) * DEPARTURE_GAIN).clamp(-LARGEST_DEPARTURE, LARGEST_DEPARTURE))
}

/// The mean of the depth found and those of the planes under the softmax of `logits`.
pub(super) fn weighed(depths: [f32; 3], logits: &[f32]) -> f32 {
    let most = logits.iter().copied().fold(f32::MIN, f32::max);
    let (mut sum, mut weights) = (0.0, 0.0);
    for (depth, logit) in depths.iter().zip(logits) {
        let weight = (logit - most).exp();
        sum += weight * depth;
        weights += weight;
    }
    sum / weights
}
