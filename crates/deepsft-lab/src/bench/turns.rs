//! Inference in processes of their own that take turns: one for each number of threads, which is fixed when a process
//! starts, and one beside each for a rival. A line on standard input asks for one image; a line on standard output
//! gives the milliseconds.

use super::workload;
use crate::measuring::{Times, timed};
use crate::reading;
use anyhow::{Context, Result, bail, ensure};
use deepsft::{ModelBundle, Stage, encode_png};
use deepsft_geometry::{ImageSize, Maps, Picture};
use serde::{Deserialize, Serialize};
use std::io::{BufRead, BufReader, Write, stdin, stdout};
use std::path::Path;
use std::process::{Child, ChildStdout, Command, Stdio};
use std::time::Duration;
use std::{env, fs, thread};

/// Between two turns: idle threads of the process before may still spin for a while.
const REST: Duration = Duration::from_millis(50);

/// Rounds before the measured ones.
const WARM_UP_ROUNDS: u32 = 3;

/// Asks for a camera frame's maps with all stages; answered by [`Stages`].
const WHOLE_FRAME: &str = "frame";

/// Asks for the network alone, from the canonical image to the values of all pixels.
const NETWORK_ALONE: &str = "network";

#[derive(Serialize)]
pub struct Inference {
    pub threads: usize,
    pub runs: u32,
    pub canonical_warp: Times,
    pub network: Times,
    pub confidence: Times,
    /// The three stages together.
    pub frame: Times,
    /// See [`NETWORK_ALONE`].
    pub network_alone: Times,
    pub rival: Option<RivalReport>,
}

/// The same network in another program.
#[derive(Serialize)]
pub struct RivalReport {
    pub name: String,
    pub network_alone: Times,
    /// Our median over the rival's.
    pub ratio: f64,
}

/// Milliseconds of the stages of a frame.
#[derive(Clone, Copy, Serialize, Deserialize)]
struct Stages {
    canonical_warp: f64,
    network: f64,
    confidence: f64,
}

/// Milliseconds of all turns on one number of threads.
struct Player<'a> {
    threads: usize,
    ours: Process,
    rival: Option<(&'a str, Process)>,
    stages: Vec<Stages>,
    network_alone: Vec<f64>,
    rival_alone: Vec<f64>,
}

/// Name, program and arguments of another program that does the same work when asked.
type Rival<'a> = (&'a str, &'a [String]);

/// A process that answers lines with lines. It ends when this is dropped and its input with it.
struct Process {
    child: Child,
    answers: BufReader<ChildStdout>,
}

impl Process {
    /// Starts it and tells it the number of threads.
    fn start(command: &mut Command, threads: usize) -> Result<Self> {
        let threads = threads.to_string();
        let child = command
            .env("RAYON_NUM_THREADS", &threads)
            .env("DEEPSFT_BENCH_THREADS", &threads)
            .stdin(Stdio::piped())
            .stdout(Stdio::piped())
            .spawn();
        let mut child = child.with_context(|| format!("could not start {}", command.get_program().display()))?;
        let answers = child.stdout.take().context("a process cannot be talked to")?;
        let answers = BufReader::new(answers);
        Ok(Self { child, answers })
    }

    fn ask(&mut self, question: &str) -> Result<String> {
        thread::sleep(REST);
        let questions = self.child.stdin.as_mut().context("a process cannot be talked to")?;
        writeln!(questions, "{question}")?;
        let mut answer = String::new();
        self.answers.read_line(&mut answer)?;
        ensure!(!answer.is_empty(), "a process that was to be measured has ended");
        Ok(answer.trim().to_owned())
    }
}

impl Drop for Process {
    fn drop(&mut self) {
        // This closes its input and it ends by itself; how does not matter any more.
        let _ = self.child.wait();
    }
}

/// Starts the processes and lets them take turns.
pub fn measure(
    model: &Path,
    frame: &Picture,
    threads: &[usize],
    runs: u32,
    rival: Option<Rival<'_>>,
) -> Result<Vec<Inference>> {
    let folder = tempfile::tempdir()?;
    let frame_file = folder.path().join("frame.png");
    fs::write(&frame_file, encode_png(frame)?)?;
    let start = |&threads: &usize| Player::start(model, &frame_file, threads, rival);
    let mut players = threads.iter().map(start).collect::<Result<Vec<_>>>()?;
    for round in 0..WARM_UP_ROUNDS + runs {
        for player in &mut players {
            player.take_turn(round >= WARM_UP_ROUNDS)?;
        }
    }
    players
        .into_iter()
        .map(|player| player.report(runs).context("nothing was measured"))
        .collect()
}

impl<'a> Player<'a> {
    fn start(model: &Path, frame: &Path, threads: usize, rival: Option<Rival<'a>>) -> Result<Self> {
        let mut ours = Command::new(env::current_exe()?);
        ours.arg("bench")
            .arg("--model")
            .arg(model)
            .arg("--take-turns")
            .arg(frame);
        let rival = rival.map(|(name, command)| -> Result<_> {
            let (program, arguments) = command.split_first().context("the rival has no program")?;
            Ok((name, Process::start(Command::new(program).args(arguments), threads)?))
        });
        Ok(Self {
            threads,
            ours: Process::start(&mut ours, threads)?,
            rival: rival.transpose()?,
            stages: Vec::new(),
            network_alone: Vec::new(),
            rival_alone: Vec::new(),
        })
    }

    fn take_turn(&mut self, counts: bool) -> Result<()> {
        let stages = serde_json::from_str(&self.ours.ask(WHOLE_FRAME)?)?;
        let network_alone = self.ours.ask(NETWORK_ALONE)?.parse()?;
        let rival_alone: Option<f64> = match &mut self.rival {
            Some((name, rival)) => {
                let answer = rival.ask(NETWORK_ALONE)?;
                Some(answer.parse().with_context(|| format!("{name} answered {answer:?}"))?)
            }
            None => None,
        };
        if counts {
            self.stages.push(stages);
            self.network_alone.push(network_alone);
            self.rival_alone.extend(rival_alone);
        }
        Ok(())
    }

    fn report(self, runs: u32) -> Option<Inference> {
        let stage = |of: fn(&Stages) -> f64| Times::of(&self.stages.iter().map(of).collect::<Vec<_>>());
        let network_alone = Times::of(&self.network_alone)?;
        let rival = self.rival.as_ref().zip(Times::of(&self.rival_alone));
        let rival = rival.map(|((name, _), times)| RivalReport {
            name: (*name).to_owned(),
            ratio: network_alone.median_ms / times.median_ms,
            network_alone: times,
        });
        Some(Inference {
            threads: self.threads,
            runs,
            canonical_warp: stage(|s| s.canonical_warp)?,
            network: stage(|s| s.network)?,
            confidence: stage(|s| s.confidence)?,
            frame: stage(|s| s.canonical_warp + s.network + s.confidence)?,
            network_alone,
            rival,
        })
    }
}

/// The other side: answers until the input ends.
pub fn take(bundle: &ModelBundle, image: &Picture) -> Result<()> {
    let camera = workload::camera(bundle)?;
    let estimator = reading::estimator(bundle)?;
    let canonical = estimator.canonical_image(image, &camera)?;
    let view = estimator.canonical_camera(camera.size());
    let ImageSize { width, height } = canonical.size();
    let mut executor = bundle.network().executor(canonical.size())?;
    let (mut maps, all) = (Maps::empty((width, height)), vec![true; width * height]);
    for question in stdin().lines() {
        let answer = match question?.as_str() {
            WHOLE_FRAME => {
                let (canonical, canonical_warp) = timed(|| estimator.canonical_image(image, &camera))?;
                let (maps, network) = timed(|| pollster::block_on(estimator.infer(&canonical, &view)))?;
                let (_, confidence) = timed(|| estimator.judge(&canonical, &maps))?;
                serde_json::to_string(&Stages {
                    canonical_warp,
                    network,
                    confidence,
                })?
            }
            NETWORK_ALONE => {
                let ((), ms) = timed(|| {
                    executor.run(&canonical)?;
                    executor.read(Stage::RegistrationRefinement, Some(&all), None, &mut maps)
                })?;
                ms.to_string()
            }
            other => bail!("there is nothing called {other:?} to measure"),
        };
        writeln!(stdout(), "{answer}")?;
        stdout().flush()?;
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    #[cfg(unix)]
    fn a_process_answers_line_by_line_knows_its_threads_and_its_end_is_an_error() {
        let script = "read x; echo \"$x on $DEEPSFT_BENCH_THREADS\"; read x; echo $RAYON_NUM_THREADS; read x";
        let mut process = Process::start(Command::new("sh").args(["-c", script]), 3).unwrap();
        assert_eq!(process.ask("one").unwrap(), "one on 3");
        assert_eq!(process.ask("two").unwrap(), "3");
        assert!(process.ask("three").unwrap_err().to_string().contains("has ended"));
    }
}
