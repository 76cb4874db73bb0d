//! Memory between the parts of an operation, which a thread keeps for the next one.

use deepsft_inference::gemm::AlignedBuffer;
use std::cell::RefCell;

thread_local! {
    static ROOM: RefCell<AlignedBuffer> = RefCell::default();
}

/// Lends `work` numbers in parts of these lengths, each a multiple of a cache line; they hold anything. Not within itself.
pub fn with_room<R, const PARTS: usize>(lengths: [usize; PARTS], work: impl FnOnce([&mut [f32]; PARTS]) -> R) -> R {
    ROOM.with_borrow_mut(|room| {
        let length = lengths.iter().sum();
        if room.values().len() < length {
            *room = AlignedBuffer::new(length);
        }
        let mut rest = room.values_mut();
        work(lengths.map(|length| {
            let (part, others) = std::mem::take(&mut rest).split_at_mut(length);
            rest = others;
            part
        }))
    })
}
