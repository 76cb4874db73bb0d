//! Scans and models of other programs, made into templates.
//!
//! A reader (`obj.rs`, `ply.rs`, `gltf.rs`, chosen in `reading.rs`) gives [`ScanPart`]s. `surface.rs` makes one mended surface of them, and
//! `assembly.rs` a template: with the textures of the file if every place of them is one place of the surface (`first_tile.rs`, `atlas.rs`),
//! else with a new one, for which `charts.rs` lays the faces out and `baking.rs` carries the colours over.

mod accessors;
mod assembly;
mod atlas;
mod baking;
mod charts;
mod first_tile;
mod gltf;
mod mending;
mod obj;
mod ply;
mod reading;
mod surface;

pub use assembly::{ScannedTemplate, assemble_scan};
pub use reading::{mesh_vertices, read_scan};

use crate::error::FormatError;
use deepsft_geometry::Picture;
use deepsft_geometry::glam::{DVec2, DVec3};
use std::path::{Component, Path, PathBuf};

/// Most bytes of all textures of a scan together, decoded.
const MAX_TEXTURE_BYTES: usize = 1 << 30;

/// A part of a scan with one texture, in the file's own units, y up and the viewer on the +z side.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ScanPart {
    /// What the file calls it.
    pub name: String,
    /// Positions of the vertices.
    pub positions: Vec<DVec3>,
    /// Texture coordinates of the vertices, v down; beyond the unit square where the file repeats its texture.
    pub texture_coordinates: Vec<DVec2>,
    /// Triangles, counter-clockwise seen from the front.
    pub faces: Vec<[usize; 3]>,
    /// Its texture, as an index of the scan's; `None` when the file names none.
    pub texture: Option<usize>,
    /// How its texture goes on beyond the unit square, along u and v.
    pub wraps: [Wrap; 2],
    /// sRGB colours of the vertices, by which those of the texture are multiplied (in linear light) if there is one. Empty where the file
    /// tells none.
    pub colors: Vec<[u8; 3]>,
}

/// How a texture goes on beyond the unit square.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Wrap {
    /// It begins again.
    #[default]
    Repeat,
    /// It runs to and fro.
    Mirror,
    /// Its border goes on.
    Clamp,
}

/// What a file holds.
#[derive(Clone, Debug, PartialEq)]
pub struct Scan {
    /// Its parts.
    pub parts: Vec<ScanPart>,
    /// Their textures.
    pub textures: Vec<Picture>,
    /// Millimetres of the format's unit: 1000 in glTF, which counts in metres; OBJ and PLY do not say, so 1.
    pub mm_per_unit: f64,
    /// What was left out of it, or found elsewhere than it says.
    pub notes: Vec<String>,
}

/// The textures of a scan as they are read, each once, and the files beside it.
struct Textures<'a> {
    beside: &'a dyn Fn(&Path) -> Result<Vec<u8>, FormatError>,
    decode: &'a dyn Fn(&[u8]) -> Result<Picture, FormatError>,
    /// Whether those that the scan names are read.
    are_wanted: bool,
    /// What the scan calls each of the pictures.
    named: Vec<String>,
    pictures: Vec<Picture>,
    notes: Vec<String>,
}

impl Textures<'_> {
    /// The number of the picture called `name`, whose file `read` gives when it is met for the first time. A picture that cannot be had is
    /// noted, and the scan goes on without it.
    fn number_or_note(
        &mut self,
        name: &str,
        read: impl FnOnce(&mut Self) -> Result<Vec<u8>, FormatError>,
    ) -> Option<usize> {
        if let Some(number) = self.named.iter().position(|known| known == name) {
            return Some(number);
        }
        match read(self).and_then(|bytes| (self.decode)(&bytes)) {
            Err(error) => self.note(format!("its texture {name:?}: {error}")),
            Ok(picture) => {
                let pictures = self.pictures.iter().chain([&picture]);
                if pictures.map(|picture| picture.rgb().len()).sum::<usize>() <= MAX_TEXTURE_BYTES {
                    self.named.push(name.to_owned());
                    self.pictures.push(picture);
                    return Some(self.pictures.len() - 1);
                }
                self.note("its textures have more than 1 GiB of pixels: make them smaller".to_owned());
            }
        }
        None
    }

    /// Notes something once.
    fn note(&mut self, note: String) {
        if !self.notes.contains(&note) {
            self.notes.push(note);
        }
    }

    /// The bytes of a file that the scan names. Where there is none, or the path is absolute or climbs out of the scan's folder, as that of
    /// its maker's disk does, the file of that name beside the scan is taken. Files from Windows write paths with backslashes.
    fn file(&mut self, name: &str) -> Result<Vec<u8>, FormatError> {
        let path = PathBuf::from(name.trim_matches('"').replace('\\', "/"));
        let is_drive = |first: Component<'_>| first.as_os_str().to_string_lossy().ends_with(':');
        let is_within = |part: Component<'_>| matches!(part, Component::Normal(_) | Component::CurDir);
        let is_inside = path.components().all(is_within) && !path.components().next().is_some_and(is_drive);
        let asked = (is_inside && path.file_name().is_some()).then(|| (self.beside)(&path));
        let asked = match asked {
            Some(Ok(bytes)) => return Ok(bytes),
            asked => asked,
        };
        let last = path.file_name().map(Path::new).filter(|last| *last != path);
        match (last.map(self.beside), asked) {
            (Some(Ok(bytes)), _) => {
                self.notes
                    .push(format!("it names {name:?}: the file of that name beside it was taken"));
                Ok(bytes)
            }
            (_, Some(asked)) => asked,
            (_, None) => refused(format!(
                "it names {name:?}, which is not in its folder: put that file beside the scan (in a page choose both together), or give \
                 one texture for all of it (on the command line --texture)"
            )),
        }
    }
}

fn refused<T>(reason: impl Into<String>) -> Result<T, FormatError> {
    Err(FormatError::Scan(reason.into()))
}
