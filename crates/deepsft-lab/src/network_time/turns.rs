//! Our executor and another program with the same network, in processes of their own that take turns image by image.

use crate::measuring::{Process, Rival, Times, cores, timed};
use anyhow::{Context, Result};
use deepsft::{FoldedNetwork, Stage};
use deepsft_geometry::{Maps, Picture};
use serde::Serialize;
use std::env;
use std::io::{Write, stdin, stdout};
use std::process::Command;

/// Rounds before the measured ones.
const WARM_UP_ROUNDS: u32 = 2;

/// Times on a number of threads.
#[derive(Serialize)]
pub struct Turns {
    network: String,
    threads: usize,
    runs: u32,
    deepsft: Times,
    rival: String,
    rival_alone: Times,
    /// Our median over the rival's.
    ratio: f64,
}

/// Lets both take `runs` turns, on one thread and on all, and prints the times.
pub fn measure(network: &str, stage: Stage, runs: u32, rival: Rival<'_>) -> Result<Vec<Turns>> {
    let mut threads = vec![1, cores()];
    threads.dedup();
    let part = if stage == Stage::Main { ", main block" } else { "" };
    let title = format!("{network}{part} alone, ms, medians of {runs}");
    println!("{title:<46}{:>14}{:>24}{:>8}", "DeepSfT", rival.name, "ratio");
    let mut all = Vec::new();
    for threads in threads {
        let mut ours = Command::new(env::current_exe()?);
        ours.args(["network-time", network, "--take-turns"]);
        if stage == Stage::Main {
            ours.arg("--main");
        }
        let (program, arguments) = rival.command.split_first().context("the rival has no program")?;
        let mut theirs = Command::new(program);
        let mut players = [
            Process::start(&mut ours, threads)?,
            Process::start(theirs.args(arguments), threads)?,
        ];
        let mut times = [Vec::new(), Vec::new()];
        for round in 0..WARM_UP_ROUNDS + runs {
            for (player, times) in players.iter_mut().zip(&mut times) {
                let ms: f64 = player.ask("image")?.parse()?;
                if round >= WARM_UP_ROUNDS {
                    times.push(ms);
                }
            }
        }
        let [ours, theirs] = times.map(|times| Times::of(times).context("nothing was measured"));
        let (deepsft, rival_alone) = (ours?, theirs?);
        let ratio = deepsft.median_ms / rival_alone.median_ms;
        let title = format!("  {threads} thread{}", if threads == 1 { "" } else { "s" });
        println!(
            "{title:<46}{:>14.2}{:>24.2}{ratio:>8.2}",
            deepsft.median_ms, rival_alone.median_ms
        );
        all.push(Turns {
            network: network.to_owned(),
            threads,
            runs,
            deepsft,
            rival: rival.name.to_owned(),
            rival_alone,
            ratio,
        });
    }
    Ok(all)
}

/// Our side: for each line one image, from its pixels to the values of all pixels.
pub fn take(network: &FoldedNetwork, stage: Stage, image: &Picture) -> Result<()> {
    let (width, height) = image.size();
    let mut executor = network.executor((width, height))?;
    let (mut maps, all) = (Maps::empty(width, height), vec![true; width * height]);
    for question in stdin().lines() {
        question?;
        let mut ms = 0.0;
        timed(&mut ms, || {
            executor.run_to(stage, image)?;
            executor.read(stage, Some(&all), &mut maps)
        })?;
        writeln!(stdout(), "{ms}")?;
        stdout().flush()?;
    }
    Ok(())
}
