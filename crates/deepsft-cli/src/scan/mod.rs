//! Scans and models of other programs, made into templates.
//!
//! A reader (`obj.rs`, `gltf.rs`) gives [`Part`]s; `assembly.rs` makes one mesh with one texture of them.

mod assembly;
mod gltf;
mod obj;

pub use assembly::{Import, assemble};

use crate::input;
use anyhow::{Context, Result, bail};
use deepsft_geometry::Picture;
use deepsft_geometry::glam::{DVec2, DVec3};
use std::path::Path;

/// A part of a scan with one texture, in the file's own units, y up and the viewer on the +z side.
pub struct Part {
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
}

/// What a file holds.
pub struct Scan {
    /// Its parts.
    pub parts: Vec<Part>,
    /// Their textures.
    pub textures: Vec<Picture>,
    /// Millimetres of the format's unit: 1000 in glTF, which counts in metres; OBJ does not say, so 1.
    pub mm_per_unit: f64,
}

/// Reads a scan. `texture`, if given, is that of all parts, whatever the file says.
pub fn read(path: &Path, texture: Option<&Path>) -> Result<Scan> {
    let extension = path.extension().unwrap_or_default().to_ascii_lowercase();
    let over = texture.map(input::picture).transpose()?;
    let textures_wanted = over.is_none();
    let mut scan = match extension.to_str() {
        Some("obj") => obj::read(path, textures_wanted)?,
        Some("glb" | "gltf") => gltf::read(path, textures_wanted)?,
        _ => bail!("it is none of .obj, .glb and .gltf"),
    };
    if let Some(picture) = over {
        scan.textures = vec![picture];
        scan.parts.iter_mut().for_each(|part| part.texture = Some(0));
    }
    Ok(scan)
}

/// Reads a texture that a scan names relative to its own folder.
fn texture_beside(scan: &Path, name: &str) -> Result<Picture> {
    // Files from Windows.
    let name = name.replace('\\', "/");
    let path = scan.parent().unwrap_or(Path::new(".")).join(&name);
    if !path.is_file() {
        bail!("its texture {name:?} is not there: expected {}", path.display());
    }
    input::picture(&path).with_context(|| format!("its texture {name:?}"))
}
