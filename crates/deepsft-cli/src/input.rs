//! What commands read: pictures, model bundles, data sets. Every error names its file.

use crate::failure::BlameInput;
use crate::progress;
use anyhow::{Result, bail};
use deepsft::{DeviceDescription, DeviceKind, Estimator, MODEL_FILE, ModelBundle, decode_picture, start_device};
use deepsft_geometry::{Camera, Picture};
use deepsft_synth::DatasetFolder;
use std::collections::BTreeMap;
use std::fs;
use std::path::{Component, Path};

/// Reads a PNG or JPEG file.
pub fn picture(path: &Path) -> Result<Picture> {
    let read = || -> Result<Picture> { Ok(decode_picture(&fs::read(path)?)?) };
    read().blame("image", path)
}

/// Reads a photograph, and what its EXIF data tell of the camera.
pub fn photograph(path: &Path) -> Result<(Picture, Option<Camera>)> {
    let read = || -> Result<(Picture, Option<Camera>)> {
        let bytes = fs::read(path)?;
        let picture = decode_picture(&bytes)?;
        let camera = deepsft_formats::camera_from_exif(&bytes, picture.size());
        Ok((picture, camera))
    };
    read().blame("image", path)
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
        bail!("there is no such folder");
    }
    let read = |name: &str| -> Result<Option<Vec<u8>>> {
        let inside = Path::new(name)
            .components()
            .all(|part| matches!(part, Component::Normal(_)));
        if !inside {
            bail!("it lists a file outside of its folder: {name:?}");
        }
        match fs::read(folder.join(name)) {
            Ok(bytes) => Ok(Some(bytes)),
            Err(error) if error.kind() == std::io::ErrorKind::NotFound => Ok(None),
            Err(error) => bail!("{name}: {error}"),
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
