//! Sparse Cholesky factorisation with the symbolic work done once.

use crate::error::{GeometryError, Result};
use faer::dyn_stack::{MemBuffer, MemStack};
use faer::sparse::linalg::SupernodalThreshold;
use faer::sparse::linalg::cholesky::{
    CholeskySymbolicParams, LltRef, SymbolicCholesky, SymbolicCholeskyRaw, SymmetricOrdering,
    factorize_symbolic_cholesky, supernodal::SymbolicSupernodalCholesky,
};
use faer::sparse::{SparseColMatRef, SymbolicSparseColMatRef};
use faer::{Conj, MatMut, Par, Side};
use glam::DVec3;

/// The Cholesky factorisation of symmetric matrices that all have one pattern. Ordering and symbolic
/// analysis happen in [`new`](Self::new), numbers in [`factorize`](Self::factorize), by blocks of columns
/// with the same rows: also for the few hundred points of a mesh that is natively faster than column by column (not in WebAssembly). One thread.
pub(crate) struct SparseCholesky {
    /// Where each column's entries start.
    pub(crate) column_starts: Vec<usize>,
    rows: Vec<usize>,
    symbolic: SymbolicCholesky<usize>,
    factor: Vec<f64>,
    scratch: MemBuffer,
    /// Points in the order of elimination.
    permuted: Vec<DVec3>,
}

impl std::fmt::Debug for SparseCholesky {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "SparseCholesky({} unknowns)", self.dimension())
    }
}

impl SparseCholesky {
    /// Analyses the pattern of the lower triangle, at least one column, in compressed columns: `rows` of column `j` are
    /// `rows[column_starts[j]..column_starts[j + 1]]`, ascending, the diagonal first.
    pub(crate) fn new(column_starts: Vec<usize>, rows: Vec<usize>) -> Result<Self> {
        let n = column_starts.len() - 1;
        let pattern = SymbolicSparseColMatRef::new_checked(n, n, &column_starts, None, &rows);
        let symbolic = factorize_symbolic_cholesky(
            pattern,
            Side::Lower,
            SymmetricOrdering::Amd,
            CholeskySymbolicParams {
                // Below the ratio of any matrix, diagonal ones (0) included.
                supernodal_flop_ratio_threshold: SupernodalThreshold(-1.0),
                ..CholeskySymbolicParams::default()
            },
        )
        .map_err(|_| GeometryError::Singular(n))?;
        let factor = vec![0.0; symbolic.len_val()];
        let scratch = MemBuffer::new(
            symbolic
                .factorize_numeric_llt_scratch::<f64>(Par::Seq, Default::default())
                .or(symbolic.solve_in_place_scratch::<f64>(3, Par::Seq)),
        );
        Ok(Self {
            column_starts,
            rows,
            symbolic,
            factor,
            scratch,
            permuted: vec![DVec3::ZERO; n],
        })
    }

    pub(crate) fn dimension(&self) -> usize {
        self.column_starts.len() - 1
    }

    /// Factorises the matrix whose lower triangle has `values`, in the pattern's order. [`GeometryError::Singular`] when it
    /// is not positive definite; then there is nothing to [`solve`](Self::solve) with.
    pub(crate) fn factorize(&mut self, values: &[f64]) -> Result<()> {
        let n = self.dimension();
        let pattern = SymbolicSparseColMatRef::new_checked(n, n, &self.column_starts, None, &self.rows);
        let matrix = SparseColMatRef::new(pattern, values);
        let stack = MemStack::new(&mut self.scratch);
        self.symbolic
            .factorize_numeric_llt(
                &mut self.factor,
                matrix,
                Side::Lower,
                Default::default(),
                Par::Seq,
                stack,
                Default::default(),
            )
            .map_err(|_| GeometryError::Singular(n))?;
        Ok(())
    }

    /// Solves for the right-hand sides in `columns` (one to three vectors, one after the other) in place.
    pub(crate) fn solve(&mut self, columns: &mut [f64]) {
        let n = self.dimension();
        let count = columns.len().checked_div(n).unwrap_or(0);
        let right_hand_sides = MatMut::from_column_major_slice_mut(columns, n, count);
        LltRef::new(&self.symbolic, &self.factor).solve_in_place_with_conj(
            Conj::No,
            right_hand_sides,
            Par::Seq,
            MemStack::new(&mut self.scratch),
        );
    }

    /// Solves for three right-hand sides that are the coordinates of points. Entry by entry: on the factors of
    /// surface meshes, whose blocks are small, twice as fast as [`solve`](Self::solve).
    pub(crate) fn solve_points(&mut self, right_hand_side: &[DVec3], solution: &mut [DVec3]) {
        let mut points = std::mem::take(&mut self.permuted);
        for (k, point) in points.iter_mut().enumerate() {
            *point = right_hand_side[self.matrix_column(k)];
        }
        for block in 0..self.supernodes().n_supernodes() {
            let (start, rows, columns) = self.columns(block);
            for (c, (within, below)) in columns.enumerate() {
                let (point, after) = points[start + c..].split_at_mut(1);
                point[0] /= within[0];
                for (other, entry) in after.iter_mut().zip(&within[1..]) {
                    *other -= *entry * point[0];
                }
                let point = point[0];
                for (&row, entry) in rows.iter().zip(below) {
                    points[row] -= *entry * point;
                }
            }
        }
        for block in (0..self.supernodes().n_supernodes()).rev() {
            let (start, rows, columns) = self.columns(block);
            for (c, (within, below)) in columns.enumerate().rev() {
                let at = start + c;
                let mut point = points[at];
                for (other, entry) in points[at + 1..].iter().zip(&within[1..]) {
                    point -= *entry * *other;
                }
                for (&row, entry) in rows.iter().zip(below) {
                    point -= *entry * points[row];
                }
                points[at] = point / within[0];
            }
        }
        for (k, point) in points.iter().enumerate() {
            solution[self.matrix_column(k)] = *point;
        }
        self.permuted = points;
    }

    fn supernodes(&self) -> &SymbolicSupernodalCholesky<usize> {
        match self.symbolic.raw() {
            SymbolicCholeskyRaw::Supernodal(supernodes) => supernodes,
            SymbolicCholeskyRaw::Simplicial(_) => unreachable!("the threshold asks for supernodes"),
        }
    }

    /// Some columns of the factor that have the same rows below them: the first column, these rows, and of each column the entries from its
    /// diagonal down to the last of the columns, and in these rows.
    fn columns(
        &self,
        block: usize,
    ) -> (
        usize,
        &[usize],
        impl DoubleEndedIterator<Item = (&[f64], &[f64])> + ExactSizeIterator,
    ) {
        let supernodes = self.supernodes();
        let start = supernodes.supernode_begin()[block];
        let rows = supernodes.col_ptr_for_row_idx()[block]..supernodes.col_ptr_for_row_idx()[block + 1];
        let entries = supernodes.col_ptr_for_val()[block]..supernodes.col_ptr_for_val()[block + 1];
        let (count, rows) = (supernodes.supernode_end()[block] - start, &supernodes.row_idx()[rows]);
        let columns = self.factor[entries].chunks_exact(count + rows.len()).enumerate();
        let parts = columns.map(move |(c, column)| (&column[c..count], &column[count..]));
        (start, rows, parts)
    }

    /// Column of the factor -> column of the matrix.
    fn matrix_column(&self, k: usize) -> usize {
        self.symbolic.perm().map_or(k, |p| p.arrays().0[k])
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A grid of m x m vertices joined to their neighbours, the first tied to the ground.
    fn grid(m: usize) -> (SparseCholesky, Vec<f64>) {
        let (mut starts, mut rows, mut values) = (vec![0], vec![], vec![]);
        for i in 0..m * m {
            let (x, y) = (i % m, i / m);
            rows.push(i);
            values.push(if i == 0 { 5.0 } else { 4.0 });
            let neighbours = [(x + 1 < m, i + 1), (y + 1 < m && x > 0, i + m - 1), (y + 1 < m, i + m)];
            for (_, j) in neighbours.into_iter().filter(|n| n.0) {
                rows.push(j);
                values.push(-0.6);
            }
            starts.push(rows.len());
        }
        (SparseCholesky::new(starts, rows).unwrap(), values)
    }

    fn product(cholesky: &SparseCholesky, values: &[f64], x: &[f64]) -> Vec<f64> {
        let mut product = vec![0.0; x.len()];
        for (column, ends) in cholesky.column_starts.windows(2).enumerate() {
            let entries = ends[0]..ends[1];
            for (&row, value) in cholesky.rows[entries.clone()].iter().zip(&values[entries]) {
                product[row] += value * x[column];
                if row != column {
                    product[column] += value * x[row];
                }
            }
        }
        product
    }

    #[test]
    fn columns_and_points_are_solved_for_in_small_and_large_factors_and_new_numbers_need_no_new_analysis() {
        for m in [1, 5, 140] {
            let (mut cholesky, mut values) = grid(m);
            let n = m * m;
            let point = |i: usize| DVec3::new(1.0, i as f64 / n as f64, (i as f64).sin());
            let points: Vec<DVec3> = (0..n).map(point).collect();
            for _ in 0..2 {
                values[0] += 1.0;
                cholesky.factorize(&values).unwrap();
                let right: Vec<f64> = (0..3).flat_map(|k| points.iter().map(move |p| p[k])).collect();
                let mut columns = right.clone();
                cholesky.solve(&mut columns);
                for (x, b) in columns.chunks(n).zip(right.chunks(n)) {
                    let product = product(&cholesky, &values, x);
                    assert!(product.iter().zip(b).all(|(p, b)| (p - b).abs() < 1e-10));
                }
                let mut solution = vec![DVec3::ZERO; n];
                cholesky.solve_points(&points, &mut solution);
                for (i, point) in solution.iter().enumerate() {
                    let expected = DVec3::new(columns[i], columns[n + i], columns[2 * n + i]);
                    assert!(point.distance(expected) < 1e-10 * expected.length(), "{i}");
                }
            }
        }
    }

    #[test]
    fn a_matrix_that_is_not_positive_definite_is_refused() {
        let (mut cholesky, mut values) = grid(7);
        values[0] = -1.0;
        assert!(cholesky.factorize(&values).is_err());
    }
}
