//! Work shared among threads: each makes a band of a map's rows.

use std::ops::Range;
#[cfg(not(target_family = "wasm"))]
use std::sync::atomic::{AtomicBool, Ordering};

/// Threads that a network can use: as many as rayon's pool has, at most 8; one in a browser.
#[cfg(not(target_family = "wasm"))]
pub fn available_threads() -> usize {
    rayon::current_num_threads().min(super::MOST_THREADS)
}

/// Threads that a network can use: one.
#[cfg(target_family = "wasm")]
pub fn available_threads() -> usize {
    1
}

/// Divides the units `units` among as many threads as there are scratches: `work` gets a scratch, some of the units and their part of
/// `out`, of which a unit has `length` values, the first `missing` fewer, the last perhaps fewer, too.
#[cfg(not(target_family = "wasm"))]
pub(crate) fn in_bands<T: Send>(
    scratches: &mut [T],
    units: Range<usize>,
    out: &mut [f32],
    [length, missing]: [usize; 2],
    work: &(impl Fn(&mut T, Range<usize>, &mut [f32]) + Sync),
) {
    match scratches {
        [] => {}
        [_] if units.is_empty() => {}
        [scratch] => work(scratch, units, out),
        _ => {
            let (few, rest) = scratches.split_at_mut(scratches.len() / 2);
            let all = few.len() + rest.len();
            let middle = units.start + (units.len() * few.len()).div_ceil(all);
            let missing_below = if middle > units.start { 0 } else { missing };
            let at = length * (middle - units.start) - (missing - missing_below);
            let (above, below) = out.split_at_mut(at.min(out.len()));
            rayon::join(
                || in_bands(few, units.start..middle, above, [length, missing], work),
                || in_bands(rest, middle..units.end, below, [length, missing_below], work),
            );
        }
    }
}

/// How often a thread looks for work before it lets others go first. After a pause both threads may begin on one core: then the one
/// that waits holds the one that works up, until the system moves it.
#[cfg(not(target_family = "wasm"))]
const TRIES: u32 = 1_000;

/// Does `work` in rayon's pool and keeps `threads` of its threads awake meanwhile: what is shared in bands takes less time than
/// a thread needs to wake up.
#[cfg(not(target_family = "wasm"))]
pub(crate) fn awake<R: Send>(threads: usize, work: impl FnOnce() -> R + Send) -> R {
    /// Says so when it is dropped, also after a panic.
    struct Done<'a>(&'a AtomicBool);
    impl Drop for Done<'_> {
        fn drop(&mut self) {
            self.0.store(true, Ordering::Release);
        }
    }
    fn wait(threads: usize, done: &AtomicBool) {
        if threads > 1 {
            rayon::join(|| wait(1, done), || wait(threads - 1, done));
            return;
        }
        let mut in_vain = 0;
        while !done.load(Ordering::Acquire) {
            if rayon::yield_now() == Some(rayon::Yield::Executed) {
                in_vain = 0;
            } else if in_vain < TRIES {
                in_vain += 1;
                std::hint::spin_loop();
            } else {
                std::thread::yield_now();
            }
        }
    }
    if threads <= 1 {
        return work();
    }
    let done = AtomicBool::new(false);
    let work = || {
        let _done = Done(&done);
        work()
    };
    rayon::join(work, || wait(threads - 1, &done)).0
}

/// There is one thread.
#[cfg(target_family = "wasm")]
pub(crate) fn awake<R>(_threads: usize, work: impl FnOnce() -> R) -> R {
    work()
}

/// WebAssembly has one thread here: it does all units.
#[cfg(target_family = "wasm")]
pub(crate) fn in_bands<T>(
    scratches: &mut [T],
    units: Range<usize>,
    out: &mut [f32],
    _lengths: [usize; 2],
    work: &impl Fn(&mut T, Range<usize>, &mut [f32]),
) {
    if let Some(scratch) = scratches.first_mut() {
        work(scratch, units, out);
    }
}
