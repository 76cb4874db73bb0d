//! What a checkpoint of step 1 belongs to.

use crate::config::TrainConfig;
use crate::data::SampleSource;
use deepsft::NetworkConfig;
use sha2::{Digest, Sha256};

/// What the parts of a fingerprint are of, as [`CheckpointMismatch`](crate::TrainError::CheckpointMismatch) says it.
const PARTS: [&str; 3] = [
    "template or with other training images",
    "network",
    "preset (optimiser, learning rates, batches, loss, averaging or epochs)",
];

/// What must be equal for a checkpoint to be continued, as three hashes: of the samples, of the network and of the settings
/// but for the budget, of which only shares count, and for what changes no more than rounding: devices and precision.
/// `epoch_samples` are those of an epoch of `source`.
pub(crate) fn fingerprint(
    source: &(impl SampleSource + ?Sized),
    network: &NetworkConfig,
    config: &TrainConfig,
    epoch_samples: Option<u64>,
) -> String {
    let TrainConfig {
        optimizer,
        schedule,
        loss,
        average_decay,
        ..
    } = config;
    [
        source.fingerprint(),
        format!("{network:?}"),
        format!("{optimizer:?} {schedule:?} {loss:?} {average_decay} {epoch_samples:?}"),
    ]
    .map(|text| {
        Sha256::digest(text)
            .iter()
            .map(|byte| format!("{byte:02x}"))
            .collect::<String>()
    })
    .join("-")
}

/// In what two fingerprints differ; `None` when they are equal.
pub(crate) fn difference(saved: &str, now: &str) -> Option<&'static str> {
    if saved == now {
        return None;
    }
    let (saved, now): (Vec<&str>, Vec<&str>) = (saved.split('-').collect(), now.split('-').collect());
    let part = saved.iter().zip(&now).position(|(saved, now)| saved != now);
    // Earlier versions of this program wrote one hash.
    Some(match part {
        Some(part) if saved.len() == PARTS.len() => PARTS[part],
        _ => "version of this program",
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Budget, Precision};
    use deepsft_geometry::{Picture, Template, training_camera};
    use deepsft_synth::{SynthConfig, Synthesizer};

    #[test]
    fn another_training_has_another_fingerprint_and_a_longer_one_the_same() {
        let synthesizer = |size_mm: f64| {
            let texture = Picture::from_fn(4, 3, |_, _| [9; 3]);
            let template = Template::thin_shell(texture, size_mm, 150.0).unwrap();
            Synthesizer::new(&template, SynthConfig::default()).unwrap()
        };
        let (here, elsewhere) = (synthesizer(200.0), synthesizer(210.0));
        let compact = |width: f64| NetworkConfig::compact([width, 150.0], &training_camera());
        let ours = TrainConfig::ours();
        let now = fingerprint(&here, &compact(200.0), &ours, None);
        let of = |source, width, config: &TrainConfig, epoch| {
            difference(&fingerprint(source, &compact(width), config, epoch), &now)
        };
        let longer = TrainConfig {
            budget: Budget::Samples(7),
            evaluate_every: 1.0,
            workers: 5,
            precision: Precision::BF16,
            ..ours.clone()
        };
        assert_eq!(of(&here, 200.0, &longer, None), None);
        assert_eq!(of(&elsewhere, 200.0, &ours, None), Some(PARTS[0]));
        assert_eq!(of(&here, 210.0, &ours, None), Some(PARTS[1]));
        assert_eq!(of(&here, 200.0, &ours, Some(9)), Some(PARTS[2]));
        let changes: [fn(&mut TrainConfig); 4] = [
            |config| config.optimizer = TrainConfig::paper().optimizer,
            |config| config.schedule.peak *= 2.0,
            |config| config.loss.mask *= 2.0,
            |config| config.average_decay = 0.0,
        ];
        for change in changes {
            let mut config = ours.clone();
            change(&mut config);
            assert_eq!(of(&here, 200.0, &config, None), Some(PARTS[2]), "{config:?}");
        }
        assert_eq!(difference("0123456789abcdef", &now), Some("version of this program"));
    }
}
