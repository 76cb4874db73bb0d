//! Inference in processes of their own that take turns: one for each number of threads, which is fixed when a process
//! starts, and one beside each for a rival. A line on standard input asks for one image; a line on standard output
//! gives the milliseconds.

use super::frame;
use crate::input;
use anyhow::{Context, Result, bail, ensure};
use deepsft::{CompactNetwork, DeviceKind, ModelBundle, encode_png, images_to_tensor, start_device};
use deepsft_geometry::Picture;
use serde::{Deserialize, Serialize};
use std::io::{BufRead, BufReader, Write, stdin, stdout};
use std::path::Path;
use std::process::{Child, ChildStdin, ChildStdout, Command, Stdio};
use std::time::{Duration, Instant};
use std::{env, fs, thread};

/// Rounds before the measured ones.
const WARM_UP_ROUNDS: u32 = 3;

/// Between two turns: idle threads of the process before may still spin for a while.
const REST: Duration = Duration::from_millis(50);

/// Asks for a camera frame's maps with all stages; answered by [`Stages`].
const WHOLE_FRAME: &str = "frame";

/// Asks for the network alone, from the input tensor to the values that maps are read from.
const NETWORK_ALONE: &str = "network";

/// Milliseconds over the measured frames.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Times {
    pub median_ms: f64,
    pub least_ms: f64,
    pub most_ms: f64,
}

/// Inference on a number of threads.
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

/// Another program that runs the network when asked.
#[derive(Clone, Copy)]
pub struct Rival<'a> {
    pub name: &'a str,
    /// Program and arguments.
    pub command: &'a [String],
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
        let rival = rival.map(|Rival { name, command }| -> Result<_> {
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
        let stage = |of: fn(&Stages) -> f64| Times::of(self.stages.iter().map(of).collect());
        let network_alone = Times::of(self.network_alone)?;
        let rival = match self.rival {
            Some((name, _)) => {
                let times = Times::of(self.rival_alone)?;
                let ratio = network_alone.median_ms / times.median_ms;
                Some(RivalReport {
                    name: name.to_owned(),
                    network_alone: times,
                    ratio,
                })
            }
            None => None,
        };
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

impl Times {
    /// `None` without any time.
    pub fn of(mut times: Vec<f64>) -> Option<Self> {
        times.sort_by(f64::total_cmp);
        let (&least_ms, &most_ms) = (times.first()?, times.last()?);
        let (low, high) = (times[(times.len() - 1) / 2], times[times.len() / 2]);
        Some(Self {
            median_ms: (low + high) / 2.0,
            least_ms,
            most_ms,
        })
    }
}

/// A process that answers lines with lines. It ends when this is dropped and its input with it.
pub struct Process {
    child: Child,
    questions: Option<ChildStdin>,
    answers: BufReader<ChildStdout>,
}

impl Process {
    /// Starts it and tells it the number of threads.
    pub fn start(command: &mut Command, threads: usize) -> Result<Self> {
        let threads = threads.to_string();
        command
            .env("RAYON_NUM_THREADS", &threads)
            .env("DEEPSFT_BENCH_THREADS", &threads);
        let program = command.get_program().to_string_lossy().into_owned();
        let mut child = command
            .stdin(Stdio::piped())
            .stdout(Stdio::piped())
            .spawn()
            .with_context(|| format!("could not start {program}"))?;
        let (Some(questions), Some(answers)) = (child.stdin.take(), child.stdout.take()) else {
            bail!("{program} cannot be talked to");
        };
        Ok(Self {
            child,
            questions: Some(questions),
            answers: BufReader::new(answers),
        })
    }

    /// Its answer to a line.
    pub fn ask(&mut self, question: &str) -> Result<String> {
        thread::sleep(REST);
        let questions = self.questions.as_mut().context("the process was told to end")?;
        writeln!(questions, "{question}")?;
        let mut answer = String::new();
        self.answers.read_line(&mut answer)?;
        ensure!(!answer.is_empty(), "a process that was to be measured has ended");
        Ok(answer.trim().to_owned())
    }
}

impl Drop for Process {
    fn drop(&mut self) {
        self.questions = None;
        // It ends by itself; how does not matter any more.
        let _ = self.child.wait();
    }
}

/// The other side: answers until the input ends.
pub fn take(bundle: &ModelBundle, image: &Picture) -> Result<()> {
    let camera = frame::camera(bundle)?;
    let (estimator, _) = input::estimator(bundle, DeviceKind::Cpu)?;
    let (device, _) = pollster::block_on(start_device(DeviceKind::Cpu))?;
    let canonical = estimator.canonical_image(image, &camera)?;
    let tensor = images_to_tensor(&[&canonical], &device);
    let network = super::export::compact(bundle)?;
    for question in stdin().lines() {
        let answer = match question?.as_str() {
            WHOLE_FRAME => {
                let mut stages = Stages {
                    canonical_warp: 0.0,
                    network: 0.0,
                    confidence: 0.0,
                };
                let canonical = timed(&mut stages.canonical_warp, || estimator.canonical_image(image, &camera))?;
                let maps = timed(&mut stages.network, || pollster::block_on(estimator.infer(&canonical)))?;
                timed(&mut stages.confidence, || estimator.judge(&canonical, &maps))?;
                serde_json::to_string(&stages)?
            }
            NETWORK_ALONE => {
                let mut ms = 0.0;
                timed(&mut ms, || {
                    let output = network.forward(tensor.clone());
                    (
                        CompactNetwork::at_pixels(output.refined).into_data(),
                        output.mask.into_data(),
                    )
                });
                ms.to_string()
            }
            other => bail!("there is nothing called {other:?} to measure"),
        };
        writeln!(stdout(), "{answer}")?;
        stdout().flush()?;
    }
    Ok(())
}

/// Runs `work` and writes its milliseconds.
pub fn timed<T>(ms: &mut f64, work: impl FnOnce() -> T) -> T {
    let started = Instant::now();
    let result = work();
    *ms = started.elapsed().as_secs_f64() * 1e3;
    result
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_median_is_the_middle_or_between_the_two_in_the_middle() {
        let times = |times: &[f64]| Times::of(times.to_vec());
        assert_eq!(
            times(&[9.0, 1.0, 4.0]),
            Some(Times {
                median_ms: 4.0,
                least_ms: 1.0,
                most_ms: 9.0
            })
        );
        assert_eq!(times(&[9.0, 1.0, 4.0, 6.0]).map(|t| t.median_ms), Some(5.0));
        assert_eq!(times(&[]), None);
    }

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
