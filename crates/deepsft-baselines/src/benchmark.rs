//! `deepsft-baselines benchmark`: frames and truth for everybody's method, and the table of their predictions.

use crate::frames::{Condition, stills};
use crate::maps_file;
use crate::table::{self, FrameErrors, Measured, Row};
use anyhow::{Context, Result, bail, ensure};
use clap::{Args, Subcommand, ValueEnum};
use deepsft_formats::{
    FolderKind, StagedFolder, camera_to_json, decode_picture, encode_png, read_template, sha256, template_to_files,
    write_file,
};
use deepsft_geometry::glam::DVec3;
use deepsft_geometry::training_camera;
use deepsft_synth::Sample;
use serde::{Deserialize, Serialize};
use std::fs;
use std::path::{Path, PathBuf};

const DESCRIPTION: &str = "benchmark.json";
const FOLDER: FolderKind = FolderKind {
    known_by: &[DESCRIPTION],
    files: &[
        DESCRIPTION,
        "README.md",
        "camera.json",
        "template/template.json",
        "template/texture.png",
        "frames/#.png",
        "truth/#.npy",
    ],
};

/// Seed of the frames: everybody has the same.
const SEED: u64 = 9_001_000;

/// What predictions say of themselves.
const METHOD: &str = "method.json";

#[derive(Args)]
pub struct BenchmarkArguments {
    #[command(subcommand)]
    command: BenchmarkCommand,
}

#[derive(Subcommand)]
enum BenchmarkCommand {
    /// Make the frames and their truth
    #[command(after_help = "\
DIR is described by its README.md. Frames depend on template, condition and number alone: their seed is fixed. The seeds of `train` and of
`deepsft train` are others.

Example:
  deepsft-baselines benchmark make frames --template models/poster-a4/template --frames 100")]
    Make {
        /// Folder of the benchmark
        #[arg(value_name = "DIR")]
        folder: PathBuf,
        /// Folder of the template, a flat sheet
        #[arg(long, value_name = "DIR")]
        template: PathBuf,
        /// Frames
        #[arg(long, value_name = "N", default_value_t = 100, value_parser = clap::value_parser!(u64).range(1..=100_000))]
        frames: u64,
        /// What is harder in them
        #[arg(long, value_name = "NAME", value_enum, default_value = "trained")]
        condition: Condition,
    },
    /// Print the table of predictions
    #[command(after_help = "\
PREDICTIONS are folders with a file NNNNNN.npy for each frame, as the README.md of DIR describes.

Example:
  deepsft-baselines benchmark score frames predictions/ours predictions/theirs --out scored")]
    Score {
        /// Folder of the benchmark
        #[arg(value_name = "DIR")]
        folder: PathBuf,
        /// Folders of predictions, a row each
        #[arg(value_name = "PREDICTIONS", required = true)]
        predictions: Vec<PathBuf>,
        /// Folder for table.md and table.json
        #[arg(long, value_name = "DIR")]
        out: Option<PathBuf>,
    },
}

/// What `benchmark.json` says.
#[derive(Debug, Serialize, Deserialize)]
struct Description {
    format_version: u32,
    frames: usize,
    seed: u64,
    condition: String,
    /// SHA-256 of each image and each truth, one behind the other.
    sha256: Vec<[String; 2]>,
}

/// What `method.json` may say.
#[derive(Debug, Default, Deserialize)]
#[serde(deny_unknown_fields)]
struct MethodFile {
    name: Option<String>,
    frames_per_second: Option<f64>,
    hardware: Option<String>,
}

const README: &str = "\
# A benchmark of Shape-from-Template

One image, one known sheet: where is it, and how deep is each of its pixels?

| file | what it is |
|---|---|
| `template/` | the sheet: `template.json` has its size in mm, `texture.png` its print. (u, v) = (0, 0) is the upper left corner of the print, (1, 1) the lower right |
| `camera.json` | the camera of all frames, a pinhole; pixel centres are at half numbers |
| `frames/NNNNNN.png` | the frames, 8-bit RGB |
| `truth/NNNNNN.npy` | their truth, in the layout of predictions |
| `benchmark.json` | number of frames, seed, and the SHA-256 of each image and truth |

A prediction is a folder with `NNNNNN.npy` for every frame: a NumPy array of `float32`, C order, of (rows, columns, 3): depth z in mm in the camera's
frame, u, v. A method that says no registration writes (rows, columns, 1). Depth is 0 (or negative, or NaN) where the object is not; a frame in
which nothing is found is all 0. `method.json` beside them may say `name`, `frames_per_second` and `hardware`.

    np.save('mine/000000.npy', np.dstack([depth, u, v]).astype(np.float32))
    deepsft-baselines benchmark score DIR mine

Scores are over the pixels inside both masks; coverage is the share of the true mask that is answered. Registration errors are pixels of the frame, by
the true map's derivatives. E_pr is the photometric error of the DeepSfT paper. Frames do not depend on each other; methods may not be told the truth.
";

pub fn run(arguments: &BenchmarkArguments) -> Result<()> {
    match &arguments.command {
        BenchmarkCommand::Make {
            folder,
            template,
            frames,
            condition,
        } => make(folder, template, *frames, *condition),
        BenchmarkCommand::Score {
            folder,
            predictions,
            out,
        } => {
            let rows = predictions
                .iter()
                .map(|predictions| score(folder, predictions))
                .collect::<Result<Vec<_>>>()?;
            let markdown = table::markdown(&rows);
            println!("{markdown}");
            if let Some(out) = out {
                write_file(&out.join("table.md"), format!("{markdown}\n").as_bytes())?;
                let json = table::json(&rows, "deepsft-baselines benchmark score");
                write_file(&out.join("table.json"), &serde_json::to_vec_pretty(&json)?)?;
            }
            Ok(())
        }
    }
}

fn image_name(frame: usize) -> String {
    format!("frames/{frame:06}.png")
}

fn truth_name(frame: usize) -> String {
    format!("truth/{}", maps_file::name(frame))
}

fn make(folder: &Path, template: &Path, frames: u64, condition: Condition) -> Result<()> {
    let template = read_template(template)?;
    ensure!(
        template.is_sheet(),
        "the template is no flat sheet, which the benchmark is for"
    );
    let staged = StagedFolder::new(folder, &FOLDER)?;
    for (name, bytes) in template_to_files(&template)? {
        staged.write(&format!("template/{name}"), &bytes)?;
    }
    let mut hashes = Vec::new();
    for sample in stills(&template, condition, SEED, frames as usize)? {
        let sample = sample?;
        let files = [encode_png(&sample.image)?, maps_file::bytes(&sample.truth, true)?];
        let names = [image_name(hashes.len()), truth_name(hashes.len())];
        names
            .iter()
            .zip(&files)
            .try_for_each(|(name, bytes)| staged.write(name, bytes))?;
        hashes.push(files.map(|bytes| sha256(&bytes)));
    }
    let condition = condition.to_possible_value();
    let description = Description {
        format_version: 1,
        frames: hashes.len(),
        seed: SEED,
        condition: condition.map(|value| value.get_name().to_owned()).unwrap_or_default(),
        sha256: hashes,
    };
    staged.write("camera.json", camera_to_json(&training_camera()).as_bytes())?;
    staged.write("README.md", README.as_bytes())?;
    staged.write(DESCRIPTION, &serde_json::to_vec_pretty(&description)?)?;
    Ok(staged.commit()?)
}

/// The row of the predictions in a folder.
fn score(folder: &Path, predictions: &Path) -> Result<Row> {
    let read = |path: &Path| fs::read(path).with_context(|| path.display().to_string());
    let path = folder.join(DESCRIPTION);
    let description: Description = serde_json::from_slice(&read(&path)?).with_context(|| path.display().to_string())?;
    let template = read_template(&folder.join("template"))?;
    let camera = training_camera();
    let path = predictions.join(METHOD);
    let said: MethodFile = match path.exists() {
        true => serde_json::from_slice(&read(&path)?).with_context(|| path.display().to_string())?,
        false => MethodFile::default(),
    };
    let mut registrations = Vec::new();
    let mut row = Row {
        label: said.name.unwrap_or_else(|| {
            predictions
                .file_name()
                .unwrap_or_default()
                .to_string_lossy()
                .into_owned()
        }),
        measured: Measured {
            depth: true,
            registration: true,
            given: false,
        },
        stated: said.frames_per_second.map(|rate| match &said.hardware {
            Some(hardware) => format!("{rate} ({hardware})"),
            None => format!("{rate}"),
        }),
        missing: None,
        frames: Vec::new(),
        paper: None,
    };
    for (frame, hashes) in description.sha256.iter().enumerate() {
        for (name, hash) in [image_name(frame), truth_name(frame)].iter().zip(hashes) {
            let path = folder.join(name);
            ensure!(
                sha256(&read(&path)?) == *hash,
                "{}: it is not the file of the benchmark; make it anew",
                path.display()
            );
        }
        let picture = decode_picture(&read(&folder.join(image_name(frame)))?)?;
        let (truth, _) = maps_file::read(&folder.join("truth"), frame, camera.size())?;
        let (answer, registration) = maps_file::read(predictions, frame, camera.size())?;
        registrations.push(registration);
        if registrations[0] != registration {
            bail!(
                "{}: it has another number of channels than {}",
                predictions.join(maps_file::name(frame)).display(),
                maps_file::name(0)
            );
        }
        row.measured.registration = registration;
        let sample = Sample::new(picture, truth, Vec::new(), camera, DVec3::Z);
        let answered = (answer.area() > 0).then_some(&answer);
        row.frames
            .push(FrameErrors::of(row.measured, answered, &sample, &template, None)?);
    }
    Ok(row)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::methods::{Followed, Method, Methods};

    fn poster() -> PathBuf {
        Path::new(env!("CARGO_MANIFEST_DIR")).join("../../models/poster-a4/template")
    }

    fn numbers(row: &Row) -> Vec<[Option<f64>; 4]> {
        let of = |e: &FrameErrors| {
            [
                e.depth_rmse_mm,
                e.registration_rmse_px,
                e.photo_consistency_error,
                e.coverage,
            ]
        };
        row.frames.iter().map(of).collect()
    }

    #[test]
    fn our_answers_score_as_in_compare_the_truth_scores_zero_and_wrong_files_are_named() {
        let place = tempfile::tempdir().unwrap();
        let (folder, ours) = (place.path().join("frames"), place.path().join("features"));
        make(&folder, &poster(), 2, Condition::Trained).unwrap();
        let template = read_template(&poster()).unwrap();
        let mut methods = Methods::new(&template, &[], None).unwrap();
        let mut compared = Vec::new();
        for sample in stills(&template, Condition::Trained, SEED, 2).unwrap() {
            let sample = sample.unwrap();
            let answer = methods
                .answer(Method::Features, 0, &sample, &Followed::default())
                .unwrap();
            maps_file::write(&ours, compared.len(), answer.as_ref(), sample.truth.size(), true).unwrap();
            let measured = Method::Features.measured();
            compared.push(FrameErrors::of(measured, answer.as_ref(), &sample, &template, None).unwrap());
        }
        let row = score(&folder, &ours).unwrap();
        assert!(
            row.frames
                .iter()
                .all(|frame| frame.depth_rmse_mm.is_some_and(|mm| mm > 0.0))
        );
        assert_eq!(
            numbers(&row),
            numbers(&Row {
                frames: compared,
                ..score(&folder, &ours).unwrap()
            })
        );

        for errors in numbers(&score(&folder, &folder.join("truth")).unwrap()) {
            assert_eq!([errors[0], errors[1], errors[3]], [Some(0.0), Some(0.0), Some(1.0)]);
        }

        // A method that says depths alone, and how fast it is.
        let alone = place.path().join("alone");
        for frame in 0..2 {
            let (truth, _) = maps_file::read(&folder.join("truth"), frame, training_camera().size()).unwrap();
            maps_file::write(&alone, frame, Some(&truth), truth.size(), false).unwrap();
        }
        write_file(
            &alone.join(METHOD),
            br#"{"name": "theirs", "frames_per_second": 25, "hardware": "a GPU"}"#,
        )
        .unwrap();
        let table = table::markdown(&[score(&folder, &alone).unwrap()]);
        assert!(
            table.contains("| theirs | 2 of 2 | 0.00 / **0.00** | - | - | 1.00 | 25 (a GPU) |"),
            "{table}"
        );

        // A row that nothing fills says why.
        let missing = Row {
            missing: methods.missing(Method::BtsFt),
            ..score(&folder, &alone).unwrap()
        };
        assert!(table::markdown(&[missing]).contains("| theirs | no weights: `train bts`, then --trained | - |"));

        let refused = |part: &str| {
            let error = format!("{:#}", score(&folder, &ours).unwrap_err());
            assert!(error.contains(part), "{error}");
        };
        let file = ours.join("000001.npy");
        let whole = fs::read(&file).unwrap();
        for (bytes, part) in [
            (&whole[..whole.len() - 4], "000001.npy"),
            (b"broken".as_slice(), "no .npy file"),
            (&f32_array(&[480, 2]), "(270, 480, 2)"),
        ] {
            fs::write(&file, bytes).unwrap();
            refused(part);
        }
        fs::remove_file(&file).unwrap();
        refused("000001.npy");
        fs::write(&file, &whole).unwrap();
        fs::write(folder.join("truth/000000.npy"), &whole).unwrap();
        refused("truth/000000.npy");
    }

    fn f32_array(row: &[usize; 2]) -> Vec<u8> {
        deepsft_formats::f32_npy(row, vec![1.0; 270 * row[0] * row[1]]).unwrap()
    }
}
