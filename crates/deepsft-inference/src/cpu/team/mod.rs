//! The thread team: the threads that make a frame together.
//!
//! They belong to this crate: no job of the caller's thread pool runs inside a frame.

mod parallel;
#[cfg_attr(target_family = "wasm", path = "single.rs")]
mod threads;

pub(crate) use parallel::{Chunks, in_parallel};
pub use threads::available_threads;
pub(crate) use threads::{MAX_THREADS, with_team};
