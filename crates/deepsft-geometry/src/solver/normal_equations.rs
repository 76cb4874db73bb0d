//! The Gauss-Newton system of a mesh in blocks of 3 x 3.

use super::cholesky::SparseCholesky;
use super::energy::ResidualSink;
use crate::error::Result;
use glam::{DMat3, DVec3};

/// J^T W J (lower triangle, blocks of 3 x 3) and J^T W r of residuals over n vertices. Which pairs of
/// vertices may share a residual is fixed when it is made.
#[derive(Debug)]
pub(crate) struct NormalEquations {
    /// Blocks of vertex column j: `rows[starts[j]..starts[j + 1]]`, ascending, the diagonal first.
    starts: Vec<usize>,
    rows: Vec<usize>,
    blocks: Vec<DMat3>,
    /// J^T W r: half the gradient of the energy.
    pub(crate) gradient: Vec<DVec3>,
    cholesky: SparseCholesky,
    values: Vec<f64>,
    /// Whether a residual coupled vertices outside the pattern since [`clear`](Self::clear).
    pub(crate) outside: bool,
    /// The triangle whose residuals were added last, and its blocks: residuals of one triangle follow each other.
    triangle: ([usize; 3], [usize; 6]),
}

/// Steps of the iteration that finds the softest modes: near ones are as good.
const MODE_ITERATIONS: usize = 8;

/// No triangle.
const NONE: [usize; 3] = [usize::MAX; 3];

impl NormalEquations {
    /// For `vertices` vertices and the coupled `pairs` (any order, any number of times).
    pub(crate) fn new(vertices: usize, mut pairs: Vec<[usize; 2]>) -> Result<Self> {
        for pair in &mut pairs {
            // Column first, so that sorting goes column by column.
            pair.sort_unstable();
        }
        pairs.extend((0..vertices).map(|i| [i, i]));
        pairs.sort_unstable();
        pairs.dedup();
        let start = |j: usize| pairs.partition_point(|[column, _]| *column < j);
        let starts: Vec<usize> = (0..=vertices).map(start).collect();
        let rows: Vec<usize> = pairs.iter().map(|p| p[1]).collect();
        let (mut scalar_starts, mut scalar_rows) = (vec![0], Vec::with_capacity(9 * rows.len()));
        for j in 0..vertices {
            for c in 0..3 {
                for &i in &rows[starts[j]..starts[j + 1]] {
                    let first = if i == j { c } else { 0 };
                    scalar_rows.extend((first..3).map(|r| 3 * i + r));
                }
                scalar_starts.push(scalar_rows.len());
            }
        }
        Ok(Self {
            values: vec![0.0; scalar_rows.len()],
            blocks: vec![DMat3::ZERO; rows.len()],
            gradient: vec![DVec3::ZERO; vertices],
            cholesky: SparseCholesky::new(scalar_starts, scalar_rows)?,
            starts,
            rows,
            outside: false,
            triangle: (NONE, [0; 6]),
        })
    }

    /// Position of the block of two vertices, if they are coupled.
    fn block(&self, a: usize, b: usize) -> Option<usize> {
        let (column, row) = (a.min(b), a.max(b));
        let (start, end) = (self.starts[column], self.starts[column + 1]);
        self.rows[start..end].binary_search(&row).ok().map(|k| start + k)
    }

    pub(crate) fn clear(&mut self) {
        self.blocks.fill(DMat3::ZERO);
        self.gradient.fill(DVec3::ZERO);
        self.outside = false;
    }

    /// The diagonal of J^T W J, one vector per vertex.
    pub(crate) fn diagonal(&self) -> impl Iterator<Item = DVec3> + '_ {
        self.starts[..self.gradient.len()].iter().map(|&start| {
            let d = &self.blocks[start];
            DVec3::new(d.x_axis.x, d.y_axis.y, d.z_axis.z)
        })
    }

    /// Factorises J^T W J with `added` on its diagonal; an error when it is not positive definite.
    pub(crate) fn factorize(&mut self, added: &[DVec3]) -> Result<()> {
        let mut next = 0;
        for (j, added) in added.iter().enumerate() {
            let added = added.to_array();
            for (c, added) in added.into_iter().enumerate() {
                for k in self.starts[j]..self.starts[j + 1] {
                    let column = self.blocks[k].col(c).to_array();
                    let first = if k == self.starts[j] { c } else { 0 };
                    self.values[next..next + 3 - first].copy_from_slice(&column[first..]);
                    if k == self.starts[j] {
                        self.values[next] += added;
                    }
                    next += 3 - first;
                }
            }
        }
        self.cholesky.factorize(&self.values)
    }

    /// The step -(J^T W J + added)^-1 J^T W r of the last factorisation.
    pub(crate) fn step(&mut self) -> Vec<DVec3> {
        step_against(&mut self.cholesky, &self.gradient)
    }

    /// -(J^T W J + added)^-1 `gradient` of the last factorisation.
    pub(crate) fn step_against(&mut self, gradient: &[DVec3]) -> Vec<DVec3> {
        step_against(&mut self.cholesky, gradient)
    }

    /// The blocks of the vertices in the inverse of the matrix that was factorised last: their covariances.
    pub(crate) fn inverse_blocks(&mut self) -> Vec<DMat3> {
        let n = 3 * self.gradient.len();
        let block = |vertex: usize| {
            let mut columns = vec![0.0; 3 * n];
            (0..3).for_each(|k| columns[k * n + 3 * vertex + k] = 1.0);
            self.cholesky.solve(&mut columns);
            let column = |k: usize| DVec3::from_slice(&columns[k * n + 3 * vertex..]);
            DMat3::from_cols(column(0), column(1), column(2))
        };
        (0..self.gradient.len()).map(block).collect()
    }

    /// The eigenvectors of the N largest eigenvalues of the inverse of the matrix that was factorised last: the unit motions along which the
    /// energy grows least, the softest first, each with the root of its eigenvalue, its standard deviation. By orthogonal iteration (Golub
    /// and Van Loan, Matrix Computations, 8.2.4). `None` where numbers fail.
    pub(crate) fn softest_modes<const N: usize>(&mut self) -> Option<[(Vec<DVec3>, f64); N]> {
        let dot = |a: &[DVec3], b: &[DVec3]| a.iter().zip(b).map(|(a, b)| a.dot(*b)).sum::<f64>();
        // Any motions will do that are not orthogonal to the modes.
        let noise = |k: usize, v: usize| DVec3::new(1.0, 2.0, 3.0).map(|axis| ((k + 1) as f64 * axis * v as f64).sin());
        let mut modes = std::array::from_fn(|k| {
            let motion = (0..self.gradient.len()).map(|v| noise(k, v));
            (motion.collect::<Vec<DVec3>>(), 0.0)
        });
        for _ in 0..MODE_ITERATIONS {
            for k in 0..N {
                let (softer, rest) = modes.split_at_mut(k);
                let (motion, deviation) = &mut rest[0];
                *motion = self.step_against(motion);
                for (other, _) in softer {
                    let along = dot(other, motion);
                    motion.iter_mut().zip(other).for_each(|(m, o)| *m -= along * *o);
                }
                let length = dot(motion, motion).sqrt();
                motion.iter_mut().for_each(|m| *m /= length);
                *deviation = length.sqrt();
            }
        }
        let is_told = modes.iter().all(|(_, deviation): &(_, f64)| deviation.is_finite());
        is_told.then_some(modes)
    }

    /// Blocks of the pairs of a triangle's vertices, in the order of two nested loops; `None` where some are not coupled.
    fn blocks_of(&mut self, triangle: [usize; 3]) -> Option<[usize; 6]> {
        if self.triangle.0 != triangle {
            let [a, b, c] = triangle;
            let mut blocks = [0; 6];
            for (block, (a, b)) in blocks.iter_mut().zip([(a, a), (a, b), (a, c), (b, b), (b, c), (c, c)]) {
                *block = self.block(a, b)?;
            }
            self.triangle = (triangle, blocks);
        }
        Some(self.triangle.1)
    }

    fn add(&mut self, a: usize, b: usize, outer: DMat3) {
        match self.block(a, b) {
            Some(k) => self.blocks[k] += outer,
            None => self.outside = true,
        }
    }
}

fn step_against(cholesky: &mut SparseCholesky, gradient: &[DVec3]) -> Vec<DVec3> {
    let mut flat: Vec<f64> = gradient.iter().flat_map(|g| (-*g).to_array()).collect();
    cholesky.solve(&mut flat);
    flat.chunks_exact(3).map(DVec3::from_slice).collect()
}

impl ResidualSink for NormalEquations {
    fn scalar(&mut self, residual: f64, weight: f64, gradient: &[(usize, DVec3)]) {
        if let &[(a, _), (b, _), (c, _)] = gradient
            && let Some(blocks) = self.blocks_of([a, b, c])
        {
            let mut blocks = blocks.into_iter();
            for (k, &(a, ga)) in gradient.iter().enumerate() {
                let weighted = weight * ga;
                self.gradient[a] += residual * weighted;
                for (&(b, gb), block) in gradient[k..].iter().zip(blocks.by_ref()) {
                    let (row, column) = if a > b { (weighted, gb) } else { (weight * gb, ga) };
                    self.blocks[block] += DMat3::from_cols(row * column.x, row * column.y, row * column.z);
                }
            }
            return;
        }
        for (k, &(a, ga)) in gradient.iter().enumerate() {
            self.gradient[a] += weight * residual * ga;
            for &(b, gb) in &gradient[k..] {
                // Rows belong to the larger index.
                let (row, column) = if a > b { (ga, gb) } else { (gb, ga) };
                let row = weight * row;
                self.add(a, b, DMat3::from_cols(row * column.x, row * column.y, row * column.z));
            }
        }
    }

    fn vector(&mut self, residual: DVec3, weight: f64, coefficients: &[(usize, f64)]) {
        for (k, &(a, ca)) in coefficients.iter().enumerate() {
            self.gradient[a] += weight * ca * residual;
            for &(b, cb) in &coefficients[k..] {
                self.add(a, b, DMat3::from_diagonal(DVec3::splat(weight * ca * cb)));
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_step_solves_the_normal_equations_of_two_residuals_by_hand() {
        // x0 = 3 (weight 2) and n . (p1 - p0) = 4 with n = (1, 2, 2) / 3 from p = 0, damped by 1: worked
        // out below by applying the matrix to the step.
        let mut equations = NormalEquations::new(2, vec![[1, 0]]).unwrap();
        let n = DVec3::new(1.0, 2.0, 2.0) / 3.0;
        equations.vector(DVec3::new(-3.0, 0.0, 0.0), 2.0, &[(0, 1.0)]);
        equations.scalar(-4.0, 1.0, &[(1, n), (0, -n)]);
        equations.factorize(&[DVec3::ONE; 2]).unwrap();
        let step = equations.step();
        let along = n.dot(step[1] - step[0]) - 4.0;
        let zero = 2.0 * (step[0] - DVec3::new(3.0, 0.0, 0.0)) - n * along + step[0];
        let one = n * along + step[1];
        assert!(zero.length() < 1e-12 && one.length() < 1e-12, "{zero} {one}");
        assert!(!equations.outside);
        // The same matrix, column by column: a block of its inverse is what unit vectors of that vertex are solved to.
        for vertex in [0, 1] {
            let unit = |axis: DVec3| [0, 1].map(|v| if v == vertex { -axis } else { DVec3::ZERO });
            let columns = DVec3::AXES.map(|axis| equations.step_against(&unit(axis))[vertex]);
            let inverse = DMat3::from_cols(columns[0], columns[1], columns[2]);
            assert!(equations.inverse_blocks()[vertex].abs_diff_eq(inverse, 1e-12));
        }
    }

    #[test]
    fn residuals_of_triangles_count_as_those_of_any_vertices_do() {
        let pairs = (0..5).flat_map(|a| (a..5).map(move |b| [a, b])).collect::<Vec<_>>();
        let mut all = [0, 1].map(|_| NormalEquations::new(5, pairs.clone()).unwrap());
        let gradient = |v: usize, k: usize| (v, DVec3::new(v as f64 - 1.3, 0.7 * k as f64, (v * k) as f64 + 0.2));
        for (k, [a, b, c]) in [[4, 0, 2], [4, 0, 2], [1, 2, 3], [4, 0, 2]].into_iter().enumerate() {
            let triangle = [gradient(a, k), gradient(b, k), gradient(c, k)];
            all[0].scalar(0.3 + k as f64, 1.5, &triangle);
            // A fourth vertex without gradient adds nothing.
            let [x, y, z] = triangle;
            let other = (0..5).find(|v| ![a, b, c].contains(v)).unwrap();
            all[1].scalar(0.3 + k as f64, 1.5, &[x, y, z, (other, DVec3::ZERO)]);
        }
        let [triangles, any] = all;
        let blocks = triangles.blocks.iter().zip(&any.blocks);
        assert!(blocks.clone().any(|(a, _)| *a != DMat3::ZERO));
        assert!(blocks.into_iter().all(|(a, b)| a.abs_diff_eq(*b, 1e-12)));
        let gradients = triangles.gradient.iter().zip(&any.gradient);
        assert!(gradients.into_iter().all(|(a, b)| a.abs_diff_eq(*b, 1e-12)));
    }
}
