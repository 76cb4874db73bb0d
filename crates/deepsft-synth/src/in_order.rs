//! Samples in order, made some at a time on all cores.

use crate::clip::ClipStory;
use crate::error::SynthError;
use crate::scene::Synthesizer;
use deepsft_formats::Sample;
use rayon::prelude::*;
use std::ops::Range;

/// Samples that are made at a time.
const AHEAD: u64 = 32;

/// The samples `indices` of `seed` in order, made some at a time on all cores.
pub fn samples(
    synthesizer: Synthesizer,
    seed: u64,
    indices: Range<u64>,
) -> impl Iterator<Item = Result<Sample, SynthError>> {
    in_order(indices, move |index| {
        let sample = synthesizer.sample(seed, index);
        synthesizer.check_photographs()?;
        Ok(sample)
    })
}

/// What `make` makes of `indices` in order, some at a time on all cores.
pub fn in_order<T: Send>(indices: Range<u64>, make: impl Fn(u64) -> T + Sync) -> impl Iterator<Item = T> {
    indices.clone().step_by(AHEAD as usize).flat_map(move |first| {
        let some = first..first.saturating_add(AHEAD).min(indices.end);
        some.into_par_iter().map(&make).collect::<Vec<_>>()
    })
}

/// The frames of a clip in order, made some at a time on all cores.
pub fn clip_frames(story: &ClipStory<'_>, frames: Range<usize>) -> impl Iterator<Item = Result<Sample, SynthError>> {
    frames.clone().step_by(AHEAD as usize).flat_map(move |first| {
        let some = first..(first + AHEAD as usize).min(frames.end);
        some.into_par_iter()
            .map(|frame| story.render(frame))
            .collect::<Vec<_>>()
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::SynthConfig;
    use deepsft_geometry::{Picture, Template};

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
}
