//! Work divided among the threads of the team.

use super::threads::join;
use std::ops::Range;

/// Output that threads write together, each a part of its own.
pub(crate) trait Partition: Send + Sized {
    /// Splits off the first `chunks` chunks.
    fn split(self, chunks: usize) -> [Self; 2];
}

/// Values in chunks of `length`; the first chunk lacks `missing` of them, and the last may be shorter, too.
pub(crate) struct Chunks<'a, T = f32> {
    pub(crate) values: &'a mut [T],
    pub(crate) length: usize,
    pub(crate) missing: usize,
}

impl<'a, T> Chunks<'a, T> {
    /// Divides `values` into chunks of `length` values.
    pub(crate) fn whole(values: &'a mut [T], length: usize) -> Self {
        Self {
            values,
            length,
            missing: 0,
        }
    }
}

impl<T: Send> Partition for Chunks<'_, T> {
    fn split(self, chunks: usize) -> [Self; 2] {
        let (length, missing) = (self.length, self.missing);
        let (above, below) = if chunks == 0 { (0, missing) } else { (missing, 0) };
        let at = (length * chunks - above).min(self.values.len());
        let (first, others) = self.values.split_at_mut(at);
        [(first, above), (others, below)].map(|(values, missing)| Self {
            values,
            length,
            missing,
        })
    }
}

impl<A: Partition, B: Partition> Partition for (A, B) {
    fn split(self, chunks: usize) -> [Self; 2] {
        let ([a, rest_a], [b, rest_b]) = (self.0.split(chunks), self.1.split(chunks));
        [(a, b), (rest_a, rest_b)]
    }
}

/// Divides `chunks` among as many threads as there are scratches: `work` gets a scratch, some of the chunks and their part of `out`.
pub(crate) fn in_parallel<T: Send, O: Partition>(
    scratches: &mut [T],
    chunks: Range<usize>,
    out: O,
    work: &(impl Fn(&mut T, Range<usize>, O) + Sync),
) {
    match scratches {
        [] => {}
        [_] if chunks.is_empty() => {}
        [scratch] => work(scratch, chunks, out),
        _ => {
            let (few, rest) = scratches.split_at_mut(scratches.len() / 2);
            let all = few.len() + rest.len();
            let count = (chunks.len() * few.len()).div_ceil(all);
            let middle = chunks.start + count;
            let [above, below] = out.split(count);
            join(
                || in_parallel(few, chunks.start..middle, above, work),
                || in_parallel(rest, middle..chunks.end, below, work),
            );
        }
    }
}
