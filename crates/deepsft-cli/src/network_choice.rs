//! Which network a command line asks for: an architecture to train, or a network by name or from a bundle.

use crate::failure::{BlameInput, usage};
use crate::input;
use anyhow::{Result, anyhow};
use clap::ValueEnum;
use deepsft::{Architecture, CompactConfig, DeviceKind, NetworkConfig, PaperConfig, R50FConfig};
use deepsft_geometry::{Camera, training_camera};
use deepsft_network::{Network, start_device};
use std::path::Path;

/// Size of the template that a network without a model is made for, mm: A4. No layer depends on it.
const TEMPLATE_SIZE_MM: [f64; 2] = [297.0, 210.0];

/// An architecture by its name.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum NetworkChoice {
    /// The network that ships: the paper's structure with a 250th of its operations
    Compact,
    /// The paper's network, 354 GFLOP per image
    Paper,
    /// A ResNet-50 with dense layers, the first method that the paper compares itself with
    R50f,
}

impl NetworkChoice {
    /// The network for a template of `template_size_mm` seen by `camera`, its widths divided by `width_divisor`.
    pub fn config(self, width_divisor: usize, template_size_mm: [f64; 2], camera: &Camera) -> Result<NetworkConfig> {
        let architecture = match (self, width_divisor) {
            (Self::Compact, 1) => Architecture::Compact(CompactConfig::default()),
            (Self::Compact, _) => return Err(usage("--width-divisor is for --network paper and r50f")),
            (Self::Paper, 1) => Architecture::Paper(PaperConfig::default()),
            (Self::Paper, divisor) => Architecture::Paper(PaperConfig::narrow(divisor)),
            (Self::R50f, 1) => Architecture::R50F(R50FConfig::default()),
            (Self::R50f, divisor) => Architecture::R50F(R50FConfig::narrow(divisor)),
        };
        Ok(NetworkConfig::new(architecture, template_size_mm, camera))
    }
}

/// The network called `name`, untrained, or that of the model bundle in the folder `name`.
pub fn named(name: &str) -> Result<Network> {
    let (device, _) = pollster::block_on(start_device(DeviceKind::Cpu))?;
    let Ok(choice) = NetworkChoice::from_str(name, false) else {
        let folder = Path::new(name);
        if !folder.exists() {
            let reason = "there is no such folder: check the path, or name a network (compact, paper, r50f)";
            return Err(anyhow!(reason)).blame("model bundle", folder);
        }
        let bundle = input::bundle(folder)?;
        return Ok(Network::from_folded(bundle.network(), &device)?);
    };
    let config = choice.config(1, TEMPLATE_SIZE_MM, &training_camera())?;
    Ok(Network::new(&config, &device))
}
