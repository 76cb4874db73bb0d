//! `deepsft-lab soak`: a very long video, and whether memory grows.

use crate::measuring::{Memory, processor};
use anyhow::{Result, bail, ensure};
use clap::Args;
use deepsft::video::{Detection, FindingPace, TrackedFrame, VideoOptions, VideoTracker};
use deepsft::{DeviceKind, View};
use deepsft_cli::object_choice::{DescriptorChoice, ObjectChoice};
use deepsft_cli::progress;
use deepsft_formats::write_file;
use deepsft_geometry::tracking::{OneEuroOptions, TrackUpdate};
use deepsft_geometry::{Camera, Picture, Template, training_camera};
use deepsft_synth::{ClipEvent, ClipLength, ClipStory, FIRST_CLIP_SEED, SynthConfig, Synthesizer, clip_frames};
use serde::Serialize;
use std::path::PathBuf;
use std::time::Instant;

/// Frames between two looks at the memory.
const LOOK_EVERY: u64 = 50;

/// Frames per second that the tracker is told.
const FRAMES_PER_S: f64 = 30.0;

/// Seed of the first clip; no training and no evaluation uses it.
const SEED: u64 = FIRST_CLIP_SEED + 0x50a6;

#[derive(Args)]
#[command(after_help = "\
The command renders one clip of each kind that `deepsft clip` knows and tracks them over and over as one video, each forwards
and then backwards: nothing jumps, but from clip to clip there is a cut. Losses, searches, detections and restarts therefore
come again and again. It looks at the memory of its own process, and takes the median over windows of frames: all that is
resident, and what of it is heap and stacks. It fails when the last window has more than --max-growth-kb above the first one
after the warm-up. Linux only.

Examples: a million frames of the poster take a thread six hours, of a small print that the finders see every other second less than two
  RAYON_NUM_THREADS=1 deepsft-lab soak --model models/poster-a4 --json soak.json
  RAYON_NUM_THREADS=1 deepsft-lab soak --picture models/poster-a4/template/texture.png --size-mm 114x80.6 --every 60 --json soak.json")]
pub struct SoakArguments {
    #[command(flatten)]
    object: ObjectChoice,
    #[command(flatten)]
    descriptors: DescriptorChoice,
    /// Frames to track, after the warm-up
    #[arg(long, value_name = "N", default_value_t = 1_000_000, value_parser = clap::value_parser!(u64).range(1..))]
    frames: u64,
    /// Frames before the memory counts
    #[arg(long, value_name = "N", default_value_t = 10_000)]
    warm_up: u64,
    /// Frames of a window
    #[arg(long, value_name = "N", default_value_t = 10_000, value_parser = clap::value_parser!(u64).range(1..))]
    window: u64,
    /// Frames of each clip
    #[arg(long, value_name = "N", default_value_t = 60, value_parser = clap::value_parser!(u32).range(2..=1000))]
    clip_frames: u32,
    /// A detection arrives K frames after its frame; then the finders start on the newest one
    #[arg(long, value_name = "K", default_value_t = 30, value_parser = clap::value_parser!(u64).range(..=30))]
    delay: u64,
    /// In place of --delay: the finders see every Nth frame, and the video waits for them
    #[arg(long, value_name = "N", conflicts_with = "delay", value_parser = clap::value_parser!(u64).range(1..))]
    every: Option<u64>,
    /// Growth from which the command fails, kB
    #[arg(long, value_name = "KB", default_value_t = 1000)]
    max_growth_kb: u64,
    /// Write the figures to this file, again after every window
    #[arg(long, value_name = "FILE")]
    json: Option<PathBuf>,
}

/// The content of the JSON file.
#[derive(Serialize)]
struct Report {
    object: String,
    /// One of the two is what was asked for.
    finding_delay_frames: Option<u64>,
    finding_every_frames: Option<u64>,
    warm_up_frames: u64,
    /// Frames tracked so far, after the warm-up.
    frames: u64,
    finished: bool,
    ms_per_frame: f64,
    /// Of the last window above the first; of the larger of the two figures.
    growth_kb: i64,
    windows: Vec<Window>,
    processor: Option<String>,
    deepsft_version: &'static str,
}

/// A stretch of frames.
#[derive(Clone, Debug, Default, Serialize)]
struct Window {
    /// Frames until its end, without the warm-up.
    until_frame: u64,
    /// Median, kB.
    resident_kb: u64,
    anonymous_kb: u64,
    #[serde(flatten)]
    happened: Happened,
    ms_per_frame: f64,
}

/// What happened in frames.
#[derive(Clone, Copy, Debug, Default, Serialize)]
struct Happened {
    found: u64,
    lost: u64,
    started: u64,
    confirmed: u64,
    restarted: u64,
    dropped: u64,
    ignored: u64,
}

impl Happened {
    /// `was_found` is of the frame before.
    fn count(&mut self, frame: &TrackedFrame, was_found: bool) {
        let found = frame.tracked.found;
        self.found += u64::from(found);
        self.lost += u64::from(was_found && !found);
        let Some(Detection { effect, .. }) = &frame.detection else {
            return;
        };
        *match effect {
            TrackUpdate::Started => &mut self.started,
            TrackUpdate::Confirmed => &mut self.confirmed,
            TrackUpdate::Restarted => &mut self.restarted,
            TrackUpdate::Dropped => &mut self.dropped,
            _ => &mut self.ignored,
        } += 1;
    }
}

/// Clips as one video without an end: each forwards, then backwards, then the next one.
struct EndlessVideo {
    clips: Vec<Vec<Picture>>,
    camera: Camera,
}

impl EndlessVideo {
    /// Renders one clip of each event.
    fn render(template: &Template, camera: Camera, frames: usize) -> Result<Self> {
        let synthesizer = Synthesizer::new(template, SynthConfig::for_clip_stories(camera))?;
        let length = ClipLength {
            frames,
            frames_per_s: FRAMES_PER_S,
            ..ClipLength::default()
        };
        let bar = progress::counting((frames * ClipEvent::ALL.len()) as u64, "frames rendered");
        let mut clips = Vec::new();
        for (&event, seed) in ClipEvent::ALL.iter().zip(SEED..) {
            let story = ClipStory::new(&synthesizer, length.clone(), event, seed)?;
            let images = clip_frames(&story, 0..frames).map(|sample| {
                bar.inc(1);
                sample.map(|sample| sample.image)
            });
            clips.push(images.collect::<Result<_, _>>()?);
        }
        bar.finish_and_clear();
        Ok(Self { clips, camera })
    }

    fn frame(&self, number: u64) -> &Picture {
        let (clip, frame) = place(number, self.clips.len(), self.clips[0].len());
        &self.clips[clip][frame]
    }
}

/// The clip and its frame that come at `number`, of so many clips of so many frames.
fn place(number: u64, clips: usize, frames: usize) -> (usize, usize) {
    let there_and_back = 2 * frames as u64;
    let clip = (number / there_and_back % clips as u64) as usize;
    let within = (number % there_and_back) as usize;
    (clip, within.min(2 * frames - 1 - within))
}

pub fn run(arguments: &SoakArguments) -> Result<()> {
    Memory::now()?;
    let chosen = arguments.object.target(DeviceKind::Cpu)?;
    let camera = chosen.target.canonical_camera(training_camera().size());
    let mut finder = arguments.descriptors.finder(chosen.target)?;
    let video = EndlessVideo::render(finder.target().template(), camera, arguments.clip_frames as usize)?;
    let options = VideoOptions {
        pace: arguments
            .every
            .map_or(FindingPace::Delayed(arguments.delay), FindingPace::Every),
        smoothing: Some(OneEuroOptions::default()),
        ..VideoOptions::default()
    };
    let windows = arguments.frames.div_ceil(arguments.window) as usize;
    let mut report = Report {
        object: chosen.name,
        finding_delay_frames: arguments.every.is_none().then_some(arguments.delay),
        finding_every_frames: arguments.every,
        warm_up_frames: arguments.warm_up,
        frames: 0,
        finished: false,
        ms_per_frame: 0.0,
        growth_kb: 0,
        // What is kept for the report must not count as growth.
        windows: Vec::with_capacity(windows),
        processor: processor(),
        deepsft_version: env!("CARGO_PKG_VERSION"),
    };
    let mut tracker = VideoTracker::new(&mut finder, options, || 0.0)?;
    let bar = progress::counting(arguments.warm_up + arguments.frames, "frames");
    println!(
        "{:>10} {:>12} {:>12}  found  lost  started  restarted  ms",
        "frames", "resident", "anonymous"
    );
    let (mut number, mut was_found) = (0, false);
    let mut next = |happened: &mut Happened| -> Result<()> {
        let mut view = View::new(video.frame(number), &video.camera);
        let frame = pollster::block_on(tracker.follow(number as f64 / FRAMES_PER_S, &mut view))?;
        happened.count(&frame, was_found);
        was_found = frame.tracked.found;
        number += 1;
        bar.inc(1);
        Ok(())
    };
    for _ in 0..arguments.warm_up {
        next(&mut Happened::default())?;
    }
    let began = Instant::now();
    let mut looks = Vec::with_capacity(arguments.window.div_ceil(LOOK_EVERY) as usize);
    while report.frames < arguments.frames {
        let mut window = Window::default();
        let start = Instant::now();
        let frames = arguments.window.min(arguments.frames - report.frames);
        looks.clear();
        for k in 0..frames {
            next(&mut window.happened)?;
            if k % LOOK_EVERY == 0 {
                looks.push(Memory::now()?);
            }
        }
        report.frames += frames;
        window.until_frame = report.frames;
        window.ms_per_frame = start.elapsed().as_secs_f64() * 1000.0 / frames as f64;
        window.resident_kb = median(&mut looks, |memory| memory.resident_kb);
        window.anonymous_kb = median(&mut looks, |memory| memory.anonymous_kb);
        bar.suspend(|| print(&window));
        report.windows.push(window);
        report.growth_kb = growth_kb(&report.windows);
        report.ms_per_frame = began.elapsed().as_secs_f64() * 1000.0 / report.frames as f64;
        report.finished = report.frames == arguments.frames;
        if let Some(path) = &arguments.json {
            write_file(path, &serde_json::to_vec_pretty(&report)?)?;
        }
    }
    bar.finish_and_clear();
    judge(&report, arguments.max_growth_kb)
}

/// The middle one of the `figure`s of looks at the memory.
fn median(looks: &mut [Memory], figure: fn(&Memory) -> u64) -> u64 {
    looks.sort_unstable_by_key(figure);
    looks.get(looks.len() / 2).map_or(0, figure)
}

fn growth_kb(windows: &[Window]) -> i64 {
    let (Some(first), Some(last)) = (windows.first(), windows.last()) else {
        return 0;
    };
    let grown = |figure: fn(&Window) -> u64| figure(last).cast_signed() - figure(first).cast_signed();
    grown(|window| window.resident_kb).max(grown(|window| window.anonymous_kb))
}

/// An error when memory grew, or when the video was not what it is meant to be.
fn judge(report: &Report, max_growth_kb: u64) -> Result<()> {
    println!(
        "{} frames, {:.2} ms each: memory grew by {} kB",
        report.frames, report.ms_per_frame, report.growth_kb
    );
    let sum = |figure: fn(&Happened) -> u64| {
        report
            .windows
            .iter()
            .map(|window| figure(&window.happened))
            .sum::<u64>()
    };
    ensure!(
        sum(|happened| happened.found) * 2 > report.frames && sum(|happened| happened.started) > 0,
        "the object was found in {} of {} frames only: that is no soak of the tracker",
        sum(|happened| happened.found),
        report.frames
    );
    if report.growth_kb > max_growth_kb.cast_signed() {
        bail!("memory grew by {} kB, more than {max_growth_kb} kB", report.growth_kb);
    }
    Ok(())
}

fn print(window: &Window) {
    let Happened {
        found,
        lost,
        started,
        restarted,
        ..
    } = window.happened;
    println!(
        "{:>10} {:>9} kB {:>9} kB {found:>6} {lost:>5} {started:>8} {restarted:>10}  {:.2}",
        window.until_frame, window.resident_kb, window.anonymous_kb, window.ms_per_frame
    );
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn clips_go_forwards_and_backwards_and_take_turns() {
        let places: Vec<_> = (0..13).map(|number| place(number, 2, 3)).collect();
        let there_and_back = |clip| [0, 1, 2, 2, 1, 0].map(|frame| (clip, frame));
        assert_eq!(places[..6], there_and_back(0));
        assert_eq!(places[6..12], there_and_back(1));
        assert_eq!(places[12], (0, 0));
    }

    #[test]
    fn growth_is_that_of_the_medians_and_too_much_of_it_is_an_error() {
        let mut looks = [5, 900, 4].map(|resident_kb| Memory {
            resident_kb,
            anonymous_kb: 2 * resident_kb,
        });
        assert_eq!(median(&mut looks, |memory| memory.anonymous_kb), 10);
        let window = |resident_kb, anonymous_kb| Window {
            resident_kb,
            anonymous_kb,
            happened: Happened {
                found: 60,
                started: 1,
                ..Happened::default()
            },
            ..Window::default()
        };
        let report = |windows: Vec<Window>| Report {
            object: String::new(),
            finding_delay_frames: Some(4),
            finding_every_frames: None,
            warm_up_frames: 0,
            frames: 100,
            finished: true,
            ms_per_frame: 1.0,
            growth_kb: growth_kb(&windows),
            windows,
            processor: None,
            deepsft_version: "",
        };
        let grown = report(vec![window(5000, 4000), window(9000, 9000), window(5100, 5001)]);
        assert_eq!(grown.growth_kb, 1001);
        let error = judge(&grown, 1000).unwrap_err().to_string();
        assert!(error.contains("grew by 1001 kB"), "{error}");
        judge(&grown, 1001).unwrap();
        judge(&report(vec![window(5000, 4000), window(4000, 3900)]), 0).unwrap();
        let mut unseen = report(vec![window(5000, 4000)]);
        unseen.windows[0].happened.found = 50;
        assert!(judge(&unseen, 1000).unwrap_err().to_string().contains("no soak"));
    }
}
