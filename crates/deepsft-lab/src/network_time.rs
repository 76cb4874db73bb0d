//! `deepsft-lab network-time`: what a forward pass costs on this machine's CPU.

use crate::measuring::{Times, cores};
use anyhow::{Context, Result};
use clap::Args;
use deepsft::{DeviceKind, Stage, start_device};
use deepsft_cli::network_choice;
use deepsft_geometry::{CANONICAL_HEIGHT, CANONICAL_WIDTH, Maps, Picture};
use std::fs;
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
}

/// Runs images through the network, by burn and by the executor if it has one, and prints median times and the peak memory of
/// this process. Operations are those of plain convolutions, also where the executor saves some.
pub fn run(arguments: &NetworkTimeArguments) -> Result<()> {
    let passes = arguments.passes;
    let network = network_choice::named(&arguments.network)?.fold();
    let (device, description) = pollster::block_on(start_device(DeviceKind::Cpu))?;
    let image = Picture::from_fn(CANONICAL_WIDTH, CANONICAL_HEIGHT, |x, y| {
        [(x % 256) as u8, (y % 256) as u8, (x * y % 251) as u8]
    });
    let flops: u64 = network.describe().iter().map(|layer| layer.executed_flops).sum();
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
            times.least_ms / 1e3,
            times.most_ms / 1e3,
            flops as f64 / times.median_ms / 1e6
        );
        Ok(())
    };
    measured("burn", &mut || {
        pollster::block_on(network.infer(&[&image], &device))?;
        Ok(())
    })?;
    if let Some(mut executor) = network.executor(CANONICAL_WIDTH, CANONICAL_HEIGHT)? {
        let mut maps = Maps::empty(CANONICAL_WIDTH, CANONICAL_HEIGHT);
        measured("our executor", &mut || {
            executor.run(&image)?;
            Ok(executor.read(Stage::RegistrationRefinement, None, &mut maps)?)
        })?;
    }
    match peak_bytes() {
        Some(bytes) => println!("peak memory of this process: {:.0} MB", bytes as f64 / 1e6),
        None => println!("peak memory of this process: this system does not report it"),
    }
    Ok(())
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
