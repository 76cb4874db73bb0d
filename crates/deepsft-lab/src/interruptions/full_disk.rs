//! `deepsft-lab full-disk`: commands on a disk that becomes full, at any point of what they write.

use super::subject::{Expected, Inputs, SEED, Subject};
use anyhow::{Context, Result, ensure};
use clap::Args;
use deepsft_cli::progress;
use deepsft_formats::write_file;
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64Mcg;
use serde::Serialize;
use std::fs::{self, File};
use std::io::{ErrorKind, Write};
use std::path::{Path, PathBuf};

/// What the system says of a full disk.
const FULL: &str = "No space left on device";

/// Largest disk that this fills, bytes: nobody wants his own to be full.
const LARGEST_DISK: u64 = 256 << 20;

/// Largest space that is left to a command, as a multiple of what its result takes: a training writes its next checkpoint beside two.
const MORE_THAN_NEEDED: f64 = 1.6;

#[derive(Args)]
#[command(after_help = "\
The command fills the file system that DIR is on, all but a random number of bytes, and lets `deepsft synth`, `train`,
`track`, `clip` or `reconstruct` write there. Where the space is not enough, the command must fail with a message that names a file
and the full disk, the result's folder must hold what it held before, and nothing half written may stay but what the next
run goes on from. Then the space is given back, and the same command must end as if nothing had happened.

Example, as root:
  mount -t tmpfs -o size=96m none /mnt/small
  deepsft-lab full-disk --command train --template models/poster-a4/template --folder /mnt/small --fillings 40")]
pub struct FullDiskArguments {
    /// What finds no space: one or several of synth, train, track, clip, reconstruct
    #[arg(long, value_name = "COMMAND", value_enum, value_delimiter = ',', required = true)]
    command: Vec<Subject>,
    /// Folder of a template
    #[arg(long, value_name = "DIR")]
    template: PathBuf,
    /// An empty folder on a small file system of its own, of 256 MB at most
    #[arg(long, value_name = "DIR")]
    folder: PathBuf,
    /// How often the disk is filled, for each
    #[arg(long, value_name = "N", default_value_t = 40)]
    fillings: u32,
    /// Seed of the bytes that are left
    #[arg(long, value_name = "S", default_value_t = 1)]
    seed: u64,
    /// The program `deepsft` to run [default: the same commands in this program]
    #[arg(long, value_name = "FILE")]
    program: Option<PathBuf>,
    /// Write the figures to this file
    #[arg(long, value_name = "FILE")]
    json: Option<PathBuf>,
}

/// The content of the JSON file.
#[derive(Default, Serialize)]
struct Report {
    command: &'static str,
    /// Bytes that an uninterrupted run leaves on the disk.
    needed_bytes: u64,
    /// Runs that failed for want of space, and went on with more to the result of an uninterrupted run.
    failed_and_equal: u32,
    /// Runs for which it was enough.
    enough: u32,
    /// The different messages, without their numbers.
    messages: Vec<String>,
}

pub fn run(arguments: &FullDiskArguments) -> Result<()> {
    let disk = Disk::new(&arguments.folder)?;
    let work = tempfile::tempdir()?;
    let program = arguments.program.as_deref();
    let folder = work.path().join("inputs");
    let inputs = Inputs::make(program, &arguments.template, folder, &arguments.command)?;
    let mut reports = Vec::new();
    for &subject in &arguments.command {
        let expected = Expected::make(subject, &inputs, &work.path().join(subject.name()))?;
        let report = fill(subject, &inputs, &expected, &disk, arguments).context(subject.name())?;
        println!("{}", serde_json::to_string(&report)?);
        reports.push(report);
    }
    if let Some(path) = &arguments.json {
        write_file(path, &serde_json::to_vec_pretty(&reports)?)?;
    }
    Ok(())
}

/// Fills the disk for one command.
fn fill(
    subject: Subject,
    inputs: &Inputs,
    expected: &Expected,
    disk: &Disk,
    arguments: &FullDiskArguments,
) -> Result<Report> {
    let case = arguments.folder.join("case");
    let mut rng = Pcg64Mcg::seed_from_u64(arguments.seed);
    let mut report = Report {
        command: subject.name(),
        needed_bytes: disk.needed(|| {
            expected.begin(&case, true)?;
            inputs.run(&subject.arguments(inputs, SEED), &case)?;
            expected.check_finished(&case, true)
        })?,
        ..Report::default()
    };
    let bar = progress::counting(arguments.fillings.into(), "fillings");
    for _ in 0..arguments.fillings {
        let with_older = rng.random_bool(0.5);
        expected.begin(&case, with_older)?;
        let free = (MORE_THAN_NEEDED * report.needed_bytes as f64 * rng.random::<f64>()) as u64;
        disk.fill(free)?;
        let ended = inputs.run(&subject.arguments(inputs, SEED), &case);
        disk.free()?;
        let ended = ended?;
        if ended.succeeded {
            report.enough += 1;
        } else {
            let message = &ended.stderr;
            let context = || format!("with {free} bytes free: {message}");
            ensure!(
                ended.code == Some(1) && message.contains(FULL) && !message.contains("panicked"),
                "not the error of a full disk (exit code {:?}), {}",
                ended.code,
                context()
            );
            ensure!(message.contains("out"), "the message names no file, {}", context());
            let swapped = expected.check_interrupted(&case, with_older).with_context(context)?;
            ensure!(!swapped, "it failed, and the new result is there, {}", context());
            let message = without_numbers(message);
            if !report.messages.contains(&message) {
                report.messages.push(message);
            }
            let again = inputs.run(&subject.again(inputs, SEED), &case)?;
            ensure!(again.succeeded, "it does not go on: {}, {}", again.stderr, context());
            report.failed_and_equal += 1;
        }
        expected
            .check_finished(&case, with_older)
            .with_context(|| format!("with {free} bytes free"))?;
        bar.inc(1);
    }
    bar.finish_and_clear();
    fs::remove_dir_all(&case)?;
    Ok(report)
}

/// The same message for every frame and shard.
fn without_numbers(message: &str) -> String {
    let mut text: String = message
        .chars()
        .map(|c| if c.is_ascii_digit() { '0' } else { c })
        .collect();
    while text.contains("00") {
        text = text.replace("00", "0");
    }
    text
}

/// A small file system, filled with a file.
struct Disk {
    ballast: PathBuf,
    size: u64,
}

impl Disk {
    fn new(folder: &Path) -> Result<Self> {
        let listing = fs::read_dir(folder).with_context(|| format!("listing {}", folder.display()))?;
        ensure!(listing.count() == 0, "{} is not empty", folder.display());
        let mut disk = Self {
            ballast: folder.join("ballast"),
            size: LARGEST_DISK,
        };
        disk.size = disk.space()?;
        ensure!(
            disk.size < LARGEST_DISK,
            "{} is on a file system with 256 MB free or more: this fills it, give it a small one of its own",
            folder.display()
        );
        Ok(disk)
    }

    /// Bytes that are free.
    fn space(&self) -> Result<u64> {
        let mut file = File::create(&self.ballast)?;
        let zeros = [0; 4096];
        let mut bytes = 0;
        while bytes < self.size {
            match file.write(&zeros) {
                Ok(written) => bytes += written as u64,
                Err(error) if error.kind() == ErrorKind::StorageFull => break,
                Err(error) => return Err(error).context("filling the disk"),
            }
        }
        drop(file);
        self.free()?;
        Ok(bytes)
    }

    /// Bytes that `work` leaves on it.
    fn needed(&self, work: impl FnOnce() -> Result<()>) -> Result<u64> {
        let before = self.space()?;
        work()?;
        Ok(before - self.space()?)
    }

    /// Leaves so many bytes.
    fn fill(&self, free: u64) -> Result<()> {
        let bytes = self.space()?.saturating_sub(free);
        let mut file = File::create(&self.ballast)?;
        let zeros = vec![0; 1 << 16];
        let mut left = bytes as usize;
        while left > 0 {
            let written = file
                .write(&zeros[..left.min(zeros.len())])
                .context("filling the disk")?;
            left -= written;
        }
        Ok(())
    }

    fn free(&self) -> Result<()> {
        Ok(fs::remove_file(&self.ballast)?)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_folder_that_holds_something_is_not_filled() {
        let folder = tempfile::tempdir().unwrap();
        fs::write(folder.path().join("mine"), "mine").unwrap();
        let error = Disk::new(folder.path()).err().unwrap().to_string();
        assert!(error.contains("is not empty"), "{error}");
    }

    #[test]
    fn messages_differ_in_more_than_numbers() {
        assert_eq!(
            without_numbers("frame-00012.png: 5"),
            without_numbers("frame-7.png: 10")
        );
    }
}
