//! `deepsft network`: what a network is made of and what it costs.

mod cost;
mod layer_table;

use crate::input;
use anyhow::Result;
use clap::{Args, Subcommand};
use deepsft::{DeviceKind, Network, NetworkConfig, start_device};
use deepsft_geometry::training_camera;
use std::path::Path;

/// Size of the template that a network without a model is described for, mm: A4. No layer depends on it.
const TEMPLATE_SIZE_MM: [f64; 2] = [297.0, 210.0];

#[derive(Subcommand)]
pub enum NetworkCommand {
    /// Print a network's layers: sizes, parameters and operations, by block and in all.
    #[command(after_help = "\
Operations are those of convolutions and dense layers for one 480 x 270 image, a multiplication and an addition
counted as two. A network by its name is described as it is trained, with batch normalisation (four parameters a
channel); that of a model is folded. The passes of --time are on the CPU, folded, with random weights or the model's.

Examples:
  deepsft network describe paper
  deepsft network describe compact --time
  deepsft network describe models/poster-a4")]
    Describe(DescribeArguments),
}

#[derive(Args)]
pub struct DescribeArguments {
    /// compact, paper, r50f, or the folder of a model bundle
    #[arg(value_name = "NETWORK|DIR")]
    network: String,
    /// Also run forward passes on this machine's CPU: time and peak memory
    #[arg(long)]
    time: bool,
    /// Passes to take the median of, after one to warm up
    #[arg(long, value_name = "N", default_value_t = 5, value_parser = clap::value_parser!(u32).range(1..), requires = "time")]
    passes: u32,
}

pub fn run(command: &NetworkCommand) -> Result<()> {
    let NetworkCommand::Describe(arguments) = command;
    let network = network(&arguments.network)?;
    print!(
        "{}",
        layer_table::text(network.config().architecture.name(), &network.describe())
    );
    if arguments.time {
        cost::print(network.fold(), arguments.passes)?;
    }
    Ok(())
}

/// The network called `name`, untrained, or that of the model bundle in the folder `name`.
fn network(name: &str) -> Result<Network> {
    let camera = training_camera();
    let config = match name {
        "compact" => NetworkConfig::compact(TEMPLATE_SIZE_MM, &camera),
        "paper" => NetworkConfig::paper(TEMPLATE_SIZE_MM, &camera),
        "r50f" => NetworkConfig::r50f(TEMPLATE_SIZE_MM, &camera),
        folder => return Ok(input::bundle(Path::new(folder))?.network().clone()),
    };
    let (device, _) = pollster::block_on(start_device(DeviceKind::Cpu))?;
    Ok(config.init(&device))
}
