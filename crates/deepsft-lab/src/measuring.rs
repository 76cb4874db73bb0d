//! How the lab measures: medians of repeated work, processes that take turns, and the machine it was done on.

mod machine;
mod process;
mod times;

pub use machine::{cores, processor};
pub use process::{Process, Rival};
pub use times::{Stopwatch, Times, timed};
