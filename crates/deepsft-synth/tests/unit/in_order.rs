//! Samples made some at a time.

use crate::{Sample, SynthConfig, Synthesizer, in_order, samples};
use deepsft_geometry::{Picture, Template};

/// Samples that are made at a time.
const AHEAD: u64 = 32;

#[test]
fn samples_come_in_order_and_none_is_lost_at_the_end() {
    let texture = Picture::from_fn(40, 30, |x, y| [6 * x as u8, 8 * y as u8, 90]);
    let template = Template::thin_shell(texture, 200.0, 150.0).unwrap();
    let synthesizer = Synthesizer::new(&template, SynthConfig::default()).unwrap();
    let some: Vec<Sample> = samples(synthesizer.clone(), 5, 7..7 + AHEAD + 3)
        .map(Result::unwrap)
        .collect();
    assert_eq!(some.len() as u64, AHEAD + 3);
    for offset in [0, AHEAD - 1, AHEAD, AHEAD + 2] {
        assert!(
            some[offset as usize] == synthesizer.sample(5, 7 + offset),
            "sample {offset}"
        );
    }
}

#[test]
fn indices_up_to_the_last_there_is_are_made() {
    let last = u64::MAX - 6..u64::MAX - 3;
    assert_eq!(
        in_order(last.clone(), |index| index).collect::<Vec<_>>(),
        last.collect::<Vec<_>>()
    );
}
