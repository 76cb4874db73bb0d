//! What commands read: pictures, model bundles, data sets. Every error names its file.

use crate::failure::BlameInput;
use crate::heif;
use crate::progress;
use anyhow::{Result, bail};
use deepsft::{DeviceDescription, DeviceKind, Estimator, MODEL_FILE, ModelBundle, decode_picture, start_device};
use deepsft_formats::read_error;
use deepsft_geometry::{Camera, Picture};
use deepsft_synth::DatasetFolder;
use std::collections::BTreeMap;
use std::fs;
use std::path::{Component, Path, PathBuf};

/// How many files that were passed over are named.
const NAMED: usize = 8;

/// Reads a picture's file.
pub fn picture(path: &Path) -> Result<Picture> {
    let read = || -> Result<Picture> {
        let bytes = fs::read(path)?;
        match heif::read(path, &bytes, true)? {
            Some((picture, _)) => Ok(picture),
            None => Ok(decode_picture(&bytes)?),
        }
    };
    read().blame("image", path)
}

/// Whether a file is a picture, by its name: also one that ffmpeg reads.
pub fn is_picture(path: &Path) -> bool {
    let ending = path.extension().unwrap_or_default();
    let is_heif = ["heic", "heif", "avif"]
        .iter()
        .any(|heif| ending.eq_ignore_ascii_case(heif));
    is_heif || deepsft_formats::is_picture(path)
}

/// The pictures of a folder that is a `what`, by name. Other files in it are named.
pub fn pictures_in(folder: &Path, what: &'static str) -> Result<Vec<PathBuf>> {
    let known = deepsft_formats::pictures_in(folder, what);
    let files = fs::read_dir(folder)
        .into_iter()
        .flatten()
        .flatten()
        .map(|entry| entry.path());
    let mut files: Vec<_> = files.filter(|path| path.is_file()).collect();
    files.sort();
    let (pictures, others): (Vec<_>, Vec<_>) = files.into_iter().partition(|path| is_picture(path));
    if pictures.is_empty() {
        // It says why.
        return Ok(known?);
    }
    if !others.is_empty() {
        let names = others
            .iter()
            .take(NAMED)
            .map(|path| path.file_name().unwrap_or_default().to_string_lossy());
        let more = if others.len() > NAMED { ", ..." } else { "" };
        let list = names.collect::<Vec<_>>().join(", ");
        eprintln!(
            "note: {} other files in {} are passed over: {list}{more}",
            others.len(),
            folder.display()
        );
    }
    Ok(pictures)
}

/// A photograph and what its file tells of the camera.
pub struct Photograph {
    /// Turned upright.
    pub picture: Picture,
    /// By how many quarters clockwise it was turned.
    pub quarters: usize,
    /// The camera as its EXIF data tell it.
    pub exif: Option<Camera>,
}

/// Reads a photograph.
pub fn photograph(path: &Path) -> Result<Photograph> {
    let read = || -> Result<Photograph> {
        let bytes = fs::read(path)?;
        let (picture, quarters) = match heif::read(path, &bytes, true)? {
            Some(read) => read,
            None => deepsft_formats::decode_photograph(&bytes)?,
        };
        let exif = deepsft_formats::camera_from_exif(&bytes, picture.size());
        Ok(Photograph {
            picture,
            quarters,
            exif,
        })
    };
    read().blame("image", path)
}

/// Reads a photograph as the camera's sensor has it: turned or not, all of one camera have one size.
pub fn photograph_as_stored(path: &Path) -> Result<Picture> {
    let read = || -> Result<Picture> {
        let bytes = fs::read(path)?;
        match heif::read(path, &bytes, false)? {
            Some((picture, _)) => Ok(picture),
            None => Ok(deepsft_formats::decode_as_stored(&bytes)?),
        }
    };
    read().blame("photograph", path)
}

/// Reads and checks a model bundle's folder.
pub fn bundle(folder: &Path) -> Result<ModelBundle> {
    let read = || -> Result<ModelBundle> { Ok(ModelBundle::from_files(&bundle_files(folder)?)?) };
    read().blame("model bundle", folder)
}

/// The files that the bundle's description lists, and the description. Those that are not there are
/// left out: the check that follows tells which.
pub fn bundle_files(folder: &Path) -> Result<BTreeMap<String, Vec<u8>>> {
    if !folder.is_dir() {
        bail!(match folder.exists() {
            true => "it is a file: name the folder of a model bundle",
            false => "there is no such folder: check the path",
        });
    }
    let read = |name: &str| -> Result<Option<Vec<u8>>> {
        let inside = Path::new(name)
            .components()
            .all(|part| matches!(part, Component::Normal(_)));
        if !inside {
            bail!("it lists a file outside of its folder, {name:?}: fetch it anew");
        }
        match fs::read(folder.join(name)) {
            Ok(bytes) => Ok(Some(bytes)),
            Err(error) if error.kind() == std::io::ErrorKind::NotFound => Ok(None),
            Err(error) => bail!("{name}: {}", read_error(error)),
        }
    };
    let mut files = BTreeMap::new();
    if let Some(description) = read(MODEL_FILE)? {
        for (name, _) in ModelBundle::file_names(&description)? {
            if let Some(bytes) = read(&name)? {
                files.insert(name, bytes);
            }
        }
        files.insert(MODEL_FILE.to_owned(), description);
    }
    Ok(files)
}

/// Compares the shards with the hashes in the descriptions of their sets, where those have any.
pub fn check_hashes(sets: &[DatasetFolder]) -> Result<()> {
    let shards = sets.iter().map(|set| set.description().shards.len() as u64).sum();
    let bar = progress::counting(shards, "shards checked");
    for set in sets {
        set.check_hashes(|| bar.inc(1))?;
    }
    bar.finish_and_clear();
    Ok(())
}

/// Starts a device and puts the bundle's model on it.
pub fn estimator(bundle: &ModelBundle, device: DeviceKind) -> Result<(Estimator, DeviceDescription)> {
    let (device, description) = pollster::block_on(start_device(device))?;
    Ok((Estimator::new(bundle, &device)?, description))
}
