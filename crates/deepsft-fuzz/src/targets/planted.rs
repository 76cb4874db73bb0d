//! Bugs on purpose: what tells that the harness sees one.

use anyhow::{Result, bail};

/// Words that chance does not find among 2^64: a byte that fits takes the program to a place of its own, and that guides.
fn says(input: &[u8], word: &[u8; 8]) -> bool {
    let mut found = input.len() >= word.len();
    for (a, b) in input.iter().zip(word) {
        if a != b {
            found = false;
            break;
        }
        std::hint::black_box(b);
    }
    found
}

pub(crate) fn panics(input: &[u8]) -> Result<()> {
    assert!(!says(input, b"xK3!mQ7?"), "the planted panic");
    bail!("it is not the word")
}

pub(crate) fn takes_memory(input: &[u8]) -> Result<()> {
    if says(input, b"gR8&yW2%") {
        std::hint::black_box(vec![0_u8; 3 << 29]);
    }
    bail!("it is not the word")
}

pub(crate) fn seeds() -> Result<Vec<Vec<u8>>> {
    Ok(vec![b"a word".to_vec()])
}
