//! When a target counts as found, and when as lost.

/// Frames in a row that must confirm a new mesh before its target counts as found.
const CONFIRMED_FRAMES: usize = 3;

/// Correlation of image and print from which one frame is enough.
const STRONG: f64 = 0.8;

/// A target is lost when no frame has confirmed it for so long, seconds: a hand that passes does not end it.
const LOST_S: f64 = 0.4;

/// Found and lost with hysteresis, so that neither flickers.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Presence {
    pub(super) is_found: bool,
    /// Frames in a row that have confirmed the mesh, the newest included.
    in_a_row: usize,
    confirmed_s: f64,
}

impl Presence {
    /// Whether the newest frame confirms the mesh.
    pub(super) fn is_confirmed(&self) -> bool {
        self.in_a_row > 0
    }

    /// Another track takes the place of the one so far: its frames count anew.
    pub(super) fn begin_track(&mut self) {
        self.in_a_row = 0;
    }

    /// Takes the frame at `time_s` (seconds of the video, ascending), with its `correlation` where it confirms the mesh.
    pub(super) fn update(&mut self, correlation: Option<f64>, time_s: f64) {
        match correlation {
            Some(correlation) => {
                self.in_a_row += 1;
                self.confirmed_s = time_s;
                self.is_found |= correlation >= STRONG || self.in_a_row >= CONFIRMED_FRAMES;
            }
            None => {
                self.in_a_row = 0;
                self.is_found &= time_s - self.confirmed_s < LOST_S;
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Whether the target is found in frames that confirm it so well, `step_s` apart.
    fn found(correlations: &[Option<f64>], step_s: f64) -> Vec<bool> {
        let mut presence = Presence::default();
        let found = |(k, correlation): (usize, &Option<f64>)| {
            presence.update(*correlation, k as f64 * step_s);
            assert_eq!(presence.is_confirmed(), correlation.is_some());
            presence.is_found
        };
        correlations.iter().enumerate().map(found).collect()
    }

    #[test]
    fn a_target_is_found_after_three_frames_in_a_row_or_at_once_by_a_strong_one() {
        let weak = Some(0.4);
        assert_eq!(found(&[None, weak, weak, weak], 0.05), [false, false, false, true]);
        let broken = [weak, weak, None, weak, weak, weak];
        assert_eq!(found(&broken, 0.05), [false, false, false, false, false, true]);
        assert_eq!(found(&[None, Some(0.8)], 0.05), [false, true]);
    }

    #[test]
    fn it_is_lost_when_no_frame_has_confirmed_it_for_so_long_and_a_shorter_gap_is_nothing() {
        let mut frames = vec![None; 17];
        (frames[0], frames[8]) = (Some(0.9), Some(0.4));
        let found_in = found(&frames, 0.05);
        assert!(
            found_in[..16].iter().all(|found| *found) && !found_in[16],
            "{found_in:?}"
        );
        // At five frames a second two in a row are enough.
        assert_eq!(found(&[Some(0.9), None, None, None], 0.2), [true, true, false, false]);
    }

    #[test]
    fn the_frames_of_another_track_count_anew() {
        let mut presence = Presence::default();
        for (k, is_new) in [false, false, true, false].into_iter().enumerate() {
            if is_new {
                presence.begin_track();
            }
            presence.update(Some(0.5), k as f64);
            assert!(!presence.is_found);
        }
        presence.update(Some(0.5), 4.0);
        assert!(presence.is_found);
    }
}
