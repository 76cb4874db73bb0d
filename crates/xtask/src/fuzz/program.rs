//! The program `deepsft-fuzz`: how it is built and run.

use super::instrument::instrument;
use crate::tools;
use anyhow::{Context, Result, bail, ensure};
use std::{
    collections::VecDeque,
    env, fs,
    io::{BufRead, BufReader},
    path::{Path, PathBuf},
    process::{self, Command, Stdio},
    time::{Duration, Instant},
};

/// What one input may take at most: memory in MiB, which the program also counts by itself, and seconds.
const LIMITS: [&str; 2] = ["-rss_limit_mb=1024", "-timeout=10"];

/// Where files are in memory, on Linux.
const MEMORY_FOLDER: &str = "/dev/shm";

/// Lines of what a failing program said that an error shows: from its complaint on, or else the last.
const LINES: usize = 12;

/// A target of the program.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct FuzzTarget {
    pub name: String,
    /// Longest input, bytes.
    longest: u64,
}

impl FuzzTarget {
    /// A target of short inputs.
    pub fn new(name: &str) -> Self {
        Self {
            name: name.to_owned(),
            longest: 64,
        }
    }
}

/// How long one process runs.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Round {
    pub seconds: u64,
    /// Most inputs.
    pub runs: Option<u64>,
}

/// A round that has ended well.
#[derive(Clone, Copy, Debug)]
pub struct Ended {
    pub inputs: u64,
    pub time: Duration,
}

/// The program as it was built.
pub struct Program(PathBuf);

impl Program {
    /// Builds it. The features are those of the whole workspace, as the tests of the crates have left them.
    pub fn build(root: &Path) -> Result<Self> {
        ensure!(super::HERE, "the fuzz targets run on Linux only");
        tools::ensure_cpp_compiler()?;
        let mut cargo = tools::cargo(root);
        cargo.args(["build", "--release", "--workspace", "--bin", "deepsft-fuzz"]);
        cargo.args(["--features", "deepsft-fuzz/libfuzzer"]);
        instrument(&mut cargo)?;
        tools::run(&mut cargo)?;
        let built = tools::target_folder(root)?.join("release/deepsft-fuzz");
        Ok(Self(built))
    }

    /// The targets that it lists.
    pub fn targets(&self) -> Result<Vec<FuzzTarget>> {
        let mut command = Command::new(&self.0);
        let listed = tools::output(command.env_remove("DEEPSFT_FUZZ_TARGET"));
        let listed = listed.with_context(|| format!("{} lists no targets", self.0.display()))?;
        let target = |line: &str| -> Option<FuzzTarget> {
            let (name, longest) = line.split_once(' ')?;
            Some(FuzzTarget {
                name: name.to_owned(),
                longest: longest.parse().ok()?,
            })
        };
        listed
            .lines()
            .map(|line| target(line).with_context(|| format!("{line:?} is no target")))
            .collect()
    }

    /// Runs one input of a target.
    pub fn run_input(&self, target: &FuzzTarget, input: &Path) -> Result<()> {
        tools::run(
            Command::new(&self.0)
                .args(LIMITS)
                .arg(input)
                .env("DEEPSFT_FUZZ_TARGET", &target.name),
        )
    }

    /// Fuzzes a target whose inputs are kept in `folder`: those that reached something new, and those that it failed on,
    /// which are run before all others.
    pub fn run_round(&self, target: &FuzzTarget, folder: &Path, round: Round) -> Result<Ended> {
        let FuzzTarget { name, longest } = target;
        let folders = ["corpus", "seeds", "failures"].map(|kind| folder.join(name).join(kind));
        for folder in &folders {
            fs::create_dir_all(folder).with_context(|| format!("making {}", folder.display()))?;
        }
        let [_, seeds, failures] = &folders;
        let memory = Path::new(MEMORY_FOLDER);
        let temporary = if memory.is_dir() {
            memory.to_path_buf()
        } else {
            env::temp_dir()
        };
        let temporary = temporary.join(format!("deepsft-fuzz-{}-{name}", process::id()));
        fs::create_dir_all(&temporary).with_context(|| format!("making {}", temporary.display()))?;
        let mut command = Command::new(&self.0);
        command.args(LIMITS).args(&folders);
        command.arg(format!("-artifact_prefix={}/", failures.display()));
        command.args([
            format!("-max_len={longest}"),
            format!("-max_total_time={}", round.seconds),
        ]);
        command.args(round.runs.map(|runs| format!("-runs={runs}")));
        command.args(["-print_final_stats=1", "-verbosity=1"]);
        command
            .env("DEEPSFT_FUZZ_TARGET", name)
            .env("DEEPSFT_FUZZ_SEEDS", seeds)
            .env("TMPDIR", &temporary);
        let ended = run_to_its_end(&mut command);
        // What a program that was ended leaves there.
        let removed = fs::remove_dir_all(&temporary);
        let Report { inputs, time, failure } = ended.with_context(|| format!("running the target {name}"))?;
        removed.with_context(|| format!("removing {}", temporary.display()))?;
        match failure {
            None => Ok(Ended { inputs, time }),
            Some(Failure { input, words }) => {
                let place = input.map_or_else(
                    || "(it left no input)".to_owned(),
                    |input| format!("on the input {input}\nrun it again with\n    cargo xtask fuzz --target {name} --input {input}"),
                );
                bail!("the target {name} fails {place}\n{words}")
            }
        }
    }
}

/// What a process said.
struct Report {
    inputs: u64,
    time: Duration,
    failure: Option<Failure>,
}

struct Failure {
    /// The file of the input.
    input: Option<String>,
    words: String,
}

fn run_to_its_end(command: &mut Command) -> Result<Report> {
    let started = Instant::now();
    let mut child = command
        .stdout(Stdio::null())
        .stderr(Stdio::piped())
        .spawn()
        .context("starting it")?;
    let stderr = child.stderr.take().context("what it says cannot be read")?;
    let (mut inputs, mut input, mut said, mut complains) = (0, None, VecDeque::new(), false);
    for line in BufReader::new(stderr).split(b'\n') {
        let line = String::from_utf8_lossy(&line?).into_owned();
        inputs = inputs_in(&line).unwrap_or(inputs);
        if let Some((_, file)) = line.split_once("Test unit written to ") {
            // Slow ones are reported and are no failures.
            input = (!file.contains("slow-unit-")).then(|| file.trim().to_owned()).or(input);
        }
        let is_told = !line.starts_with('#') && !line.starts_with("stat::") && !line.trim().is_empty();
        if is_told && !(complains && said.len() >= LINES) {
            if !complains && ["panicked at", "ERROR: "].iter().any(|sign| line.contains(sign)) {
                complains = true;
                said.clear();
            }
            said.push_back(line);
            if said.len() > LINES {
                said.pop_front();
            }
        }
    }
    let status = child.wait()?;
    let failure = (!status.success()).then(|| Failure {
        input,
        words: said.into_iter().collect::<Vec<_>>().join("\n"),
    });
    Ok(Report {
        inputs,
        time: started.elapsed(),
        failure,
    })
}

/// The number of inputs until now in a line of libFuzzer: `#1024 pulse cov: ...` or `stat::number_of_executed_units: 1024`.
fn inputs_in(line: &str) -> Option<u64> {
    let number = match line.strip_prefix('#') {
        Some(rest) => rest.split_whitespace().next()?,
        None => line.strip_prefix("stat::number_of_executed_units:")?.trim(),
    };
    number.parse().ok()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_number_of_inputs_is_read_from_what_libfuzzer_says() {
        assert_eq!(
            inputs_in("#65536\tpulse  cov: 12 ft: 34 corp: 5/67b lim: 64 exec/s: 32768 rss: 40Mb"),
            Some(65536)
        );
        assert_eq!(inputs_in("stat::number_of_executed_units: 1234567"), Some(1_234_567));
        for other in [
            "# 0x55 in main",
            "INFO: seed corpus: files: 3",
            "stat::new_units_added: 7",
            "",
        ] {
            assert_eq!(inputs_in(other), None, "{other}");
        }
    }

    #[test]
    #[cfg(unix)]
    fn a_program_that_fails_is_reported_with_its_input_and_its_words() {
        let run = |script: &str| run_to_its_end(Command::new("sh").args(["-c", script])).unwrap();
        let good = run("echo '#12 INITED' >&2; echo 'stat::number_of_executed_units: 40' >&2");
        assert_eq!((good.inputs, good.failure.is_none()), (40, true));
        let slow = "artifact_prefix='f/'; Test unit written to f/slow-unit-1";
        let crash = "artifact_prefix='f/'; Test unit written to f/crash-2";
        let bad = run(&format!(
            "echo \"#7 NEW\n{crash}\nwhat went wrong\n{slow}\" >&2; exit 77"
        ));
        let failure = bad.failure.unwrap();
        assert_eq!((bad.inputs, failure.input.as_deref()), (7, Some("f/crash-2")));
        assert!(failure.words.contains("what went wrong"));
        // What follows the complaint may be long, as what goes before it.
        let many = "for k in 1 2 3 4 5 6 7 8 9 10 11 12 13 14 15; do echo \"frame $k\" >&2; done";
        let bad = run(&format!(
            "{many}; echo 'thread main panicked at x.rs:1' >&2; {many}; exit 77"
        ));
        let words = bad.failure.unwrap().words;
        assert!(
            words.starts_with("thread main panicked") && words.lines().count() == LINES,
            "{words}"
        );
    }
}
