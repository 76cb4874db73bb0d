//! Template files: `template.json`, and beside it the texture and, of a template that is no sheet, the mesh.

use crate::error::FormatError;
use crate::obj::{mesh_from_obj, mesh_to_obj};
use crate::picture::{decode_picture, encode_png};
use crate::reasons::json_reason;
use deepsft_geometry::Template;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

/// Name of the description in a template's folder.
pub const TEMPLATE_FILE: &str = "template.json";

/// Name of the texture in a template's folder that we write.
pub const TEXTURE_FILE: &str = "texture.png";

/// Name of the mesh in a template's folder that we write.
const MESH_FILE: &str = "mesh.obj";

/// The one version of the description that this version of the crate reads and writes.
const FORMAT_VERSION: u32 = 1;

/// The content of a `template.json`, read before the files it names. There are two kinds:
///
/// * `thin-shell`: a flat sheet of `width_mm` x `height_mm` with the picture `texture` from edge to edge;
/// * `mesh`: any textured surface, the mesh in the OBJ file `mesh` (see [`crate::mesh_to_obj`]).
///
/// ```
/// use deepsft_formats::{TemplateFile, encode_png};
/// use deepsft_geometry::Picture;
///
/// let json = br#"{"format_version": 1, "kind": "thin-shell", "width_mm": 297, "height_mm": 210, "texture": "art.png"}"#;
/// let file = TemplateFile::parse(json)?;
/// assert_eq!(file.texture(), "art.png");
/// let art = encode_png(&Picture::from_fn(4, 3, |_, _| [200; 3]))?; // the bytes of art.png
/// assert_eq!(file.template(&art, None)?.size_mm().x, 297.0);
/// # Ok::<(), deepsft_formats::FormatError>(())
/// ```
#[derive(Clone, Debug, PartialEq, Deserialize, Serialize)]
pub struct TemplateFile {
    format_version: u32,
    #[serde(flatten)]
    surface: Surface,
    texture: String,
}

#[derive(Clone, Debug, PartialEq, Deserialize, Serialize)]
#[serde(tag = "kind", rename_all = "kebab-case")]
enum Surface {
    ThinShell { width_mm: f64, height_mm: f64 },
    Mesh { mesh: String },
}

/// The field that is read first, so that a newer file is called newer and not malformed.
#[derive(Deserialize)]
struct Versioned {
    format_version: u32,
}

impl TemplateFile {
    /// Reads and checks the content of a `template.json`.
    ///
    /// # Errors
    /// * [`FormatError::TemplateFile`] when it is not JSON, lacks a field, is of an unknown kind or
    ///   names a file outside its own folder.
    /// * [`FormatError::TemplateVersion`] when it was written by a newer version.
    pub fn parse(json: &[u8]) -> Result<Self, FormatError> {
        let malformed = |error: serde_json::Error| FormatError::TemplateFile(json_reason(&error));
        let Versioned { format_version: actual } = serde_json::from_slice(json).map_err(malformed)?;
        if actual != FORMAT_VERSION {
            return Err(FormatError::TemplateVersion {
                actual,
                expected: FORMAT_VERSION,
            });
        }
        let file: Self = serde_json::from_slice(json).map_err(malformed)?;
        for (field, name) in [("texture", Some(file.texture())), ("mesh", file.mesh())] {
            let Some(name) = name else { continue };
            if name.is_empty() || name.contains(['/', '\\', ':']) || name.starts_with('.') {
                let reason = format!("{field} must be a file in the template's own folder, not {name:?}");
                return Err(FormatError::TemplateFile(reason));
            }
        }
        Ok(file)
    }

    /// Name of the texture's file, in the folder of `template.json`.
    pub fn texture(&self) -> &str {
        &self.texture
    }

    /// Name of the mesh's file, in the folder of `template.json`; `None` of a sheet, which has none.
    pub fn mesh(&self) -> Option<&str> {
        match &self.surface {
            Surface::ThinShell { .. } => None,
            Surface::Mesh { mesh } => Some(mesh),
        }
    }

    /// The template, given the bytes of the texture's file (PNG or JPEG) and of the mesh's, if there is one.
    ///
    /// # Errors
    /// [`FormatError::Geometry`] when a sheet's size is not positive and finite or a mesh is not fit to be a template
    /// ([`Template::of_mesh`]), or an error of [`decode_picture`] or [`crate::mesh_from_obj`].
    pub fn template(&self, texture: &[u8], mesh: Option<&[u8]>) -> Result<Template, FormatError> {
        let picture = decode_picture(texture)?;
        Ok(match &self.surface {
            Surface::ThinShell { width_mm, height_mm } => Template::thin_shell(picture, *width_mm, *height_mm)?,
            Surface::Mesh { mesh: name } => {
                let missing = || FormatError::TemplateFile(format!("the mesh {name:?} was not read"));
                Template::of_mesh(mesh_from_obj(mesh.ok_or_else(missing)?)?, picture)?
            }
        })
    }
}

/// The files of a template by name: `template.json`, `texture.png` and, of a template that is no sheet, `mesh.obj`.
///
/// # Errors
/// [`FormatError::PictureFile`] when the texture cannot be encoded.
pub fn template_to_files(template: &Template) -> Result<BTreeMap<String, Vec<u8>>, FormatError> {
    let ([width_mm, height_mm], mesh) = (template.size_mm().to_array(), MESH_FILE.to_owned());
    let surface = match template.is_sheet() {
        true => Surface::ThinShell { width_mm, height_mm },
        false => Surface::Mesh { mesh },
    };
    let file = TemplateFile {
        format_version: FORMAT_VERSION,
        surface,
        texture: TEXTURE_FILE.to_owned(),
    };
    let json = serde_json::to_vec_pretty(&file).map_err(|e| FormatError::TemplateFile(e.to_string()))?;
    let mut files = BTreeMap::from([
        (TEMPLATE_FILE.to_owned(), json),
        (TEXTURE_FILE.to_owned(), encode_png(template.texture())?),
    ]);
    if let Some(name) = file.mesh() {
        files.insert(name.to_owned(), mesh_to_obj(template.mesh()).into_bytes());
    }
    Ok(files)
}
