//! The figure sheet: rows of frames as in the tables of the paper.

use super::worst::{Frame, badness, halved};
use crate::output::{panels, sheet};
use deepsft::{Estimate, ModelBundle};
use deepsft_train::{EvaluationFrame, FrameResult};

/// Frames that are spread over the set.
const SPREAD: u64 = 5;

/// Ends of the error scales.
const DEPTH_SCALE_MM: f64 = 50.0;
const REGISTRATION_SCALE_PX: f64 = 10.0;

/// Frames spread over a set, and the worst one.
pub struct Chosen {
    count: u64,
    spread: Vec<Frame>,
    worst: Option<Frame>,
}

impl Chosen {
    /// Nothing yet of a set of `count` frames.
    pub fn new(count: u64) -> Self {
        Self {
            count,
            spread: Vec::new(),
            worst: None,
        }
    }

    /// Keeps a frame if it belongs to those that are drawn: the first that shows the object from each fifth of the set on,
    /// and the worst so far.
    pub fn offer(&mut self, frame: &EvaluationFrame, estimate: &Estimate, result: &FrameResult) {
        if !result.has_template {
            return;
        }
        let kept = self.spread.len() as u64;
        if kept < SPREAD && result.index >= kept * self.count / SPREAD {
            self.spread.push(Frame::new(frame, estimate, result));
        }
        let bad = badness(result, frame.truth.has_registration());
        let worse = |worst: &Frame| bad > badness(&worst.result, worst.has_registration);
        if self.worst.as_ref().is_none_or(worse) {
            self.worst = Some(Frame::new(frame, estimate, result));
        }
    }

    /// The rows of the sheet, `place` before each caption.
    pub fn rows(&self, bundle: &ModelBundle, place: &str) -> Vec<sheet::Row> {
        let row = |kind: &str, frame: &Frame| sheet::Row {
            caption: format!("{place}{kind}{}", frame.caption()),
            panels: columns(frame, bundle).into_iter().map(halved).collect(),
        };
        let spread = self.spread.iter().map(|frame| row("", frame));
        let worst = self.worst.iter().map(|frame| row("the worst, ", frame));
        spread.chain(worst).collect()
    }
}

/// The columns of a row; those that need a true registration are left out where there is none.
fn columns(frame: &Frame, bundle: &ModelBundle) -> Vec<sheet::Panel> {
    let Frame {
        image,
        predicted,
        truth,
        ..
    } = frame;
    let (template, camera) = (bundle.template(), bundle.camera());
    let true_depth = if frame.has_registration {
        "true depth"
    } else {
        "measured depth"
    };
    // One scale for both depths; where there is no truth to take it from, the estimate's.
    let range = panels::depth_range(if truth.area() > 0 { truth } else { predicted });
    let mut columns = vec![
        panels::plain("input", image),
        panels::depth_within(true_depth, truth, range),
        panels::depth_within("depth", predicted, range),
        panels::coordinate("u", predicted, 0),
        panels::coordinate("v", predicted, 1),
        panels::depth_error("depth error", predicted, truth, DEPTH_SCALE_MM),
    ];
    if frame.has_registration {
        columns.push(panels::registration_error_px(
            "registration error",
            predicted,
            (truth, camera),
            template.size_mm(),
            REGISTRATION_SCALE_PX,
        ));
    }
    columns.push(panels::average("I_avg", image, template.texture(), predicted));
    columns
}

#[cfg(test)]
mod tests {
    use super::*;
    use deepsft::{Accuracy, DeviceKind, FoundRule, Judgement, ModelCard, NetworkConfig, Provenance, start_device};
    use deepsft_geometry::metrics::FrameMetrics;
    use deepsft_geometry::{Maps, Picture, Template, training_camera};
    use deepsft_train::FrameTruth;

    fn bundle() -> ModelBundle {
        let (device, _) = pollster::block_on(start_device(DeviceKind::Cpu)).unwrap();
        let camera = training_camera();
        let texture = Picture::from_fn(40, 30, |x, y| [6 * x as u8, 8 * y as u8, 90]);
        let card = ModelCard {
            name: "untrained".to_owned(),
            licence: "MIT OR Apache-2.0".to_owned(),
            found: FoundRule::default(),
            provenance: Provenance::default(),
            accuracy: Accuracy::default(),
        };
        let network = NetworkConfig::compact([200.0, 150.0], &camera).init(&device);
        let template = Template::thin_shell(texture, 200.0, 150.0).unwrap();
        ModelBundle::new(network, template, camera, card)
    }

    /// A frame whose answer is its truth, and a result of an error.
    fn frame(index: u64, error: f64, measured: bool) -> (EvaluationFrame, Estimate, FrameResult) {
        let mut maps = Maps::empty(480, 270);
        for pixel in (0..200).flat_map(|y| (0..300).map(move |x| y * 480 + x)) {
            maps.set(
                pixel,
                400.0,
                [(pixel % 480) as f32 / 300.0, (pixel / 480) as f32 / 200.0],
            );
        }
        let truth = if measured {
            FrameTruth::Measured {
                depth_mm: vec![400.0; 480 * 270],
                mask: None,
            }
        } else {
            FrameTruth::Exact {
                maps: maps.clone(),
                has_template: true,
            }
        };
        let image = Picture::from_fn(480, 270, |_, _| [90; 3]);
        let judgement = Judgement {
            found: true,
            confidence: 0.5,
            area: 0.1,
        };
        let estimate = Estimate {
            maps,
            canonical: image.clone(),
            judgement,
        };
        let result = FrameResult {
            index,
            has_template: index != 4,
            judgement,
            metrics: FrameMetrics {
                registration_rmse_px: Some(error),
                depth_rmse_mm: Some(error),
                ..FrameMetrics::default()
            },
            photometric_error: None,
            measured_pixels: None,
            fit: None,
            seconds: None,
        };
        let camera = training_camera();
        (EvaluationFrame { image, camera, truth }, estimate, result)
    }

    #[test]
    fn five_frames_are_spread_over_the_set_and_the_worst_comes_last() {
        let mut chosen = Chosen::new(20);
        for index in 0..20 {
            let (frame, estimate, result) = frame(index, if index == 13 { 9.0 } else { 1.0 }, false);
            chosen.offer(&frame, &estimate, &result);
        }
        let rows = chosen.rows(&bundle(), "here, ");
        let starts = [
            "frame 0:",
            "frame 5:",
            "frame 8:",
            "frame 12:",
            "frame 16:",
            "the worst, frame 13:",
        ];
        assert_eq!(rows.len(), starts.len());
        for (row, start) in rows.iter().zip(starts) {
            assert!(row.caption.starts_with(&format!("here, {start}")), "{}", row.caption);
        }
    }

    #[test]
    fn a_row_has_its_columns_with_colour_bars_and_a_recording_those_that_are_known() {
        let bundle = bundle();
        let panels = |measured| {
            let (frame, estimate, result) = frame(0, 1.0, measured);
            columns(&Frame::new(&frame, &estimate, &result), &bundle)
        };
        let exact = panels(false);
        let titles: Vec<&str> = exact.iter().map(|panel| panel.title.as_str()).collect();
        let expected = [
            "input",
            "true depth",
            "depth",
            "u",
            "v",
            "depth error",
            "registration error",
            "I_avg",
        ];
        assert_eq!(titles, expected);
        let units: Vec<Option<&str>> = exact
            .iter()
            .map(|panel| panel.bar.as_ref().map(|bar| bar.unit))
            .collect();
        let mm = Some("mm");
        assert_eq!(units, [None, mm, mm, Some(""), Some(""), mm, Some("px"), None]);
        assert!(
            exact
                .iter()
                .all(|panel| (panel.picture.width(), panel.picture.height()) == (480, 270))
        );
        // No error is the first colour of its bar; both depths have one scale.
        for panel in &exact[5..7] {
            let bar = panel.bar.as_ref().unwrap();
            assert_eq!(panel.picture.pixel(100, 100), bar.color(0.0));
        }
        assert_eq!(exact[1].bar, exact[2].bar);
        let measured = panels(true);
        assert_eq!(measured[1].title, "measured depth");
        assert_eq!(measured.len(), expected.len() - 1);
    }
}
