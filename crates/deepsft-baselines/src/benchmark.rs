//! `deepsft-baselines benchmark`: frames and truth for everybody's method, and the table of their predictions.

use crate::frames::{Condition, name, stills};
use crate::maps_file;
use crate::table::{self, FrameErrors, Measured, Row};
use anyhow::{Context, Result, bail, ensure};
use clap::Subcommand;
use deepsft_formats::{
    FolderKind, StagedFolder, camera_to_json, decode_picture, encode_png, read_template, sha256, template_to_files,
};
use deepsft_geometry::glam::DVec3;
use deepsft_geometry::training_camera;
use deepsft_synth::Sample;
use serde::de::DeserializeOwned;
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

#[derive(Subcommand)]
pub enum BenchmarkCommand {
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

pub fn run(command: &BenchmarkCommand) -> Result<()> {
    match command {
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
            let rows = predictions.iter().map(|predictions| score(folder, predictions));
            let rows = rows.collect::<Result<Vec<_>>>()?;
            let markdown = table::markdown(&rows);
            println!("{markdown}");
            let json = table::json(&rows, "deepsft-baselines benchmark score");
            out.as_ref().map_or(Ok(()), |out| table::write(out, &markdown, &json))
        }
    }
}

/// The files of a frame: its image and its truth.
fn names(frame: usize) -> [String; 2] {
    [
        format!("frames/{frame:06}.png"),
        format!("truth/{}", maps_file::name(frame)),
    ]
}

fn make(folder: &Path, template: &Path, frames: u64, condition: Condition) -> Result<()> {
    let template = read_template(template)?;
    let is_sheet = template.is_sheet();
    ensure!(is_sheet, "the template is no flat sheet, which the benchmark is for");
    let staged = StagedFolder::new(folder, &FOLDER)?;
    for (name, bytes) in template_to_files(&template)? {
        staged.write(&format!("template/{name}"), &bytes)?;
    }
    let mut hashes = Vec::new();
    for sample in stills(&template, condition, SEED, frames as usize)? {
        let sample = sample?;
        let files = [encode_png(&sample.image)?, maps_file::bytes(&sample.truth, true)?];
        for (name, bytes) in names(hashes.len()).iter().zip(&files) {
            staged.write(name, bytes)?;
        }
        hashes.push(files.map(|bytes| sha256(&bytes)));
    }
    let description = Description {
        format_version: 1,
        frames: hashes.len(),
        seed: SEED,
        condition: name(condition),
        sha256: hashes,
    };
    staged.write("camera.json", camera_to_json(&training_camera()).as_bytes())?;
    staged.write("README.md", README.as_bytes())?;
    staged.write(DESCRIPTION, &serde_json::to_vec_pretty(&description)?)?;
    Ok(staged.commit()?)
}

/// What a JSON file says.
fn read_json<T: DeserializeOwned>(path: &Path) -> Result<T> {
    let read = || -> Result<T> { Ok(serde_json::from_slice(&fs::read(path)?)?) };
    read().with_context(|| path.display().to_string())
}

/// The row of the predictions in a folder.
fn score(folder: &Path, predictions: &Path) -> Result<Row> {
    let description: Description = read_json(&folder.join(DESCRIPTION))?;
    let template = read_template(&folder.join("template"))?;
    let camera = training_camera();
    let said = predictions.join(METHOD);
    let said: MethodFile = if said.exists() {
        read_json(&said)?
    } else {
        MethodFile::default()
    };
    let folder_name = || {
        predictions
            .file_name()
            .unwrap_or_default()
            .to_string_lossy()
            .into_owned()
    };
    let mut row = Row {
        label: said.name.unwrap_or_else(folder_name),
        stated: said.frames_per_second.map(|rate| match &said.hardware {
            Some(hardware) => format!("{rate} ({hardware})"),
            None => format!("{rate}"),
        }),
        ..Row::default()
    };
    for (frame, hashes) in description.sha256.iter().enumerate() {
        let mut files = Vec::new();
        for (name, hash) in names(frame).iter().zip(hashes) {
            let path = folder.join(name);
            let (bytes, place) = (fs::read(&path), path.display());
            files.push(bytes.with_context(|| place.to_string())?);
            let is_same = files.last().is_some_and(|bytes| sha256(bytes) == *hash);
            ensure!(is_same, "{place}: it is not the file of the benchmark; make it anew");
        }
        let picture = decode_picture(&files[0])?;
        let (truth, _) = maps_file::read(&folder.join("truth"), frame, camera.size())?;
        let (answer, registration) = maps_file::read(predictions, frame, camera.size())?;
        if frame > 0 && row.measured.registration != registration {
            let (file, first) = (predictions.join(maps_file::name(frame)), maps_file::name(0));
            bail!("{}: it has another number of channels than {first}", file.display());
        }
        row.measured = Measured {
            depth: true,
            registration,
            given: false,
        };
        let sample = Sample::new(picture, truth, Vec::new(), camera, DVec3::Z);
        let answered = (answer.area() > 0).then_some(&answer);
        let errors = FrameErrors::of(row.measured, answered, &sample, &template, None)?;
        row.frames.push(errors);
    }
    Ok(row)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::methods::{Followed, Method, Methods};
    use crate::table::Column;

    fn poster() -> PathBuf {
        Path::new(env!("CARGO_MANIFEST_DIR")).join("../../models/poster-a4/template")
    }

    fn numbers(row: &Row) -> Vec<[Option<f64>; 4]> {
        let of = |[a, b, c, d]: [Column; 4]| row.frames.iter().map(|e| [a(e), b(e), c(e), d(e)]).collect();
        of([
            table::DEPTH,
            table::REGISTRATION,
            table::PHOTO_CONSISTENCY,
            table::COVERAGE,
        ])
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
            let answer = methods.answer(Method::Features, 0, &sample, &Followed::default());
            let answer = answer.unwrap();
            maps_file::write(&ours, compared.len(), answer.as_ref(), sample.truth.size(), true).unwrap();
            let measured = Method::Features.measured();
            compared.push(FrameErrors::of(measured, answer.as_ref(), &sample, &template, None).unwrap());
        }
        let row = score(&folder, &ours).unwrap();
        let mut depths = row.frames.iter().map(|frame| frame.depth_rmse_mm);
        assert!(depths.all(|depth| depth.is_some_and(|mm| mm > 0.0)));
        let compared = Row {
            frames: compared,
            ..Row::default()
        };
        assert_eq!(numbers(&row), numbers(&compared));

        for errors in numbers(&score(&folder, &folder.join("truth")).unwrap()) {
            assert_eq!([errors[0], errors[1], errors[3]], [Some(0.0), Some(0.0), Some(1.0)]);
        }

        // A method that says depths alone, and how fast it is.
        let alone = place.path().join("alone");
        for frame in 0..2 {
            let (truth, _) = maps_file::read(&folder.join("truth"), frame, training_camera().size()).unwrap();
            maps_file::write(&alone, frame, Some(&truth), truth.size(), false).unwrap();
        }
        let said = r#"{"name": "theirs", "frames_per_second": 25, "hardware": "a GPU"}"#;
        fs::write(alone.join(METHOD), said).unwrap();
        let table = table::markdown(&[score(&folder, &alone).unwrap()]);
        let theirs = "| theirs | 2 of 2 | 0.00 / **0.00** | - | - | 1.00 | 25 (a GPU) |";
        assert!(table.contains(theirs), "{table}");

        // A row that nothing fills says why.
        let missing = Row {
            missing: methods.missing(Method::BtsFt),
            ..score(&folder, &alone).unwrap()
        };
        assert!(table::markdown(&[missing]).contains("| theirs | no weights: `train bts`, then --trained | - |"));

        let refused = |part: &str| {
            let error = format!("{:#}", score(&folder, &ours).err().unwrap());
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
