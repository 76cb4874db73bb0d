//! `deepsft-lab bench`: how fast this machine is at every part of the work.

mod mesh_times;
mod plain_arrays;
mod throughput;
mod turns;
mod workload;

use crate::measuring::{Rival, cores, processor};
use crate::reading;
use anyhow::{Result, ensure};
use clap::{Args, ValueEnum};
use deepsft::ModelBundle;
use deepsft_formats::write_file;
use deepsft_network::{Network, start_device};
use serde::Serialize;
use std::path::PathBuf;
use throughput::{Rate, SampleTime};
use turns::Inference;

#[derive(Args)]
#[command(after_help = "\
The command measures on this machine's CPU:
  synthesis   training images per second with each preset, on one thread and on all, and where their time goes
  training    samples per second of training step 1 on windows and on whole frames; making the images is included
  inference   one 1280 x 720 camera frame through the canonical warp, the network and the confidence, and the
              network alone; medians over --runs frames, for each number of threads
  the mesh    fitting it to a frame, the start of a track, one frame followed, on a clip of 24 frames
Run nothing else meanwhile. The numbers of threads take turns frame by frame: a machine that slows down slows all
of them.

Example:
  deepsft-lab bench --model models/poster-a4 --json bench.json
  deepsft-lab bench --model models/poster-a4 --only synthesis")]
pub struct BenchArguments {
    /// Model bundle to measure with
    #[arg(long, value_name = "BUNDLE")]
    model: PathBuf,
    /// Measure only this part; the JSON file then holds nothing else
    #[arg(long, value_name = "PART", value_enum, conflicts_with_all = ["threads", "rival", "take_turns", "export"])]
    only: Option<Only>,
    /// Write the figures to this file
    #[arg(long, value_name = "FILE")]
    json: Option<PathBuf>,
    /// Numbers of threads for inference [default: 1 and all cores]
    #[arg(long, value_name = "N,N", value_delimiter = ',', value_parser = clap::value_parser!(u16).range(1..=1024))]
    threads: Vec<u16>,
    /// Frames for each median
    #[arg(long, value_name = "N", default_value_t = 21, value_parser = clap::value_parser!(u32).range(1..))]
    runs: u32,
    /// Measure nothing; write the network, one image and the network's output for it as plain arrays, which other
    /// programs can read
    #[arg(long, value_name = "DIR", conflicts_with_all = ["json", "threads", "rival", "take_turns"])]
    export: Option<PathBuf>,
    /// Name of another program that runs the same network, started by the words after `--`: for each line it reads
    /// it does one image and prints the milliseconds. DEEPSFT_BENCH_THREADS tells it the number of threads
    #[arg(long, value_name = "NAME", hide = true, requires = "rival_command")]
    rival: Option<String>,
    /// Program and arguments of the rival
    #[arg(last = true, value_name = "COMMAND", hide = true, requires = "rival")]
    rival_command: Vec<String>,
    /// Be one of the processes that take turns, on this camera frame
    #[arg(long, value_name = "FRAME", hide = true, conflicts_with_all = ["json", "threads", "rival"])]
    take_turns: Option<PathBuf>,
}

/// Parts that can be measured alone.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum Only {
    /// Making training images
    Synthesis,
}

/// How fast training images are made.
#[derive(Serialize)]
struct SynthesisReport {
    processor: Option<String>,
    cores: usize,
    synthesis: Vec<Rate>,
    sample_time: Vec<SampleTime>,
}

/// The content of the JSON file.
#[derive(Serialize)]
struct Report {
    model: String,
    parameters: usize,
    processor: Option<String>,
    cores: usize,
    synthesis: Vec<Rate>,
    sample_time: Vec<SampleTime>,
    training: Vec<Rate>,
    inference: Vec<Inference>,
    mesh: mesh_times::MeshTimes,
    deepsft_version: &'static str,
}

pub fn run(arguments: &BenchArguments) -> Result<()> {
    let bundle = reading::bundle(&arguments.model)?;
    if let Some(frame) = &arguments.take_turns {
        return turns::take(&bundle, &reading::picture(frame)?);
    }
    if let Some(folder) = &arguments.export {
        return plain_arrays::write(&bundle, &workload::camera_frame(&bundle)?, folder);
    }
    match arguments.only {
        Some(Only::Synthesis) => measure_synthesis(arguments, &bundle),
        None => measure(arguments, &bundle),
    }
}

fn measure_synthesis(arguments: &BenchArguments, bundle: &ModelBundle) -> Result<()> {
    let cores = cores();
    let (synthesis, sample_time) = throughput::synthesis(bundle.template(), cores)?;
    let report = SynthesisReport {
        processor: processor(),
        cores,
        synthesis,
        sample_time,
    };
    print_machine(report.processor.as_deref(), cores);
    println!("{:<46}{:>14}", "throughput", "samples/s");
    print_rates("synthesis", &report.synthesis);
    print_sample_times(&report.sample_time);
    match &arguments.json {
        Some(path) => Ok(write_file(path, &serde_json::to_vec_pretty(&report)?)?),
        None => Ok(()),
    }
}

fn print_machine(processor: Option<&str>, cores: usize) {
    println!("{}, {cores} cores", processor.unwrap_or("unknown processor"));
}

fn print_rates(kind: &str, rates: &[Rate]) {
    for rate in rates {
        println!("{:<46}{:>14.2}", format!("{kind}, {}", rate.of), rate.samples_per_s);
    }
}

fn print_sample_times(times: &[SampleTime]) {
    println!(
        "\n{:<46}{:>10}{:>10}{:>10}{:>10}",
        "a sample, ms, medians, 1 thread", "shape", "scene", "image", "coding"
    );
    for time in times {
        println!(
            "{:<46}{:>10.2}{:>10.2}{:>10.2}{:>10.2}",
            format!("{}, {} preset", time.template, time.preset),
            time.shape_ms,
            time.scene_ms,
            time.image_ms,
            time.coding_ms
        );
    }
}

fn measure(arguments: &BenchArguments, bundle: &ModelBundle) -> Result<()> {
    let cores = cores();
    let mut threads: Vec<usize> = arguments.threads.iter().map(|&count| count.into()).collect();
    if threads.is_empty() {
        threads = vec![1, cores];
    }
    threads.dedup();
    ensure!(
        threads.iter().all(|&count| count <= cores),
        "--threads asks for more threads than the {cores} cores this program may use"
    );
    let estimator = reading::estimator(bundle)?;
    let rival = arguments.rival.as_ref().map(|name| Rival {
        name,
        command: &arguments.rival_command,
    });
    // Inference first: a processor that is not yet hot from training is what a user's frame meets.
    eprintln!("inference on {threads:?} threads");
    let frame = workload::camera_frame(bundle)?;
    let (device, _) = pollster::block_on(start_device(deepsft::DeviceKind::Cpu))?;
    let layers = Network::from_folded(bundle.network(), &device)?.describe();
    let gflop = layers.iter().map(|layer| layer.executed_flops).sum::<u64>() as f64 / 1e9;
    let inference = turns::measure(&arguments.model, gflop, &frame, &threads, arguments.runs, rival)?;
    eprintln!("the mesh");
    let mesh = mesh_times::measure(bundle)?;
    eprintln!("synthesis");
    let (synthesis, sample_time) = throughput::synthesis(bundle.template(), cores)?;
    eprintln!("training");
    let training = throughput::training(bundle)?;
    let report = Report {
        model: bundle.name().to_owned(),
        parameters: estimator.parameters(),
        processor: processor(),
        cores,
        synthesis,
        sample_time,
        training,
        inference,
        mesh,
        deepsft_version: env!("CARGO_PKG_VERSION"),
    };
    print(&report);
    if let Some(path) = &arguments.json {
        write_file(path, &serde_json::to_vec_pretty(&report)?)?;
    }
    Ok(())
}

fn print(report: &Report) {
    println!("{}, {} parameters", report.model, report.parameters);
    print_machine(report.processor.as_deref(), report.cores);
    println!("{:<46}{:>14}", "throughput", "samples/s");
    print_rates("synthesis", &report.synthesis);
    print_rates("training", &report.training);
    print_sample_times(&report.sample_time);
    let runs = report.inference.first().map_or(0, |inference| inference.runs);
    let columns = |title: &str, of: &dyn Fn(&Inference) -> Option<String>| {
        let cells: Option<Vec<String>> = report.inference.iter().map(of).collect();
        if let Some(cells) = cells {
            let cells: String = cells.iter().map(|cell| format!("{cell:>14}")).collect();
            println!("{title:<46}{cells}");
        }
    };
    let ms = |ms: f64| Some(format!("{ms:.2}"));
    println!();
    columns(&format!("inference, ms, medians of {runs}"), &|i| {
        Some(format!("{} thread{}", i.threads, if i.threads == 1 { "" } else { "s" }))
    });
    columns("  canonical warp of 1280 x 720", &|i| ms(i.canonical_warp.median_ms));
    columns("  network, with reading the maps", &|i| ms(i.network.median_ms));
    columns("  confidence", &|i| ms(i.confidence.median_ms));
    columns("camera frame to maps", &|i| ms(i.frame.median_ms));
    columns("network alone, DeepSfT", &|i| ms(i.network_alone.median_ms));
    if let Some(rival) = report.inference.first().and_then(|i| i.rival.as_ref()) {
        columns(&format!("network alone, {}", rival.name), &|i| {
            ms(i.rival.as_ref()?.network_alone.median_ms)
        });
        columns(&format!("  ratio, DeepSfT : {}", rival.name), &|i| {
            Some(format!("{:.2}", i.rival.as_ref()?.ratio))
        });
    }
    columns("GFLOP/s of the network's plain convolutions", &|i| {
        Some(format!("{:.0}", i.operations.network_gflop_per_s))
    });
    columns("GFLOP/s of a product of matrices (burn)", &|i| {
        Some(format!("{:.0}", i.operations.matrices_gflop_per_s))
    });
    columns("  share", &|i| Some(format!("{:.2}", i.operations.share)));
    println!(
        "\n{:<46}{:>14}",
        format!("the mesh, ms, medians of {}", report.mesh.frames),
        "1 thread"
    );
    for (stage, times) in [
        ("mesh fitted to one frame", &report.mesh.fit),
        ("ARAP completion of one frame", &report.mesh.completion),
        ("start of a track", &report.mesh.track_start),
        ("one frame followed", &report.mesh.track),
    ] {
        println!("{stage:<46}{:>14.2}", times.median_ms);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use clap::{Parser, error::ErrorKind};

    #[derive(Parser)]
    struct Line {
        #[command(flatten)]
        bench: BenchArguments,
    }

    fn parse(words: &str) -> Result<BenchArguments, ErrorKind> {
        Line::try_parse_from(format!("deepsft-lab --model m {words}").split_whitespace())
            .map(|line| line.bench)
            .map_err(|error| error.kind())
    }

    #[test]
    fn a_rivals_own_arguments_come_after_two_dashes() {
        let bench = parse("--threads 1,2 --rival other -- python x.py --runs 3").unwrap();
        assert_eq!(bench.threads, [1, 2]);
        assert_eq!(bench.rival_command, ["python", "x.py", "--runs", "3"]);
        assert_eq!(bench.runs, 21);
        assert_eq!(parse("--rival other").err(), Some(ErrorKind::MissingRequiredArgument));
        assert_eq!(parse("-- python").err(), Some(ErrorKind::MissingRequiredArgument));
    }

    #[test]
    fn no_threads_and_no_runs_are_refused() {
        assert_eq!(parse("--threads 0").err(), Some(ErrorKind::ValueValidation));
        assert_eq!(parse("--runs 0").err(), Some(ErrorKind::ValueValidation));
    }
}
