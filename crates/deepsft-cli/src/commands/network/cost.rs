//! What a forward pass costs on this machine's CPU.

use anyhow::Result;
use deepsft::{DeviceKind, Network, start_device};
use deepsft_geometry::{CANONICAL_HEIGHT, CANONICAL_WIDTH, Picture};
use std::time::Instant;
use std::{fs, thread};

/// Runs `passes` images through `network` and prints the median time and the peak memory of this process.
pub fn print(network: Network, passes: u32) -> Result<()> {
    let (device, description) = pollster::block_on(start_device(DeviceKind::Cpu))?;
    let image = Picture::from_fn(CANONICAL_WIDTH, CANONICAL_HEIGHT, |x, y| {
        [(x % 256) as u8, (y % 256) as u8, (x * y % 251) as u8]
    });
    let mut seconds = Vec::new();
    // The first pass fills caches and thread pools.
    for pass in 0..=passes {
        let start = Instant::now();
        pollster::block_on(network.infer(&[&image], &device))?;
        if pass > 0 {
            seconds.push(start.elapsed().as_secs_f64());
        }
    }
    seconds.sort_by(f64::total_cmp);
    let median = seconds[seconds.len() / 2];
    let threads = thread::available_parallelism().map_or(1, usize::from);
    let flops: u64 = network.describe().iter().map(|layer| layer.executed_flops).sum();
    println!(
        "forward pass on {}, {threads} threads: {:.3} s (median of {passes}, {:.3} to {:.3}), {:.1} GFLOP/s",
        description.adapter_name,
        median,
        seconds[0],
        seconds[seconds.len() - 1],
        flops as f64 / median / 1e9
    );
    match peak_bytes() {
        Some(bytes) => println!("peak memory of this process: {:.0} MB", bytes as f64 / 1e6),
        None => println!("peak memory of this process: not told by this system"),
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
