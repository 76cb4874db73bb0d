//! What happened in one clip, frame by frame, and what follows from it.

use super::seen_vertices::seen_vertices;
use deepsft::session::{Detection, FrameTimes};
use deepsft_geometry::glam::{DVec2, DVec3};
use deepsft_geometry::{Camera, Maps, Template};
use deepsft_synth::ClipStory;
use deepsft_train::tracking_errors::TRACKED_PX;
use serde::Serialize;

/// Fraction of the print that must be seen for a frame to count as one with the sheet in view.
pub const IN_VIEW: f64 = 0.3;

/// A track that is off by more than this is lost, whatever it says; pixels.
pub const LOST_PX: f64 = 5.0;

/// Frames after a cut in which a loss is the cut's.
const AFTER_CUT: usize = 8;

/// Frames that a still clip is given before its jitter is measured, and the fewest after them.
const SETTLING: usize = 10;
const MIN_STILL: usize = 10;

/// Step for the speed of vertices, frames.
const SPEED_STEP: f64 = 0.25;

#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct FrameRecord {
    pub frame: usize,
    /// Fraction of the print that is seen.
    pub print_in_view: f64,
    pub found: bool,
    pub correlation: f64,
    pub iterations: usize,
    pub registration_rmse_px: Option<f64>,
    pub points_rmse_mm: Option<f64>,
    /// The detection that arrived after it.
    pub detection: Option<Detection>,
    pub ms: FrameTimes,
}

impl FrameRecord {
    /// Whether enough of the sheet is seen to ask for a track.
    pub fn in_view(&self) -> bool {
        self.print_in_view >= IN_VIEW
    }

    /// Whether the sheet is found and within 2 pixels of the truth.
    pub fn tracked(&self) -> bool {
        self.found && self.registration_rmse_px.is_some_and(|px| px <= TRACKED_PX)
    }

    /// Whether there is no track, or one that is nowhere near.
    pub fn lost(&self) -> bool {
        !self.found || self.registration_rmse_px.is_none_or(|px| px > LOST_PX)
    }
}

/// Why there was no track.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Cause {
    /// The clip began.
    Start,
    Cut,
    /// The sheet came back into view.
    Return,
    /// None of these: the tracker lost what it had.
    Track,
}

/// A time without a track although the sheet is in view.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Loss {
    pub from: usize,
    pub cause: Cause,
    /// The frame at which the network's first answer about a frame of this time arrived.
    pub next_answer: Option<usize>,
    /// Whether a finder saw the sheet then.
    pub seen: bool,
    /// The first frame that is tracked within 2 pixels again.
    pub recovered: Option<usize>,
}

/// How a loss ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Ending {
    /// The track came back within the network's next answer.
    WithinNextAnswer,
    Later,
    /// Not at all, although an answer came.
    Never,
    /// No answer came before the clip was over or the sheet was gone.
    Unanswered,
}

impl Loss {
    pub fn ending(&self) -> Ending {
        match (self.recovered, self.next_answer) {
            (Some(recovered), Some(answer)) if recovered > answer => Ending::Later,
            (Some(_), _) => Ending::WithinNextAnswer,
            (None, Some(_)) => Ending::Never,
            (None, None) => Ending::Unanswered,
        }
    }
}

/// The losses of a clip. `cut`: the first frame after a cut.
pub fn losses(frames: &[FrameRecord], cut: Option<usize>) -> Vec<Loss> {
    let mut losses: Vec<Loss> = Vec::new();
    let mut open: Option<Loss> = None;
    let mut seen_before = false;
    for (k, frame) in frames.iter().enumerate() {
        if !frame.in_view() {
            losses.extend(open.take());
            continue;
        }
        let first = !seen_before;
        let returned = !first && !frames[k - 1].in_view();
        seen_before = true;
        if open.is_none() && frame.lost() {
            let after_cut = cut.is_some_and(|cut| (cut..cut + AFTER_CUT).contains(&k));
            let cause = if first {
                Cause::Start
            } else if returned {
                Cause::Return
            } else if after_cut {
                Cause::Cut
            } else {
                Cause::Track
            };
            open = Some(Loss {
                from: k,
                cause,
                next_answer: None,
                seen: false,
                recovered: None,
            });
        }
        let Some(loss) = &mut open else { continue };
        if loss.next_answer.is_none()
            && let Some(answer) = frame.detection.filter(|answer| answer.of_frame as usize >= loss.from)
        {
            loss.next_answer = Some(k);
            loss.seen = answer.by.is_some();
        }
        if frame.tracked() {
            loss.recovered = Some(k);
            losses.extend(open.take());
        }
    }
    losses.extend(open);
    losses
}

/// The frames of a loss for which no track can be asked: the network had not yet answered about the sheet as it is.
pub fn waiting(losses: &[Loss], frames: usize) -> Vec<bool> {
    let mut waiting = vec![false; frames];
    for loss in losses.iter().filter(|loss| loss.cause != Cause::Track) {
        let end = loss.next_answer.or(loss.recovered).unwrap_or(frames);
        waiting[loss.from..end].fill(true);
    }
    waiting
}

/// Tracked meshes of a clip, `None` where the sheet was not found, against what was rendered.
pub struct Clip<'a> {
    pub story: &'a ClipStory<'a>,
    pub template: &'a Template,
    pub camera: &'a Camera,
    pub truths: &'a [Maps],
    pub meshes: &'a [Option<Vec<DVec3>>],
}

impl Clip<'_> {
    /// Frames by which the track trails the sheet: the shift in time that explains the differences in the image best
    /// (least squares over seen vertices, to first order in the shift). Over the frames for which `counts` is true;
    /// `None` when nothing moves there.
    pub fn lag_frames(&self, counts: &[bool]) -> Option<f64> {
        let (mut along, mut square) = (0.0, 0.0);
        for (k, mesh) in self.meshes.iter().enumerate() {
            let Some(mesh) = mesh.as_ref().filter(|_| counts[k]) else {
                continue;
            };
            let at = |offset: f64| self.story.vertices_camera(k as f64 + offset);
            let (before, now, after) = (at(-SPEED_STEP), at(0.0), at(SPEED_STEP));
            let seen = seen_vertices(self.template, &now, &self.truths[k], self.camera);
            for vertex in (0..now.len()).filter(|vertex| seen[*vertex]) {
                let pixel = |p: &DVec3| self.camera.project(*p);
                let pixels = [&before[vertex], &now[vertex], &after[vertex], &mesh[vertex]].map(pixel);
                if let [Some(before), Some(now), Some(after), Some(tracked)] = pixels {
                    let speed: DVec2 = (after - before) / (2.0 * SPEED_STEP);
                    along += (now - tracked).dot(speed);
                    square += speed.length_squared();
                }
            }
        }
        (square > 0.0).then(|| along / square)
    }

    /// Root mean square distance of the seen vertices' places in the image from their means over time, pixels; for a
    /// sheet that is still. `None` when it was found in too few frames.
    pub fn jitter_px(&self) -> Option<f64> {
        let meshes: Vec<&Vec<DVec3>> = self.meshes.iter().skip(SETTLING).flatten().collect();
        let truth = self.truths.first()?;
        if meshes.len() < MIN_STILL {
            return None;
        }
        let seen = seen_vertices(self.template, &self.story.vertices_camera(0.0), truth, self.camera);
        let (mut squares, mut count) = (0.0, 0.0);
        for vertex in (0..seen.len()).filter(|vertex| seen[*vertex]) {
            let places: Vec<DVec2> = meshes
                .iter()
                .filter_map(|mesh| self.camera.project(mesh[vertex]))
                .collect();
            let mean = places.iter().sum::<DVec2>() / places.len().max(1) as f64;
            squares += places.iter().map(|place| place.distance_squared(mean)).sum::<f64>();
            count += places.len() as f64;
        }
        (count > 0.0).then(|| (squares / count).sqrt())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn frame(frame: usize, in_view: bool, error: Option<f64>) -> FrameRecord {
        FrameRecord {
            frame,
            print_in_view: if in_view { 1.0 } else { 0.0 },
            found: error.is_some(),
            registration_rmse_px: error,
            ..FrameRecord::default()
        }
    }

    fn answered(mut record: FrameRecord, of_frame: u64) -> FrameRecord {
        record.detection = Some(Detection {
            of_frame,
            by: Some(deepsft::FinderKind::Network),
            effect: deepsft_geometry::tracking::TrackUpdate::Started,
        });
        record
    }

    #[test]
    fn a_loss_ends_within_two_pixels_and_knows_the_answer_that_was_next() {
        let frames = vec![
            frame(0, true, None),
            answered(frame(1, true, Some(0.5)), 0),
            frame(2, true, Some(0.5)),
            // Lost at 3; the answer that comes at 4 is about a frame before that.
            frame(3, true, Some(9.0)),
            answered(frame(4, true, Some(3.0)), 1),
            answered(frame(5, true, Some(2.5)), 4),
            frame(6, true, Some(1.5)),
            frame(7, false, None),
            frame(8, true, None),
        ];
        let found = losses(&frames, None);
        let causes: Vec<Cause> = found.iter().map(|loss| loss.cause).collect();
        assert_eq!(causes, [Cause::Start, Cause::Track, Cause::Return]);
        let endings: Vec<Ending> = found.iter().map(Loss::ending).collect();
        assert_eq!(endings, [Ending::WithinNextAnswer, Ending::Later, Ending::Unanswered]);
        assert_eq!(
            (found[1].from, found[1].next_answer, found[1].recovered),
            (3, Some(5), Some(6))
        );
        // What the tracker lost by itself is no wait.
        assert_eq!(
            waiting(&found, 9),
            [true, false, false, false, false, false, false, false, true]
        );
    }

    #[test]
    fn a_loss_soon_after_a_cut_is_the_cuts() {
        let frames: Vec<FrameRecord> = (0..20)
            .map(|k| frame(k, true, Some(if k == 11 { 30.0 } else { 1.0 })))
            .collect();
        assert_eq!(losses(&frames, Some(10))[0].cause, Cause::Cut);
        assert_eq!(losses(&frames, Some(1))[0].cause, Cause::Track);
        assert!(losses(&frames[..11], Some(10)).is_empty());
    }

    mod motion {
        use super::*;
        use deepsft_geometry::{Picture, training_camera};
        use deepsft_synth::{ClipEvent, ClipLength, FIRST_CLIP_SEED, SynthConfig, Synthesizer};

        fn with_motion<T>(
            event: ClipEvent,
            mesh: impl Fn(&ClipStory<'_>, usize) -> Vec<DVec3>,
            ask: impl Fn(&Clip<'_>) -> T,
        ) -> T {
            let art = Picture::from_fn(30, 20, |x, y| [(8 * x) as u8, (12 * y) as u8, 90]);
            let template = Template::thin_shell(art, 297.0, 210.0).unwrap();
            let camera = training_camera();
            let synthesizer = Synthesizer::new(&template, SynthConfig::for_clip_stories(camera)).unwrap();
            let length = ClipLength {
                frames: 24,
                ..ClipLength::default()
            };
            let story = ClipStory::new(&synthesizer, length, event, FIRST_CLIP_SEED + 7).unwrap();
            let truths: Vec<Maps> = (0..24)
                .map(|k| synthesizer.render_clean(story.vertices_camera(k as f64)).unwrap().truth)
                .collect();
            let meshes: Vec<_> = (0..24).map(|k| Some(mesh(&story, k))).collect();
            ask(&Clip {
                story: &story,
                template: &template,
                camera: &camera,
                truths: &truths,
                meshes: &meshes,
            })
        }

        #[test]
        fn a_track_of_half_a_frame_ago_lags_by_half_a_frame() {
            let lag = with_motion(
                ClipEvent::Motion,
                |story, k| story.vertices_camera(k as f64 - 0.5),
                |motion| motion.lag_frames(&[true; 24]).unwrap(),
            );
            // To first order: the motion's curvature within half a frame is left out.
            assert!((lag - 0.5).abs() < 0.02, "{lag}");
        }

        #[test]
        fn a_mesh_that_swings_by_a_pixel_jitters_by_that() {
            // Two tenths of a pixel to the left and to the right by turns, at the vertex's own depth.
            let swing = |story: &ClipStory<'_>, k: usize| {
                let side = if k.is_multiple_of(2) { 0.2 } else { -0.2 };
                let vertices = story.vertices_camera(0.0).into_iter();
                vertices.map(|p| p + DVec3::X * side * p.z / 380.0).collect()
            };
            let jitter = with_motion(ClipEvent::Still, swing, |motion| motion.jitter_px().unwrap());
            assert!((jitter - 0.2).abs() < 1e-9, "{jitter}");
        }
    }
}
