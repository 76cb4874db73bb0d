//! The worst clips of the study as pictures.

use super::clip_record::FrameRecord;
use super::plot::{self, Mark, Point};
use super::summary::TrackedClip;
use deepsft_cli::output::{panels, sheet, wireframe};
use deepsft_geometry::{Picture, Template};
use deepsft_synth::Sample;

/// Clips on the sheet, and frames of each.
const CLIPS: usize = 10;
const FRAMES: usize = 3;

/// The clips with the smallest fraction of tracked frames, worst first.
#[derive(Default)]
pub struct Worst {
    rows: Vec<(f64, sheet::Row)>,
}

impl Worst {
    /// Keeps the clip if it is one of the worst.
    pub fn offer(&mut self, template: &Template, samples: &[Sample], clip: &TrackedClip) {
        let fraction = clip.record.tracked_fraction.unwrap_or(1.0);
        let at = self.rows.partition_point(|(other, _)| *other <= fraction);
        if at < CLIPS {
            self.rows.insert(at, (fraction, row(template, samples, clip)));
            self.rows.truncate(CLIPS);
        }
    }

    /// The rows of the sheet.
    pub fn into_rows(self) -> Vec<sheet::Row> {
        self.rows.into_iter().map(|(_, row)| row).collect()
    }
}

fn row(template: &Template, samples: &[Sample], clip: &TrackedClip) -> sheet::Row {
    let record = &clip.record;
    let (tracked, in_view) = record.tracked();
    let points: Vec<Point> = record.frames.iter().map(point).collect();
    let mut panels = vec![panels::plain(
        "registration RMSE, px",
        &plot::track_plot(&points, record.event_frames),
    )];
    for frame in worst_frames(&record.frames) {
        let (sample, of) = (&samples[frame], &record.frames[frame]);
        let drawn = match &clip.meshes[frame] {
            Some((vertices, confidence)) => {
                wireframe::wireframe(&sample.image, &sample.camera, template, vertices, confidence)
            }
            None => sample.image.clone(),
        };
        panels.push(panels::plain(&title(of), &drawn));
    }
    // All panels of a sheet have one size.
    panels
        .iter_mut()
        .for_each(|panel| panel.picture = fitted(&panel.picture));
    sheet::Row {
        caption: format!(
            "clip {} ({}): {tracked} of {in_view} frames in view tracked",
            record.seed, record.event
        ),
        panels,
    }
}

fn fitted(picture: &Picture) -> Picture {
    Picture::from_fn(plot::WIDTH, plot::HEIGHT, |x, y| {
        if x < picture.width() && y < picture.height() {
            picture.pixel(x, y)
        } else {
            [0; 3]
        }
    })
}

fn point(frame: &FrameRecord) -> Point {
    Point {
        error: frame.registration_rmse_px.filter(|_| frame.found),
        mark: match (frame.in_view(), frame.found) {
            (true, false) => Mark::Missed,
            (false, _) if frame.print_in_view == 0.0 => Mark::Away,
            (false, _) => Mark::HardlyThere,
            (true, true) => Mark::Found,
        },
        answer: frame.detection.is_some(),
    }
}

/// The frames to look at, in order of time: what is said to be found where nothing is, then missed frames, then the
/// largest errors; those that hardly differ in time from a worse one are left out.
fn worst_frames(frames: &[FrameRecord]) -> Vec<usize> {
    let badness = |frame: &FrameRecord| match (frame.print_in_view == 0.0, frame.found) {
        (true, true) => f64::INFINITY,
        (false, true) => frame.registration_rmse_px.unwrap_or(1e6),
        (false, false) if frame.in_view() => 20.0,
        _ => 0.0,
    };
    let mut order: Vec<usize> = (0..frames.len()).collect();
    order.sort_by(|a, b| badness(&frames[*b]).total_cmp(&badness(&frames[*a])));
    let mut chosen: Vec<usize> = Vec::new();
    for frame in order {
        if chosen.len() < FRAMES && chosen.iter().all(|other| other.abs_diff(frame) > 3) {
            chosen.push(frame);
        }
    }
    chosen.sort_unstable();
    chosen
}

fn title(frame: &FrameRecord) -> String {
    match (frame.found, frame.registration_rmse_px) {
        (true, Some(px)) => format!("{}: {px:.1} px", frame.frame),
        (true, None) => format!("{}: found elsewhere", frame.frame),
        (false, _) => format!("{}: not found", frame.frame),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_frames_to_look_at_are_the_worst_and_not_side_by_side() {
        let mut frames: Vec<FrameRecord> = (0..30)
            .map(|frame| FrameRecord {
                frame,
                print_in_view: 1.0,
                found: true,
                registration_rmse_px: Some(0.5),
                ..FrameRecord::default()
            })
            .collect();
        frames[10].registration_rmse_px = Some(50.0);
        frames[11].registration_rmse_px = Some(49.0);
        frames[20].found = false;
        frames[5].print_in_view = 0.0;
        assert_eq!(worst_frames(&frames), [5, 10, 20]);
    }
}
