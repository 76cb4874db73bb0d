//! `deepsft train`: a model bundle for a template.

mod arguments;
mod data_sets;
mod plan;
mod progress_lines;
mod recording_steps;
mod training;

use crate::failure::{BlameInput, usage};
use crate::{input, synthesis};
use anyhow::{Result, bail};
pub use arguments::TrainArguments;
use data_sets::DataSets;
use deepsft::ModelBundle;
use deepsft_formats::recover_folder;
use deepsft_network::start_device;
use plan::Plan;
use std::sync::Arc;
use training::{BUNDLE_FOLDER, Training};

pub fn run(arguments: &TrainArguments) -> Result<()> {
    let mut plan = Plan::new(arguments)?;
    deepsft_formats::check_folder(&arguments.out, &BUNDLE_FOLDER)?;
    // Two trainings would overwrite each other's checkpoints.
    let alone = deepsft_formats::FolderLock::acquire(&arguments.out)?;
    for checkpoint in plan.checkpoints() {
        recover_folder(&checkpoint)?;
        if !arguments.resume && checkpoint.exists() {
            bail!(
                "there is a checkpoint of an earlier training: add --resume to go on with it, or remove it: {}",
                checkpoint.display()
            );
        }
    }
    let (template, bundle) = match (&arguments.template, &arguments.model) {
        (Some(folder), _) => (deepsft_formats::read_template(folder)?, None),
        (None, Some(folder)) => {
            let bundle = input::bundle(folder)?;
            check_blocks(&bundle, &plan).blame("model bundle", folder)?;
            (bundle.template().clone(), Some(bundle))
        }
        (None, None) => return Err(usage("--template or --model is needed")),
    };
    let data_sets = DataSets::open(&arguments.data, &template, plan.config.held_out_frames)?;
    if let Some(data_sets) = &data_sets {
        let DataSets { training, held_out, .. } = data_sets;
        plan.take_training_samples(*training);
        let sets = if arguments.data.len() == 1 { "set" } else { "sets" };
        println!("data {sets}: {training} samples to train on, {held_out} held out at the end");
    }
    let (device, description) = pollster::block_on(start_device(arguments.device))?;
    let synthesizer = Arc::new(synthesis::synthesizer(&template, &arguments.images)?);
    println!("training on {} ({})", description.kind, description.adapter_name);
    let training = Training {
        plan: &plan,
        alone: &alone,
        synthesizer,
        data_sets,
        device,
        description,
    };
    let (mut bundle, curve) = match bundle {
        None => training.step_one()?,
        Some(bundle) => (bundle, Vec::new()),
    };
    if let Some(recording) = &arguments.recording {
        bundle = training.recording_steps(bundle, &curve, recording)?;
    }
    println!("model bundle: {} ({})", arguments.out.display(), bundle.name());
    Ok(())
}

/// Checks that the network has the blocks that are to be trained.
fn check_blocks(bundle: &ModelBundle, plan: &Plan<'_>) -> Result<()> {
    let stages = bundle.network().config.architecture.stages();
    for step in &plan.steps {
        if !stages.contains(&step.block().stage()) {
            bail!(
                "its network has no {}, which step {} trains",
                step.block().name(),
                step.number()
            );
        }
    }
    Ok(())
}
