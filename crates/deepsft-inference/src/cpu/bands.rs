//! Work shared among threads: each makes a band of a map's rows.

use std::ops::Range;

/// Calls `work` with a scratch, the units `units` of it and their part of `out`, on as many threads as there are scratches. A unit is
/// `length` numbers of `out`, the last may be shorter.
#[cfg(not(target_family = "wasm"))]
pub(crate) fn in_bands<T: Send>(
    scratches: &mut [T],
    units: Range<usize>,
    out: &mut [f32],
    length: usize,
    work: &(impl Fn(&mut T, Range<usize>, &mut [f32]) + Sync),
) {
    match scratches {
        [] => {}
        [scratch] => work(scratch, units, out),
        _ => {
            let (few, rest) = scratches.split_at_mut(scratches.len() / 2);
            let all = few.len() + rest.len();
            let middle = units.start + (units.len() * few.len()).div_ceil(all);
            let at = (length * (middle - units.start)).min(out.len());
            let (above, below) = out.split_at_mut(at);
            rayon::join(
                || in_bands(few, units.start..middle, above, length, work),
                || in_bands(rest, middle..units.end, below, length, work),
            );
        }
    }
}

/// As everywhere, on one thread.
#[cfg(target_family = "wasm")]
pub(crate) fn in_bands<T>(
    scratches: &mut [T],
    units: Range<usize>,
    out: &mut [f32],
    _length: usize,
    work: &impl Fn(&mut T, Range<usize>, &mut [f32]),
) {
    if let Some(scratch) = scratches.first_mut() {
        work(scratch, units, out);
    }
}
