//! `deepsft track`: the template through a video.

mod report;

use crate::camera_choice::{CameraReport, camera_for};
use crate::clip_folder::{CAMERA_FILE, Clip, frame_name};
use crate::failure::BlameInput;
use crate::output::atomic::{self, StagedFolder};
use crate::output::{glb, npy, wireframe};
use crate::track_errors::{self, TRACKED_PX};
use crate::video::Video;
use crate::{input, progress};
use anyhow::{Context, Result, anyhow};
use clap::Args;
use deepsft::video::{NetworkPace, TrackedFrame, VideoOptions, VideoTracker};
use deepsft::{DeviceKind, Estimator, ModelBundle, encode_png};
use deepsft_geometry::glam::DVec3;
use deepsft_geometry::tracking::OneEuroOptions;
use deepsft_geometry::{Camera, Picture, Template};
use deepsft_synth::Sample;
use report::{Errors, FrameReport, FrameTruth, MeanMedian, Report, StageTimes, medians, table};
use std::fs;
use std::path::{Path, PathBuf};
use std::time::Instant;

/// Name of the report, by which a folder of results is known.
const TRACK_FILE: &str = "track.json";

#[derive(Args)]
#[command(after_help = "\
The network finds the sheet, and the tracker follows it from frame to frame: the mesh of the last frame, moved on, is
fitted to the next image. The network runs beside it, confirms the track, starts it, and starts it again when it is lost.

Writes
  DIR/track.json     for every frame: found or not, agreement of image and print (0 to 1), solver iterations, what the
                     network said, milliseconds of each stage; the cameras; medians
  DIR/track.csv      the same as a table
  DIR/vertices.npy   f32 [frames, vertices, 3]: the mesh, mm, camera frame; NaN where the sheet was not found
  DIR/pictures/      with --pictures: every frame with the mesh drawn over it, green where the image confirms it
  DIR/meshes/        with --meshes: every mesh as a textured .glb file (metres, y up)

VIDEO is a folder of PNG or JPEG frames, taken in natural order (frame-2 before frame-10), a .y4m file, or any file that
the program ffmpeg reads (it must be on the PATH). Without --camera the camera.json in the folder is taken, if there is
one, else a typical phone; depths are then wrong by the share by which the focal length is.

By default the network is given 4 frames for each answer, as on a device that follows a camera. Where time does not
matter, --network-every 1 asks it about every frame and waits.

In a folder that `deepsft clip` wrote the truth is there too: then the errors are told.

Examples:
  deepsft track --model models/poster-a4 --camera camera.json --pictures --out track video.mp4
  deepsft clip --model models/poster-a4 --event occlusion --out clip
  deepsft track --model models/poster-a4 --out track clip")]
pub struct TrackArguments {
    /// Model bundle of the object
    #[arg(long, value_name = "BUNDLE")]
    model: PathBuf,
    /// Intrinsics of the camera that took the video; may be for another size of the same aspect ratio
    #[arg(long, value_name = "FILE")]
    camera: Option<PathBuf>,
    /// Frames a second [default: what the video says, 30 for a folder of images]
    #[arg(long, value_name = "RATE", value_parser = rate)]
    fps: Option<f64>,
    /// The network's answer comes K frames after the frame it is about, then it starts on the newest one [default: 4]
    #[arg(long, value_name = "K", conflicts_with = "network_every", value_parser = clap::value_parser!(u64).range(..=30))]
    delay: Option<u64>,
    /// Ask the network about every Nth frame and wait for its answer
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u64).range(1..))]
    network_every: Option<u64>,
    /// Smooth the mesh over time (One-Euro filter): steadier when still, a little late when moving
    #[arg(long)]
    smooth: bool,
    /// Draw the mesh over every frame
    #[arg(long)]
    pictures: bool,
    /// Write every mesh as a .glb file, with its texture
    #[arg(long)]
    meshes: bool,
    /// Folder to write; an older track there is replaced
    #[arg(long, value_name = "DIR")]
    out: PathBuf,
    /// What computes: cpu, or vulkan, webgpu or cuda if the program was built with it
    #[arg(long, value_name = "DEVICE", default_value_t = DeviceKind::Cpu)]
    device: DeviceKind,
    /// Folder of images, or video file
    #[arg(value_name = "VIDEO")]
    video: PathBuf,
}

pub fn run(arguments: &TrackArguments) -> Result<()> {
    atomic::check_folder(&arguments.out, &[TRACK_FILE])?;
    let clip = Clip::open(&arguments.video)?;
    let rate = arguments
        .fps
        .or_else(|| clip.as_ref().map(|clip| clip.description.frames_per_s));
    let mut video = Video::open(&arguments.video, rate)?;
    let bundle = input::bundle(&arguments.model)?;
    if let Some(clip) = &clip {
        check_template(clip, bundle.template()).blame("clip", &arguments.video)?;
    }
    let (estimator, device) = input::estimator(&bundle, arguments.device)?;
    let start = Instant::now();
    let first = video
        .frames
        .next()
        .unwrap_or_else(|| Err(anyhow!("it has no frame")).blame("video", &arguments.video))?;
    let decode_ms = milliseconds(start);
    let (camera, source) = camera(arguments, &first)?;
    let pace = match (arguments.delay, arguments.network_every) {
        (_, Some(frames)) => NetworkPace::Every(frames),
        (Some(frames), None) => NetworkPace::Delayed(frames),
        (None, None) => NetworkPace::default(),
    };
    let options = VideoOptions {
        pace,
        smoothing: arguments.smooth.then(OneEuroOptions::default),
        ..VideoOptions::default()
    };
    let began = Instant::now();
    let mut track = Track {
        bundle: &bundle,
        estimator: &estimator,
        camera,
        frames_per_s: video.frames_per_s,
        tracker: VideoTracker::new(bundle.template(), &estimator, options, || milliseconds(began))?,
        truth: clip
            .as_ref()
            .map(|clip| Box::new(clip.truth()) as Box<dyn Iterator<Item = _>>),
        texture_png: arguments
            .meshes
            .then(|| encode_png(bundle.template().texture()))
            .transpose()?,
        pictures: arguments.pictures,
        folder: StagedFolder::new(&arguments.out, &[TRACK_FILE])?,
        frames: Vec::new(),
        vertices: Vec::new(),
    };
    let bar = progress::counting(video.count.unwrap_or(0), "frames");
    track.frame(&first, decode_ms)?;
    bar.inc(1);
    loop {
        let start = Instant::now();
        let Some(image) = video.frames.next().transpose()? else {
            break;
        };
        let decode_ms = milliseconds(start);
        track.frame(&image, decode_ms)?;
        bar.inc(1);
    }
    bar.finish_and_clear();
    let (delay, every) = match pace {
        NetworkPace::Delayed(frames) => (Some(frames), None),
        NetworkPace::Every(frames) => (None, Some(frames)),
    };
    let report = Report {
        video: arguments.video.display().to_string(),
        model: bundle.name().to_owned(),
        frames: track.frames.len(),
        frames_per_s: video.frames_per_s,
        found: track.frames.iter().filter(|frame| frame.found).count(),
        network_delay_frames: delay,
        network_every_frames: every,
        smoothed: arguments.smooth,
        camera: CameraReport::new(&camera, source),
        canonical_camera: CameraReport::new(estimator.canonical_camera(), "model"),
        device: format!("{}: {}", device.kind, device.adapter_name),
        median_ms: medians(&track.frames),
        errors: clip.is_some().then(|| Errors::of(&track.frames)),
        per_frame: std::mem::take(&mut track.frames),
        deepsft_version: env!("CARGO_PKG_VERSION"),
    };
    track.write(&report)?;
    print(&report, &arguments.out);
    Ok(())
}

/// The camera of the video: the one given, the one that lies in its folder, or a typical one.
fn camera(arguments: &TrackArguments, first: &Picture) -> Result<(Camera, &'static str)> {
    let beside = arguments.video.join(CAMERA_FILE);
    let path = match &arguments.camera {
        Some(path) => path,
        None if beside.is_file() => &beside,
        None => return Ok((Camera::typical(first.width() as u32, first.height() as u32)?, "assumed")),
    };
    camera_for(first, &input::camera(path)?).blame("camera file", path)
}

fn check_template(clip: &Clip, template: &Template) -> Result<()> {
    let ([width, height], size) = (clip.template_size_mm(), template.size_mm());
    if [width, height] != size.to_array() {
        let (x, y) = (size.x, size.y);
        return Err(anyhow!(
            "its template has {width} x {height} mm, the model's {x} x {y} mm"
        ));
    }
    Ok(())
}

/// A video that is being tracked.
struct Track<'a> {
    bundle: &'a ModelBundle,
    estimator: &'a Estimator,
    camera: Camera,
    frames_per_s: f64,
    tracker: VideoTracker<'a>,
    truth: Option<Box<dyn Iterator<Item = Result<Sample>>>>,
    /// The texture of the meshes, if they are to be written.
    texture_png: Option<Vec<u8>>,
    pictures: bool,
    folder: StagedFolder,
    frames: Vec<FrameReport>,
    /// Coordinates of the vertices, frame by frame.
    vertices: Vec<f32>,
}

impl Track<'_> {
    fn frame(&mut self, image: &Picture, decode_ms: f64) -> Result<()> {
        let number = self.frames.len();
        let time_s = number as f64 / self.frames_per_s;
        let start = Instant::now();
        let canonical = self.estimator.canonical_image(image, &self.camera)?;
        let warp_ms = milliseconds(start);
        let TrackedFrame {
            tracked,
            detection,
            times,
        } = pollster::block_on(self.tracker.follow(time_s, &canonical))?;
        let template = self.bundle.template();
        let truth = match &mut self.truth {
            // A clip may have been given more frames by hand: they have no truth.
            Some(samples) => match samples.next().transpose()? {
                Some(sample) => Some(self.compare(&sample, &tracked.vertices_camera)?),
                None => None,
            },
            None => None,
        };
        let count = template.mesh().vertices().len();
        if tracked.found {
            let coordinates = tracked.vertices_camera.iter().flat_map(|p| p.as_vec3().to_array());
            self.vertices.extend(coordinates);
        } else {
            self.vertices.extend(std::iter::repeat_n(f32::NAN, 3 * count));
        }
        if self.pictures {
            let (vertices, confidence) = (&tracked.vertices_camera, &tracked.confidence);
            let drawn = wireframe::wireframe(image, &self.camera, template, vertices, confidence);
            self.write_in("pictures", &frame_name(number, "png"), &encode_png(&drawn)?)?;
        }
        if let Some(texture) = self.texture_png.as_ref().filter(|_| tracked.found) {
            let mesh = template.mesh().with_vertices(tracked.vertices_camera.clone())?;
            self.write_in("meshes", &frame_name(number, "glb"), &glb::textured_glb(&mesh, texture))?;
        }
        self.frames.push(FrameReport {
            frame: number,
            time_s,
            found: tracked.found,
            agreement: tracked.agreement,
            iterations: tracked.iterations,
            network: detection,
            ms: StageTimes::new(decode_ms, warp_ms, &times),
            truth,
        });
        Ok(())
    }

    fn compare(&self, sample: &Sample, vertices_camera: &[DVec3]) -> Result<FrameTruth> {
        let (template, camera) = (self.bundle.template(), self.estimator.canonical_camera());
        let truth = track_errors::canonical_truth(sample, template, camera)?;
        let metrics = match vertices_camera {
            [] => None,
            vertices => Some(track_errors::errors(template, vertices, &truth, camera)?),
        };
        Ok(FrameTruth {
            print_in_view: track_errors::print_in_view(&truth),
            registration_rmse_px: metrics.and_then(|m| m.registration_rmse_px),
            points_rmse_mm: metrics.and_then(|m| m.points_rmse_mm),
        })
    }

    fn write_in(&self, folder: &str, name: &str, bytes: &[u8]) -> Result<()> {
        let folder = self.folder.path().join(folder);
        fs::create_dir_all(&folder).with_context(|| format!("could not make {}", folder.display()))?;
        atomic::write_file(&folder.join(name), bytes)
    }

    /// Puts the folder in its place.
    fn write(self, report: &Report) -> Result<()> {
        let file = |name: &str| self.folder.path().join(name);
        let vertices = self.bundle.template().mesh().vertices().len();
        let shape = [report.frames, vertices, 3];
        atomic::write_file(
            &file("vertices.npy"),
            &npy::f32_npy(&shape, self.vertices.iter().copied()),
        )?;
        atomic::write_file(&file("track.csv"), table(&report.per_frame).as_bytes())?;
        atomic::write_file(&file(TRACK_FILE), &serde_json::to_vec_pretty(report)?)?;
        self.folder.commit()
    }
}

fn print(report: &Report, out: &Path) {
    println!("{} frames, found in {}: {}", report.frames, report.found, out.display());
    let ms = |value: Option<f64>| value.map_or_else(|| "-".to_owned(), |value| format!("{value:.1} ms"));
    let times = &report.median_ms;
    println!(
        "medians: decode {}, canonical warp {}, follow {}, catch up {}, network {}",
        ms(times.decode),
        ms(times.canonical_warp),
        ms(times.follow),
        ms(times.catch_up),
        ms(times.network)
    );
    let Some(errors) = &report.errors else { return };
    println!(
        "truth: in view in {} frames, registration within {TRACKED_PX} px in {} of them; found where it is not in {}",
        errors.frames_in_view, errors.tracked, errors.found_where_it_is_not
    );
    let figure = |value: &Option<MeanMedian>| {
        value.as_ref().map_or_else(
            || "-".to_owned(),
            |value| format!("{:.2} (median {:.2})", value.mean, value.median),
        )
    };
    println!(
        "registration RMSE {} px, 3D point RMSE {} mm",
        figure(&errors.registration_rmse_px),
        figure(&errors.points_rmse_mm)
    );
}

fn rate(text: &str) -> Result<f64, String> {
    match text.parse() {
        Ok(rate) if rate > 0.0 && f64::is_finite(rate) => Ok(rate),
        _ => Err("expected a positive number".to_owned()),
    }
}

fn milliseconds(since: Instant) -> f64 {
    since.elapsed().as_secs_f64() * 1000.0
}
