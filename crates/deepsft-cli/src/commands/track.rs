//! `deepsft track`: the template through a video.

mod report;
mod track_folder;

use crate::camera_choice::{self, CameraReport, camera_of};
use crate::failure::{self, BlameInput};
use crate::numbers::positive;
use crate::object_choice::FinderChoice;
use crate::output::flat::flat_files;
use crate::output::wireframe;
use crate::video::{Video, VideoFrame};
use crate::{interruption, progress};
use anyhow::{Result, anyhow};
use clap::Args;
use deepsft::session::{SessionOptions, TrackedFrame, VideoFollower, VideoOptions};
use deepsft::{DeviceKind, View, encode_png};
use deepsft_formats::FormatError;
use deepsft_geometry::glam::DVec3;
use deepsft_geometry::tracking::OneEuroOptions;
use deepsft_geometry::{CalibratedCamera, Camera, FlatMedian, Picture, Template};
use deepsft_synth::{CAMERA_FILE, ClipFolder, Sample};
use deepsft_train::tracking_errors::{self, TRACKED_PX};
use report::{CopyReport, Errors, FrameReport, FrameTruth, MeanMedian, Report, StageTimes, medians};
use std::path::{Path, PathBuf};
use std::time::Instant;
use track_folder::{TRACK_FOLDER, TrackFolder};

/// Updates of the camera after which it counts as not found.
const MAX_CAMERA_UPDATES: usize = 30;
/// Standard deviation of the focal length, a fraction of it, from which its user is warned.
const UNSURE: f64 = 0.05;

#[derive(Args)]
#[command(after_help = "\
A finder sees the object, and the tracker follows it from frame to frame: it moves the mesh of the last frame on and
fits it to the next image. A model has its own network as finder; a picture's corners are found without any training. The
finder runs beside the tracker. Its detections start the track, confirm it, and start it again when it is lost.

The command writes
  DIR/track.json     for every frame: found or not, held or not, correlation of image and template (0 to 1), solver
                     iterations, the finder's detection, milliseconds per stage; the cameras; medians
  DIR/track.csv      the same as a table
  DIR/vertices.npy   f32 [frames, vertices, 3]: the mesh, mm, camera frame; NaN where the object was not found. With --copies
                     f32 [frames, copies, vertices, 3]; track.json then has the further ones as \"copies\" of each frame
  DIR/pictures/      with --pictures: every frame with the mesh drawn over it, green where the image confirms it
  DIR/meshes/        with --meshes: every mesh as a textured .glb file (metres, y up)
  DIR/flat.png       with --flat: the print as most frames show it, laid flat, without hands and reflections that move
  DIR/flat-confidence.png  how much the frames show of each of its pixels, 255 for all that there is to see in all of them

VIDEO is a folder of PNG or JPEG frames, taken in natural order (frame-2 before frame-10), a .y4m file, or any file that
the program ffmpeg reads (it must be on the PATH). Frames have the times of the video's file, also where their rate varies;
what a phone records in HDR is reduced to the ordinary range. The command takes the camera.json in the folder if you give no
--camera, else it assumes a typical phone. Depths are then wrong by the same fraction as the focal length.
--write-camera finds the camera out: no other focal length than the true one explains how the sheet looks while it moves
and bends. Then track again with that file as --camera. Frontal views of a flat sheet say nothing.

cx and cy count from the image's corner: the first pixel's centre is (0.5, 0.5). OpenCV, ROS and TUM count from
that centre: for their numbers add \"pixel_centers\": \"integer\" to the file, or half a pixel to cx and cy.

A video that cannot be read to its end leaves the frames before: \"ended_early\" in track.json says why, and the exit code
is 3. Ctrl-C does the same (exit code 130), and so does a full disk if it has room for the report (exit code 1). An older track in DIR that is whole stays; the frames are then in DIR.partial.

By default a detection arrives 4 frames after its frame, as on a device that follows a camera. The finder then looks for what is
missing; a picture that is followed well is confirmed every 2 seconds. Where time does not matter, --find-every 1 shows every frame to
the finder and waits.

The object is found when three frames in a row confirm its mesh, or one clearly, and lost when none has for 0.4 seconds.

A folder that `deepsft clip` wrote holds the truth too: the command then also reports the errors.

Examples:
  deepsft track --picture cover.jpg --size-mm 210x297 --camera camera.json --pictures --out track video.mp4
  deepsft track --model models/poster-a4 --camera camera.json --pictures --out track video.mp4
  deepsft clip --model models/poster-a4 --event occlusion --out clip
  deepsft track --model models/poster-a4 --out track clip")]
pub struct TrackArguments {
    #[command(flatten)]
    finder: FinderChoice,
    /// Intrinsics of the camera that took the video; may be for another size of the same aspect ratio
    #[arg(long, value_name = "FILE")]
    camera: Option<PathBuf>,
    /// Find the camera from the sheet as it moves and bends, and write it to this file
    #[arg(long, value_name = "FILE")]
    write_camera: Option<PathBuf>,
    /// Frames per second [default: each at the time that the video's file says, 30 for a folder of images]
    #[arg(long, value_name = "RATE", value_parser = positive)]
    fps: Option<f64>,
    /// A detection arrives K frames after its frame; then the finder starts on the newest one [default: 4]
    #[arg(long, value_name = "K", conflicts_with = "find_every", value_parser = clap::value_parser!(u64).range(..=30))]
    delay: Option<u64>,
    /// Show every Nth frame to the finder and wait for its detection
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u64).range(1..))]
    find_every: Option<u64>,
    /// Smooth the mesh over time (One-Euro filter): steadier when still, a little late when moving
    #[arg(long)]
    smooth: bool,
    /// Follow up to N copies of the print that are in view together
    #[arg(long, value_name = "N", default_value_t = 1, conflicts_with_all = ["meshes", "flat"], value_parser = clap::value_parser!(u32).range(1..=16))]
    copies: u32,
    /// Draw the mesh over every frame
    #[arg(long)]
    pictures: bool,
    /// Write every mesh as a .glb file, with its texture
    #[arg(long)]
    meshes: bool,
    /// Lay the print flat too as most frames show it, so many pixels wide: flat.png
    #[arg(long, value_name = "PX", conflicts_with = "smooth", value_parser = clap::value_parser!(u16).range(16..=8192))]
    flat: Option<u16>,
    /// Divide shadows, uneven light and its colour out of flat.png
    #[arg(long, requires = "flat")]
    unshaded: bool,
    /// Folder to write; an older track there is replaced
    #[arg(long, value_name = "DIR")]
    out: PathBuf,
    /// What computes: cpu, or webgpu if the program was built with it
    #[arg(long, value_name = "DEVICE", default_value_t = DeviceKind::Cpu)]
    device: DeviceKind,
    /// Folder of images, or video file
    #[arg(value_name = "VIDEO")]
    video: PathBuf,
}

impl TrackArguments {
    fn options(&self) -> VideoOptions {
        let defaults = VideoOptions::default();
        VideoOptions {
            session: SessionOptions {
                smoothing: self.smooth.then(OneEuroOptions::default),
                ask_every: self.find_every,
            },
            delay: match self.find_every {
                Some(_) => 0,
                None => self.delay.unwrap_or(defaults.delay),
            },
            focal_deviation: match self.write_camera {
                Some(_) => f64::INFINITY,
                None => defaults.focal_deviation,
            },
        }
    }
}

pub fn run(arguments: &TrackArguments) -> Result<()> {
    deepsft_formats::check_folder(&arguments.out, &TRACK_FOLDER)?;
    let clip = ClipFolder::open(&arguments.video)?;
    let rate = arguments
        .fps
        .or_else(|| clip.as_ref().map(|clip| clip.description.frames_per_s));
    let mut video = Video::open(&arguments.video, rate, true)?;
    let mut chosen = arguments.finder.finder(arguments.device)?;
    let finder = &mut chosen.finder;
    let template = &finder.target().template().clone();
    if let Some(clip) = &clip {
        check_template(clip, template).blame("clip", &arguments.video)?;
    }
    finder.look_for_copies(arguments.copies);
    let first = decode(&mut video)?
        .ok_or_else(|| anyhow!("it has no frame: choose another video"))
        .blame("video", &arguments.video)?;
    let (camera, source) = camera(arguments, &first.0.picture, video.quarters)?;
    let canonical_camera = finder.target().canonical_camera(camera.size());
    let options = arguments.options();
    let delay = arguments.find_every.is_none().then_some(options.delay);
    let began = Instant::now();
    let mut track = Track {
        template,
        canonical_camera,
        camera,
        tracker: VideoFollower::new(finder, options, || milliseconds(began))?,
        truth: match &clip {
            Some(clip) => Some(Box::new(clip.truth()?)),
            None => None,
        },
        texture_png: arguments.meshes.then(|| encode_png(template.texture())).transpose()?,
        pictures: arguments.pictures,
        flat: arguments.flat.map(|width| (width.into(), FlatMedian::default())),
        folder: TrackFolder::new(
            &arguments.out,
            arguments.copies as usize,
            template.mesh().vertices().len(),
        )?,
        frames: Vec::new(),
    };
    interruption::watch()?;
    let bar = progress::counting(video.count.unwrap_or(0), "frames");
    let follow = || -> Result<()> {
        let mut next = Some(first);
        while let Some((frame, decode_ms)) = next {
            track.frame(&frame, decode_ms)?;
            bar.inc(1);
            interruption::check()?;
            next = decode(&mut video)?;
        }
        Ok(())
    };
    let failure = follow().err();
    bar.finish_and_clear();
    // A video whose very first frame fails leaves nothing worth keeping.
    let failure = match failure {
        Some(error) if track.frames.is_empty() => return Err(error),
        failure => failure,
    };
    let frames = track.frames;
    let report = Report {
        video: arguments.video.display().to_string(),
        object: chosen.name.clone(),
        frames: frames.len(),
        ended_early: failure.as_ref().map(failure::message),
        frames_per_s: video.frames_per_s,
        found: frames.iter().filter(|frame| frame.found).count(),
        finding_delay_frames: delay,
        finding_every_frames: arguments.find_every,
        smoothed: arguments.smooth,
        camera: CameraReport::new(&camera, source),
        canonical_camera: CameraReport::new(&canonical_camera, "model"),
        device: chosen.device.as_ref().map(ToString::to_string),
        median_ms: medians(&frames),
        errors: clip.is_some().then(|| Errors::of(&frames)),
        per_frame: frames,
        deepsft_version: env!("CARGO_PKG_VERSION"),
    };
    let laid_flat = || -> Result<()> {
        let flat = track.flat.as_ref().and_then(|(_, prints)| prints.median());
        if let Some(flat) = flat {
            for (name, bytes) in flat_files(&flat, arguments.unshaded.then(|| template.texture()))? {
                track.folder.write_whole(name, &bytes)?;
            }
        }
        Ok(())
    };
    let committed = laid_flat().and_then(|()| track.folder.commit(&report));
    let Some(failure) = failure else {
        print(&report, &committed?);
        if let Some(path) = &arguments.write_camera {
            write_camera(path, track.tracker.solve_camera(MAX_CAMERA_UPDATES)?, &camera)?;
        }
        return Ok(());
    };
    match committed {
        Ok(place) => {
            print(&report, &place);
            println!(
                "the track ends before the video: {} holds the frames until then",
                place.display()
            );
            if place != arguments.out {
                println!("{} keeps its older track, which is whole", arguments.out.display());
            }
        }
        // The exit code is that of why the track ended.
        Err(error) => eprintln!("error: the frames are not kept: {}", failure::message(&error)),
    }
    Err(failure)
}

/// The next frame of a video and the milliseconds that it took to decode; `None` at its end.
fn decode(video: &mut Video) -> Result<Option<(VideoFrame, f64)>> {
    let start = Instant::now();
    let frame = video.frames.next().transpose()?;
    Ok(frame.map(|frame| (frame, milliseconds(start))))
}

/// Writes the camera that was `found` for images of the `assumed` one.
fn write_camera(path: &Path, found: Option<CalibratedCamera>, assumed: &Camera) -> Result<()> {
    let found = found.ok_or_else(|| {
        anyhow!(
            "{}: the video does not tell what its camera is: the sheet has to be found in views that differ, tilted or bent",
            path.display()
        )
    })?;
    let camera = found.of_source(assumed)?;
    deepsft_formats::write_file(path, deepsft_formats::camera_to_json(&camera).as_bytes())?;
    println!(
        "camera: focal length {:.1} px, standard deviation {:.1} % ({:.1} px were assumed), from {} views: {}",
        camera.focal().x,
        100.0 * found.focal_deviation,
        assumed.focal().x,
        found.views,
        path.display()
    );
    if found.focal_deviation > UNSURE {
        println!("that is not much better than a guess: tilt and bend the sheet more, and nearer to the camera");
    }
    Ok(())
}

/// The camera of the video: the one given, the one that lies in its folder, or a typical one.
fn camera(arguments: &TrackArguments, first: &Picture, quarters: usize) -> Result<(Camera, &'static str)> {
    let beside = arguments.video.join(CAMERA_FILE);
    let path = arguments
        .camera
        .as_ref()
        .or(Some(&beside).filter(|path| path.is_file()));
    let camera = path.map(|path| camera_choice::read(path)).transpose()?;
    camera_of(first, quarters, camera.as_ref().zip(path.map(PathBuf::as_path)), None)
}

fn check_template(clip: &ClipFolder, template: &Template) -> Result<()> {
    let ([width, height], size) = (clip.template_size_mm(), template.size_mm());
    // Those of a scan are computed: the last digits of one that was written and read again may be others.
    let is_same = |a: f64, b: f64| (a - b).abs() <= 1e-6 * b;
    if !(is_same(width, size.x) && is_same(height, size.y)) {
        let (x, y) = (size.x, size.y);
        return Err(anyhow!(
            "its template has {width} x {height} mm, the one to look for {x} x {y} mm: look for that one"
        ));
    }
    Ok(())
}

/// A video that is being tracked.
struct Track<'a> {
    template: &'a Template,
    canonical_camera: Camera,
    camera: Camera,
    tracker: VideoFollower<'a>,
    truth: Option<Box<dyn Iterator<Item = Result<Sample, FormatError>>>>,
    /// The texture of the meshes, if they are to be written.
    texture_png: Option<Vec<u8>>,
    pictures: bool,
    /// The width of the flat print and what frames show of it, if it is asked for.
    flat: Option<(usize, FlatMedian)>,
    folder: TrackFolder,
    frames: Vec<FrameReport>,
}

impl Track<'_> {
    fn frame(&mut self, frame: &VideoFrame, decode_ms: f64) -> Result<()> {
        let number = self.frames.len();
        let VideoFrame { picture: image, time_s } = frame;
        let mut view = View::new(image, &self.camera);
        let TrackedFrame {
            followed,
            copies,
            view: seen_by,
            detection,
            times,
            ..
        } = pollster::block_on(self.tracker.follow(*time_s, &mut view))?;
        let surface = followed.surface.as_ref();
        let surfaces = || [&followed].into_iter().chain(&copies).map(|copy| copy.surface.as_ref());
        let vertices = surface.map_or(&[][..], |surface| &surface.vertices_camera);
        let truth = match &mut self.truth {
            // A clip may have been given more frames by hand: they have no truth.
            Some(samples) => match samples.next().transpose()? {
                Some(sample) => Some(self.compare(&sample, &seen_by, vertices)?),
                None => None,
            },
            None => None,
        };
        if self.pictures {
            let mut drawn = image.clone();
            for surface in surfaces().flatten() {
                let (vertices, confidence) = (&surface.vertices_camera, &surface.confidence);
                drawn = wireframe::wireframe(&drawn, &self.camera, self.template, vertices, confidence);
            }
            self.folder.write("pictures", number, "png", &encode_png(&drawn)?)?;
        }
        if let (Some(texture), Some(surface)) = (&self.texture_png, surface) {
            let mesh = surface.mesh(self.template.mesh())?;
            let glb = deepsft_formats::mesh_to_glb(&mesh, texture, &[]);
            self.folder.write("meshes", number, "glb", &glb)?;
        }
        if let (Some((width, prints)), Some(surface)) = (&mut self.flat, surface.filter(|_| !followed.held)) {
            prints.add(|| surface.flatten(self.template, (image, &self.camera), *width))?;
        }
        let report = FrameReport {
            frame: number,
            time_s: *time_s,
            found: followed.found,
            held: followed.held,
            correlation: followed.correlation,
            iterations: followed.iterations,
            detection,
            ms: StageTimes::new(decode_ms, &times),
            truth,
            copies: copies
                .iter()
                .map(|copy| CopyReport {
                    found: copy.found,
                    held: copy.held,
                    correlation: copy.correlation,
                })
                .collect(),
        };
        let found = surfaces().map(|surface| surface.map(|surface| &surface.vertices_camera[..]));
        self.folder.add(found)?;
        self.frames.push(report);
        Ok(())
    }

    /// Compares the mesh with the truth in the view that the frame was followed in; pixels are those of the nearest view.
    fn compare(&self, sample: &Sample, camera: &Camera, vertices_camera: &[DVec3]) -> Result<FrameTruth> {
        let template = self.template;
        let truth = tracking_errors::truth_maps(sample, template, camera)?;
        let metrics = match vertices_camera {
            [] => None,
            vertices => Some(tracking_errors::mesh_errors(template, vertices, &truth, camera)?),
        };
        let nearest = self.canonical_camera.focal().x / camera.focal().x;
        Ok(FrameTruth {
            print_in_view: tracking_errors::print_in_view(&truth),
            registration_rmse_px: metrics.and_then(|m| m.registration_rmse_px).map(|px| nearest * px),
            points_rmse_mm: metrics.and_then(|m| m.points_rmse_mm),
        })
    }
}

fn print(report: &Report, out: &Path) {
    println!("{} frames, found in {}: {}", report.frames, report.found, out.display());
    let ms = |value: Option<f64>| value.map_or_else(|| "-".to_owned(), |value| format!("{value:.1} ms"));
    let [decode, warp, follow, catch_up, finder] = report.median_ms.0.map(ms);
    println!("medians: decode {decode}, canonical warp {warp}, follow {follow}, catch up {catch_up}, finder {finder}");
    let Some(errors) = &report.errors else { return };
    println!(
        "truth: in view in {} frames, registration within {TRACKED_PX} px in {} of them; found where it is not in {}",
        errors.frames_in_view, errors.tracked, errors.found_where_it_is_not
    );
    let figure = |value: &Option<MeanMedian>| {
        let value = value.as_ref();
        let value = value.map(|value| format!("{:.2} (median {:.2})", value.mean, value.median));
        value.unwrap_or_else(|| "-".to_owned())
    };
    println!(
        "registration RMSE {} px, 3D point RMSE {} mm",
        figure(&errors.registration_rmse_px),
        figure(&errors.points_rmse_mm)
    );
}

fn milliseconds(since: Instant) -> f64 {
    since.elapsed().as_secs_f64() * 1000.0
}
