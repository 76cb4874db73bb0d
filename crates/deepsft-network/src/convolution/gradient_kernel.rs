//! The kernel of the filters' gradient: products along places, all sums in registers.

use pulp::Simd;

/// Rows that are summed together: channels of what is read.
pub const TOGETHER: usize = 8;

/// What is read and its gradient at positions in lines.
pub struct GradientKernel<'a> {
    /// What is read: [`TOGETHER`] numbers of every place.
    pub read: &'a [f32],
    /// From one place to the next, and from one line to the next.
    pub step: usize,
    pub line: usize,
    /// The gradient: `pitch` numbers of every place.
    pub gradient: &'a [f32],
    pub pitch: usize,
    /// From one line to the next.
    pub row: usize,
    /// Lines, and places of a line.
    pub rows: usize,
    pub columns: usize,
}

impl GradientKernel<'_> {
    /// Adds the products of what is read and the gradient over all places: `sums` [`TOGETHER`, `pitch`].
    #[inline(always)]
    pub fn add_to<S: Simd>(&self, simd: S, sums: &mut [f32]) {
        let mut first = 0;
        while first < self.pitch {
            // The sums, the vectors of the gradient and one number have to fit into the registers: 32 of them, or 16.
            first += match S::F32_LANES {
                16 if self.pitch - first >= 32 => self.add::<S, 8, 2>(simd, first, sums),
                16 => self.add::<S, 8, 1>(simd, first, sums),
                _ => self.add::<S, 4, 2>(simd, first, sums),
            };
        }
    }

    /// The same for the numbers of the gradient from `first` on; returns how many.
    #[inline(always)]
    fn add<S: Simd, const ROWS: usize, const VECTORS: usize>(&self, simd: S, first: usize, sums: &mut [f32]) -> usize {
        let numbers = VECTORS * S::F32_LANES;
        for start in (0..TOGETHER).step_by(ROWS) {
            let mut totals = [[simd.splat_f32s(0.0); VECTORS]; ROWS];
            for line in 0..self.rows {
                let read = self.read[line * self.line + start..].chunks(self.step);
                let gradient = self.gradient[line * self.row + first..].chunks(self.pitch);
                for (read, gradient) in read.zip(gradient).take(self.columns) {
                    let (read, gradient) = (&read[..ROWS], &S::as_simd_f32s(&gradient[..numbers]).0[..VECTORS]);
                    for (totals, &number) in totals.iter_mut().zip(read) {
                        let number = simd.splat_f32s(number);
                        for (total, &gradient) in totals.iter_mut().zip(gradient) {
                            *total = simd.mul_add_e_f32s(number, gradient, *total);
                        }
                    }
                }
            }
            for (r, totals) in totals.iter().enumerate() {
                let sums = &mut sums[(start + r) * self.pitch + first..][..numbers];
                for (sum, &total) in S::as_mut_simd_f32s(sums).0.iter_mut().zip(totals) {
                    *sum = simd.add_f32s(*sum, total);
                }
            }
        }
        numbers
    }
}
