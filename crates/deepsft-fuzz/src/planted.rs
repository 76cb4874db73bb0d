//! Bugs on purpose: what tells that the harness sees one.

use anyhow::{Result, bail};

/// Whether an input begins with a word, which chance does not find among 2^64: what it is compared with guides mutations.
fn says(input: &[u8], word: u64) -> bool {
    input
        .first_chunk()
        .is_some_and(|&bytes| u64::from_le_bytes(bytes) == word)
}

pub(crate) fn panics(input: &[u8]) -> Result<()> {
    assert!(!says(input, 0x784b_3321_6d51_373f), "the planted panic");
    bail!("it is not the word")
}

pub(crate) fn takes_memory(input: &[u8]) -> Result<()> {
    if says(input, 0x6752_3826_7957_3225) {
        std::hint::black_box(vec![0_u8; 3 << 29]);
    }
    bail!("it is not the word")
}

pub(crate) fn seeds() -> Result<Vec<Vec<u8>>> {
    Ok(vec![b"a word".to_vec()])
}
