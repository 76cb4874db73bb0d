//! The pictures of `deepsft eval`: chosen frames of a set as the rows of a sheet.

use crate::output::{panels, sheet};
use deepsft::Estimate;
use deepsft_geometry::{Camera, Maps, Picture, Template};
use deepsft_train::{EvaluationFrame, FrameResult};

/// Ends of the error scales.
const DEPTH_SCALE_MM: f64 = 50.0;
const REGISTRATION_SCALE_PX: f64 = 10.0;

/// Which frames that show the object a picture has.
pub struct PictureKind {
    /// Frames spread over the set: the first from the beginning of each of so many equal parts on.
    spread: u64,
    /// The worst frames, which come after those.
    worst: usize,
    /// What the captions of the worst begin with.
    worst_are: &'static str,
}

/// `--sheet`: the worst frames.
pub const WORST: PictureKind = PictureKind {
    spread: 0,
    worst: 12,
    worst_are: "",
};

/// `--figure`: frames from all over the set.
pub const FIGURE: PictureKind = PictureKind {
    spread: 5,
    worst: 1,
    worst_are: "the worst, ",
};

/// The frames of a set that a picture shows.
pub struct DrawnFrames {
    kind: &'static PictureKind,
    count: u64,
    spread: Vec<Frame>,
    /// Worst first.
    worst: Vec<Frame>,
}

impl DrawnFrames {
    /// Nothing yet of a set of `count` frames.
    pub fn new(kind: &'static PictureKind, count: u64) -> Self {
        Self {
            kind,
            count,
            spread: Vec::new(),
            worst: Vec::new(),
        }
    }

    /// Keeps a frame if it belongs to those that are drawn, as far as the set is known until it.
    pub fn offer(&mut self, frame: &EvaluationFrame, estimate: &Estimate, compared: &Maps, result: &FrameResult) {
        if !result.has_template {
            return;
        }
        let kept = self.spread.len() as u64;
        if kept < self.kind.spread && result.index >= kept * self.count / self.kind.spread {
            self.spread.push(Frame::new(frame, estimate, compared, result));
        }
        let bad = badness(result, frame.truth.has_registration());
        let at = self.worst.partition_point(|kept| kept.badness() >= bad);
        if at < self.kind.worst {
            self.worst.insert(at, Frame::new(frame, estimate, compared, result));
            self.worst.truncate(self.kind.worst);
        }
    }

    /// The rows of the sheet, `place` before each caption, for maps of `camera`.
    pub fn rows(&self, template: &Template, camera: &Camera, place: &str) -> Vec<sheet::Row> {
        let row = |frame: &Frame, kind: &str| {
            let panels = columns(frame, template, camera).into_iter().map(sheet::Panel::halved);
            sheet::Row::new(format!("{place}{kind}{}", frame.caption()), panels)
        };
        let spread = self.spread.iter().map(|frame| row(frame, ""));
        let worst = self.worst.iter().map(|frame| row(frame, self.kind.worst_are));
        spread.chain(worst).collect()
    }
}

/// A frame and the answer to it, to be drawn.
struct Frame {
    result: FrameResult,
    image: Picture,
    predicted: Maps,
    /// The maps whose depth error is told, as [`EvaluationFrame::metrics`] has it.
    compared: Maps,
    /// As [`deepsft_train::FrameTruth::reference`] has it.
    truth: Maps,
    has_registration: bool,
}

impl Frame {
    fn new(frame: &EvaluationFrame, estimate: &Estimate, compared: &Maps, result: &FrameResult) -> Self {
        Self {
            result: *result,
            image: estimate.canonical.clone(),
            predicted: estimate.maps.clone(),
            compared: compared.clone(),
            truth: frame.truth.reference(&estimate.maps).into_owned(),
            has_registration: frame.truth.has_registration(),
        }
    }

    fn badness(&self) -> f64 {
        badness(&self.result, self.has_registration)
    }

    /// What a sheet says of the frame.
    fn caption(&self) -> String {
        let metrics = &self.result.metrics;
        let number = |value: Option<f64>| value.map_or_else(|| "-".to_owned(), |value| format!("{value:.3}"));
        format!(
            "frame {}: registration {} px, depth {} mm, mask IoU {}, coverage {}, confidence {:.2}",
            self.result.index,
            number(metrics.registration_rmse_px),
            number(metrics.depth_rmse_mm),
            number(metrics.mask_iou),
            number(metrics.coverage),
            self.result.judgement.confidence,
        )
    }
}

/// What the frames are ordered by: without any answer first, then by registration error; where nobody knows the
/// registration, by depth error.
fn badness(result: &FrameResult, has_registration: bool) -> f64 {
    let metrics = &result.metrics;
    let error = if has_registration {
        metrics.registration_rmse_px
    } else {
        metrics.depth_rmse_mm
    };
    error.unwrap_or(f64::INFINITY)
}

/// The columns, as in the tables of the paper; those that need a true registration are left out where there is none.
fn columns(frame: &Frame, template: &Template, camera: &Camera) -> Vec<sheet::Panel> {
    let (image, predicted, truth) = (&frame.image, &frame.predicted, &frame.truth);
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
        panels::depth_error("depth error", &frame.compared, truth, DEPTH_SCALE_MM),
    ];
    if frame.has_registration {
        columns.push(panels::registration_error_px(
            "registration error",
            predicted,
            truth,
            camera,
            template.into(),
            REGISTRATION_SCALE_PX,
        ));
    }
    columns.push(panels::average("I_avg", image, template.texture(), predicted));
    columns
}

#[cfg(test)]
mod tests {
    use super::*;
    use deepsft::Judgement;
    use deepsft_geometry::metrics::FrameMetrics;
    use deepsft_geometry::training_camera;
    use deepsft_train::FrameTruth;

    fn template() -> Template {
        let texture = Picture::from_fn(40, 30, |x, y| [6 * x as u8, 8 * y as u8, 90]);
        Template::thin_shell(texture, 200.0, 150.0).unwrap()
    }

    /// A frame whose answer is its truth, and a result of an error. Every fifth does not show the object.
    fn frame(index: u64, error: Option<f64>, measured: bool) -> (EvaluationFrame, Estimate, FrameResult) {
        let mut maps = Maps::empty((480, 270));
        for pixel in (0..200).flat_map(|y| (0..300).map(move |x| y * 480 + x)) {
            let uv = [(pixel % 480) as f32 / 300.0, (pixel / 480) as f32 / 200.0];
            maps.set(pixel, 400.0, uv);
        }
        let (depth_mm, mask, has_template) = (vec![400.0; 480 * 270], None, true);
        let exact = maps.clone();
        let truth = match measured {
            true => FrameTruth::Measured { depth_mm, mask },
            false => FrameTruth::Exact {
                maps: exact,
                has_template,
            },
        };
        let image = Picture::from_fn(480, 270, |_, _| [90; 3]);
        let judgement = Judgement {
            found: true,
            confidence: 0.5,
            area: 0.1,
            shape_determined: false,
        };
        let estimate = Estimate {
            by: None,
            surface: None,
            maps,
            canonical: image.clone(),
            canonical_camera: training_camera(),
            judgement,
        };
        let result = FrameResult {
            index,
            has_template: index % 5 != 4,
            judgement,
            metrics: FrameMetrics {
                registration_rmse_px: error,
                depth_rmse_mm: error,
                ..FrameMetrics::default()
            },
            photo_consistency_error: None,
            measured_pixels: None,
            network: None,
            seconds: None,
        };
        let camera = training_camera();
        (EvaluationFrame { image, camera, truth }, estimate, result)
    }

    /// The captions that `kind` has for a set of frames with these errors.
    fn captions(kind: &'static PictureKind, errors: &[Option<f64>]) -> Vec<String> {
        let mut drawn = DrawnFrames::new(kind, errors.len() as u64);
        for (index, &error) in (0..).zip(errors) {
            let (frame, estimate, result) = frame(index, error, false);
            drawn.offer(&frame, &estimate, &estimate.maps, &result);
        }
        let rows = drawn.rows(&template(), &training_camera(), "here, ");
        let start = |row: sheet::Row| row.caption.split(':').next().unwrap().to_owned();
        rows.into_iter().map(start).collect()
    }

    #[test]
    fn the_worst_frames_come_in_order_and_those_without_the_object_do_not() {
        let mut errors: Vec<Option<f64>> = (0..30).map(|index| Some(f64::from(index * 11 % 30))).collect();
        // No answer is worse than any. Frames 19, 4 and 24, with errors of 29, 14 and 24, do not show the object.
        errors[8] = None;
        let expected = [8, 27, 16, 5, 13, 2, 21, 10, 18, 7, 26, 15];
        assert_eq!(
            captions(&WORST, &errors),
            expected.map(|index| format!("here, frame {index}"))
        );
    }

    #[test]
    fn five_frames_are_spread_over_the_set_and_the_worst_comes_last() {
        let errors: Vec<Option<f64>> = (0..20).map(|index| Some(if index == 13 { 9.0 } else { 1.0 })).collect();
        let starts = ["", "", "", "", "", "the worst, "]
            .into_iter()
            .zip([0, 5, 8, 12, 16, 13]);
        let starts: Vec<String> = starts
            .map(|(kind, index)| format!("here, {kind}frame {index}"))
            .collect();
        assert_eq!(captions(&FIGURE, &errors), starts);
    }

    #[test]
    fn a_row_has_its_columns_with_colour_bars_and_a_recording_those_that_are_known() {
        let panels = |measured| {
            let (frame, estimate, result) = frame(0, Some(1.0), measured);
            let frame = Frame::new(&frame, &estimate, &estimate.maps, &result);
            columns(&frame, &template(), &training_camera())
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
        let units = exact.iter().map(|panel| panel.bar.as_ref().map(|bar| bar.unit));
        let mm = Some("mm");
        let expected_units = [None, mm, mm, Some(""), Some(""), mm, Some("px"), None];
        assert_eq!(units.collect::<Vec<_>>(), expected_units);
        let whole = |panel: &sheet::Panel| panel.picture.size() == (480, 270).into();
        assert!(exact.iter().all(whole));
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

    #[test]
    fn the_depth_error_is_drawn_of_the_compared_maps_where_the_models_own_mask_has_nothing() {
        let (frame, mut estimate, result) = frame(0, Some(1.0), true);
        let compared = std::mem::replace(&mut estimate.maps, Maps::empty((480, 270)));
        let mut frame = Frame::new(&frame, &estimate, &compared, &result);
        frame.truth = compared;
        let panels = columns(&frame, &template(), &training_camera());
        let error = panels.iter().find(|panel| panel.title == "depth error").unwrap();
        assert_eq!(error.picture.pixel(100, 100), error.bar.as_ref().unwrap().color(0.0));
    }
}
