//! `deepsft bundle`: looking after model bundles.

use crate::failure::BlameInput;
use crate::input;
use anyhow::{Result, bail};
use clap::Subcommand;
use deepsft::{DeviceKind, ModelBundle};
use deepsft_geometry::{Maps, Picture};
use std::path::PathBuf;

#[derive(Subcommand)]
pub enum BundleCommand {
    /// Check that a model bundle is whole and works: version, sizes and hashes of its files, shapes of the weights,
    /// template and camera against the network, and one image through the network.
    #[command(
        after_help = "The exit code is 3, with the reason, when it is not.\n\nExample:\n  deepsft bundle verify models/poster-a4"
    )]
    Verify {
        /// Folder of the bundle
        #[arg(value_name = "DIR")]
        bundle: PathBuf,
    },
}

pub fn run(command: &BundleCommand) -> Result<()> {
    let BundleCommand::Verify { bundle: folder } = command;
    let bundle = input::bundle(folder)?;
    try_out(&bundle).blame("model bundle", folder)?;
    print(&bundle);
    println!("whole and working: {}", folder.display());
    Ok(())
}

/// Runs the network once: weights of the right shapes can still hold something that is no number.
fn try_out(bundle: &ModelBundle) -> Result<()> {
    let (estimator, _) = input::estimator(bundle, DeviceKind::Cpu)?;
    let camera = estimator.training_camera();
    let image = Picture::from_fn(camera.size().width, camera.size().height, |x, y| {
        [x as u8, y as u8, 128]
    });
    let maps = pollster::block_on(estimator.infer(&image, camera))?;
    if !is_finite(&maps) {
        bail!("the network's maps hold values that are no numbers");
    }
    Ok(())
}

fn is_finite(maps: &Maps) -> bool {
    maps.depth()
        .iter()
        .chain(maps.registration().iter().flatten())
        .all(|value| value.is_finite())
}

fn print(bundle: &ModelBundle) {
    let (card, size) = (bundle.card(), bundle.template().size_mm());
    let licence = card.licence.as_deref().unwrap_or("not stated");
    println!("{}, licence {licence}", bundle.name());
    println!("template {} x {} mm", size.x, size.y);
    let camera = bundle.camera();
    println!("trained for {} pixels, f = {}", camera.size(), camera.focal().x);
    let (samples, minutes) = (card.provenance.samples, card.provenance.seconds / 60.0);
    println!("trained on {samples} samples in {minutes:.0} minutes");
    let figure = |value: Option<f64>| value.map_or_else(|| "unknown".to_owned(), |value| format!("{value:.2}"));
    let accuracy = &card.accuracy;
    println!(
        "on {} held-out frames: registration {} px, depth {} mm (medians), mask IoU {} (mean)",
        accuracy.frames,
        figure(accuracy.registration_rmse_px),
        figure(accuracy.depth_rmse_mm),
        figure(accuracy.mask_iou),
    );
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn one_value_that_is_no_number_is_found() {
        let mut maps = Maps::empty((4, 3));
        assert!(is_finite(&maps));
        maps.set(5, 400.0, [0.5, f32::NAN]);
        assert!(!is_finite(&maps));
        maps.set(5, f32::INFINITY, [0.5, 0.5]);
        assert!(!is_finite(&maps));
    }
}
