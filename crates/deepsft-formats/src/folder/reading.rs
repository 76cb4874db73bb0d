//! What is read from the disk: cameras, templates, scans, folders of pictures.

#[cfg(feature = "scan")]
use super::file::{entries, parent};
use crate::camera::camera_from_json;
use crate::error::FormatError;
use crate::picture::{decode_picture, is_picture};
use crate::reasons::read_error;
#[cfg(feature = "scan")]
use crate::scan::{Scan, ScanPart, read_scan};
use crate::template::{TEMPLATE_FILE, TemplateFile};
use deepsft_geometry::{Camera, Template};
use std::path::{Path, PathBuf};
use std::{fs, io};

/// Reads a `camera.json`, or with the feature `cameras` the camera file of another program.
///
/// # Errors
/// [`FormatError::Unusable`] when it is missing, corrupt or unfit.
pub fn read_camera(path: &Path) -> Result<Camera, FormatError> {
    let bytes = fs::read(path).map_err(|error| FormatError::unusable("camera file", path, read_error(error)))?;
    let camera = camera_from_json(&bytes);
    #[cfg(feature = "cameras")]
    let camera = camera.or_else(|own| match own {
        FormatError::CameraFile(_) => crate::foreign_camera::camera_from_foreign(&bytes),
        own => Err(own),
    });
    camera.map_err(|error| FormatError::unusable("camera file", path, error))
}

/// Reads the template in `folder`: `template.json` and the files that it names.
///
/// # Errors
/// [`FormatError::Unusable`] with the file that is missing, corrupt or unfit.
pub fn read_template(folder: &Path) -> Result<Template, FormatError> {
    let read = |what, path: &Path| fs::read(path).map_err(|error| FormatError::unusable(what, path, read_error(error)));
    let description = folder.join(TEMPLATE_FILE);
    if !description.exists() {
        let reason = format!("there is no {TEMPLATE_FILE} in it: name the folder of a template");
        return Err(FormatError::unusable("template", folder, reason));
    }
    let file = TemplateFile::parse(&read("template", &description)?)
        .map_err(|error| FormatError::unusable("template", &description, error))?;
    let texture = folder.join(file.texture());
    let (with_texture, with_mesh) = ("template with the texture", "template with the mesh");
    let pixels = read(with_texture, &texture)?;
    let unfit = |error| match error {
        FormatError::Template(error) => FormatError::unusable("template", &description, error),
        error => FormatError::unusable(with_texture, &texture, error),
    };
    let Some(name) = file.mesh() else {
        return file.template(&pixels, None).map_err(unfit);
    };
    let mesh = folder.join(name);
    let triangles = read(with_mesh, &mesh)?;
    decode_picture(&pixels).map_err(unfit)?;
    file.template(&pixels, Some(&triangles))
        .map_err(|error| FormatError::unusable(with_mesh, &mesh, error))
}

/// The pictures of a folder that is a `what` ("folder of frames"), by name. There must be one.
///
/// # Errors
/// [`FormatError::Unusable`] when the folder cannot be read or holds none.
pub fn pictures_in(folder: &Path, what: &'static str) -> Result<Vec<PathBuf>, FormatError> {
    let list = || -> io::Result<Vec<PathBuf>> {
        let paths: io::Result<Vec<PathBuf>> = fs::read_dir(folder)?.map(|entry| Ok(entry?.path())).collect();
        let mut pictures = paths?;
        pictures.retain(|path| is_picture(path));
        pictures.sort();
        match pictures.is_empty() {
            true => Err(io::Error::other(
                "there is no picture in it: put PNG or JPEG files there",
            )),
            false => Ok(pictures),
        }
    };
    list().map_err(|error| FormatError::unusable(what, folder, read_error(error)))
}

/// Reads the scan at `path` with the files beside it. `texture`, if given, is the picture file of all its parts. A scan without texture and
/// colours has the one picture beside it, if there is one.
///
/// # Errors
/// [`FormatError::File`] for a file that cannot be read, and those of [`read_scan`].
#[cfg(feature = "scan")]
pub fn read_scan_file(path: &Path, texture: Option<&Path>) -> Result<Scan, FormatError> {
    let picture =
        |path: &Path| decode_picture(&read_bounded(path)?).map_err(|error| FormatError::unreadable(path, error));
    let texture = texture.map(picture).transpose()?;
    let folder = parent(path);
    let name = path.file_name().unwrap_or_default().to_string_lossy();
    let bytes = read_bounded(path)?;
    let beside = |beside: &Path| {
        let path = folder.join(beside);
        if path.exists() {
            return read_bounded(&path);
        }
        // Files from Windows may write its letters otherwise.
        let wanted = path.file_name().unwrap_or_default();
        let mut entries = entries(parent(&path)).unwrap_or_default().into_iter();
        let alike = entries.find(|entry| entry.file_name().eq_ignore_ascii_case(wanted));
        read_bounded(&alike.map_or(path, |entry| entry.path()))
    };
    let is_given = texture.is_some();
    let scan = read_scan(&name, &bytes, texture, &decode_picture, &beside)?;
    let is_bare = |part: &ScanPart| part.texture.is_none() && part.colors.is_empty();
    let mut parts = scan.parts.iter().filter(|part| !part.faces.is_empty()).peekable();
    if is_given || parts.peek().is_none() || !parts.all(is_bare) {
        return Ok(scan);
    }
    // Where the only picture beside it is no texture, what is wrong with the scan itself is told.
    let lone = pictures_in(folder, "folder")
        .ok()
        .filter(|pictures| pictures.len() == 1);
    let Some((path, texture)) = lone.and_then(|lone| Some((lone[0].clone(), picture(&lone[0]).ok()?))) else {
        return Ok(scan);
    };
    let mut textured = read_scan(&name, &bytes, Some(texture), &decode_picture, &beside)?;
    textured.notes.extend(scan.notes);
    let lone = path.display();
    (textured.notes).push(format!(
        "it names no texture: the one picture beside it was taken, {lone}"
    ));
    Ok(textured)
}

/// The bytes of a file of at most 4 GiB. Devices and pipes, which may never end, are refused.
#[cfg(feature = "scan")]
fn read_bounded(path: &Path) -> Result<Vec<u8>, FormatError> {
    let read = || match fs::metadata(path)? {
        file if file.is_dir() => Err(io::Error::other("it is a folder: name a file in it")),
        file if !file.is_file() => Err(io::Error::other("it is a device or a pipe: name a file")),
        file if file.len() > 4 << 30 => Err(io::Error::other("it is larger than 4 GiB: make it smaller")),
        _ => fs::read(path),
    };
    read().map_err(|error| FormatError::unreadable(path, read_error(error)))
}
