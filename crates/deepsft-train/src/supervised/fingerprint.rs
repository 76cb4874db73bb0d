//! What a checkpoint of step 1 belongs to.

use super::trunk::Trunk;
use crate::config::TrainConfig;
use crate::data::SampleSource;
use crate::run::Fingerprint;
use deepsft::NetworkConfig;

/// The names of the parts, as [`CheckpointMismatch`](crate::TrainError::CheckpointMismatch) has them.
const SAMPLES: &str = "template or with other training images";
const NETWORK: &str = "network";
const SETTINGS: &str = "preset (optimiser, learning rates, batches, loss, averaging or epochs)";

const BEGINNING: &str = "beginning (--from)";

/// What must be equal for a checkpoint to be continued: the samples, the network and the settings. Of the budget only
/// fractions count. `epoch_samples` are those of an epoch of `source`.
pub(crate) fn fingerprint(
    source: &(impl SampleSource + ?Sized),
    network: &NetworkConfig,
    config: &TrainConfig,
    epoch_samples: Option<u64>,
    trunk: Option<&Trunk>,
) -> Fingerprint {
    let TrainConfig {
        optimizer,
        schedule,
        loss,
        average_decay,
        ..
    } = config;
    let fingerprint = Fingerprint::default()
        .with(SAMPLES, &source.fingerprint())
        .with(NETWORK, network)
        .with(SETTINGS, &(optimizer, schedule, loss, average_decay, epoch_samples));
    match trunk {
        Some(trunk) => fingerprint.with(BEGINNING, &trunk.sha256),
        None => fingerprint,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Budget;
    use deepsft::Weights;
    use deepsft_geometry::{Picture, Template, training_camera};
    use deepsft_synth::{SynthConfig, Synthesizer};
    use std::path::PathBuf;

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
        let now = fingerprint(&here, &compact(200.0), &ours, None, None);
        let of = |source, width, config: &TrainConfig, epoch| {
            now.difference(&fingerprint(source, &compact(width), config, epoch, None))
        };
        let longer = TrainConfig {
            budget: Budget::Samples(7),
            evaluate_every: 1.0,
            workers: 5,
            ..ours.clone()
        };
        assert_eq!(of(&here, 200.0, &longer, None), None);
        assert_eq!(of(&elsewhere, 200.0, &ours, None), Some(SAMPLES.to_owned()));
        assert_eq!(of(&here, 210.0, &ours, None), Some(NETWORK.to_owned()));
        assert_eq!(of(&here, 200.0, &ours, Some(9)), Some(SETTINGS.to_owned()));
        let begun = |sha256: &str| {
            let trunk = Trunk {
                path: PathBuf::new(),
                sha256: sha256.to_owned(),
                weights: Weights::new(),
            };
            fingerprint(&here, &compact(200.0), &ours, None, Some(&trunk))
        };
        assert_eq!(begun("a").difference(&begun("a")), None);
        for (now, saved) in [
            (begun("a"), now.clone()),
            (now.clone(), begun("a")),
            (begun("b"), begun("a")),
        ] {
            assert_eq!(now.difference(&saved), Some(BEGINNING.to_owned()));
        }
        let changes: [fn(&mut TrainConfig); 4] = [
            |config| config.optimizer = TrainConfig::paper().optimizer,
            |config| config.schedule.peak *= 2.0,
            |config| config.loss.mask *= 2.0,
            |config| config.average_decay = 0.0,
        ];
        for change in changes {
            let mut config = ours.clone();
            change(&mut config);
            assert_eq!(of(&here, 200.0, &config, None), Some(SETTINGS.to_owned()), "{config:?}");
        }
    }
}
