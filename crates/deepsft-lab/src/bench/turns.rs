//! Inference in processes of their own that take turns: one for each number of threads, which is fixed when a process
//! starts, and one beside each for a rival. A line on standard input asks for one image; a line on standard output
//! gives the milliseconds.

use super::workload;
use crate::measuring::{Process, Rival, Times, timed};
use crate::reading;
use anyhow::{Context, Result, bail};
use deepsft::{ModelBundle, Stage, encode_png};
use deepsft_geometry::{ImageSize, Maps, Picture};
use serde::{Deserialize, Serialize};
use std::io::{Write, stdin, stdout};
use std::path::Path;
use std::process::Command;
use std::{env, fs};

/// Rounds before the measured ones.
const WARM_UP_ROUNDS: u32 = 3;

/// Asks for a camera frame's maps with all stages; answered by [`Stages`].
const WHOLE_FRAME: &str = "frame";

/// Asks for the network alone, from the canonical image to the values of all pixels.
const NETWORK_ALONE: &str = "network";

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
                let mut stages = Stages {
                    canonical_warp: 0.0,
                    network: 0.0,
                    confidence: 0.0,
                };
                let canonical = timed(&mut stages.canonical_warp, || estimator.canonical_image(image, &camera))?;
                let maps = timed(&mut stages.network, || {
                    pollster::block_on(estimator.infer(&canonical, &view))
                })?;
                timed(&mut stages.confidence, || estimator.judge(&canonical, &maps))?;
                serde_json::to_string(&stages)?
            }
            NETWORK_ALONE => {
                let mut ms = 0.0;
                timed(&mut ms, || {
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
