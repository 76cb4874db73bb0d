//! From a finished training to a model bundle: the rule for "found" is set and the accuracy measured
//! on held-out frames.

use super::training::Trained;
use crate::config::TrainConfig;
use crate::error::TrainError;
use crate::evaluation::Evaluation;
use deepsft::{Accuracy, Estimator, FoundRule, ModelBundle, ModelCard, Provenance};
use deepsft_synth::Synthesizer;

/// Seed of the frames that set the rule for "found" and the accuracy on a model's card. It is not one to train with, nor that
/// of the held-out frames.
pub const ACCURACY_SEED: u64 = 0xca1b;

/// Confidence a frame must have at least, whatever the frames say.
const MIN_CONFIDENCE: f64 = 0.1;

/// What nobody measures of a model: it comes from who trains it.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct ModelLabel {
    /// Name for people.
    pub name: String,
    /// Licence of the model, an SPDX expression; `None` states none.
    pub licence: Option<String>,
    /// The command that trained it.
    pub command: String,
}

/// Makes a bundle with this `label` of a finished training. `synthesizer` makes the frames that are measured
/// ([`TrainConfig::accuracy_frames`], some of them without the template).
///
/// # Errors
/// [`TrainError`] when the bundle cannot be put together or the device fails.
pub fn export_bundle(
    trained: Trained,
    synthesizer: &Synthesizer,
    config: &TrainConfig,
    label: ModelLabel,
) -> Result<ModelBundle, TrainError> {
    let template = synthesizer.template().clone();
    let card = ModelCard {
        name: label.name,
        licence: label.licence,
        found: FoundRule::default(),
        provenance: Provenance {
            command: label.command,
            seed: config.seed,
            samples: trained.state.samples,
            seconds: trained.state.seconds,
            deepsft_version: env!("CARGO_PKG_VERSION").to_owned(),
        },
        accuracy: Accuracy::default(),
    };
    let bundle = ModelBundle::new(trained.network.folded(), template, synthesizer.config().camera, card);
    // Measured as it will be read: its weights are rounded.
    let mut bundle = ModelBundle::from_files(&bundle.to_files()?)?;
    let estimator = Estimator::new(&bundle, &deepsft::Device::Cpu)?;
    let samples = (0..config.accuracy_frames).map(|index| synthesizer.sample(ACCURACY_SEED, index));
    let evaluation = Evaluation::run(&estimator, None, synthesizer.template(), samples, |_, _, _, _| {})?;
    synthesizer.check_photographs()?;
    let mut card = bundle.card().clone();
    card.found.min_confidence = separating_confidence(&evaluation, card.found.min_area);
    let summary = evaluation.summary();
    card.accuracy = Accuracy {
        frames: config.accuracy_frames,
        registration_rmse_px: summary.median.registration_rmse_px,
        depth_rmse_mm: summary.median.depth_rmse_mm,
        mask_iou: summary.mean.mask_iou,
    };
    bundle.set_card(card);
    Ok(bundle)
}

/// The confidence that best separates frames with and without the template: the fewest frames on the
/// wrong side as fractions of their kind, the middle of the best interval.
fn separating_confidence(evaluation: &Evaluation, min_area: f64) -> f64 {
    let confidences = |with: bool| -> Vec<f64> {
        let counted = evaluation.frames.iter().filter(|f| f.has_template == with);
        counted
            .filter(|f| f64::from(f.judgement.area) >= min_area)
            .map(|f| f64::from(f.judgement.confidence))
            .collect()
    };
    let (with, without) = (confidences(true), confidences(false));
    let frames_without = evaluation.frames.iter().filter(|f| !f.has_template).count().max(1) as f64;
    let cost = |t: f64| {
        let missed = with.iter().filter(|&&c| c < t).count() as f64 / with.len().max(1) as f64;
        let invented = without.iter().filter(|&&c| c >= t).count() as f64 / frames_without;
        missed + invented
    };
    let thresholds: Vec<f64> = (0..=80)
        .map(|i| f64::from(i) / 100.0)
        .filter(|&t| t >= MIN_CONFIDENCE)
        .collect();
    let best = thresholds.iter().map(|&t| cost(t)).fold(f64::INFINITY, f64::min);
    let optimal: Vec<f64> = thresholds.into_iter().filter(|&t| cost(t) <= best + 1e-9).collect();
    optimal.get(optimal.len() / 2).copied().unwrap_or(MIN_CONFIDENCE)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::evaluation::FrameResult;
    use deepsft::Judgement;

    fn frame(has_template: bool, confidence: f32, area: f32) -> FrameResult {
        FrameResult {
            has_template,
            judgement: Judgement {
                found: false,
                confidence,
                area,
                shape_determined: false,
            },
            ..FrameResult::default()
        }
    }

    #[test]
    fn the_threshold_lies_in_the_middle_of_the_gap() {
        let frames = vec![
            frame(true, 0.8, 0.2),
            frame(true, 0.6, 0.2),
            frame(false, 0.2, 0.1),
            frame(false, 0.0, 0.0),
        ];
        let t = separating_confidence(&Evaluation { frames }, 0.002);
        assert!((t - 0.4).abs() < 0.02, "{t}");
    }

    #[test]
    fn a_frame_whose_mask_is_too_small_does_not_count() {
        let frames = vec![frame(true, 0.5, 0.2), frame(false, 0.9, 0.0001)];
        let t = separating_confidence(&Evaluation { frames }, 0.002);
        assert!((MIN_CONFIDENCE..0.5).contains(&t), "{t}");
    }
}
