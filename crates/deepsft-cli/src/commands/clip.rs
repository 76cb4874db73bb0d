//! `deepsft clip`: a synthetic clip of a moving, bending object, with ground truth.

use crate::failure::usage;
use crate::numbers::positive;
use crate::object_choice::ObjectChoice;
use crate::synthesis::write_with_truth;
use anyhow::Result;
use clap::Args;
use deepsft::{camera_to_json, encode_png};
use deepsft_formats::{FolderKind, StagedFolder};
use deepsft_geometry::training_camera;
use deepsft_synth::{
    CAMERA_FILE, CLIP_FILE, ClipDescription, ClipEvent, ClipLength, ClipStory, FIRST_CLIP_SEED, SynthConfig,
    Synthesizer, frame_name,
};
use std::path::PathBuf;

/// The folder of a clip.
const CLIP_FOLDER: FolderKind = FolderKind {
    known_by: &[CLIP_FILE],
    files: &[
        CLIP_FILE,
        CAMERA_FILE,
        "frame-#.png",
        "truth/dataset.json",
        "truth/shard-#.tar",
    ],
};

#[derive(Args)]
#[command(after_help = "\
The command writes
  DIR/frame-00000.png ...   the frames
  DIR/camera.json           the camera that took them
  DIR/clip.json             frames per second, exposure, what happens and when, the seed
  DIR/truth/                a data set as `deepsft synth` writes: depth, registration and the mesh of every frame;
                            `deepsft eval --data DIR/truth` measures a network on it, frame by frame

What can happen:
  motion      the object moves and bends as in two hands; all of it is in view nearly always
  occlusion   the same, and an arm passes before it
  jump-cut    from one frame to the next the object is elsewhere, as after a cut
  leaving     the object leaves the view, is away for a while, and comes back
  still       nothing moves; the sensor noise differs from frame to frame
  turning     the object also turns once around its upright axis, so that all its sides are seen

The same template, seed and options give the same frames: on one machine bit for bit. On other machines the last bits
may differ, as libraries of elementary functions do. `deepsft track` follows it; the truth lies beside the frames,
so it also reports its errors. The program ffmpeg makes a video of the frames:
  ffmpeg -framerate 30 -i DIR/frame-%05d.png -pix_fmt yuv420p clip.mp4

Example:
  deepsft clip --model models/poster-a4 --event leaving --out clip
  deepsft track --model models/poster-a4 --pictures --out track clip")]
pub struct ClipArguments {
    #[command(flatten)]
    object: ObjectChoice,
    /// Seed of the clip; no training and no evaluation of this project uses seeds from 9000000 on
    #[arg(long, value_name = "S", default_value_t = FIRST_CLIP_SEED)]
    seed: u64,
    /// What happens
    #[arg(long, value_name = "EVENT", default_value = "motion")]
    event: ClipEvent,
    /// An object with a volume keeps its rest shape: a box, a tin
    #[arg(long)]
    at_rest: bool,
    /// Number of frames
    #[arg(long, value_name = "N", default_value_t = 60, value_parser = clap::value_parser!(u32).range(1..=1_000_000))]
    frames: u32,
    /// Frames per second
    #[arg(long, value_name = "RATE", default_value_t = 30.0, value_parser = positive)]
    fps: f64,
    /// Exposure in milliseconds: what moves is blurred by it [default: a third of the time between two frames]
    #[arg(long, value_name = "MS")]
    exposure_ms: Option<f64>,
    /// Size of the frames, as a multiple of the 480 x 270 pixels of the training camera
    #[arg(long, value_name = "K", default_value_t = 1, value_parser = clap::value_parser!(u32).range(1..=4))]
    scale: u32,
    /// The camera stands upright, as a phone does: 270 x 480 pixels times K
    #[arg(long)]
    upright: bool,
    /// Folder to write; an older clip there is replaced
    #[arg(long, value_name = "DIR")]
    out: PathBuf,
}

pub fn run(arguments: &ClipArguments) -> Result<()> {
    let length = length(arguments)?;
    let template = arguments.object.template_to_show()?;
    deepsft_formats::check_folder(&arguments.out, &CLIP_FOLDER)?;
    let base = training_camera();
    let scale = arguments.scale as usize;
    let across = base.resized((base.size().width * scale, base.size().height * scale))?;
    let camera = if arguments.upright {
        across.turned_anticlockwise()
    } else {
        across
    };
    let mut config = SynthConfig::for_clip_stories(camera);
    if arguments.at_rest {
        if template.is_sheet() {
            return Err(usage(
                "--at-rest is for objects with a volume; a sheet bends in every clip",
            ));
        }
        config = config.at_rest();
    }
    let folder = StagedFolder::new(&arguments.out, &CLIP_FOLDER)?;
    let synthesizer = Synthesizer::new(&template, config)?;
    let story = ClipStory::new(&synthesizer, length, arguments.event, arguments.seed)?;
    let frames = story.length().frames;
    let samples = deepsft_synth::clip_frames(&story, 0..frames);
    let made = (synthesizer.config().description(), arguments.seed);
    write_with_truth(&folder, &template, made, frames, samples, |frame, sample| {
        folder.write(&frame_name(frame, "png"), &encode_png(&sample.image)?)?;
        Ok(sample)
    })?;
    let description = ClipDescription::new(&story);
    folder.write(CAMERA_FILE, camera_to_json(&camera).as_bytes())?;
    folder.write(CLIP_FILE, &serde_json::to_vec_pretty(&description)?)?;
    folder.commit()?;
    let (size, event, out) = (camera.size(), description.event, arguments.out.display());
    println!("{frames} frames of {size} pixels, {event}: {out}");
    Ok(())
}

fn length(arguments: &ClipArguments) -> Result<ClipLength> {
    let fps = arguments.fps;
    let exposure_s = arguments.exposure_ms.map_or(1.0 / (3.0 * fps), |ms| ms / 1000.0);
    if !(0.0..=1.0 / fps).contains(&exposure_s) {
        return Err(usage(format!(
            "--exposure-ms is {}, expected 0 to {:.3}, the time between two frames",
            1000.0 * exposure_s,
            1000.0 / fps
        )));
    }
    Ok(ClipLength {
        frames: arguments.frames as usize,
        frames_per_s: fps,
        exposure_s,
    })
}
