//! Streams of random numbers.

use crate::random::{Stream, generator};
use rand::RngExt;

#[test]
fn streams_of_neighbouring_samples_differ() {
    let draw = |seed, index, stream| generator(seed, index, stream).random::<u64>();
    assert_eq!(draw(1, 2, Stream::Scene), draw(1, 2, Stream::Scene));
    let all = [
        draw(1, 2, Stream::Scene),
        draw(1, 3, Stream::Scene),
        draw(2, 2, Stream::Scene),
        draw(2, 1, Stream::Scene),
        draw(1, 2, Stream::Shape),
    ];
    assert!((0..all.len()).all(|i| (0..i).all(|j| all[i] != all[j])));
}
