//! `cargo xtask fuzz`: the fuzz targets of `deepsft-fuzz` under libFuzzer.
//!
//! `cargo fuzz` would compile all crates of others a second time, with coverage. Here cargo calls `rustc.sh` in place of rustc for
//! the crates of the workspace alone, and takes the others as the ordinary build has left them.

use crate::tools;
use anyhow::{Context, Result, bail, ensure};
use std::{
    env, fs, iter,
    path::{Path, PathBuf},
    process::Command,
    sync::{Mutex, PoisonError},
    thread,
};

/// Whether the fuzz targets run on this system.
pub const HERE: bool = cfg!(target_os = "linux");

/// What one input may take at most: memory in MiB, which the program also counts by itself, and seconds.
const LIMITS: [&str; 2] = ["-rss_limit_mb=1024", "-timeout=120"];

/// Where files are in memory.
const MEMORY_FOLDER: &str = "/dev/shm";

/// Lines that libFuzzer ends with where nothing failed, and a word by which its failures are known.
const INPUTS: &str = "stat::number_of_executed_units:";
const WRITTEN: &str = "Test unit written to ";

/// What to run.
#[derive(clap::Args)]
pub struct Options {
    /// Run this target alone: bundle, camera, gltf, obj, picture, ply, recording, shard, template, weights or y4m
    #[arg(long)]
    target: Option<String>,
    /// How long for all targets together
    #[arg(long, default_value_t = 60, value_parser = clap::value_parser!(u64).range(1..))]
    seconds: u64,
    /// Targets that run at once
    #[arg(long, default_value_t = 1, value_parser = clap::value_parser!(u64).range(1..))]
    jobs: u64,
    /// Run this file alone, an input of --target
    #[arg(long, requires = "target")]
    input: Option<PathBuf>,
}

/// Builds the fuzz targets and runs what is asked for.
///
/// # Errors
/// When they cannot be built, and when a target fails, which is told with the file of the input.
pub fn run(root: &Path, options: &Options) -> Result<()> {
    let program = Program::build(root)?;
    if let (Some(target), Some(input)) = (&options.target, &options.input) {
        return tools::run(program.command(target).arg(input));
    }
    let targets = options
        .target
        .clone()
        .map_or_else(|| program.targets(), |name| Ok(vec![name]));
    program.fuzz_all(targets?, options.seconds, options.jobs)
}

/// Builds the fuzz targets.
pub fn build(root: &Path) -> Result<()> {
    Program::build(root).map(drop)
}

/// Runs all targets, two at once, for `seconds` together, after two with planted bugs: a failure has to be seen.
pub fn check(root: &Path, seconds: u64) -> Result<()> {
    let program = Program::build(root)?;
    let folder = tools::target_folder(root)?.join("fuzz-planted");
    // Too much memory is seen by the program's own count after the input, or by libFuzzer while it runs.
    for (target, signs) in [
        ("planted-panic", ["the planted panic"; 2]),
        ("planted-memory", ["bytes of memory", "out-of-memory"]),
    ] {
        // What was found before would be run first.
        tools::empty(&folder)?;
        let Err(error) = program.fuzz(target, &folder, 180) else {
            bail!("{target} did not fail: the harness is blind")
        };
        let error = format!("{error:#}");
        let is_seen = signs.iter().any(|sign| error.contains(sign)) && error.contains(WRITTEN);
        ensure!(is_seen, "{target} failed otherwise: {error}");
        let kept = fs::read_dir(folder.join(target).join("failures"))?.count();
        ensure!(kept > 0, "{target} left no input that it failed on");
    }
    program.fuzz_all(program.targets()?, seconds, 2)
}

/// The program `deepsft-fuzz` as it was built.
struct Program {
    file: PathBuf,
    /// Where its inputs are kept.
    folder: PathBuf,
}

impl Program {
    /// Builds it. The features are those of the whole workspace, as the tests of the crates have left them.
    fn build(root: &Path) -> Result<Self> {
        ensure!(HERE, "the fuzz targets run on Linux only");
        if env::var_os("CXX").is_none() {
            tools::CPP_COMPILER.find()?;
        }
        let mut cargo = tools::cargo(root);
        cargo.args(["build", "--release", "--workspace", "--bin", "deepsft-fuzz"]);
        cargo.args(["--features", "deepsft-fuzz/libfuzzer"]);
        tools::run(cargo.env("RUSTC_WORKSPACE_WRAPPER", root.join("crates/deepsft-fuzz/rustc.sh")))?;
        let target = tools::target_folder(root)?;
        let (file, folder) = (target.join("release/deepsft-fuzz"), target.join("fuzz"));
        Ok(Self { file, folder })
    }

    /// The targets that it lists.
    fn targets(&self) -> Result<Vec<String>> {
        let listed = tools::output(Command::new(&self.file).env_remove("DEEPSFT_FUZZ_TARGET"));
        let listed = listed.context("it lists no targets")?;
        Ok(listed.lines().map(str::to_owned).collect())
    }

    /// It with one target.
    fn command(&self, target: &str) -> Command {
        let mut command = Command::new(&self.file);
        command.args(LIMITS).env("DEEPSFT_FUZZ_TARGET", target);
        command
    }

    /// Fuzzes these targets, `jobs` at once, for `seconds` together.
    fn fuzz_all(&self, targets: Vec<String>, seconds: u64, jobs: u64) -> Result<()> {
        let jobs = jobs.min(targets.len() as u64);
        let seconds = (seconds * jobs).div_ceil(targets.len() as u64);
        let (waiting, failed) = (Mutex::new(targets), Mutex::new(Vec::new()));
        let next = || waiting.lock().unwrap_or_else(PoisonError::into_inner).pop();
        let work = || {
            for target in iter::from_fn(next) {
                match self.fuzz(&target, &self.folder, seconds) {
                    Ok(inputs) => println!("{target:<12}{inputs:>12} inputs in {seconds} s"),
                    Err(error) => {
                        eprintln!("{error:#}");
                        failed.lock().unwrap_or_else(PoisonError::into_inner).push(target);
                    }
                }
            }
        };
        thread::scope(|scope| (0..jobs).for_each(|_| drop(scope.spawn(work))));
        let failed = failed.into_inner().unwrap_or_else(PoisonError::into_inner).join(", ");
        ensure!(
            failed.is_empty(),
            "a bug was found in {failed}: the inputs are named above"
        );
        Ok(())
    }

    /// Fuzzes a target for some seconds; the number of inputs that it has had. Its inputs are kept in `folder`: those that reached
    /// something new, and those that it failed on, which are run before all others.
    fn fuzz(&self, target: &str, folder: &Path, seconds: u64) -> Result<String> {
        let folders = ["corpus", "seeds", "failures"].map(|kind| folder.join(target).join(kind));
        // In memory where there is such a folder.
        let memory = Some(Path::new(MEMORY_FOLDER)).filter(|folder| folder.is_dir());
        let temporary = memory.map_or_else(env::temp_dir, Path::to_owned);
        let temporary = temporary.join(format!("deepsft-fuzz-{}-{target}", std::process::id()));
        for folder in folders.iter().chain([&temporary]) {
            fs::create_dir_all(folder).with_context(|| format!("making {}", folder.display()))?;
        }
        let [_, seeds, failures] = &folders;
        let mut command = self.command(target);
        command.args(&folders).args(["-print_final_stats=1", "-verbosity=0"]);
        command.arg(format!("-artifact_prefix={}/", failures.display()));
        command.arg(format!("-max_total_time={seconds}"));
        command.env("DEEPSFT_FUZZ_SEEDS", seeds).env("TMPDIR", &temporary);
        let output = command.output().context("starting it");
        // What a program that was ended leaves there.
        fs::remove_dir_all(&temporary).with_context(|| format!("removing {}", temporary.display()))?;
        let output = output?;
        let said = String::from_utf8_lossy(&output.stderr);
        let after = |word: &str| Some(said.lines().rev().find_map(|line| line.split_once(word))?.1.trim());
        if !output.status.success() {
            let input = after(WRITTEN).unwrap_or("(none was left)");
            bail!("{said}\n{target} fails; run it again with\n    cargo xtask fuzz --target {target} --input {input}");
        }
        Ok(after(INPUTS).unwrap_or("no").to_owned())
    }
}
