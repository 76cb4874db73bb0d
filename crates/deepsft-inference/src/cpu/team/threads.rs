//! The team where there are threads: a pool of this crate's own, which serves one frame at a time.

use rayon::{ThreadPool, ThreadPoolBuilder};
use std::cell::Cell;
use std::panic::resume_unwind;
use std::sync::LazyLock;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread::{available_parallelism, scope};

/// More would find nothing to do: the map with most work has nine rows of tiles. Each thread has 2 MB of its own.
pub(crate) const MAX_THREADS: usize = 8;

/// How often a thread looks for work before it lets other programs go first.
const TRIES: u32 = 1_000;

/// The team; `None` where the system gives no threads.
static TEAM: LazyLock<Option<ThreadPool>> = LazyLock::new(|| {
    let count = available_parallelism().map_or(1, usize::from).min(MAX_THREADS);
    let named = |k: usize| format!("deepsft-{k}");
    ThreadPoolBuilder::new()
        .num_threads(count)
        .thread_name(named)
        .build()
        .ok()
});

/// Whether a frame has the team.
static IS_TAKEN: AtomicBool = AtomicBool::new(false);

thread_local! {
    /// Whether this thread is in the midst of a frame's work, and waits for other threads' parts of it at most.
    static IN_WORK: Cell<bool> = const { Cell::new(false) };
}

/// Does something when it is dropped, also after a panic.
struct OnDrop<F: Fn()>(F);

impl<F: Fn()> Drop for OnDrop<F> {
    fn drop(&mut self) {
        (self.0)();
    }
}

/// Runs a part of a frame's work.
fn as_work<R>(work: impl FnOnce() -> R) -> R {
    let before = IN_WORK.replace(true);
    let _restore = OnDrop(|| IN_WORK.set(before));
    work()
}

/// Returns the number of threads that a network can use: as many as rayon's current pool has, at most 8; one in a browser.
pub fn available_threads() -> usize {
    rayon::current_num_threads().min(MAX_THREADS)
}

fn is_member() -> bool {
    TEAM.as_ref().is_some_and(|team| team.current_thread_index().is_some())
}

/// Runs both at the same time on the team's threads, one after the other elsewhere.
pub(super) fn join<A: Send, B: Send>(a: impl FnOnce() -> A + Send, b: impl FnOnce() -> B + Send) -> (A, B) {
    if is_member() {
        rayon::join(|| as_work(a), || as_work(b))
    } else {
        (a(), b())
    }
}

/// Runs `work` on the team, `threads` of whose threads stay awake meanwhile: a part of a layer takes less time than a thread needs
/// to wake up. While another frame has the team, `work` runs on the calling thread alone.
pub(crate) fn with_team<R: Send>(threads: usize, work: impl FnOnce() -> R + Send) -> R {
    if threads <= 1 || is_member() || IS_TAKEN.swap(true, Ordering::Acquire) {
        return work();
    }
    let _taken = OnDrop(|| IS_TAKEN.store(false, Ordering::Release));
    let Some(team) = &*TEAM else {
        return work();
    };
    let run = || team.install(|| keep_awake(threads, work));
    if rayon::current_thread_index().is_none() {
        return run();
    }
    // A thread of a pool would take on other jobs of its pool while it waits for the team: it waits for a plain thread instead.
    let joined = scope(|scope| scope.spawn(run).join());
    joined.unwrap_or_else(|panic| resume_unwind(panic))
}

/// Runs `work` while `threads` threads of the team, this one included, spin for its parts.
fn keep_awake<R: Send>(threads: usize, work: impl FnOnce() -> R + Send) -> R {
    let done = AtomicBool::new(false);
    let work = || {
        let _done = OnDrop(|| done.store(true, Ordering::Release));
        as_work(work)
    };
    rayon::join(work, || spin(threads - 1, &done)).0
}

fn spin(threads: usize, done: &AtomicBool) {
    // A thread that waits for a part of its work may be given this job: it must not wait in it for its own end.
    if IN_WORK.get() {
        return;
    }
    if threads > 1 {
        rayon::join(|| spin(1, done), || spin(threads - 1, done));
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

#[cfg(test)]
mod tests {
    use super::*;
    use std::sync::mpsc;
    use std::time::Duration;

    #[test]
    fn a_thread_that_waits_for_its_own_work_does_not_spin_until_that_ends() {
        let (sender, receiver) = mpsc::channel();
        std::thread::spawn(move || {
            as_work(|| spin(3, &AtomicBool::new(false)));
            sender.send(IN_WORK.get())
        });
        assert_eq!(receiver.recv_timeout(Duration::from_secs(60)), Ok(false));
    }
}
