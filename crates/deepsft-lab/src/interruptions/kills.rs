//! `deepsft-lab kills`: a command is killed at random moments, again and again, and has to end as if it had not been.

use super::subject::{Expected, Inputs, SEED, Subject};
use anyhow::{Result, bail, ensure};
use clap::Args;
use deepsft_cli::progress;
use deepsft_formats::write_file;
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64Mcg;
use serde::Serialize;
use std::path::{Path, PathBuf};
use std::process::Child;
use std::thread::sleep;
use std::time::{Duration, Instant};

/// A kill at the end falls within this after the last file of a result was written.
const END: Duration = Duration::from_millis(12);

/// How often is looked whether it is there.
const LOOK: Duration = Duration::from_micros(100);

/// Of a training's files the last comes several times: a kill waits for one of so many.
const MAX_TURNS: u32 = 4;

/// A run that was to be killed and ended before, so often in a row, is not what was measured.
const MAX_TOO_LATE: u32 = 1000;

#[derive(Args)]
#[command(after_help = "\
The command runs `deepsft synth`, `train`, `track` or `clip` on a small input, and kills it (SIGKILL) at a moment that is drawn evenly
over the time of an uninterrupted run. After each kill the result's folder must hold what it held before, or the new result,
whole; finished shards and checkpoints must not have become fewer. Then, by the toss of a coin, the command is killed again as it
goes on, or it may end. Then the folder must equal that of an uninterrupted run, byte for byte but for times, with nothing
beside it. Half of the runs begin with an older result in the folder and a file of somebody, which has to stay.
--at-the-end adds kills while the last files are written and folders are put in place.

Example:
  deepsft-lab kills --command train --template models/poster-a4/template --kills 200 --seed 1")]
pub struct KillsArguments {
    /// What is killed: one or several of synth, train, track, clip, reconstruct
    #[arg(long, value_name = "COMMAND", value_enum, value_delimiter = ',', required = true)]
    command: Vec<Subject>,
    /// Folder of a template
    #[arg(long, value_name = "DIR")]
    template: PathBuf,
    /// Number of kills of each, evenly over the whole run
    #[arg(long, value_name = "N", default_value_t = 200)]
    kills: u32,
    /// Number of kills more, while folders are put in place
    #[arg(long, value_name = "N", default_value_t = 0)]
    at_the_end: u32,
    /// Seed of the moments
    #[arg(long, value_name = "S", default_value_t = 1)]
    seed: u64,
    /// The program `deepsft` to kill [default: the same commands in this program]
    #[arg(long, value_name = "FILE")]
    program: Option<PathBuf>,
    /// Write the figures to this file
    #[arg(long, value_name = "FILE")]
    json: Option<PathBuf>,
}

/// The content of the JSON file.
#[derive(Serialize)]
struct Report {
    command: &'static str,
    seed: u64,
    /// Seconds of an uninterrupted run.
    seconds: f64,
    anywhere: Hits,
    at_the_end: Hits,
    /// Runs that went on after kills to their end, and equalled an uninterrupted one.
    equal: u32,
    /// Those of them that began with an older result.
    equal_over_older: u32,
    /// Most kills in a row before one of them.
    max_kills_of_a_run: u32,
    deepsft_version: &'static str,
}

/// What kills hit.
#[derive(Clone, Copy, Debug, Default, Serialize)]
struct Hits {
    kills: u32,
    /// Nothing was written yet.
    before_the_first_file: u32,
    /// Files lay beside the place of the result.
    at_work: u32,
    /// The new result was in its place, and the process had not yet ended.
    after_the_swap: u32,
    /// The process had ended before: no kill.
    too_late: u32,
}

/// When a run is to be killed.
#[derive(Clone, Copy)]
enum Moment {
    After(Duration),
    /// So long after one of the last files has come, the number of times that it comes.
    End {
        turn: u32,
        after: Duration,
    },
}

pub fn run(arguments: &KillsArguments) -> Result<()> {
    let work = tempfile::tempdir()?;
    let program = arguments.program.as_deref();
    let folder = work.path().join("inputs");
    let inputs = Inputs::make(program, &arguments.template, folder, &arguments.command)?;
    let mut reports = Vec::new();
    for &subject in &arguments.command {
        let outcome = kill(
            subject,
            &inputs,
            &work.path().join(subject.name()),
            arguments,
            &mut reports,
        );
        if let Some(path) = &arguments.json {
            write_file(path, &serde_json::to_vec_pretty(&reports)?)?;
        }
        if let Err(error) = outcome {
            let kept = work.keep();
            return Err(error.context(format!("{}, whose folder is kept: {}", subject.name(), kept.display())));
        }
    }
    Ok(())
}

/// Kills one command, in `folder`. The report is made whatever is found.
fn kill(
    subject: Subject,
    inputs: &Inputs,
    folder: &Path,
    arguments: &KillsArguments,
    reports: &mut Vec<Report>,
) -> Result<()> {
    let expected = Expected::make(subject, inputs, folder)?;
    let case = folder.join("case");
    expected.begin(&case, false)?;
    let start = Instant::now();
    let ended = inputs.run(&subject.arguments(inputs, SEED), &case)?;
    ensure!(ended.succeeded, "{}", ended.stderr);
    let whole_run = start.elapsed();
    expected.check_finished(&case, false)?;
    let mut killer = Killer {
        rng: Pcg64Mcg::seed_from_u64(arguments.seed),
        inputs,
        expected: &expected,
        case: &case,
        whole_run,
        report: Report {
            command: subject.name(),
            seed: arguments.seed,
            seconds: whole_run.as_secs_f64(),
            anywhere: Hits::default(),
            at_the_end: Hits::default(),
            equal: 0,
            equal_over_older: 0,
            max_kills_of_a_run: 0,
            deepsft_version: env!("CARGO_PKG_VERSION"),
        },
    };
    let outcome = killer.kill(arguments);
    println!("{}", serde_json::to_string(&killer.report)?);
    reports.push(killer.report);
    outcome
}

struct Killer<'a> {
    rng: Pcg64Mcg,
    inputs: &'a Inputs,
    expected: &'a Expected,
    case: &'a Path,
    whole_run: Duration,
    report: Report,
}

impl Killer<'_> {
    fn kill(&mut self, arguments: &KillsArguments) -> Result<()> {
        let bar = progress::counting(u64::from(arguments.kills + arguments.at_the_end), "kills");
        loop {
            let left = arguments.kills.saturating_sub(self.report.anywhere.kills);
            let left_at_the_end = arguments.at_the_end.saturating_sub(self.report.at_the_end.kills);
            if left + left_at_the_end == 0 {
                bar.finish_and_clear();
                return Ok(());
            }
            self.a_run(left, left_at_the_end)?;
            bar.set_position(u64::from(self.report.anywhere.kills + self.report.at_the_end.kills));
        }
    }

    /// A run with one kill or more, `left` of them at most anywhere and `left_at_the_end` at the end.
    fn a_run(&mut self, mut left: u32, mut left_at_the_end: u32) -> Result<()> {
        let with_older = self.rng.random_bool(0.5);
        self.expected.begin(self.case, with_older)?;
        let subject = self.expected.subject;
        let (mut come, mut kills) = (0, 0);
        while left + left_at_the_end > 0 && (kills == 0 || self.rng.random_bool(0.5)) {
            let at_the_end = self.rng.random_range(0..left + left_at_the_end) >= left;
            let arguments = match kills {
                0 => subject.arguments(self.inputs, SEED),
                _ => subject.again(self.inputs, SEED),
            };
            let before = super::results::files(self.case)?.unwrap_or_default();
            let moment = self.moment(at_the_end);
            let child = self.inputs.start(&arguments, self.case)?;
            let killed = killed_at(child, moment, subject, self.case)?;
            let swapped = self.expected.check_interrupted(self.case, with_older)?;
            let hits = match at_the_end {
                true => &mut self.report.at_the_end,
                false => &mut self.report.anywhere,
            };
            if !killed {
                hits.too_late += 1;
                ensure!(hits.too_late < MAX_TOO_LATE, "runs end before they can be killed");
                break;
            }
            hits.kills += 1;
            kills += 1;
            *(if at_the_end { &mut left_at_the_end } else { &mut left }) -= 1;
            if swapped {
                hits.after_the_swap += 1;
                // The next one finds it done.
                break;
            }
            let written = super::results::files(self.case)?.unwrap_or_default();
            *(if written == before {
                &mut hits.before_the_first_file
            } else {
                &mut hits.at_work
            }) += 1;
            let now = subject.progress(self.case);
            if now < come {
                bail!("{come} samples had been done before a kill, {now} are left after it");
            }
            come = now;
        }
        let ended = self.inputs.run(&subject.again(self.inputs, SEED), self.case)?;
        ensure!(
            ended.succeeded,
            "after {kills} kills the command does not go on: {}",
            ended.stderr
        );
        self.expected.check_finished(self.case, with_older)?;
        if kills > 0 {
            self.report.equal += 1;
            self.report.equal_over_older += u32::from(with_older);
            self.report.max_kills_of_a_run = self.report.max_kills_of_a_run.max(kills);
        }
        Ok(())
    }

    fn moment(&mut self, at_the_end: bool) -> Moment {
        let fraction: f64 = self.rng.random();
        match at_the_end {
            false => Moment::After(self.whole_run.mul_f64(fraction)),
            true => Moment::End {
                turn: match self.expected.subject {
                    Subject::Train => self.rng.random_range(0..MAX_TURNS),
                    _ => 0,
                },
                after: END.mul_f64(fraction),
            },
        }
    }
}

/// Kills a process at a moment; false when it had ended.
fn killed_at(mut child: Child, moment: Moment, subject: Subject, case: &Path) -> Result<bool> {
    match moment {
        Moment::After(time) => sleep(time),
        Moment::End { turn, after } => {
            let is_there = || subject.last_files().iter().any(|file| case.join(file).is_file());
            let mut turns = 0;
            let mut was_there = is_there();
            while child.try_wait()?.is_none() {
                let there = is_there();
                turns += u32::from(there && !was_there);
                was_there = there;
                if turns > turn {
                    sleep(after);
                    break;
                }
                sleep(LOOK);
            }
        }
    }
    let ended = child.try_wait()?.is_some();
    child.kill()?;
    child.wait()?;
    Ok(!ended)
}
