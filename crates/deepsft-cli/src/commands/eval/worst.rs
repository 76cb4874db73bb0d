//! The sheet of the worst frames.

use crate::output::{panels, sheet};
use deepsft::{Estimate, ModelBundle};
use deepsft_geometry::{Maps, Picture};
use deepsft_train::{EvaluationFrame, FrameResult};

/// Frames on the sheet.
const WORST: usize = 12;

/// Ends of the error scales on the sheet, mm.
const DEPTH_SCALE_MM: f64 = 50.0;
const REGISTRATION_SCALE_MM: f64 = 20.0;

/// The frames with the largest registration error, worst first.
#[derive(Default)]
pub struct Worst {
    frames: Vec<Frame>,
}

/// A frame and the answer to it, to be drawn.
pub struct Frame {
    pub result: FrameResult,
    pub image: Picture,
    pub predicted: Maps,
    /// As [`deepsft_train::FrameTruth::reference`] has it.
    pub truth: Maps,
    pub has_registration: bool,
}

impl Frame {
    pub fn new(frame: &EvaluationFrame, estimate: &Estimate, result: &FrameResult) -> Self {
        Self {
            result: *result,
            image: estimate.canonical.clone(),
            predicted: estimate.maps.clone(),
            truth: frame.truth.reference(&estimate.maps).into_owned(),
            has_registration: frame.truth.has_registration(),
        }
    }

    /// What a sheet says of the frame.
    pub fn caption(&self) -> String {
        let metrics = &self.result.metrics;
        format!(
            "frame {}: registration {} px, depth {} mm, mask IoU {}, coverage {}, confidence {:.2}",
            self.result.index,
            number(metrics.registration_rmse_px, 3),
            number(metrics.depth_rmse_mm, 3),
            number(metrics.mask_iou, 3),
            number(metrics.coverage, 3),
            self.result.judgement.confidence,
        )
    }
}

impl Worst {
    /// Keeps a frame if it is among the worst so far.
    pub fn offer(&mut self, frame: &EvaluationFrame, estimate: &Estimate, result: &FrameResult) {
        let bad = badness(result, frame.truth.has_registration());
        let at = self
            .frames
            .partition_point(|kept| badness(&kept.result, kept.has_registration) >= bad);
        if !result.has_template || at >= WORST {
            return;
        }
        self.frames.insert(at, Frame::new(frame, estimate, result));
        self.frames.truncate(WORST);
    }

    /// The rows of the sheet.
    pub fn rows(&self, bundle: &ModelBundle) -> Vec<sheet::Row> {
        let size = bundle.template().size_mm();
        let row = |frame: &Frame| {
            let Frame {
                image,
                predicted,
                truth,
                ..
            } = frame;
            let mut panels = vec![
                panels::plain("input", image),
                panels::overlay("registration, estimated", image, predicted, size),
            ];
            if frame.has_registration {
                panels.push(panels::overlay("registration, true", image, truth, size));
            }
            panels.push(panels::depth_error("depth error", predicted, truth, DEPTH_SCALE_MM));
            if frame.has_registration {
                let title = "registration error";
                panels.push(panels::registration_error(
                    title,
                    predicted,
                    truth,
                    size,
                    REGISTRATION_SCALE_MM,
                ));
            }
            sheet::Row {
                caption: frame.caption(),
                panels: panels.into_iter().map(halved).collect(),
            }
        };
        self.frames.iter().map(row).collect()
    }
}

/// A number, or a dash where there is none.
fn number(value: Option<f64>, digits: usize) -> String {
    value.map_or_else(|| "-".to_owned(), |value| format!("{value:.digits$}"))
}

/// Half the size: many rows are to fit on a screen.
pub fn halved(panel: sheet::Panel) -> sheet::Panel {
    sheet::Panel {
        picture: panel.picture.halved(),
        ..panel
    }
}

/// The order of the sheet: frames without any answer first, then by registration error; where nobody knows the
/// registration, by depth error.
pub fn badness(result: &FrameResult, has_registration: bool) -> f64 {
    let metrics = &result.metrics;
    let error = if has_registration {
        metrics.registration_rmse_px
    } else {
        metrics.depth_rmse_mm
    };
    error.unwrap_or(f64::INFINITY)
}

#[cfg(test)]
mod tests {
    use super::*;
    use deepsft::Judgement;
    use deepsft_geometry::Template;
    use deepsft_geometry::metrics::FrameMetrics;
    use deepsft_synth::{SynthConfig, Synthesizer};

    fn template() -> Template {
        Template::thin_shell(
            Picture::from_fn(40, 30, |x, y| [6 * x as u8, 8 * y as u8, 90]),
            200.0,
            150.0,
        )
        .unwrap()
    }

    #[test]
    fn the_worst_frames_are_kept_in_order_and_those_without_the_object_are_not() {
        let frame: EvaluationFrame = Synthesizer::new(&template(), SynthConfig::default())
            .unwrap()
            .sample(1, 0)
            .into();
        let judgement = Judgement {
            found: true,
            confidence: 0.5,
            area: 0.1,
        };
        let estimate = Estimate {
            maps: Maps::empty(480, 270),
            canonical: frame.image.clone(),
            judgement,
        };
        let mut worst = Worst::default();
        for index in 0..30 {
            let error = if index == 7 {
                None
            } else {
                Some((index * 11 % 30) as f64)
            };
            let metrics = FrameMetrics {
                registration_rmse_px: error,
                ..FrameMetrics::default()
            };
            let has_template = index != 8;
            let result = FrameResult {
                index,
                has_template,
                judgement,
                metrics,
                photometric_error: None,
                measured_pixels: None,
                fit: None,
                seconds: None,
            };
            worst.offer(&frame, &estimate, &result);
        }
        let errors: Vec<f64> = worst.frames.iter().map(|frame| badness(&frame.result, true)).collect();
        // 8 * 11 = 28 mod 30 is without the object.
        let expected = [
            f64::INFINITY,
            29.0,
            27.0,
            26.0,
            25.0,
            24.0,
            23.0,
            22.0,
            21.0,
            20.0,
            19.0,
            18.0,
        ];
        assert_eq!(errors, expected);
    }
}
