//! How much memory this process holds.

use anyhow::{Context, Result};
use std::fs;

/// What the system says of this process, exactly: it walks the process's pages.
const ROLLUP: &str = "/proc/self/smaps_rollup";

/// Memory of this process, kB.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Memory {
    /// All that is resident: the program's file too.
    pub resident_kb: u64,
    /// What is resident of heap and stacks.
    pub anonymous_kb: u64,
}

impl Memory {
    /// Of now.
    pub fn now() -> Result<Self> {
        let text = fs::read_to_string(ROLLUP).with_context(|| {
            format!("memory cannot be measured here: {ROLLUP} cannot be read (it is of Linux, from 4.14 on)")
        })?;
        Self::of(&text).with_context(|| format!("{ROLLUP} does not tell Rss and Anonymous"))
    }

    fn of(rollup: &str) -> Option<Self> {
        let field = |name: &str| -> Option<u64> {
            let line = rollup.lines().find(|line| line.starts_with(name))?;
            line.split_whitespace().nth(1)?.parse().ok()
        };
        Some(Self {
            resident_kb: field("Rss:")?,
            anonymous_kb: field("Anonymous:")?,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_systems_words_are_read() {
        let text = "55d0-7ffd ---p 0 00:00 0    [rollup]\nRss:      1234 kB\nPss:       7 kB\nAnonymous:      987 kB\n";
        let memory = Memory {
            resident_kb: 1234,
            anonymous_kb: 987,
        };
        assert_eq!(Memory::of(text), Some(memory));
        assert_eq!(Memory::of("Rss: much\n"), None);
    }

    #[test]
    #[cfg(target_os = "linux")]
    fn a_buffer_of_ten_megabytes_is_seen_and_so_is_its_end() {
        let before = Memory::now().unwrap().anonymous_kb;
        // Not zeros: the system gives pages of zeros without memory.
        let buffer = std::hint::black_box(vec![7_u8; 10_000_000]);
        let during = Memory::now().unwrap().anonymous_kb;
        drop(buffer);
        let after = Memory::now().unwrap().anonymous_kb;
        // Other tests of this process run meanwhile: half of it would be enough.
        assert!(
            during > before + 5000 && after + 5000 < during,
            "{before} {during} {after}"
        );
    }
}
