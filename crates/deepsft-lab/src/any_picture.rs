//! `deepsft-lab any-picture`: trains the network that describes any picture.

mod loss;
mod pairs;
mod prints;
mod training;

use anyhow::{Result, ensure};
use clap::Args;
use deepsft::DeviceKind;
use deepsft_formats::{FolderLock, write_file};
use deepsft_network::start_device;
use std::path::PathBuf;
use training::{Point, Training};

/// Of so many photographs one is held out.
const HELD_OUT: usize = 3;

#[derive(Args)]
#[command(after_help = "\
A pair is a window of a synthetic frame and a turned, scaled view of the print in it. For each cell of 8 x 8 pixels of the window the
network learns which cell of the view shows the same, or that none does. Prints are painted, half of them from your
photographs if you name a folder; each is shown in eight frames. One photograph in three is held out. It is measured on
prints of those and on prints painted with another seed.

OUT/weights.bpk has the weights, OUT/curve.csv the curve. OUT/checkpoint holds what --resume goes on from.

Example, the size of what ships (some hours; 20 GFLOP a pair):
  deepsft-lab any-picture --photographs photographs --pairs 86000 --out any-picture")]
pub struct AnyPictureArguments {
    /// Folder of photographs (PNG or JPEG), printed and put behind the sheets
    #[arg(long, value_name = "DIR")]
    photographs: Option<PathBuf>,
    /// Pairs to learn from: the learning rate falls to nothing over them
    #[arg(long, value_name = "N", default_value_t = 86_000, value_parser = clap::value_parser!(u64).range(1..))]
    pairs: u64,
    /// Pairs between two measurements; the checkpoint is written then
    #[arg(long, value_name = "N", default_value_t = 2_000, value_parser = clap::value_parser!(u64).range(1..))]
    measure_every: u64,
    /// Seed of prints, frames and weights
    #[arg(long, value_name = "S", default_value_t = 0)]
    seed: u64,
    /// Go on from OUT/checkpoint
    #[arg(long)]
    resume: bool,
    /// What to compute on
    #[arg(long, value_name = "DEVICE", default_value_t = DeviceKind::Cpu)]
    device: DeviceKind,
    /// Folder to write
    #[arg(long, value_name = "DIR")]
    out: PathBuf,
}

pub fn run(arguments: &AnyPictureArguments) -> Result<()> {
    let photographs = match &arguments.photographs {
        Some(folder) => deepsft_formats::pictures_in(folder, "folder of pictures")?,
        None => Vec::new(),
    };
    ensure!(
        photographs.is_empty() || photographs.len() >= HELD_OUT,
        "fewer than {HELD_OUT} photographs: none could be held out"
    );
    std::fs::create_dir_all(&arguments.out)?;
    let _lock = FolderLock::acquire(&arguments.out)?;
    let (device, _) = pollster::block_on(start_device(arguments.device))?;
    let checkpoint = arguments.out.join("checkpoint");
    ensure!(
        arguments.resume || !checkpoint.exists(),
        "there is a checkpoint of an earlier training: add --resume to go on with it, or remove {}",
        checkpoint.display()
    );
    let (held_out, learnt): (Vec<_>, Vec<_>) = photographs
        .into_iter()
        .enumerate()
        .partition(|(number, _)| number % HELD_OUT == 1);
    let paths = |files: Vec<(usize, PathBuf)>| files.into_iter().map(|(_, path)| path).collect();
    let mut training = Training::new(&device, arguments.seed, paths(held_out))?;
    if arguments.resume {
        training.resume(&checkpoint)?;
        println!("going on after {} pairs", training.pairs());
    }
    let source = prints::PrintSource::start(arguments.seed, training.next_print(), paths(learnt));
    let mut next = training.pairs() + arguments.measure_every;
    while training.pairs() < arguments.pairs {
        training.step(&source, training.pairs() as f64 / arguments.pairs as f64)?;
        if training.pairs() >= next || training.pairs() >= arguments.pairs {
            next = training.pairs() + arguments.measure_every;
            let Point {
                pairs,
                loss,
                held_out_loss,
                right,
            } = training.measure()?;
            let right = 100.0 * right;
            println!("{pairs:8} pairs  loss {loss:.3}  held out {held_out_loss:.3}  right {right:.1} %");
            training.save(&checkpoint)?;
            write_file(&arguments.out.join("weights.bpk"), &training.weights()?)?;
            write_file(&arguments.out.join("curve.csv"), training.curve_csv().as_bytes())?;
        }
    }
    Ok(())
}
