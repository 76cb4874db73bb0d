//! Which colour and depth pictures of a recording belong together.

use crate::error::SynthError;
use deepsft_formats::{is_picture, read_error};
use std::collections::BTreeMap;
use std::fs;
use std::path::{Component, Path, PathBuf};

/// Name of the file that tells which pictures belong together.
pub(super) const ASSOCIATIONS_FILE: &str = "associations.txt";
/// Name of the folder with the colour pictures.
pub const RGB_FOLDER: &str = "rgb";
/// Name of the folder with the depth pictures.
pub const DEPTH_FOLDER: &str = "depth";
/// Name of the folder with the object's masks.
pub const MASK_FOLDER: &str = "mask";

/// A colour picture and its depth picture, paths within the recording.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct Pair {
    pub(super) rgb: PathBuf,
    pub(super) depth: PathBuf,
}

impl Pair {
    /// The mask of the pair in the folder `masks`: a PNG of the colour picture's name.
    pub(super) fn mask(&self, masks: &Path) -> PathBuf {
        masks
            .join(self.rgb.file_name().unwrap_or_default())
            .with_extension("png")
    }
}

/// The pairs of the recording in `folder`: those of `associations.txt` or, without it, pictures of the same name.
pub(super) fn pairs(folder: &Path) -> Result<Vec<Pair>, SynthError> {
    let list = folder.join(ASSOCIATIONS_FILE);
    let pairs = match fs::read_to_string(&list) {
        Ok(text) => associated(&text).map_err(|reason| SynthError::recording(reason, &list))?,
        Err(error) if error.kind() == std::io::ErrorKind::NotFound => by_name(folder)?,
        Err(error) => return Err(SynthError::recording(error.to_string(), &list)),
    };
    for path in pairs.iter().flat_map(|pair| [&pair.rgb, &pair.depth]) {
        let path = folder.join(path);
        if !path.is_file() {
            return Err(SynthError::recording(
                "there is no such picture: add it, or take its line out",
                &path,
            ));
        }
    }
    if pairs.is_empty() {
        return Err(SynthError::recording(
            "there are no pictures in it: a recording has PNG or JPEG files there",
            &folder.join(RGB_FOLDER),
        ));
    }
    Ok(pairs)
}

/// The lines `time path time path` of an association file; those that begin with # are comments.
fn associated(text: &str) -> Result<Vec<Pair>, String> {
    let mut pairs = Vec::new();
    for (number, line) in (1..).zip(text.lines()) {
        if line.trim().is_empty() || line.trim_start().starts_with('#') {
            continue;
        }
        let words: Vec<&str> = line.split_whitespace().collect();
        let [_, a, _, b] = words[..] else {
            return Err(format!("line {number} is not `time path time path`"));
        };
        let inside = |path: &str| Path::new(path).components().all(|c| matches!(c, Component::Normal(_)));
        if !(inside(a) && inside(b)) {
            return Err(format!("line {number} names a file outside of the recording"));
        }
        let is_depth = |path: &str| Path::new(path).starts_with(DEPTH_FOLDER);
        let (rgb, depth) = match (is_depth(a), is_depth(b)) {
            (false, true) => (a.into(), b.into()),
            (true, false) => (b.into(), a.into()),
            _ => return Err(format!("line {number} does not name one picture in {DEPTH_FOLDER}/")),
        };
        pairs.push(Pair { rgb, depth });
    }
    Ok(pairs)
}

/// Pictures of the same name without its ending, in the order of the names.
fn by_name(folder: &Path) -> Result<Vec<Pair>, SynthError> {
    let alone = |path: &Path, other: &str, name: &str| {
        let reason = format!(
            "it has no partner {other}/{name}.png, and there is no {ASSOCIATIONS_FILE}: add one of them, or remove it"
        );
        SynthError::recording(reason, &folder.join(path))
    };
    let mut depth = pictures(folder, DEPTH_FOLDER)?;
    let mut pairs = Vec::new();
    for (name, rgb) in pictures(folder, RGB_FOLDER)? {
        let depth = depth.remove(&name).ok_or_else(|| alone(&rgb, DEPTH_FOLDER, &name))?;
        pairs.push(Pair { rgb, depth });
    }
    match depth.first_key_value() {
        Some((name, path)) => Err(alone(path, RGB_FOLDER, name)),
        None => Ok(pairs),
    }
}

/// The PNG and JPEG files of a folder of the recording by name, with their paths within the recording.
fn pictures(folder: &Path, name: &str) -> Result<BTreeMap<String, PathBuf>, SynthError> {
    let path = folder.join(name);
    let unreadable = |error| SynthError::recording(read_error(error), &path);
    let mut pictures = BTreeMap::new();
    for entry in fs::read_dir(&path).map_err(unreadable)? {
        let file = PathBuf::from(entry.map_err(unreadable)?.file_name());
        if let Some(stem) = file.file_stem()
            && is_picture(&file)
        {
            pictures.insert(stem.to_string_lossy().into_owned(), Path::new(name).join(&file));
        }
    }
    Ok(pictures)
}
