//! What commands read: pictures and model bundles. Every error names its file.

use crate::failure::BlameInput;
use anyhow::{Result, bail};
use deepsft::{DeviceDescription, DeviceKind, Estimator, MODEL_FILE, ModelBundle, decode_picture, start_device};
use deepsft_geometry::Picture;
use std::collections::BTreeMap;
use std::fs;
use std::path::{Component, Path};

/// Reads a PNG or JPEG file.
pub fn picture(path: &Path) -> Result<Picture> {
    let read = || -> Result<Picture> { Ok(decode_picture(&fs::read(path)?)?) };
    read().blame("image", path)
}

/// Whether a file's name is that of a PNG or JPEG file.
pub fn is_image(path: &Path) -> bool {
    let extension = path.extension().unwrap_or_default().to_ascii_lowercase();
    ["png", "jpg", "jpeg"].iter().any(|known| extension == *known)
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
    let mut files = BTreeMap::new();
    let mut read = |name: &str| -> Result<()> {
        let inside = Path::new(name)
            .components()
            .all(|part| matches!(part, Component::Normal(_)));
        if !inside {
            bail!("it lists a file outside of its folder: {name:?}");
        }
        match fs::read(folder.join(name)) {
            Ok(bytes) => {
                files.insert(name.to_owned(), bytes);
                Ok(())
            }
            Err(error) if error.kind() == std::io::ErrorKind::NotFound => Ok(()),
            Err(error) => bail!("{name}: {error}"),
        }
    };
    read(MODEL_FILE)?;
    let listed = match fs::read(folder.join(MODEL_FILE)) {
        Ok(description) => ModelBundle::file_names(&description)?,
        Err(_) => Vec::new(),
    };
    for (name, _) in listed {
        read(&name)?;
    }
    Ok(files)
}

/// Starts a device and puts the bundle's model on it.
pub fn estimator(bundle: &ModelBundle, device: DeviceKind) -> Result<(Estimator, DeviceDescription)> {
    let (device, description) = pollster::block_on(start_device(device))?;
    Ok((Estimator::new(bundle, &device)?, description))
}
