//! The figures of the study.

use super::clip_record::{Cause, Ending, FrameRecord, Loss, waiting};
use crate::measuring::Spread;
use deepsft::session::FrameTimes;
use deepsft_synth::ClipEvent;
use serde::Serialize;
use std::collections::BTreeMap;

/// A clip and what followed from it.
#[derive(Serialize)]
pub struct ClipRecord {
    pub seed: u64,
    pub event: &'static str,
    /// The first frame in which it happens and the first after it.
    pub event_frames: [usize; 2],
    /// Fraction of the frames in view that are tracked within 2 pixels.
    pub tracked_fraction: Option<f64>,
    pub losses: Vec<Loss>,
    /// Of a still clip: as the tracker gives it, and smoothed.
    pub jitter_px: Option<[f64; 2]>,
    /// Of a clip that moves: as the tracker gives it, and smoothed.
    pub lag_frames: Option<[f64; 2]>,
    pub frames: Vec<FrameRecord>,
}

impl ClipRecord {
    /// Frames that are tracked, of those in view.
    pub fn tracked(&self) -> (usize, usize) {
        let in_view = self.frames.iter().filter(|frame| frame.in_view());
        (in_view.clone().filter(|frame| frame.tracked()).count(), in_view.count())
    }
}

#[derive(Serialize)]
pub struct Summary {
    pub clips: usize,
    pub frames: usize,
    /// Frames with at least 30 % of the print in view.
    pub frames_in_view: usize,
    /// Fraction of them that are tracked within 2 pixels.
    pub tracked_fraction: Option<f64>,
    /// The same without the frames in which the network had not yet answered about the sheet: at the start of a clip,
    /// after a cut and after a return.
    pub tracked_fraction_after_answer: Option<f64>,
    /// Frames in view that were said to be found and are off by more than 5 pixels.
    pub found_but_off: usize,
    /// Over the frames that are found and in view.
    pub registration_rmse_px: Option<Spread>,
    pub points_rmse_mm: Option<Spread>,
    /// Frames that show nothing of the sheet, and those of them that were said to show it.
    pub frames_without: usize,
    pub found_without: usize,
    pub recoveries: BTreeMap<Cause, Recoveries>,
    /// Root mean square jitter of still clips, pixels: as it is, and smoothed.
    pub jitter_px: Option<[Spread; 2]>,
    /// Frames by which the track trails: as it is, and smoothed.
    pub lag_frames: Option<[Spread; 2]>,
    pub ms: Times,
}

/// How many losses of one cause ended in which way, see [`Ending`].
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct Recoveries {
    pub losses: usize,
    pub within_next_answer: usize,
    pub later: usize,
    pub never: usize,
    pub unanswered: usize,
}

#[derive(Serialize)]
pub struct Times {
    pub follow: Option<Spread>,
    pub catch_up: Option<Spread>,
    pub finding: Option<Spread>,
}

impl Summary {
    pub fn of<'a>(clips: impl Iterator<Item = &'a ClipRecord> + Clone) -> Self {
        let frames = || clips.clone().flat_map(|clip| &clip.frames);
        let in_view = || frames().filter(|frame| frame.in_view());
        let tracked = |count: usize, of: usize| (of > 0).then(|| count as f64 / of as f64);
        let answered: Vec<&FrameRecord> = clips
            .clone()
            .flat_map(|clip| {
                let waiting = waiting(&clip.losses, clip.frames.len());
                let frames = clip.frames.iter().zip(waiting);
                frames
                    .filter(|(frame, waiting)| frame.in_view() && !waiting)
                    .map(|(frame, _)| frame)
            })
            .collect();
        let found = || in_view().filter(|frame| frame.found);
        let without = || frames().filter(|frame| frame.print_in_view == 0.0);
        let mut recoveries: BTreeMap<Cause, Recoveries> = BTreeMap::new();
        for loss in clips.clone().flat_map(|clip| &clip.losses) {
            recoveries.entry(loss.cause).or_default().count(loss.ending());
        }
        let pair = |value: fn(&ClipRecord) -> Option<[f64; 2]>| {
            let of = |k: usize| Spread::of(clips.clone().filter_map(value).map(|pair| pair[k]));
            Some([of(0)?, of(1)?])
        };
        let ms = |time: fn(&FrameTimes) -> Option<f64>| Spread::of(frames().filter_map(|frame| time(&frame.ms)));
        Self {
            clips: clips.clone().count(),
            frames: frames().count(),
            frames_in_view: in_view().count(),
            tracked_fraction: tracked(in_view().filter(|frame| frame.tracked()).count(), in_view().count()),
            tracked_fraction_after_answer: tracked(
                answered.iter().filter(|frame| frame.tracked()).count(),
                answered.len(),
            ),
            found_but_off: found().filter(|frame| frame.lost()).count(),
            registration_rmse_px: Spread::of(found().filter_map(|frame| frame.registration_rmse_px)),
            points_rmse_mm: Spread::of(found().filter_map(|frame| frame.points_rmse_mm)),
            frames_without: without().count(),
            found_without: without().filter(|frame| frame.found).count(),
            recoveries,
            jitter_px: pair(|clip| clip.jitter_px),
            lag_frames: pair(|clip| clip.lag_frames),
            ms: Times {
                follow: ms(|ms| Some(ms.follow)),
                catch_up: ms(|ms| ms.catch_up),
                finding: ms(|ms| ms.finding),
            },
        }
    }

    pub fn by_event(clips: &[ClipRecord]) -> BTreeMap<&'static str, Self> {
        let of = |event: ClipEvent| clips.iter().filter(move |clip| clip.event == event.name());
        ClipEvent::ALL
            .iter()
            .copied()
            .filter(|event| of(*event).next().is_some())
            .map(|event| (event.name(), Self::of(of(event))))
            .collect()
    }

    pub fn all_recoveries(&self) -> Recoveries {
        let sum = |count: fn(&Recoveries) -> usize| self.recoveries.values().map(count).sum();
        Recoveries {
            losses: sum(|of| of.losses),
            within_next_answer: sum(|of| of.within_next_answer),
            later: sum(|of| of.later),
            never: sum(|of| of.never),
            unanswered: sum(|of| of.unanswered),
        }
    }
}

impl Recoveries {
    fn count(&mut self, ending: Ending) {
        self.losses += 1;
        *match ending {
            Ending::WithinNextAnswer => &mut self.within_next_answer,
            Ending::Later => &mut self.later,
            Ending::Never => &mut self.never,
            Ending::Unanswered => &mut self.unanswered,
        } += 1;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::json;

    fn frame(print_in_view: f64, error: Option<f64>) -> FrameRecord {
        FrameRecord {
            print_in_view,
            found: error.is_some(),
            registration_rmse_px: error,
            ..FrameRecord::default()
        }
    }

    #[test]
    fn every_frame_is_counted_where_it_belongs() {
        let loss = |next_answer, recovered| Loss {
            from: 0,
            cause: Cause::Start,
            next_answer,
            seen: true,
            recovered,
        };
        let clip = |event, frames, losses| ClipRecord {
            seed: 1,
            event,
            event_frames: [0, 0],
            tracked_fraction: None,
            losses,
            jitter_px: Some([0.1, 0.05]),
            lag_frames: None,
            frames,
        };
        let clips = [
            clip(
                "motion",
                vec![
                    frame(1.0, None),
                    frame(1.0, Some(1.0)),
                    frame(1.0, Some(7.0)),
                    frame(0.1, Some(90.0)),
                    frame(0.0, Some(1.0)),
                    frame(0.0, None),
                ],
                vec![loss(Some(1), Some(1)), loss(Some(1), Some(3)), loss(Some(2), None)],
            ),
            clip("still", vec![frame(1.0, Some(2.0))], vec![loss(None, None)]),
        ];
        let all = Summary::of(clips.iter());
        assert_eq!((all.clips, all.frames, all.frames_in_view), (2, 7, 4));
        assert_eq!(all.tracked_fraction, Some(0.5));
        // The first clip waits up to the answer at 2, by its third loss, and the frame of that answer is off; the second clip
        // is never answered.
        assert_eq!(all.tracked_fraction_after_answer, Some(0.0));
        assert_eq!((all.found_but_off, all.frames_without, all.found_without), (1, 2, 1));
        let recoveries = serde_json::to_value(all.all_recoveries()).unwrap();
        let expected = json!({"losses": 4, "within_next_answer": 1, "later": 1, "never": 1, "unanswered": 1});
        assert_eq!(recoveries, expected);
        assert_eq!(
            all.jitter_px.map(|[raw, smooth]| [raw.median, smooth.most]),
            Some([0.1, 0.05])
        );
        let errors = all.registration_rmse_px.map(|spread| [spread.median, spread.most]);
        assert_eq!(errors, Some([2.0, 7.0]));
        assert_eq!(
            Summary::by_event(&clips).keys().copied().collect::<Vec<_>>(),
            ["motion", "still"]
        );
    }
}
