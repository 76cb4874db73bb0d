//! The team where there are no threads: one.

pub(crate) const MAX_THREADS: usize = 1;

/// Returns the number of threads that a network can use: one.
pub fn available_threads() -> usize {
    1
}

pub(crate) fn with_team<R>(_threads: usize, work: impl FnOnce() -> R) -> R {
    work()
}

pub(super) fn join<A, B>(a: impl FnOnce() -> A, b: impl FnOnce() -> B) -> (A, B) {
    (a(), b())
}
