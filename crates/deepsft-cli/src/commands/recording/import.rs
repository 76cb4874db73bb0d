//! `deepsft recording import`: a recording in the layout of another program or data set.

use crate::camera_choice;
use crate::numbers::positive;
use crate::{input, interruption, progress};
use anyhow::Result;
use clap::builder::{PossibleValuesParser, TypedValueParser};
use clap::{Args, ValueEnum};
use deepsft_formats::read_template;
use deepsft_synth::{FramePairing, RecordingImport, RecordingSource, RgbdSensor, TRUTH_FOLDER, TruthSource};
use std::path::PathBuf;

#[derive(Args)]
#[command(after_help = "\
The command writes a recording that `recording verify` and `train --steps 2,3` read: DIR/camera.json, DIR/rgb, DIR/depth,
DIR/mask with --masks, DIR/truth with --truth (a data set for `eval --data DIR/truth`), and DIR/imported.csv, which lists
the files of each frame.

Depth is 16-bit grey PNG in the colour camera's image, pixel on pixel, 0 where nothing was measured. Coloured depth, as
the RealSense Viewer and rs-convert write it, cannot be read: align depth to colour and save its 16-bit values. Places are
folders, or quoted paths with one * for what differs in the names. --pairs says how the files of a frame are known; those
without a partner are named and left out.

Open3D, and RealSense by Open3D: color/ and depth/ with numbered names, millimetres. Redwood too, with --pairs order
  deepsft recording import --color scene/color --depth scene/depth --camera scene/camera_intrinsic.json --out recording

TUM: rgb/ and depth/ named by time, 5000 units in a metre. rgb.txt, depth.txt or associations.txt beside them go before
the names. Intrinsics count from the first pixel's centre: add \"pixel_centers\": \"integer\" to a camera.json
  deepsft recording import --color rgb --depth depth --pairs time --depth-scale 5000 --camera tum.json --out recording

KillingFusion: one folder with colour, depth and masks
  deepsft recording import --color 'duck/color_*' --depth 'duck/depth_*' --masks 'duck/omask_*' --camera duck.json --out rec

Truth as meshes, a file for each frame, in metres: OBJ or PLY with the texture coordinates of the template, or without
them and with its vertices in its order. In the colour camera's frame: x right, y down, z forward
  deepsft recording import --color rgb --depth depth --camera cam.yaml --template paper --truth meshes --truth-unit m --out rec

Truth as registered points, a .txt, .csv, .xyz or .npy file for each frame. Rows are u v x y z (u to the right and v down
on the template, 0 to 1), or vertex x y z (vertices from 0), or x y z for every vertex. Between points the surface is
interpolated; where there are none it is recovered as rigidly as possible, and no part of the truth. Depth that is 3 %
nearer than the surface hides it, as masks do
  deepsft recording import --color rgb --depth depth --camera cam.yaml --model model --truth points --out recording
  deepsft eval --model model --data recording/truth")]
pub struct ImportArguments {
    /// Colour pictures
    #[arg(long, value_name = "PLACE")]
    color: PathBuf,
    /// Depth pictures in the colour camera's image
    #[arg(long, value_name = "PLACE")]
    depth: PathBuf,
    /// The colour camera: camera.json, a file of another program (`deepsft camera import --help`), or one of the paper's by name
    #[arg(long, value_name = "FILE")]
    camera: PathBuf,
    /// Units of a depth picture in a metre
    #[arg(long, value_name = "N", default_value_t = 1000.0, value_parser = positive)]
    depth_scale: f64,
    /// Masks of the object in the colour camera's image: what is brighter than half of the brightest pixel
    #[arg(long, value_name = "PLACE")]
    masks: Option<PathBuf>,
    /// How the files of a frame are known
    #[arg(long, value_name = "HOW", default_value = "number")]
    pairs: Pairs,
    /// The true surfaces, meshes or registered points, of the object of --model or --template
    #[arg(long, value_name = "PLACE", requires = "object")]
    truth: Option<PathBuf>,
    /// Unit of the true surfaces
    #[arg(long, value_name = "UNIT", default_value = "mm", value_parser = PossibleValuesParser::new(["mm", "m"]).map(|unit| if unit == "m" { 1000.0 } else { 1.0 }))]
    truth_unit: f64,
    /// Model bundle of the object
    #[arg(long, value_name = "BUNDLE", group = "object", requires = "truth")]
    model: Option<PathBuf>,
    /// Folder of the object's template
    #[arg(long, value_name = "DIR", group = "object", requires = "truth")]
    template: Option<PathBuf>,
    /// Folder to write; an older import there is replaced
    #[arg(long, value_name = "DIR")]
    out: PathBuf,
}

#[derive(Clone, Copy, ValueEnum)]
enum Pairs {
    /// The last number in their names, or in what * stands for, is the same
    Number,
    /// They have the same place in their folders, sorted by name with numbers by value
    Order,
    /// Their times are nearest to each other, at most 20 ms apart
    Time,
}

impl From<Pairs> for FramePairing {
    fn from(pairs: Pairs) -> Self {
        match pairs {
            Pairs::Number => Self::Number,
            Pairs::Order => Self::Order,
            Pairs::Time => Self::Time,
        }
    }
}

impl ImportArguments {
    /// The true surfaces, if there are any.
    fn truth(&self) -> Result<Option<TruthSource>> {
        let template = match (&self.model, &self.template) {
            (Some(bundle), _) => input::bundle(bundle)?.template().clone(),
            (None, Some(folder)) => read_template(folder)?,
            (None, None) => return Ok(None),
        };
        Ok(self.truth.clone().map(|files| TruthSource {
            files,
            template,
            mm_per_unit: self.truth_unit,
        }))
    }
}

pub fn run(arguments: &ImportArguments) -> Result<()> {
    let import = RecordingImport::open(RecordingSource {
        color: arguments.color.clone(),
        depth: arguments.depth.clone(),
        masks: arguments.masks.clone(),
        truth: arguments.truth()?,
        pairing: arguments.pairs.into(),
        sensor: RgbdSensor {
            depth_scale: arguments.depth_scale,
            ..RgbdSensor::registered(camera_choice::read(&arguments.camera)?)
        },
    })?;
    let left_out = import.left_out();
    if !left_out.is_empty() {
        let names = input::listed(left_out.iter().map(PathBuf::as_path));
        eprintln!("note: left out, without a partner: {names}");
    }
    interruption::watch()?;
    let bar = progress::counting(import.frames() as u64, "frames");
    import.write(&arguments.out, || -> Result<()> {
        interruption::check()?;
        bar.inc(1);
        Ok(())
    })?;
    bar.finish_and_clear();
    println!("recording, {} frames: {}", import.frames(), arguments.out.display());
    if arguments.truth.is_some() {
        println!("its truth, a data set: {}", arguments.out.join(TRUTH_FOLDER).display());
    }
    Ok(())
}
