//! Threads that work together, each on a core of its own.
//!
//! Kernels decide by what threads did lately where they run. After a pause that is little: some, on virtual machines above all, then
//! gather all threads of a program on one core, and notice too late for a frame that takes 10 ms. For as long as a frame takes, each
//! thread therefore keeps to the core that it is on.

#[cfg(target_os = "linux")]
pub(super) use linux::Cores;
#[cfg(not(target_os = "linux"))]
pub(super) use other::Cores;

#[cfg(target_os = "linux")]
mod linux {
    use rustix::thread::{CpuSet, sched_getaffinity, sched_getcpu, sched_setaffinity};
    use std::sync::{Mutex, PoisonError};

    /// The cores that threads of one frame keep to.
    pub(crate) struct Cores(Mutex<CpuSet>);

    /// The calling thread keeps to its core as long as this lives.
    pub(crate) struct Kept(Option<CpuSet>);

    impl Cores {
        /// Nobody has one yet.
        pub(crate) fn new() -> Self {
            Self(Mutex::new(CpuSet::new()))
        }

        /// The calling thread keeps to a core that no other of the frame has, if there is one.
        pub(crate) fn keep(&self) -> Kept {
            let Ok(allowed) = sched_getaffinity(None) else {
                return Kept(None);
            };
            let mut taken = self.0.lock().unwrap_or_else(PoisonError::into_inner);
            let mut free = CpuSet::new();
            for core in (0..CpuSet::MAX_CPU).filter(|&core| allowed.is_set(core) && !taken.is_set(core)) {
                free.set(core);
            }
            // It moves at once.
            if free.count() == 0 || sched_setaffinity(None, &free).is_err() {
                return Kept(None);
            }
            let core = sched_getcpu();
            let mut here = CpuSet::new();
            here.set(core);
            taken.set(core);
            // Should it fail, the thread may move, no more.
            let _ = sched_setaffinity(None, &here);
            Kept(Some(allowed))
        }
    }

    impl Drop for Kept {
        fn drop(&mut self) {
            if let Some(allowed) = &self.0 {
                let _ = sched_setaffinity(None, allowed);
            }
        }
    }
}

#[cfg(not(target_os = "linux"))]
mod other {
    /// Other systems spread threads by themselves.
    pub(crate) struct Cores;

    pub(crate) struct Kept;

    impl Cores {
        pub(crate) fn new() -> Self {
            Self
        }

        pub(crate) fn keep(&self) -> Kept {
            Kept
        }
    }
}

#[cfg(all(test, target_os = "linux"))]
mod tests {
    use super::Cores;
    use rustix::thread::{sched_getaffinity, sched_getcpu};

    #[test]
    fn a_second_thread_leaves_the_core_of_the_first_and_both_may_go_anywhere_afterwards() {
        let allowed = sched_getaffinity(None).unwrap();
        let cores = Cores::new();
        let first = cores.keep();
        let core = sched_getcpu();
        std::thread::scope(|scope| {
            let second = scope.spawn(|| {
                // Where the first is, so that it has to leave.
                let mut there = rustix::thread::CpuSet::new();
                there.set(core);
                rustix::thread::sched_setaffinity(None, &there).unwrap();
                rustix::thread::sched_setaffinity(None, &allowed).unwrap();
                let kept = cores.keep();
                assert_eq!(sched_getcpu() == core, allowed.count() == 1);
                assert_eq!(sched_getaffinity(None).unwrap().count(), 1);
                drop(kept);
                assert_eq!(sched_getaffinity(None).unwrap(), allowed);
            });
            second.join().unwrap();
        });
        assert_eq!(sched_getcpu(), core);
        drop(first);
        assert_eq!(sched_getaffinity(None).unwrap(), allowed);
    }
}
