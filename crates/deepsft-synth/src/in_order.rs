//! Samples in order, made some at a time on all cores.

use crate::clip::ClipStory;
use crate::error::SynthError;
use crate::sample::Sample;
use crate::scene::Synthesizer;
use rayon::prelude::*;
use std::ops::Range;

/// Samples that are made at a time.
const AHEAD: u64 = 32;

/// The samples `indices` of `seed` in order, made some at a time on all cores.
///
/// # Errors
/// Items are [`SynthError`]s where a photograph of the backgrounds cannot be read, see [`Synthesizer::check_photographs`].
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
///
/// # Errors
/// Items are the errors of [`ClipStory::render`].
pub fn clip_frames(story: &ClipStory<'_>, frames: Range<usize>) -> impl Iterator<Item = Result<Sample, SynthError>> {
    in_order(frames.start as u64..frames.end as u64, |frame| {
        story.render(frame as usize)
    })
}
