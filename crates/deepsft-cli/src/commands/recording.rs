//! `deepsft recording`: RGB-D recordings to train steps 2 and 3 on.

mod import;

use crate::failure::BlameInput;
use crate::object_choice::ObjectChoice;
use crate::progress;
use crate::synthesis::write_with_truth;
use anyhow::Result;
use clap::{Args, Subcommand};
use deepsft_formats::{FolderKind, StagedFolder, encode_jpeg};
use deepsft_geometry::training_camera;
use deepsft_synth::{
    CAMERA_FILE, DATASET_FILE, DEPTH_FOLDER, MASK_FOLDER, RGB_FOLDER, Recording, RecordingSimulator, Sample,
    SimulatedFrame, TRUTH_FOLDER, encode_depth_png, encode_mask_png, in_order,
};
use std::path::{Path, PathBuf};

/// Quality of the colour pictures: what a camera's stream has.
const JPEG_QUALITY: u8 = 92;

/// Name of the file that says in words what the folder is.
const README: &str = "README.md";

/// The folder of a simulated recording. The truth is what recordings of other people do not have: their folders are never
/// replaced.
const SIMULATED_FOLDER: FolderKind = FolderKind {
    known_by: &["truth/dataset.json"],
    files: &[
        CAMERA_FILE,
        README,
        "rgb/#.jpg",
        "depth/#.png",
        "mask/#.png",
        "truth/dataset.json",
        "truth/shard-#.tar",
    ],
};

#[derive(Subcommand)]
pub enum RecordingCommand {
    /// Simulate a recording of a template: a program makes it up, nobody records it.
    Simulate(SimulateArguments),
    /// Make a recording of one in another layout: TUM, Open3D, RealSense, numbered pictures, with meshes or points as truth.
    Import(import::ImportArguments),
    /// Read every frame of a recording and report what is in it.
    Verify {
        /// Folder of the recording
        #[arg(value_name = "DIR")]
        recording: PathBuf,
    },
}

pub fn run(command: &RecordingCommand) -> Result<()> {
    match command {
        RecordingCommand::Simulate(arguments) => simulate(arguments),
        RecordingCommand::Import(arguments) => import::run(arguments),
        RecordingCommand::Verify { recording } => verify(recording),
    }
}

#[derive(Args)]
#[command(after_help = "\
The command writes a simulated RGB-D recording in the layout of TUM and Open3D:
  DIR/camera.json      the colour camera, the depth camera, where it stands; depth_scale; \"simulated\": true
  DIR/rgb/NNNNNN.jpg   colour pictures of 960 x 540 pixels
  DIR/depth/NNNNNN.png depth pictures of 512 x 424 pixels, 16-bit, millimetres, 0 where nothing was measured
  DIR/mask/NNNNNN.png  with --masks: where the sheet is seen
  DIR/truth/           a data set as `deepsft synth` writes: exact depth and registration in the training camera's
                       image. Training never reads it; it is there to measure on
  DIR/README.md        that it is simulated, and how

The pictures differ from those of step 1. The sheet is a print with duller colours, up to 5 % smaller or larger than the
template (printers scale pages to their margins). The light is harder and more coloured, the camera is noisier, there are
hands before the sheet and other sheets behind it. The depth camera stands beside the colour camera. It errs in the style
of a Kinect v2: noise that grows with distance and tilt, holes and flying pixels at edges, whole millimetres, nothing
nearer than 500 mm. The sheet moves smoothly. Every 20 frames another take begins, with another motion, another background
and other hands. Light, print and camera stay the same, as in one place. The same seed gives the same recording.

Your own recordings go into the same folders; `deepsft recording import` puts those of other programs there, and
`deepsft recording verify` says what is wrong with one.

cx and cy count from the image's corner: the first pixel's centre is (0.5, 0.5). OpenCV, ROS and TUM count from
that centre: for their numbers add \"pixel_centers\": \"integer\" to the file, or half a pixel to cx and cy.

Example:
  deepsft recording simulate --model models/poster-a4 --frames 480 --seed 1 --out recording
  deepsft train --steps 2,3 --model models/poster-a4 --recording recording --out tuned")]
pub struct SimulateArguments {
    #[command(flatten)]
    object: ObjectChoice,
    /// Number of frames
    #[arg(long, value_name = "N", default_value_t = 480, value_parser = clap::value_parser!(u32).range(1..=1_000_000))]
    frames: u32,
    /// Seed of the recording
    #[arg(long, value_name = "S", default_value_t = 1)]
    seed: u64,
    /// Also write masks of where the sheet is seen, as a segmented recording has them
    #[arg(long)]
    masks: bool,
    /// Give every take other light, paper and camera settings, as if made in many places
    #[arg(long)]
    changing_place: bool,
    /// Folder to write; an older simulated recording there is replaced
    #[arg(long, value_name = "DIR")]
    out: PathBuf,
}

fn simulate(arguments: &SimulateArguments) -> Result<()> {
    let template = arguments.object.template_to_show()?;
    let folder = StagedFolder::new(&arguments.out, &SIMULATED_FOLDER)?;
    let simulator = RecordingSimulator::new(&template, arguments.changing_place, arguments.seed)?;
    let frames = arguments.frames as usize;
    let made = (simulator.renderer().description(), arguments.seed);
    let simulated = simulated_frames(&simulator, frames);
    write_with_truth(&folder, &template, made, frames, simulated, |index, frame| {
        write_frame(&folder, index, &simulator, frame, arguments.masks)
    })?;
    folder.write(CAMERA_FILE, simulator.sensor().to_json().as_bytes())?;
    folder.write(README, readme(&simulator, arguments, frames).as_bytes())?;
    folder.commit()?;
    println!("simulated recording, {frames} frames: {}", arguments.out.display());
    Ok(())
}

/// The frames in order, a take at a time on all cores.
fn simulated_frames(simulator: &RecordingSimulator, frames: usize) -> impl Iterator<Item = Result<SimulatedFrame>> {
    let a_take = RecordingSimulator::FRAMES_PER_TAKE;
    (0..frames.div_ceil(a_take)).flat_map(move |number| {
        let take = simulator.take(number);
        let count = a_take.min(frames - number * a_take);
        in_order(0..count as u64, move |index| Ok(take.frame(index as usize)?))
    })
}

/// Writes the pictures of a frame; gives its truth.
fn write_frame(
    folder: &StagedFolder,
    index: usize,
    simulator: &RecordingSimulator,
    SimulatedFrame {
        color, depth, truth, ..
    }: SimulatedFrame,
    masks: bool,
) -> Result<Sample> {
    let sensor = simulator.sensor();
    let write = |kind: &str, ending: &str, bytes: &[u8]| folder.write(&format!("{kind}/{index:06}.{ending}"), bytes);
    write(RGB_FOLDER, "jpg", &encode_jpeg(&color.image, JPEG_QUALITY)?)?;
    write(DEPTH_FOLDER, "png", &encode_depth_png(&depth, &sensor.depth)?)?;
    if masks {
        write(
            MASK_FOLDER,
            "png",
            &encode_mask_png(&color.truth.mask(), &sensor.color)?,
        )?;
    }
    Ok(truth)
}

fn readme(simulator: &RecordingSimulator, arguments: &SimulateArguments, frames: usize) -> String {
    format!(
        "\
# A simulated RGB-D recording

Nobody recorded this. `deepsft recording simulate` {version} made it up with seed {seed}: {frames} frames at {rate} per second.
Figures measured on it are figures on simulated data.

* light, paper and camera settings: {place}
* print: {print:?}
* depth camera: noise, holes and flying pixels in the style of a Kinect v2
* renderer: `{DATASET_FILE}` in `{TRUTH_FOLDER}/`, which holds the truth. Training never reads it.
",
        seed = arguments.seed,
        version = env!("CARGO_PKG_VERSION"),
        rate = RecordingSimulator::FRAMES_PER_S,
        place = if arguments.changing_place {
            "others in every take"
        } else {
            "the same in all takes"
        },
        print = simulator.print(),
    )
}

fn verify(folder: &Path) -> Result<()> {
    let recording = Recording::open(folder).blame("recording", folder)?;
    let canonical = training_camera();
    let bar = progress::counting(recording.frames() as u64, "frames");
    let mut measured = 0.0;
    for index in 0..recording.frames() {
        let frame = recording.frame(index, &canonical).blame("recording", folder)?;
        let count = frame.depth_mm.iter().filter(|&&depth| depth > 0.0).count();
        measured += count as f64 / frame.depth_mm.len() as f64 / recording.frames() as f64;
        bar.inc(1);
    }
    bar.finish_and_clear();
    let sensor = recording.sensor();
    println!(
        "{}recording of {} frames, colour {}, depth {} ({}), {} masks: depth in {:.0} % of the canonical image",
        if sensor.simulated { "simulated " } else { "" },
        recording.frames(),
        sensor.color.size(),
        sensor.depth.size(),
        if sensor.is_registered() {
            "registered"
        } else {
            "a camera of its own"
        },
        if recording.has_masks() { "with" } else { "without" },
        100.0 * measured
    );
    Ok(())
}
