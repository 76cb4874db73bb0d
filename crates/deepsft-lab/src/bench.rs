//! `deepsft-lab bench`: how fast this machine is at every part of the work.

mod mesh_times;
mod plain_arrays;
mod throughput;
mod turns;
mod workload;

use crate::measuring::write_json;
use crate::reading;
use anyhow::{Result, ensure};
use clap::Args;
use deepsft::ModelBundle;
use mesh_times::MeshTimes;
use serde::Serialize;
use std::path::PathBuf;
use std::{fs, thread};
use throughput::Rate;
use turns::Inference;

#[derive(Args)]
#[command(after_help = "\
The command measures on this machine's CPU:
  synthesis   training images per second with each preset, on one thread and on all
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
    #[arg(long, value_name = "PART", value_parser = ["synthesis"], conflicts_with_all = ["threads", "rival", "take_turns", "export"])]
    only: Option<String>,
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

/// The content of the JSON file; what was not measured is left out.
#[derive(Serialize)]
struct Report {
    model: String,
    parameters: usize,
    processor: Option<String>,
    cores: usize,
    synthesis: Vec<Rate>,
    #[serde(skip_serializing_if = "Vec::is_empty")]
    training: Vec<Rate>,
    #[serde(skip_serializing_if = "Vec::is_empty")]
    inference: Vec<Inference>,
    #[serde(skip_serializing_if = "Option::is_none")]
    mesh: Option<MeshTimes>,
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
    let report = measured(arguments, &bundle)?;
    print(&report);
    write_json(arguments.json.as_deref(), &report)
}

/// The processor's name, where the system has it in a file.
fn processor() -> Option<String> {
    let text = fs::read_to_string("/proc/cpuinfo").ok()?;
    let line = text.lines().find(|line| line.starts_with("model name"))?;
    Some(line.split_once(':')?.1.trim().to_owned())
}

fn measured(arguments: &BenchArguments, bundle: &ModelBundle) -> Result<Report> {
    let cores = thread::available_parallelism().map_or(1, usize::from);
    let mut threads: Vec<usize> = arguments.threads.iter().map(|&count| count.into()).collect();
    if threads.is_empty() {
        threads = vec![1, cores];
    }
    threads.dedup();
    ensure!(
        threads.iter().all(|&count| count <= cores),
        "--threads asks for more threads than the {cores} cores this program may use"
    );
    let mut report = Report {
        model: bundle.name().to_owned(),
        parameters: reading::estimator(bundle)?.parameters(),
        processor: processor(),
        cores,
        synthesis: Vec::new(),
        training: Vec::new(),
        inference: Vec::new(),
        mesh: None,
        deepsft_version: env!("CARGO_PKG_VERSION"),
    };
    if arguments.only.is_none() {
        let rival = arguments
            .rival
            .as_deref()
            .map(|name| (name, &arguments.rival_command[..]));
        // Inference first: a processor that is not yet hot from training is what a user's frame meets.
        eprintln!("inference on {threads:?} threads");
        let frame = workload::camera_frame(bundle)?;
        report.inference = turns::measure(&arguments.model, &frame, &threads, arguments.runs, rival)?;
        eprintln!("the mesh");
        report.mesh = Some(mesh_times::measure(bundle)?);
        eprintln!("training");
        report.training = throughput::training(bundle)?;
    }
    eprintln!("synthesis");
    report.synthesis = throughput::synthesis(bundle.template(), cores)?;
    Ok(report)
}

fn print(report: &Report) {
    println!("{}, {} parameters", report.model, report.parameters);
    let processor = report.processor.as_deref().unwrap_or("unknown processor");
    println!("{processor}, {} cores", report.cores);
    println!("{:<46}{:>14}", "throughput", "samples/s");
    for (kind, rates) in [("synthesis", &report.synthesis), ("training", &report.training)] {
        for rate in rates {
            println!("{:<46}{:>14.2}", format!("{kind}, {}", rate.of), rate.samples_per_s);
        }
    }
    let Some(mesh) = &report.mesh else { return };
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
    println!(
        "\n{:<46}{:>14}",
        format!("the mesh, ms, medians of {}", mesh.frames),
        "1 thread"
    );
    for (stage, times) in [
        ("mesh fitted to one frame", &mesh.fit),
        ("ARAP completion of one frame", &mesh.completion),
        ("start of a track", &mesh.track_start),
        ("one frame followed", &mesh.track),
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
