//! Core affinity: each thread of the team keeps to a core while a frame lasts.
//!
//! Kernels decide by what threads did lately where they run. After a pause that is little: some, on virtual machines above all, then
//! gather all threads of a program on one core, and notice too late for a frame that takes 10 ms.

#[cfg(target_os = "linux")]
pub(super) use linux::Cores;
#[cfg(not(target_os = "linux"))]
pub(super) use other::Cores;

#[cfg(target_os = "linux")]
mod linux {
    use rustix::thread::{CpuSet, sched_getaffinity, sched_getcpu, sched_setaffinity};
    use std::sync::{Mutex, PoisonError};

    /// The cores that the threads of a frame keep to.
    #[derive(Default)]
    pub(crate) struct Cores(Mutex<CpuSet>);

    /// Keeps the calling thread on its core until it is dropped.
    pub(crate) struct Pinned(Option<CpuSet>);

    impl Cores {
        /// Moves the calling thread to a core that no other of the frame has, if there is one, and keeps it there.
        pub(crate) fn pin(&self) -> Pinned {
            let Ok(allowed) = sched_getaffinity(None) else {
                return Pinned(None);
            };
            let mut taken = self.0.lock().unwrap_or_else(PoisonError::into_inner);
            let mut free = CpuSet::new();
            for core in (0..CpuSet::MAX_CPU).filter(|&core| allowed.is_set(core) && !taken.is_set(core)) {
                free.set(core);
            }
            // It moves at once.
            if free.count() == 0 || sched_setaffinity(None, &free).is_err() {
                return Pinned(None);
            }
            let core = sched_getcpu();
            let mut here = CpuSet::new();
            here.set(core);
            taken.set(core);
            // Should it fail, the thread may move, no more.
            let _ = sched_setaffinity(None, &here);
            Pinned(Some(allowed))
        }
    }

    impl Drop for Pinned {
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
    #[derive(Default)]
    pub(crate) struct Cores;

    impl Cores {
        pub(crate) fn pin(&self) -> Self {
            Self
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
        let cores = Cores::default();
        let first = cores.pin();
        let core = sched_getcpu();
        std::thread::scope(|scope| {
            let second = scope.spawn(|| {
                // Where the first is, so that it has to leave.
                let mut there = rustix::thread::CpuSet::new();
                there.set(core);
                rustix::thread::sched_setaffinity(None, &there).unwrap();
                rustix::thread::sched_setaffinity(None, &allowed).unwrap();
                let pinned = cores.pin();
                assert_eq!(sched_getcpu() == core, allowed.count() == 1);
                assert_eq!(sched_getaffinity(None).unwrap().count(), 1);
                drop(pinned);
                assert_eq!(sched_getaffinity(None).unwrap(), allowed);
            });
            second.join().unwrap();
        });
        assert_eq!(sched_getcpu(), core);
        drop(first);
        assert_eq!(sched_getaffinity(None).unwrap(), allowed);
    }
}
