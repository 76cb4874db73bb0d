//! `deepsft-lab network-time`: what a forward pass costs on this machine's CPU.

mod turns;

use crate::bench::plain_arrays;
use crate::measuring::{Rival, Times, cores};
use anyhow::{Context, Result};
use clap::Args;
use deepsft::{Architecture, DeviceKind, FoldedNetwork, Stage};
use deepsft_cli::failure::usage;
use deepsft_cli::network_choice;
use deepsft_formats::write_file;
use deepsft_geometry::{CANONICAL_HEIGHT, CANONICAL_WIDTH, Maps, Picture};
use deepsft_network::{Block, start_device};
use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};
use std::time::Instant;

#[derive(Args)]
#[command(after_help = "\
The passes run with folded batch normalisation, with random weights or the model's. `deepsft network describe` lists the
layers.

Example:
  deepsft-lab network-time paper --passes 1")]
pub struct NetworkTimeArguments {
    /// compact, paper, r50f, or the folder of a model bundle
    #[arg(value_name = "NETWORK|DIR")]
    network: String,
    /// Passes to take the median of, after one to warm up
    #[arg(long, value_name = "N", default_value_t = 5, value_parser = clap::value_parser!(u32).range(1..))]
    passes: u32,
    /// Of the paper's network: our executor as far as the main block, and nothing by burn
    #[arg(long)]
    main: bool,
    /// Measure nothing; write the network, one image and what it says of it as plain arrays, which other programs can read
    #[arg(long, value_name = "DIR")]
    export: Option<PathBuf>,
    /// Name of another program that runs the same network, in turns with our executor on one thread and on all; see `bench`
    #[arg(long, value_name = "NAME", hide = true, requires = "rival_command")]
    rival: Option<String>,
    /// Program and arguments of the rival
    #[arg(last = true, value_name = "COMMAND", hide = true, requires = "rival")]
    rival_command: Vec<String>,
    /// Write the figures of the turns to this file
    #[arg(long, value_name = "FILE", hide = true, requires = "rival")]
    json: Option<PathBuf>,
    /// Be the process that takes turns
    #[arg(long, hide = true)]
    take_turns: bool,
}

impl NetworkTimeArguments {
    /// What is read of the network.
    fn stage(&self) -> Stage {
        match self.main {
            true => Stage::Main,
            false => Stage::RegistrationRefinement,
        }
    }
}

/// Runs images through the network, by burn and by our executor, and prints median times and the peak memory of
/// this process. Operations are those of plain convolutions, also where the executor saves some.
pub fn run(arguments: &NetworkTimeArguments) -> Result<()> {
    let passes = arguments.passes;
    if let Some(name) = &arguments.rival {
        let command = &arguments.rival_command;
        let turns = turns::measure(&arguments.network, arguments.stage(), passes, Rival { name, command })?;
        return match &arguments.json {
            Some(path) => Ok(write_file(path, &serde_json::to_vec_pretty(&turns)?)?),
            None => Ok(()),
        };
    }
    let network = network_choice::named(&arguments.network)?.fold();
    if arguments.main && !matches!(network.config().architecture, Architecture::Paper(_)) {
        return Err(usage(
            "--main is for the paper's network: the others have no main block of their own".to_owned(),
        ));
    }
    if arguments.take_turns {
        return turns::take(&network.folded(), arguments.stage(), &image());
    }
    if let Some(folder) = &arguments.export {
        return export(&network.folded(), arguments.stage(), folder);
    }
    let (device, description) = pollster::block_on(start_device(DeviceKind::Cpu))?;
    let image = image();
    let mut layers = network.describe();
    layers.retain(|layer| !arguments.main || layer.block == Block::Main);
    let flops: u64 = layers.iter().map(|layer| layer.executed_flops).sum();
    let stage = arguments.stage();
    let measured = |way: &str, pass: &mut dyn FnMut() -> Result<()>| -> Result<()> {
        let mut milliseconds = Vec::new();
        // The first pass fills caches and thread pools.
        for number in 0..=passes {
            let start = Instant::now();
            pass()?;
            if number > 0 {
                milliseconds.push(start.elapsed().as_secs_f64() * 1e3);
            }
        }
        let times = Times::of(milliseconds).context("nothing was measured")?;
        println!(
            "{}: forward pass by {way} on the {}, {} threads: {:.4} s (median of {passes}, {:.4} to {:.4}), {:.1} GFLOP/s",
            arguments.network,
            description.adapter_name,
            cores(),
            times.median_ms / 1e3,
            times.min_ms / 1e3,
            times.max_ms / 1e3,
            flops as f64 / times.median_ms / 1e6
        );
        Ok(())
    };
    if !arguments.main {
        measured("burn", &mut || {
            pollster::block_on(network.infer(&[&image], &device))?;
            Ok(())
        })?;
    }
    let mut executor = network.folded().executor((CANONICAL_WIDTH, CANONICAL_HEIGHT))?;
    let mut maps = Maps::empty(CANONICAL_WIDTH, CANONICAL_HEIGHT);
    measured("our executor", &mut || {
        executor.run_to(stage, &image)?;
        Ok(executor.read(stage, None, &mut maps)?)
    })?;
    match peak_bytes() {
        Some(bytes) => println!("peak memory of this process: {:.0} MB", bytes as f64 / 1e6),
        None => println!("peak memory of this process: this system does not report it"),
    }
    Ok(())
}

fn image() -> Picture {
    Picture::from_fn(CANONICAL_WIDTH, CANONICAL_HEIGHT, |x, y| {
        [(x % 256) as u8, (y % 256) as u8, (x * y % 251) as u8]
    })
}

/// Writes the network, its image [1, 3, H, W], and what our executor says of all pixels at `stage`: depth [1, 1, H, W] in mm, (u, v)
/// [1, 2, H, W].
fn export(network: &FoldedNetwork, stage: Stage, folder: &Path) -> Result<()> {
    let image = image();
    let (width, height) = image.size();
    let mut executor = network.executor((width, height))?;
    let (mut maps, all) = (Maps::empty(width, height), vec![true; width * height]);
    executor.run_to(stage, &image)?;
    executor.read(stage, Some(&all), &mut maps)?;
    let channel = |k: usize| {
        image
            .rgb()
            .chunks_exact(3)
            .map(move |color| f32::from(color[k]) / 255.0)
    };
    let coordinate = |k: usize| (0..width * height).map(move |pixel| (pixel, k));
    let uv = [0, 1].into_iter().flat_map(coordinate);
    let arrays = [
        ("images", vec![1, 3, height, width], (0..3).flat_map(channel).collect()),
        ("depth_mm", vec![1, 1, height, width], maps.depth().to_vec()),
        (
            "uv",
            vec![1, 2, height, width],
            uv.map(|(pixel, k)| maps.uv(pixel)[k] as f32).collect(),
        ),
    ];
    plain_arrays::write_network(network, &arrays, BTreeMap::new(), folder)
}

/// The most memory that this process has held so far, where the system has it in a file (Linux).
fn peak_bytes() -> Option<u64> {
    let status = fs::read_to_string("/proc/self/status").ok()?;
    peak_of(&status)
}

/// `VmHWM` of the text of a Linux process's status.
fn peak_of(status: &str) -> Option<u64> {
    let line = status.lines().find_map(|line| line.strip_prefix("VmHWM:"))?;
    let kibibytes: u64 = line.trim().strip_suffix("kB")?.trim().parse().ok()?;
    Some(kibibytes * 1024)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_peak_is_read_from_a_process_s_status() {
        let status = "VmPeak:\t  123456 kB\nVmHWM:\t    2048 kB\nVmRSS:\t    1024 kB\n";
        assert_eq!(peak_of(status), Some(2_097_152));
        assert_eq!(peak_of("VmRSS:\t 1 kB\n"), None);
    }
}
