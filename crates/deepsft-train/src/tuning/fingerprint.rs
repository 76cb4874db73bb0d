//! What a checkpoint of steps 2 and 3 belongs to, and the one that belongs to a network which is gone.

use super::recorded_frames::TuningSet;
use crate::config::{TrainConfig, TuningSettings, TuningStep};
use crate::error::TrainError;
use crate::run::{Checkpoint, CheckpointFolder, Fingerprint};
use deepsft_formats::{picture_fingerprint, sha256};
use deepsft_network::Network;
use serde::Serialize;
use std::path::PathBuf;

/// The names of the parts, as [`CheckpointMismatch`](crate::TrainError::CheckpointMismatch) has them.
const SETTINGS: &str = "preset, network, or number of recorded frames";
const START: &str = "network at its start";
const FRAMES: &str = "recording";

/// What must be equal for a checkpoint to be continued: the settings, the network at the start, and the frames. The network
/// has a say in the last: it tells where the object is in a frame, and in which frames it is.
pub(crate) fn fingerprint(
    network: &Network,
    step: TuningStep,
    set: &TuningSet<'_>,
    config: &TrainConfig,
) -> Fingerprint {
    // More epochs go on with the same training: order and rate depend on the epoch and the iteration alone.
    let tuning = TuningSettings {
        epochs: 0,
        ..config.tuning(step)
    };
    let recorded = set.frames.training.len() + set.frames.held_out.len() + set.frames.left_out;
    let fingerprint = Fingerprint::default();
    let (number, network_config) = (step.number(), network.config());
    let fingerprint = match step {
        TuningStep::Depth => fingerprint.with(SETTINGS, &(number, tuning, config.depth_loss, network_config, recorded)),
        TuningStep::Registration => fingerprint.with(
            SETTINGS,
            &(number, tuning, config.photo_consistency, network_config, recorded),
        ),
    };
    fingerprint.with(START, &weights(network)).with(FRAMES, &frames(set))
}

/// Puts a checkpoint aside that began with another network than `network`. It does so if the checkpoint at `config.checkpoint`
/// is of the same `step` with the same settings and seed. This is for a step whose `network` was trained further by the step
/// before it, and comes before [`tune`](crate::tune): which would refuse such a checkpoint, and now begins anew. Returns where
/// the checkpoint is kept: beside its place, with the ending `.outdated`, or `.outdated-2` and so on where that is taken.
///
/// Frames are not compared, as the network has a say in them, but for the number of frames in the recording.
///
/// # Errors
/// [`TrainError::Format`] names the file that cannot be read or moved.
pub fn set_aside_outdated(
    network: &Network,
    step: TuningStep,
    set: TuningSet<'_>,
    config: &TrainConfig,
) -> Result<Option<PathBuf>, TrainError> {
    let folder = CheckpointFolder::new(&config.checkpoint);
    let Some(saved) = folder.read::<Checkpoint>()?.map(|saved| saved.state) else {
        return Ok(None);
    };
    let now = fingerprint(network, step, &set, config);
    let outdated = now.agrees_in(&saved.fingerprint, SETTINGS) && !now.agrees_in(&saved.fingerprint, START);
    if saved.seed == config.seed && outdated {
        return folder.set_aside().map(Some);
    }
    Ok(None)
}

/// The hash of each weight's values.
fn weights(network: &Network) -> Vec<String> {
    let mut hashes = Vec::new();
    network.each_weight(|_, values| hashes.push(sha256(&values.bytes()[..])));
    hashes
}

/// The hashes of what is trained on of each frame.
fn frames(set: &TuningSet<'_>) -> Vec<impl Serialize> {
    let frames = set.frames.training.iter();
    frames
        .map(|frame| {
            let depth: Vec<u8> = frame.depth_mm.iter().flat_map(|depth| depth.to_le_bytes()).collect();
            let masks = [&frame.depth_counts, &frame.inside, &frame.object]
                .map(|mask| sha256(&mask.iter().map(|&set| u8::from(set)).collect::<Vec<_>>()));
            (
                frame.index,
                frame.level,
                picture_fingerprint(&frame.image),
                sha256(&depth),
                masks,
            )
        })
        .collect()
}
