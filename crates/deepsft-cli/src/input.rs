//! What commands read: pictures, model bundles, data sets. Every error names its file.

use crate::failure::BlameInput;
use crate::heif;
use crate::progress;
use anyhow::{Result, bail};
use deepsft::{DeviceDescription, DeviceKind, Estimator, MODEL_FILE, ModelBundle, start_device};
use deepsft_formats::read_error;
use deepsft_geometry::{Camera, Picture};
use deepsft_synth::DatasetFolder;
use std::collections::BTreeMap;
use std::fs;
use std::path::{Component, Path, PathBuf};

/// How many files are named of those that are passed over.
const NAMED: usize = 8;

/// The bytes of a file that is a `what`, its picture, turned upright or as the sensor has it, and by how many quarters
/// clockwise that was turned.
fn decoded(what: &'static str, path: &Path, upright: bool) -> Result<(Vec<u8>, Picture, usize)> {
    let read = || -> Result<_> {
        let bytes = fs::read(path)?;
        let (picture, quarters) = match heif::read(path, &bytes, upright)? {
            Some(read) => read,
            None if upright => deepsft_formats::decode_photograph(&bytes)?,
            None => (deepsft_formats::decode_as_stored(&bytes)?, 0),
        };
        Ok((bytes, picture, quarters))
    };
    read().blame(what, path)
}

/// Reads a picture's file.
pub fn picture(path: &Path) -> Result<Picture> {
    Ok(decoded("image", path, true)?.1)
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
    let entries = fs::read_dir(folder).into_iter().flatten().flatten();
    let mut files: Vec<_> = entries
        .map(|entry| entry.path())
        .filter(|path| path.is_file())
        .collect();
    files.sort();
    let (pictures, others): (Vec<_>, Vec<_>) = files.into_iter().partition(|path| is_picture(path));
    if pictures.is_empty() {
        // It says why.
        return Ok(deepsft_formats::pictures_in(folder, what)?);
    }
    if !others.is_empty() {
        let names = others
            .iter()
            .map(|path| Path::new(path.file_name().unwrap_or_default()));
        let (count, folder, names) = (others.len(), folder.display(), listed(names));
        eprintln!("note: {count} other files in {folder} are passed over: {names}");
    }
    Ok(pictures)
}

/// The first of some paths, for people.
pub fn listed<'a>(paths: impl ExactSizeIterator<Item = &'a Path>) -> String {
    let more = if paths.len() > NAMED { ", ..." } else { "" };
    let names = paths.take(NAMED).map(|path| path.to_string_lossy().into_owned());
    names.collect::<Vec<_>>().join(", ") + more
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
    let (bytes, picture, quarters) = decoded("image", path, true)?;
    Ok(Photograph {
        exif: deepsft_formats::camera_from_exif(&bytes, picture.size()),
        picture,
        quarters,
    })
}

/// Reads a photograph as the camera's sensor has it: turned or not, all of one camera have one size.
pub fn photograph_as_stored(path: &Path) -> Result<Picture> {
    Ok(decoded("photograph", path, false)?.1)
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
        let mut parts = Path::new(name).components();
        if !parts.all(|part| matches!(part, Component::Normal(_))) {
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
