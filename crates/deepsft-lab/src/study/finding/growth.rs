//! What more targets cost: time per frame and memory.

use super::judging::{frames_config, median};
use super::prints::Print;
use crate::measuring::Stopwatch;
use anyhow::Result;
use deepsft_finding::{FeatureFinder, FeatureOptions, Features, PictureTarget, feature_image};
use deepsft_geometry::training_camera;
use deepsft_synth::Synthesizer;
use serde::Serialize;
use std::fs;

/// Numbers of targets.
const TARGETS: [usize; 3] = [1, 4, 16];

/// Frames of each median.
const FRAMES: u64 = 12;

/// Time and memory on one thread. Each frame shows one of the targets.
#[derive(Debug, Serialize)]
pub struct Growth {
    /// Median time to prepare a picture, ms.
    pub prepare_ms: f64,
    /// Median time of a frame's features, once for all targets, ms.
    pub features_ms: f64,
    /// Targets and the median time to look for all of them, ms.
    pub find_ms: Vec<(usize, f64)>,
    /// Memory per target, picture included, MB; where the system tells (Linux).
    pub target_mb: Option<f64>,
}

impl Growth {
    /// Measures with up to 16 of `prints`, spread over all of them.
    pub fn measured(prints: &[Print], seed: u64) -> Result<Self> {
        let count = prints.len().min(TARGETS[TARGETS.len() - 1]);
        let chosen: Vec<&Print> = (0..count).map(|k| &prints[k * prints.len() / count]).collect();
        let (camera, config) = frames_config()?;
        let canonical = training_camera();
        let before = resident_mb();
        let (mut finders, mut prepare) = (Vec::new(), Vec::new());
        for print in &chosen {
            let start = Stopwatch::start();
            finders.push(FeatureFinder::new(PictureTarget::from_template(
                print.template.clone(),
            )?)?);
            prepare.push(start.ms());
        }
        let target_mb = resident_mb()
            .zip(before)
            .map(|(after, before)| (after - before) / count as f64);
        let (mut features_ms, mut find) = (Vec::new(), vec![Vec::new(); TARGETS.len()]);
        for index in 0..FRAMES {
            let shown = index as usize * count / FRAMES as usize;
            let sample = Synthesizer::new(&chosen[shown].template, config.clone())?.sample(seed, index);
            let start = Stopwatch::start();
            let (image, small) = feature_image(&sample.image, &camera)?;
            let features = Features::of(&image, &FeatureOptions::default());
            features_ms.push(start.ms());
            let start = Stopwatch::start();
            let mut looked = 0;
            for (&number, times) in TARGETS.iter().zip(&mut find).filter(|(number, _)| **number <= count) {
                // The one that is shown, then the others.
                for k in looked..number {
                    finders[(shown + k) % count].find(&features, &small, &canonical)?;
                }
                looked = number;
                times.push(start.ms());
            }
        }
        let middle = |times: Vec<f64>| median(times.into_iter());
        Ok(Self {
            prepare_ms: middle(prepare).unwrap_or_default(),
            features_ms: middle(features_ms).unwrap_or_default(),
            find_ms: (TARGETS.into_iter().zip(find))
                .filter_map(|(number, times)| Some((number, middle(times)?)))
                .collect(),
            target_mb,
        })
    }

    pub fn print(&self) {
        let Self {
            prepare_ms,
            features_ms,
            ..
        } = self;
        print!("one thread: prepare a picture {prepare_ms:.0} ms, features of a frame {features_ms:.0} ms, find");
        for (targets, ms) in &self.find_ms {
            print!(" {ms:.0} ms with {targets} targets,");
        }
        match self.target_mb {
            Some(mb) => println!(" {mb:.1} MB per target"),
            None => println!(),
        }
        println!();
    }
}

/// The memory that this process holds now, MB, where the system has it in a file (Linux).
fn resident_mb() -> Option<f64> {
    let status = fs::read_to_string("/proc/self/status").ok()?;
    let line = status.lines().find_map(|line| line.strip_prefix("VmRSS:"))?;
    let kibibytes: f64 = line.trim().strip_suffix("kB")?.trim().parse().ok()?;
    Some(kibibytes / 1024.0)
}
