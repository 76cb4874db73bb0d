//! A count of what is done, for a person who waits.

use std::io::{IsTerminal, stderr};

/// Counts things on the standard error, if it is a terminal.
pub struct Progress {
    things: &'static str,
    all: u64,
    done: u64,
}

impl Progress {
    /// Of `all` things of a kind ("frames").
    pub fn of(all: u64, things: &'static str) -> Self {
        Self { things, all, done: 0 }
    }

    /// One more is done.
    pub fn step(&mut self) {
        self.done += 1;
        if stderr().is_terminal() {
            let end = if self.done == self.all { "\n" } else { "" };
            eprint!("\r{} of {} {}{end}", self.done, self.all, self.things);
        }
    }
}
