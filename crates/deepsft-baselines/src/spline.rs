//! Bicubic B-splines over a sheet: the warps and depths of analytical Shape-from-Template (Rueckert et al. 1999; Brunet et al. 2014).

use anyhow::{Context, Result};
use deepsft_geometry::glam::{DMat2, DVec2};
use faer::linalg::solvers::Solve;
use faer::{Mat, Side};

/// Ridge on control points, as a fraction of the largest diagonal entry: settles what neither data nor bending do.
const RIDGE: f64 = 1e-13;

/// Abscissae of Gauss-Legendre quadrature by two points.
const GAUSS: [f64; 2] = [0.211_324_865_405_187_1, 0.788_675_134_594_812_9];

/// How often a basis is differentiated along x and along y.
type Order = [usize; 2];

/// Control points that a basis row touches, with their weights.
type Row = [(usize, f64); 16];

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

    /// Weights of the control points in the value, or a derivative per mm, at `place` (mm from the sheet's corner).
    fn row(&self, place: DVec2, order: Order) -> Row {
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
}

impl Spline<1> {
    /// The gradient at `place`, per mm.
    pub fn gradient(&self, place: DVec2) -> DVec2 {
        DVec2::new(self.at(place, [1, 0])[0], self.at(place, [0, 1])[0])
    }
}

impl Spline<2> {
    /// The Jacobian at `place`, per mm: its columns are the derivatives along x and y.
    pub fn jacobian(&self, place: DVec2) -> DMat2 {
        DMat2::from_cols(self.at(place, [1, 0]).into(), self.at(place, [0, 1]).into())
    }
}

/// A linear least-squares problem for the control points of a spline.
#[derive(Debug)]
pub struct SplineFit<const N: usize> {
    grid: SplineGrid,
    normal: Mat<f64>,
    right: Mat<f64>,
}

impl<const N: usize> SplineFit<N> {
    /// The problem without data.
    pub fn new(grid: SplineGrid) -> Self {
        let n = grid.controls();
        Self {
            grid,
            normal: Mat::zeros(n, n),
            right: Mat::zeros(n, N),
        }
    }

    fn add(&mut self, row: &Row, weight: f64, value: [f64; N]) {
        for &(a, wa) in row {
            for &(b, wb) in row {
                self.normal[(a, b)] += weight * wa * wb;
            }
            for (k, value) in value.into_iter().enumerate() {
                self.right[(a, k)] += weight * wa * value;
            }
        }
    }

    /// Asks for a value at `place`, mm.
    pub fn add_value(&mut self, place: DVec2, weight: f64, value: [f64; N]) {
        self.add(&self.grid.row(place, [0, 0]), weight, value);
    }

    /// Adds `weight` times the bending energy, the integral of the squared second derivatives times the squared diagonal: a spline bends
    /// as dear on a large sheet as on a small one.
    pub fn add_bending(&mut self, weight: f64) {
        let cell = self.grid.size_mm / DVec2::new(self.grid.cells[0] as f64, self.grid.cells[1] as f64);
        let per_point = weight * self.grid.size_mm.length_squared() * cell.element_product() / 4.0;
        for k in 0..self.grid.cells[0] * self.grid.cells[1] {
            let corner = DVec2::new((k % self.grid.cells[0]) as f64, (k / self.grid.cells[0]) as f64);
            for at in GAUSS.iter().flat_map(|&x| GAUSS.map(|y| DVec2::new(x, y))) {
                for (order, times) in [([2, 0], 1.0), ([1, 1], 2.0), ([0, 2], 1.0)] {
                    let row = self.grid.row((corner + at) * cell, order);
                    self.add(&row, times * per_point, [0.0; N]);
                }
            }
        }
    }

    /// The spline that satisfies the problem best.
    ///
    /// # Errors
    /// When data and bending leave the control points open.
    pub fn solve(mut self) -> Result<Spline<N>> {
        let n = self.grid.controls();
        let largest = (0..n).map(|k| self.normal[(k, k)]).fold(0.0, f64::max);
        for k in 0..n {
            self.normal[(k, k)] += RIDGE * largest;
        }
        let factor = self.normal.llt(Side::Lower).ok();
        factor
            .context("the spline is not determined by its data")?
            .solve_in_place(self.right.as_mut());
        let control = |k: usize| std::array::from_fn(|value| self.right[(k, value)]);
        Ok(Spline {
            grid: self.grid,
            controls: (0..n).map(control).collect(),
        })
    }
}

impl SplineFit<1> {
    /// Asks for a gradient at `place`, per mm.
    pub fn add_gradient(&mut self, place: DVec2, weight: f64, gradient: DVec2) {
        self.add(&self.grid.row(place, [1, 0]), weight, [gradient.x]);
        self.add(&self.grid.row(place, [0, 1]), weight, [gradient.y]);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_spline_takes_a_quadratic_with_its_derivatives_exactly() {
        let size = DVec2::new(300.0, 200.0);
        let quadratic = |p: DVec2| 2.0 + 0.1 * p.x - 0.3 * p.y + 0.002 * p.x * p.y + 0.001 * p.y * p.y;
        let mut fit = SplineFit::<1>::new(SplineGrid::new(size, 9));
        for k in 0..2500 {
            let place = DVec2::new((k % 50) as f64, (k / 50) as f64) / 49.0 * size;
            fit.add_value(place, 1.0, [quadratic(place)]);
        }
        let spline = fit.solve().unwrap();
        for place in [DVec2::new(11.0, 3.0), DVec2::new(150.0, 199.0), DVec2::new(222.0, 77.0)] {
            let gradient = DVec2::new(0.1 + 0.002 * place.y, -0.3 + 0.002 * place.x + 0.002 * place.y);
            assert!((spline.value(place)[0] - quadratic(place)).abs() < 1e-6);
            assert!(
                spline.gradient(place).distance(gradient) < 1e-6,
                "{}",
                spline.gradient(place)
            );
        }
    }

    #[test]
    fn bending_leaves_planes_alone_and_bends_nothing_else() {
        let size = DVec2::new(300.0, 200.0);
        let mut fit = SplineFit::<1>::new(SplineGrid::new(size, 9));
        // Three points determine a plane; without bending 12 x 9 control points would be open.
        for (place, value) in [([10.0, 20.0], 1.0), ([250.0, 30.0], 4.0), ([90.0, 180.0], -2.0)] {
            fit.add_value(place.into(), 1.0, [value]);
        }
        fit.add_bending(1e-3);
        let spline = fit.solve().unwrap();
        let [a, b] = [
            spline.gradient(DVec2::new(20.0, 30.0)),
            spline.gradient(DVec2::new(280.0, 170.0)),
        ];
        assert!(a.distance(b) < 1e-6, "{a} {b}");
    }
}
