//! Bicubic B-splines over a sheet: the warps and depths of analytical Shape-from-Template (Rueckert et al. 1999; Brunet et al. 2014).

use anyhow::{Context, Result};
use deepsft_geometry::glam::DVec2;
use faer::linalg::solvers::Solve;
use faer::{Mat, Side};

/// Ridge on control points, as a fraction of the largest diagonal entry: settles what neither data nor bending do.
const RIDGE: f64 = 1e-13;

/// Abscissae of Gauss-Legendre quadrature by two points.
const GAUSS: [f64; 2] = [0.211_324_865_405_187_1, 0.788_675_134_594_812_9];

/// How often a basis is differentiated along x and along y.
type Order = [usize; 2];

/// The grid of control points of uniform bicubic B-splines over a sheet.
#[derive(Clone, Copy, Debug)]
pub struct SplineGrid {
    size_mm: DVec2,
    cells: [usize; 2],
}

impl SplineGrid {
    /// Divides a sheet of `size_mm` into square-like cells, `cells` of them along its longer side.
    pub fn new(size_mm: DVec2, cells: usize) -> Self {
        let per_mm = cells as f64 / size_mm.max_element();
        let along = |side: f64| ((side * per_mm).round() as usize).max(1);
        Self {
            size_mm,
            cells: [along(size_mm.x), along(size_mm.y)],
        }
    }

    /// Control points.
    fn controls(&self) -> usize {
        (self.cells[0] + 3) * (self.cells[1] + 3)
    }

    /// Control points and their weights in the value, or a derivative per mm, at `place` (mm from the sheet's corner).
    fn row(&self, place: DVec2, order: Order) -> [(usize, f64); 16] {
        let [(column, across), (line, down)] = [0, 1].map(|axis| {
            let cells = self.cells[axis] as f64;
            let at = (place[axis] / self.size_mm[axis] * cells).clamp(0.0, cells);
            let cell = (at as usize).min(self.cells[axis] - 1);
            let per_mm = (cells / self.size_mm[axis]).powi(order[axis] as i32);
            (cell, basis(at - cell as f64, order[axis]).map(|weight| weight * per_mm))
        });
        let columns = self.cells[0] + 3;
        std::array::from_fn(|k| {
            let (i, j) = (k % 4, k / 4);
            ((line + j) * columns + column + i, across[i] * down[j])
        })
    }
}

/// The four uniform cubic B-splines, or their first or second derivative, at `t` from 0 to 1.
fn basis(t: f64, order: usize) -> [f64; 4] {
    let s = 1.0 - t;
    match order {
        0 => [
            s * s * s / 6.0,
            (3.0 * t * t * t - 6.0 * t * t + 4.0) / 6.0,
            (3.0 * s * s * s - 6.0 * s * s + 4.0) / 6.0,
            t * t * t / 6.0,
        ],
        1 => [
            -s * s / 2.0,
            (3.0 * t * t - 4.0 * t) / 2.0,
            (4.0 * s - 3.0 * s * s) / 2.0,
            t * t / 2.0,
        ],
        _ => [s, 3.0 * t - 2.0, 3.0 * s - 2.0, t],
    }
}

/// A function on the sheet with `N` numbers as its values.
#[derive(Clone, Debug)]
pub struct Spline<const N: usize> {
    grid: SplineGrid,
    controls: Vec<[f64; N]>,
}

impl<const N: usize> Spline<N> {
    /// The spline nearest to `values` at places (mm): each counts `weight`, the bending energy `bending`.
    /// Fails when values and bending leave the control points open.
    pub fn through(
        grid: SplineGrid,
        values: impl IntoIterator<Item = (DVec2, [f64; N])>,
        weight: f64,
        bending: f64,
    ) -> Result<Self> {
        let mut fit = SplineFit::new(grid);
        for (place, value) in values {
            fit.add(place, [0, 0], weight, value);
        }
        fit.solve(bending)
    }

    fn at(&self, place: DVec2, order: Order) -> [f64; N] {
        let mut sum = [0.0; N];
        for (control, weight) in self.grid.row(place, order) {
            for (sum, value) in sum.iter_mut().zip(self.controls[control]) {
                *sum += weight * value;
            }
        }
        sum
    }

    /// The value at `place`, mm from the sheet's upper left corner; beyond the edges that of the nearest point.
    pub fn value(&self, place: DVec2) -> [f64; N] {
        self.at(place, [0, 0])
    }

    /// The derivatives at `place` along x and along y, per mm.
    pub fn derivatives(&self, place: DVec2) -> [[f64; N]; 2] {
        [[1, 0], [0, 1]].map(|order| self.at(place, order))
    }
}

impl Spline<1> {
    /// The spline whose gradients, per mm, are nearest to `gradients`, weighted as in [`Spline::through`].
    /// Fails as that.
    pub fn along(
        grid: SplineGrid,
        gradients: impl Iterator<Item = (DVec2, DVec2)>,
        weight: f64,
        bending: f64,
    ) -> Result<Self> {
        let mut fit = SplineFit::new(grid);
        for (place, gradient) in gradients {
            fit.add(place, [1, 0], weight, [gradient.x]);
            fit.add(place, [0, 1], weight, [gradient.y]);
        }
        fit.solve(bending)
    }

    /// The gradient at `place`, per mm.
    pub fn gradient(&self, place: DVec2) -> DVec2 {
        self.derivatives(place).map(|[derivative]| derivative).into()
    }
}

/// A linear least-squares problem for the control points of a spline.
struct SplineFit<const N: usize> {
    grid: SplineGrid,
    normal: Mat<f64>,
    right: Mat<f64>,
}

impl<const N: usize> SplineFit<N> {
    fn new(grid: SplineGrid) -> Self {
        let n = grid.controls();
        let (normal, right) = (Mat::zeros(n, n), Mat::zeros(n, N));
        Self { grid, normal, right }
    }

    /// Asks for a value or a derivative at `place`.
    fn add(&mut self, place: DVec2, order: Order, weight: f64, value: [f64; N]) {
        let row = self.grid.row(place, order);
        for (a, wa) in row {
            for (b, wb) in row {
                self.normal[(a, b)] += weight * wa * wb;
            }
            for (k, value) in value.into_iter().enumerate() {
                self.right[(a, k)] += weight * wa * value;
            }
        }
    }

    /// Adds `weight` times the bending energy, the integral of the squared second derivatives times the squared diagonal: a spline bends
    /// as dear on a large sheet as on a small one.
    fn add_bending(&mut self, weight: f64) {
        let cell = self.grid.size_mm / DVec2::new(self.grid.cells[0] as f64, self.grid.cells[1] as f64);
        let per_point = weight * self.grid.size_mm.length_squared() * cell.element_product() / 4.0;
        for k in 0..self.grid.cells[0] * self.grid.cells[1] {
            let corner = DVec2::new((k % self.grid.cells[0]) as f64, (k / self.grid.cells[0]) as f64);
            for at in GAUSS.iter().flat_map(|&x| GAUSS.map(|y| DVec2::new(x, y))) {
                for (order, times) in [([2, 0], 1.0), ([1, 1], 2.0), ([0, 2], 1.0)] {
                    self.add((corner + at) * cell, order, times * per_point, [0.0; N]);
                }
            }
        }
    }

    /// The spline that satisfies the problem best, with a weight of its bending.
    fn solve(mut self, bending: f64) -> Result<Spline<N>> {
        self.add_bending(bending);
        let n = self.grid.controls();
        let largest = (0..n).map(|k| self.normal[(k, k)]).fold(0.0, f64::max);
        for k in 0..n {
            self.normal[(k, k)] += RIDGE * largest;
        }
        let factor = self.normal.llt(Side::Lower).ok();
        let factor = factor.context("the spline is not determined by its data")?;
        factor.solve_in_place(self.right.as_mut());
        let control = |k: usize| std::array::from_fn(|value| self.right[(k, value)]);
        Ok(Spline {
            grid: self.grid,
            controls: (0..n).map(control).collect(),
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_spline_takes_a_quadratic_with_its_derivatives_exactly() {
        let size = DVec2::new(300.0, 200.0);
        let quadratic = |p: DVec2| 2.0 + 0.1 * p.x - 0.3 * p.y + 0.002 * p.x * p.y + 0.001 * p.y * p.y;
        let places = (0..2500).map(|k| DVec2::new((k % 50) as f64, (k / 50) as f64) / 49.0 * size);
        let values = places.map(|place| (place, [quadratic(place)]));
        let spline = Spline::through(SplineGrid::new(size, 9), values, 1.0, 0.0).unwrap();
        for place in [DVec2::new(11.0, 3.0), DVec2::new(150.0, 199.0), DVec2::new(222.0, 77.0)] {
            let expected = DVec2::new(0.1 + 0.002 * place.y, -0.3 + 0.002 * place.x + 0.002 * place.y);
            let gradient = spline.gradient(place);
            assert!((spline.value(place)[0] - quadratic(place)).abs() < 1e-6);
            assert!(gradient.distance(expected) < 1e-6, "{gradient}");
        }
    }

    #[test]
    fn bending_leaves_planes_alone_and_bends_nothing_else() {
        let size = DVec2::new(300.0, 200.0);
        // Three points determine a plane; without bending 12 x 9 control points would be open.
        let values = [([10.0, 20.0], 1.0), ([250.0, 30.0], 4.0), ([90.0, 180.0], -2.0)];
        let values = values.map(|(place, value)| (place.into(), [value]));
        let spline = Spline::through(SplineGrid::new(size, 9), values, 1.0, 1e-3).unwrap();
        let [a, b] = [[20.0, 30.0], [280.0, 170.0]].map(|place| spline.gradient(place.into()));
        assert!(a.distance(b) < 1e-6, "{a} {b}");
    }
}
