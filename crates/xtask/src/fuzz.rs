//! `cargo xtask fuzz`: the fuzz targets of `deepsft-fuzz` under libFuzzer, and what they had until now.

pub mod instrument;
mod program;
mod totals;

use crate::tools;
use anyhow::{Context, Result, bail, ensure};
use program::{FuzzTarget, Program, Round};
use std::{
    collections::BTreeSet,
    path::{Path, PathBuf},
    sync::{Mutex, PoisonError},
    thread,
    time::Duration,
};
use totals::Totals;

/// Longest time for which one process runs, s: then the inputs it had are written down, and another target has its turn.
const LONGEST_ROUND_S: u64 = 120;

/// Whether the fuzz targets run on this system.
pub const HERE: bool = cfg!(target_os = "linux");

/// What to run.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Options {
    /// One target; else all.
    pub target: Option<String>,
    /// When to end.
    pub effort: Effort,
    /// Processes at once.
    pub jobs: usize,
    /// Run this input of the target alone.
    pub input: Option<PathBuf>,
}

/// When a run ends.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Effort {
    /// After about so many seconds for all targets together.
    Seconds(u64),
    /// When each target has had so many inputs, those of earlier runs included.
    Runs(u64),
}

impl Options {
    /// Reads the task's command line.
    ///
    /// # Errors
    /// For an unknown option or a missing or unfit value.
    pub fn parse(arguments: &[String]) -> Result<Self> {
        let mut options = Self {
            target: None,
            effort: Effort::Seconds(60),
            jobs: 1,
            input: None,
        };
        let mut arguments = arguments.iter();
        while let Some(argument) = arguments.next() {
            let value = arguments.next().with_context(|| format!("{argument} wants a value"))?;
            let number = || match value.parse() {
                Ok(number) if number > 0 => Ok(number),
                _ => bail!("{argument} {value}: expected a number from 1"),
            };
            match argument.as_str() {
                "--target" => options.target = Some(value.clone()),
                "--seconds" => options.effort = Effort::Seconds(number()?),
                "--runs" => options.effort = Effort::Runs(number()?),
                "--jobs" => options.jobs = number()? as usize,
                "--input" => options.input = Some(value.into()),
                other => bail!("cargo xtask fuzz does not know {other:?}"),
            }
        }
        ensure!(
            options.input.is_none() || options.target.is_some(),
            "--input wants the --target that it is an input of"
        );
        Ok(options)
    }
}

/// Builds the fuzz targets and runs them.
///
/// # Errors
/// When they cannot be built, and when a target fails, which is told with the file of the input.
pub fn run(root: &Path, options: &Options) -> Result<()> {
    let program = Program::build(root)?;
    let mut targets = program.targets()?;
    if let Some(name) = &options.target {
        // Planted ones are not listed.
        let known = targets.iter().find(|target| target.name == *name).cloned();
        targets = vec![known.unwrap_or_else(|| FuzzTarget::new(name))];
    }
    if let Some(input) = &options.input {
        return program.run_input(&targets[0], input);
    }
    let folder = tools::target_folder(root)?.join("fuzz");
    let schedule = Schedule::new(targets, options, Totals::load(&folder)?);
    let state = Mutex::new(schedule);
    let locked = || state.lock().unwrap_or_else(PoisonError::into_inner);
    let work = || -> Result<()> {
        loop {
            let Some((target, round)) = locked().next() else {
                return Ok(());
            };
            let ended = program.run_round(&target, &folder, round);
            match locked().ended(&target.name, ended)? {
                Ok(line) => println!("{line}"),
                Err(failure) => eprintln!("{failure}"),
            }
        }
    };
    let results: Vec<Result<()>> = thread::scope(|scope| {
        let threads: Vec<_> = (0..options.jobs).map(|_| scope.spawn(work)).collect();
        let joined = threads.into_iter().map(|thread| thread.join());
        joined
            .map(|result| result.unwrap_or_else(|_| bail!("a thread of the task panicked")))
            .collect()
    });
    results.into_iter().collect::<Result<()>>()?;
    let failed = locked().failed.join(", ");
    ensure!(
        failed.is_empty(),
        "a bug was found in {failed}: the inputs are named above"
    );
    Ok(())
}

/// Sees to it that a failure is seen: two targets with planted bugs have to fail.
///
/// # Errors
/// When one does not.
pub fn check_that_failures_are_seen(root: &Path) -> Result<()> {
    let program = Program::build(root)?;
    let folder = tools::target_folder(root)?.join("fuzz-planted");
    // Too much memory is seen by the program's own count after the input, or by libFuzzer while it runs.
    for (name, signs) in [
        ("planted-panic", &["the planted panic"][..]),
        ("planted-memory", &["bytes of memory", "out-of-memory"][..]),
    ] {
        // What was found before would be run first.
        if folder.exists() {
            std::fs::remove_dir_all(&folder).with_context(|| format!("removing {}", folder.display()))?;
        }
        let round = Round {
            seconds: 60,
            runs: None,
        };
        match program.run_round(&FuzzTarget::new(name), &folder, round) {
            Ok(ended) => bail!(
                "{name} did not fail within {} inputs: the harness is blind",
                ended.inputs
            ),
            Err(error) => {
                let error = format!("{error:#}");
                let is_seen = signs.iter().any(|sign| error.contains(sign)) && error.contains("on the input");
                ensure!(is_seen, "{name} failed otherwise: {error}");
            }
        }
    }
    Ok(())
}

/// Which target runs when.
struct Schedule {
    targets: Vec<FuzzTarget>,
    effort: Effort,
    jobs: usize,
    totals: Totals,
    running: BTreeSet<String>,
    /// Targets that have had their one round of a run of so many seconds.
    done: BTreeSet<String>,
    /// Targets that failed: the others go on.
    failed: Vec<String>,
}

impl Schedule {
    fn new(targets: Vec<FuzzTarget>, options: &Options, totals: Totals) -> Self {
        Self {
            jobs: options.jobs.min(targets.len()),
            targets,
            effort: options.effort,
            totals,
            running: BTreeSet::new(),
            done: BTreeSet::new(),
            failed: Vec::new(),
        }
    }

    /// The next target, the one with the fewest inputs, and its round.
    fn next(&mut self) -> Option<(FuzzTarget, Round)> {
        let inputs = |target: &&FuzzTarget| self.totals.inputs(&target.name);
        let is_open = |target: &&FuzzTarget| {
            let finished = match self.effort {
                Effort::Seconds(_) => self.done.contains(&target.name),
                Effort::Runs(runs) => self.totals.inputs(&target.name) >= runs,
            };
            !finished && !self.running.contains(&target.name) && !self.failed.contains(&target.name)
        };
        let target = self.targets.iter().filter(is_open).min_by_key(inputs)?.clone();
        let round = match self.effort {
            Effort::Seconds(seconds) => Round {
                seconds: (seconds * self.jobs as u64 / self.targets.len() as u64).max(1),
                runs: None,
            },
            Effort::Runs(runs) => Round {
                seconds: LONGEST_ROUND_S,
                runs: Some(runs - self.totals.inputs(&target.name)),
            },
        };
        self.running.insert(target.name.clone());
        Some((target, round))
    }

    /// Writes down what a round had; gives a line to print, or the failure.
    ///
    /// # Errors
    /// When it cannot be written down.
    fn ended(&mut self, name: &str, ended: Result<program::Ended>) -> Result<Result<String, String>> {
        self.running.remove(name);
        self.done.insert(name.to_owned());
        let program::Ended { inputs, time } = match ended {
            Ok(ended) => ended,
            Err(error) => {
                self.failed.push(name.to_owned());
                return Ok(Err(format!("{error:#}")));
            }
        };
        self.totals.add(name, inputs)?;
        let rate = inputs as f64 / time.max(Duration::from_millis(1)).as_secs_f64();
        Ok(Ok(format!(
            "{name:<12} {inputs:>10} inputs in {:>4.0} s, {rate:>7.0} in a second, {:>11} in total",
            time.as_secs_f64(),
            self.totals.inputs(name)
        )))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn words(text: &str) -> Vec<String> {
        text.split_whitespace().map(str::to_owned).collect()
    }

    fn ended(inputs: u64) -> Result<program::Ended> {
        Ok(program::Ended {
            inputs,
            time: Duration::from_secs(1),
        })
    }

    #[test]
    fn options_are_read_and_what_is_none_is_named() {
        let options = Options::parse(&words("--target obj --runs 500 --jobs 2")).unwrap();
        assert_eq!((options.effort, options.jobs), (Effort::Runs(500), 2));
        assert_eq!(options.target.as_deref(), Some("obj"));
        assert_eq!(Options::parse(&[]).unwrap().effort, Effort::Seconds(60));
        for (line, part) in [
            ("--runs 0", "from 1"),
            ("--seconds", "wants a value"),
            ("--input file", "--target"),
            ("--shape round", "--shape"),
        ] {
            let error = Options::parse(&words(line)).unwrap_err().to_string();
            assert!(error.contains(part), "{error}");
        }
    }

    #[test]
    fn the_target_with_the_fewest_inputs_is_next_until_all_have_had_enough() {
        let folder = tempfile::tempdir().unwrap();
        let targets = ["a", "b"].map(FuzzTarget::new).to_vec();
        let options = Options::parse(&words("--runs 100 --jobs 2")).unwrap();
        let mut schedule = Schedule::new(targets.clone(), &options, Totals::load(folder.path()).unwrap());
        let name = |next: Option<(FuzzTarget, Round)>| next.map(|(target, round)| (target.name, round.runs));
        assert_eq!(name(schedule.next()), Some(("a".to_owned(), Some(100))));
        assert_eq!(name(schedule.next()), Some(("b".to_owned(), Some(100))));
        assert_eq!(name(schedule.next()), None, "both are running");
        schedule.ended("a", ended(60)).unwrap().unwrap();
        schedule.ended("b", ended(100)).unwrap().unwrap();
        assert_eq!(name(schedule.next()), Some(("a".to_owned(), Some(40))));
        schedule.ended("a", ended(41)).unwrap().unwrap();
        assert_eq!(name(schedule.next()), None);
        // Another run goes on from there.
        let options = Options::parse(&words("--runs 150")).unwrap();
        let mut schedule = Schedule::new(targets, &options, Totals::load(folder.path()).unwrap());
        assert_eq!(name(schedule.next()), Some(("b".to_owned(), Some(50))));
    }

    #[test]
    fn a_target_that_fails_is_left_out_and_the_others_go_on() {
        let folder = tempfile::tempdir().unwrap();
        let targets = ["a", "b"].map(FuzzTarget::new).to_vec();
        let options = Options::parse(&words("--runs 100")).unwrap();
        let mut schedule = Schedule::new(targets, &options, Totals::load(folder.path()).unwrap());
        assert_eq!(schedule.next().unwrap().0.name, "a");
        let failure = schedule
            .ended("a", Err(anyhow::anyhow!("it fails on crash-1")))
            .unwrap();
        assert_eq!(failure, Err("it fails on crash-1".to_owned()));
        assert_eq!(schedule.next().unwrap().0.name, "b");
        schedule.ended("b", ended(100)).unwrap().unwrap();
        assert!(schedule.next().is_none() && schedule.failed == ["a"]);
    }

    #[test]
    fn seconds_are_those_of_all_targets_together() {
        let folder = tempfile::tempdir().unwrap();
        let options = Options::parse(&words("--seconds 60 --jobs 2")).unwrap();
        let targets = ["a", "b", "c", "d"].map(FuzzTarget::new).to_vec();
        let mut schedule = Schedule::new(targets, &options, Totals::load(folder.path()).unwrap());
        let mut names = BTreeSet::new();
        while let Some((target, round)) = schedule.next() {
            assert_eq!(
                round,
                Round {
                    seconds: 30,
                    runs: None
                }
            );
            schedule.ended(&target.name, ended(1)).unwrap().unwrap();
            names.insert(target.name);
        }
        assert_eq!(names.len(), 4);
    }
}
