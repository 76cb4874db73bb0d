//! Scratch memory: each thread keeps it for its next operation.

use deepsft_inference::gemm::AlignedBuffer;
use std::cell::RefCell;

thread_local! {
    static SCRATCH: RefCell<AlignedBuffer> = RefCell::default();
}

/// Lends `work` numbers in parts of these lengths, each a multiple of a cache line; they hold anything. Not within itself.
pub fn with_scratch<R, const PARTS: usize>(lengths: [usize; PARTS], work: impl FnOnce([&mut [f32]; PARTS]) -> R) -> R {
    SCRATCH.with_borrow_mut(|scratch| {
        let length = lengths.iter().sum();
        if scratch.values().len() < length {
            *scratch = AlignedBuffer::new(length);
        }
        let mut rest = scratch.values_mut();
        work(lengths.map(|length| {
            let (part, others) = std::mem::take(&mut rest).split_at_mut(length);
            rest = others;
            part
        }))
    })
}
