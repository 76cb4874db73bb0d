//! `deepsft-lab study tracking`: clips that are rendered, tracked and compared with the truth.

mod clip_record;
mod seen_vertices;
mod summary;

use super::frames::doubled;
use crate::measuring::{Spread, write_json};
use crate::reading;
use anyhow::{Context, Result};
use clap::{Args, ValueEnum};
use clip_record::{Clip, FrameRecord, losses};
use deepsft::session::{VideoFollower, VideoOptions};
use deepsft::{Device, Finder, Target, TargetFinder, View};
use deepsft_geometry::glam::DVec3;
use deepsft_geometry::raster::VisibleSurface;
use deepsft_geometry::tracking::{OneEuro, OneEuroOptions, TrackUpdate};
use deepsft_geometry::{Camera, Maps, Template, training_camera};
use deepsft_synth::ClipEvent::{self, JumpCut, Leaving, Motion, Occlusion, Still, Turning};
use deepsft_synth::{ClipLength, ClipStory, FIRST_CLIP_SEED, Sample, SynthConfig, Synthesizer};
use deepsft_train::tracking_errors;
use indicatif::ProgressBar;
use serde::Serialize;
use std::collections::BTreeMap;
use std::path::PathBuf;
use std::time::Instant;
use summary::{ClipRecord, Recoveries, Summary};

/// What happens in the clips, in turn.
const EVENTS: [ClipEvent; 10] = [
    Motion, Occlusion, JumpCut, Leaving, Still, Motion, Occlusion, JumpCut, Leaving, Motion,
];

/// The same of an object that is no sheet.
const EVENTS_OF_SOLIDS: [ClipEvent; 5] = [Turning, Occlusion, Turning, Leaving, Motion];

#[derive(Args)]
#[command(after_help = "\
Each clip shows a sheet that moves and bends as in two hands, at 30 frames per second. The exposure is a third of a frame,
and the sensor is noisy. Ten clips take turns: in three nothing else happens, in two an arm passes in front, two have a
cut, in two the sheet leaves the view and comes back, in one it is still. `deepsft clip` writes any of them. An object
with a volume bends too; of five clips it turns all around in two, an arm passes in one, in one it leaves and comes back.

The report lists
  tracked         fraction of the frames in view (at least 30 % of the print; of an object with a volume, of the print on
                  the side that it shows) whose registration RMSE is at most 2 px of the 480 x 270 image; also without the
                  frames in which the network had not yet answered about the sheet, at the start, after a cut and after a
                  return
  off             false positions: frames in view that count as found and are more than 5 px off
  found without   false detections: frames that count as found and show nothing of the sheet
  recoveries      how losses (not found, or more than 5 px off) ended: within 2 px again by the frame at which the
                  network's next detection arrived, later, or never
  jitter          of a still sheet: RMS distance of the seen vertices' pixels from their means, px
  lag             frames by which the track trails the sheet: the shift in time that explains the differences best
It also lists jitter and lag after smoothing (One-Euro filter).

Example:
  deepsft-lab study tracking --model models/poster-a4 --clips 50 --json tracking.json")]
pub struct TrackingStudyArguments {
    /// Model bundle of the sheet
    #[arg(long, value_name = "BUNDLE")]
    model: PathBuf,
    /// Who looks for the sheet
    #[arg(long, value_name = "WHO", value_enum, default_value = "network")]
    finders: Finders,
    /// Number of clips
    #[arg(long, value_name = "N", default_value_t = 50, value_parser = clap::value_parser!(u64).range(1..))]
    clips: u64,
    /// Frames of each clip
    #[arg(long, value_name = "N", default_value_t = 60, value_parser = clap::value_parser!(u32).range(30..=100_000))]
    frames: u32,
    /// Seed of the first clip; the next ones count up
    #[arg(long, value_name = "S", default_value_t = FIRST_CLIP_SEED + 1000)]
    seed: u64,
    /// Only clips in which this happens: motion, occlusion, jump-cut, leaving, still or turning
    #[arg(long, value_name = "EVENT")]
    event: Option<ClipEvent>,
    /// The object keeps its rest shape: a box, a tin
    #[arg(long)]
    at_rest: bool,
    /// Frames after which the network's answer is there
    #[arg(long, value_name = "K", default_value_t = 4, value_parser = clap::value_parser!(u64).range(..=30))]
    delay: u64,
    /// Write the figures to this file
    #[arg(long, value_name = "FILE")]
    json: Option<PathBuf>,
}

/// Who looks for the sheet.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum Finders {
    /// The model's own network
    Network,
    /// Features of the picture, without any training
    Features,
    /// Both
    All,
}

/// The content of the JSON file.
#[derive(Serialize)]
struct Report<'a> {
    object: &'a str,
    first_seed: u64,
    finding_delay_frames: u64,
    #[serde(flatten)]
    summary: &'a Summary,
    by_event: &'a BTreeMap<&'static str, Summary>,
    per_clip: &'a [ClipRecord],
    deepsft_version: &'static str,
}

pub fn run(arguments: &TrackingStudyArguments) -> Result<()> {
    let bundle = reading::bundle(&arguments.model)?;
    let target = Target::from_model(&bundle, &Device::Cpu)?;
    let (mut finder, camera) = finder(&target, arguments.finders)?;
    let mut config = SynthConfig::for_clip_stories(camera);
    if arguments.at_rest {
        config = config.at_rest();
    }
    let synthesizer = Synthesizer::new(target.template(), config)?;
    let events = match target.template().is_sheet() {
        true => &EVENTS[..],
        false => &EVENTS_OF_SOLIDS,
    };
    let progress = ProgressBar::new(arguments.clips);
    let mut clips = Vec::new();
    for number in 0..arguments.clips {
        let event = arguments.event.unwrap_or(events[number as usize % events.len()]);
        let length = ClipLength {
            frames: arguments.frames as usize,
            ..ClipLength::default()
        };
        let story = ClipStory::new(&synthesizer, length, event, arguments.seed + number)?;
        let frames = deepsft_synth::clip_frames(&story, 0..story.length().frames);
        let samples: Vec<Sample> = frames.collect::<Result<_, _>>()?;
        clips.push(track(&mut finder, &story, &samples, arguments)?);
        progress.inc(1);
    }
    let (summary, by_event) = (Summary::of(clips.iter()), Summary::by_event(&clips));
    print(&summary, &by_event);
    let report = Report {
        object: bundle.name(),
        first_seed: arguments.seed,
        finding_delay_frames: arguments.delay,
        summary: &summary,
        by_event: &by_event,
        per_clip: &clips,
        deepsft_version: env!("CARGO_PKG_VERSION"),
    };
    write_json(arguments.json.as_deref(), &report)
}

/// The finders, and the camera of the clips: features are taken from images of twice the canonical size.
fn finder(target: &Target, finders: Finders) -> Result<(TargetFinder, Camera)> {
    let canonical = target.canonical_camera(training_camera().size());
    let doubled = doubled(&canonical)?;
    Ok(match finders {
        Finders::Network => {
            let network = target.network().context("the model has no network")?.clone();
            let finders = vec![Finder::Network(Box::new(network))];
            (TargetFinder::with_finders(target.clone(), finders), canonical)
        }
        Finders::Features => (
            TargetFinder::new(Target::from_template(target.template().clone()))?,
            doubled,
        ),
        Finders::All => (TargetFinder::new(target.clone())?, doubled),
    })
}

fn track(
    finder: &mut TargetFinder,
    story: &ClipStory<'_>,
    samples: &[Sample],
    arguments: &TrackingStudyArguments,
) -> Result<ClipRecord> {
    let (template, camera) = (
        finder.target().template().clone(),
        finder.target().canonical_camera(training_camera().size()),
    );
    let (template, camera) = (&template, &camera);
    let options = VideoOptions {
        delay: arguments.delay,
        ..VideoOptions::default()
    };
    let began = Instant::now();
    let clock_ms = || began.elapsed().as_secs_f64() * 1000.0;
    let mut tracker = VideoFollower::new(finder, options, clock_ms)?;
    let mut filter = OneEuro::new(OneEuroOptions::default());
    let (mut frames, mut meshes, mut smooth) = (Vec::new(), Vec::new(), Vec::new());
    let truths = samples
        .iter()
        .map(|sample| tracking_errors::truth_maps(sample, template, camera))
        .collect::<Result<Vec<Maps>, _>>()?;
    for (frame, (sample, truth)) in samples.iter().zip(&truths).enumerate() {
        let time_s = frame as f64 / story.length().frames_per_s;
        let mut view = View::new(&sample.image, &sample.camera);
        let followed = pollster::block_on(tracker.follow(time_s, &mut view))?;
        let tracked = followed.followed;
        // A mesh that is held says where the sheet was.
        let surface = tracked.surface.filter(|_| !tracked.held);
        let errors = surface
            .as_ref()
            .map(|surface| tracking_errors::mesh_errors(template, &surface.vertices_camera, truth, camera))
            .transpose()?;
        let effect = followed.detection.map(|detection| detection.effect);
        frames.push(FrameRecord {
            frame,
            print_in_view: tracking_errors::print_in_view(truth)
                / most_in_view(template, &sample.vertices_camera, camera)?,
            found: surface.is_some(),
            correlation: tracked.correlation,
            iterations: tracked.iterations,
            registration_rmse_px: errors.and_then(|errors| errors.registration_rmse_px),
            points_rmse_mm: errors.and_then(|errors| errors.points_rmse_mm),
            detection: followed.detection,
            ms: followed.times,
        });
        if matches!(effect, Some(TrackUpdate::Started | TrackUpdate::Restarted)) {
            filter.reset();
        }
        if let Some(surface) = surface {
            let mut vertices = surface.vertices_camera.clone();
            filter.smooth(time_s, &mut vertices);
            smooth.push(Some(vertices));
            meshes.push(Some(surface.vertices_camera));
        } else {
            filter.reset();
            smooth.push(None);
            meshes.push(None);
        }
    }
    let during = story.event_frames();
    let cut = (story.event() == JumpCut).then_some(during.start);
    let clip = |meshes| Clip {
        story,
        template,
        camera,
        truths: &truths,
        meshes,
    };
    let both =
        |ask: &dyn Fn(&Clip<'_>) -> Option<f64>| Some([ask(&clip(meshes.as_slice()))?, ask(&clip(smooth.as_slice()))?]);
    let counts: Vec<bool> = frames.iter().map(|frame| frame.in_view() && !frame.lost()).collect();
    let (jitter_px, lag_frames) = match story.event() {
        Still => (both(&|clip| clip.jitter_px()), None),
        // Where the sheet comes and goes or jumps, smoothing starts again and the lag is of the events.
        Motion | Occlusion => (None, both(&|clip| clip.lag_frames(&counts))),
        _ => (None, None),
    };
    let mut record = ClipRecord {
        seed: story.seed(),
        event: story.event().name(),
        event_frames: [during.start, during.end],
        tracked_fraction: None,
        losses: losses(&frames, cut),
        jitter_px,
        lag_frames,
        frames,
    };
    let (tracked, in_view) = record.tracked();
    record.tracked_fraction = (in_view > 0).then(|| tracked as f64 / in_view as f64);
    Ok(record)
}

/// Fraction of the print that would be in view if nothing hid the object and the image had no end: of a sheet all of it.
fn most_in_view(template: &Template, vertices_camera: &[DVec3], camera: &Camera) -> Result<f64> {
    if template.is_sheet() || vertices_camera.is_empty() {
        return Ok(1.0);
    }
    let (size, focal) = (camera.size(), camera.focal());
    let centre = camera.principal_point() + size.as_dvec2();
    let wide = Camera::pinhole((3 * size.width, 3 * size.height), focal, centre)?;
    let maps = VisibleSurface::new(template.mesh(), vertices_camera, &wide).maps();
    Ok(tracking_errors::print_in_view(&maps).max(f64::MIN_POSITIVE))
}

fn print(summary: &Summary, by_event: &BTreeMap<&'static str, Summary>) {
    let percent = |fraction: Option<f64>| fraction.map_or_else(|| "-".to_owned(), |f| format!("{:.1} %", 100.0 * f));
    let median =
        |spread: Option<Spread>| spread.map_or_else(|| "-".to_owned(), |spread| format!("{:.2}", spread.median));
    println!(
        "{:10}{:>6}{:>9}{:>10}{:>14}{:>6}{:>9}{:>8}{:>8}",
        "", "clips", "in view", "tracked", "after answer", "off", "without", "px", "mm"
    );
    for (name, figures) in by_event.iter().chain([(&"all", summary)]) {
        println!(
            "{name:10}{:>6}{:>9}{:>10}{:>14}{:>6}{:>9}{:>8}{:>8}",
            figures.clips,
            figures.frames_in_view,
            percent(figures.tracked_fraction),
            percent(figures.tracked_fraction_after_answer),
            figures.found_but_off,
            format!("{}/{}", figures.found_without, figures.frames_without),
            median(figures.registration_rmse_px),
            median(figures.points_rmse_mm),
        );
    }
    println!(
        "recoveries{:>8}{:>20}{:>7}{:>7}{:>12}",
        "losses", "within next answer", "later", "never", "unanswered"
    );
    let line = |name: &str, of: &Recoveries| {
        let Recoveries {
            losses,
            within_next_answer,
            later,
            never,
            unanswered,
        } = of;
        println!("  {name:8}{losses:>8}{within_next_answer:>20}{later:>7}{never:>7}{unanswered:>12}");
    };
    for (cause, of) in &summary.recoveries {
        line(&format!("{cause:?}").to_lowercase(), of);
    }
    line("all", &summary.all_recoveries());
    let pair = |what: &str, of: &Option<[Spread; 2]>| {
        if let Some([raw, smooth]) = of {
            println!(
                "{what}: median {:.3}, most {:.3}; smoothed: median {:.3}, most {:.3}",
                raw.median, raw.most, smooth.median, smooth.most
            );
        }
    };
    pair("jitter of a still sheet, px", &summary.jitter_px);
    pair("lag, frames", &summary.lag_frames);
    let ms = |name: &str, of: &Option<Spread>| {
        if let Some(of) = of {
            println!(
                "{name}: median {:.1} ms, 95 % {:.1}, most {:.1}",
                of.median, of.p95, of.most
            );
        }
    };
    ms("follow", &summary.ms.follow);
    ms("catch up", &summary.ms.catch_up);
    ms("finder", &summary.ms.finding);
}
