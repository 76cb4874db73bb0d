//! Work shared among threads: each makes a band of a map's rows.

#[cfg(not(target_family = "wasm"))]
mod apart;

use std::ops::Range;
#[cfg(not(target_family = "wasm"))]
use {
    apart::Cores,
    rayon::join,
    std::sync::atomic::{AtomicBool, Ordering},
};

/// Threads that a network can use: as many as rayon's pool has, at most 8; one in a browser.
#[cfg(not(target_family = "wasm"))]
pub fn available_threads() -> usize {
    rayon::current_num_threads().min(super::MAX_THREADS)
}

/// Threads that a network can use: one.
#[cfg(target_family = "wasm")]
pub fn available_threads() -> usize {
    1
}

/// What several threads write, each a part of its own.
pub(crate) trait Shared: Send + Sized {
    /// The first `units` units, and the others.
    fn split(self, units: usize) -> [Self; 2];
}

/// Numbers of units of `length` each, the first of which `missing` fewer, the last perhaps fewer, too.
pub(crate) struct Units<'a> {
    pub(crate) values: &'a mut [f32],
    pub(crate) length: usize,
    pub(crate) missing: usize,
}

impl<'a> Units<'a> {
    /// Units of `length` numbers.
    pub(crate) fn whole(values: &'a mut [f32], length: usize) -> Self {
        let missing = 0;
        Self {
            values,
            length,
            missing,
        }
    }
}

impl Shared for Units<'_> {
    fn split(self, units: usize) -> [Self; 2] {
        let Self {
            values,
            length,
            missing,
        } = self;
        let (above, below) = if units == 0 { (0, missing) } else { (missing, 0) };
        let at = (length * units - above).min(values.len());
        let (first, others) = values.split_at_mut(at);
        [(first, above), (others, below)].map(|(values, missing)| Self {
            values,
            length,
            missing,
        })
    }
}

/// One after the other: there is one thread.
#[cfg(target_family = "wasm")]
fn join<A, B>(a: impl FnOnce() -> A, b: impl FnOnce() -> B) -> (A, B) {
    (a(), b())
}

/// Divides the units `units` among as many threads as there are scratches: `work` gets a scratch, some of the units and their part of
/// `out`.
pub(crate) fn in_bands<T: Send, O: Shared>(
    scratches: &mut [T],
    units: Range<usize>,
    out: O,
    work: &(impl Fn(&mut T, Range<usize>, O) + Sync),
) {
    match scratches {
        [] => {}
        [_] if units.is_empty() => {}
        [scratch] => work(scratch, units, out),
        _ => {
            let (few, rest) = scratches.split_at_mut(scratches.len() / 2);
            let all = few.len() + rest.len();
            let count = (units.len() * few.len()).div_ceil(all);
            let middle = units.start + count;
            let [above, below] = out.split(count);
            join(
                || in_bands(few, units.start..middle, above, work),
                || in_bands(rest, middle..units.end, below, work),
            );
        }
    }
}

/// How often a thread looks for work before it lets others go first.
#[cfg(not(target_family = "wasm"))]
const TRIES: u32 = 1_000;

/// Does `work` in rayon's pool and keeps `threads` of its threads awake meanwhile, each on a core of its own: what is shared in bands
/// takes less time than a thread needs to wake up.
#[cfg(not(target_family = "wasm"))]
pub(crate) fn awake<R: Send>(threads: usize, work: impl FnOnce() -> R + Send) -> R {
    /// Says so when it is dropped, also after a panic.
    struct Done<'a>(&'a AtomicBool);
    impl Drop for Done<'_> {
        fn drop(&mut self) {
            self.0.store(true, Ordering::Release);
        }
    }
    fn wait(threads: usize, cores: &Cores, done: &AtomicBool) {
        if threads > 1 {
            join(|| wait(1, cores, done), || wait(threads - 1, cores, done));
            return;
        }
        // Where nobody else took this on, the work is done.
        if done.load(Ordering::Acquire) {
            return;
        }
        let _kept = cores.keep();
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
    let (done, cores) = (AtomicBool::new(false), Cores::new());
    let work = || {
        let (_done, _kept) = (Done(&done), cores.keep());
        // Who was woken on this core can leave it now.
        std::thread::yield_now();
        work()
    };
    join(work, || wait(threads - 1, &cores, &done)).0
}

/// There is one thread.
#[cfg(target_family = "wasm")]
pub(crate) fn awake<R>(_threads: usize, work: impl FnOnce() -> R) -> R {
    work()
}
