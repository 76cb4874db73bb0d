//! What a checkpoint of steps 2 and 3 belongs to, and the one that belongs to a network which is gone.

use super::recorded_frames::{RefinementData, RefinementStep};
use crate::TrainError;
use crate::config::{RefinementSteps, TrainConfig};
use crate::run::CheckpointFolder;
use burn::module::{Module, ModuleVisitor, Param};
use burn::tensor::Tensor;
use deepsft::Network;
use sha2::{Digest, Sha256};
use std::path::PathBuf;

/// What must be equal for a checkpoint to be continued, as three hashes: of the settings, of the network at the start, and
/// of the frames. The network has a say in the last: it tells where the object is in a frame, and in which frames it is.
pub(crate) fn fingerprint(
    network: &Network,
    step: RefinementStep,
    data: &RefinementData<'_>,
    config: &TrainConfig,
) -> String {
    let parts = [settings(network, step, data, config), weights(network), frames(data)];
    parts.join("-")
}

/// Whether two fingerprints are of the same settings, but of networks that are not the same at the start.
fn is_of_another_network(one: &str, other: &str) -> bool {
    let parts = |text: &str| -> Option<[String; 3]> {
        let parts: Vec<String> = text.split('-').map(str::to_owned).collect();
        parts.try_into().ok()
    };
    match (parts(one), parts(other)) {
        (Some([settings, network, _]), Some([other_settings, other_network, _])) => {
            settings == other_settings && network != other_network
        }
        _ => false,
    }
}

/// Puts the checkpoint at `config.checkpoint` aside if it is of the same `step` with the same settings and seed, but began
/// with another network. This is for a step whose `network` was trained further by the step before it, and comes before
/// [`refine`](crate::refine): which would refuse such a checkpoint, and now begins anew. Returns where the checkpoint is
/// kept: beside its place, with the ending `.outdated`, or `.outdated-2` and so on where that is taken.
///
/// Frames are not compared, as the network has a say in them, but for the number of frames in the recording.
///
/// # Errors
/// [`TrainError::Checkpoint`] names the file that cannot be read or moved.
pub fn set_aside_outdated(
    network: &Network,
    step: RefinementStep,
    data: RefinementData<'_>,
    config: &TrainConfig,
) -> Result<Option<PathBuf>, TrainError> {
    let folder = CheckpointFolder::new(&config.checkpoint);
    let Some((_, saved)) = folder.state()? else {
        return Ok(None);
    };
    let fingerprint = fingerprint(network, step, &data, config);
    if saved.seed == config.seed && is_of_another_network(&saved.fingerprint, &fingerprint) {
        return folder.set_aside();
    }
    Ok(None)
}

fn settings(network: &Network, step: RefinementStep, data: &RefinementData<'_>, config: &TrainConfig) -> String {
    // More epochs go on with the same training: order and rate depend on the epoch and the step alone.
    let whatever_long = |steps: RefinementSteps| RefinementSteps { epochs: 0, ..steps };
    let settings = match step {
        RefinementStep::Depth => format!("{:?} {:?}", whatever_long(config.depth_steps), config.depth_loss),
        RefinementStep::Registration => format!(
            "{:?} {:?}",
            whatever_long(config.registration_steps),
            config.photo_consistency
        ),
    };
    let recorded = data.frames.training.len() + data.frames.held_out.len() + data.frames.left_out;
    let mut hash = Sha256::new();
    hash.update(format!("{step:?} {settings} {:?} {recorded}", network.config()));
    hexadecimal(hash)
}

fn weights(network: &Network) -> String {
    struct Weights(Sha256);
    impl ModuleVisitor for Weights {
        fn visit_float<const D: usize>(&mut self, param: &Param<Tensor<D>>) {
            self.0.update(&param.val().into_data().bytes()[..]);
        }
    }
    let mut hash = Weights(Sha256::new());
    network.visit(&mut hash);
    hexadecimal(hash.0)
}

fn frames(data: &RefinementData<'_>) -> String {
    let mut hash = Sha256::new();
    for frame in &data.frames.training {
        hash.update(frame.image.rgb());
        hash.update(frame.index.to_le_bytes());
        hash.update(frame.level.to_le_bytes());
        frame.depth_mm.iter().for_each(|depth| hash.update(depth.to_le_bytes()));
        for mask in [&frame.depth_counts, &frame.inside] {
            mask.iter().for_each(|&counts| hash.update([u8::from(counts)]));
        }
    }
    hexadecimal(hash)
}

fn hexadecimal(hash: Sha256) -> String {
    hash.finalize().iter().map(|byte| format!("{byte:02x}")).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_checkpoint_is_outdated_by_its_network_alone() {
        let now = "settings-network-frames";
        for (saved, outdated) in [
            (now, false),
            ("settings-before-frames", true),
            // Another network may see the object elsewhere.
            ("settings-before-others", true),
            ("settings-network-others", false),
            ("others-before-frames", false),
            // Of an earlier version of this program.
            ("0123456789abcdef", false),
        ] {
            assert_eq!(is_of_another_network(saved, now), outdated, "{saved}");
        }
    }
}
