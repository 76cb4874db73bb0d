//! Template files: `template.json`, and beside it the texture and, of a template that is no sheet, the mesh.

use crate::{FormatError, decode_picture, encode_png, mesh_from_obj, mesh_to_obj};
use deepsft_geometry::Template;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

/// Name of the description in a template's folder.
pub const TEMPLATE_FILE: &str = "template.json";

/// Name of the texture in a template's folder that we write.
const TEXTURE_FILE: &str = "texture.png";

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
        let malformed = |error: serde_json::Error| FormatError::TemplateFile {
            reason: error.to_string(),
        };
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
                return Err(FormatError::TemplateFile { reason });
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
                let missing = || FormatError::TemplateFile {
                    reason: format!("the mesh {name:?} was not read"),
                };
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
    let surface = if template.is_sheet() {
        Surface::ThinShell {
            width_mm: template.size_mm().x,
            height_mm: template.size_mm().y,
        }
    } else {
        Surface::Mesh {
            mesh: MESH_FILE.to_owned(),
        }
    };
    let file = TemplateFile {
        format_version: FORMAT_VERSION,
        surface,
        texture: TEXTURE_FILE.to_owned(),
    };
    let json = serde_json::to_vec_pretty(&file).map_err(|e| FormatError::TemplateFile { reason: e.to_string() })?;
    let mut files = BTreeMap::from([
        (TEMPLATE_FILE.to_owned(), json),
        (TEXTURE_FILE.to_owned(), encode_png(template.texture())?),
    ]);
    if let Some(name) = file.mesh() {
        files.insert(name.to_owned(), mesh_to_obj(template.mesh()).into_bytes());
    }
    Ok(files)
}

#[cfg(test)]
mod tests {
    use super::*;
    use deepsft_geometry::glam::{DVec2, DVec3};
    use deepsft_geometry::{GeometryError, Picture, TriangleMesh};

    const GOOD: &str =
        r#"{"format_version":1,"kind":"thin-shell","width_mm":297,"height_mm":210,"texture":"texture.png"}"#;

    fn error(json: &str) -> FormatError {
        TemplateFile::parse(json.as_bytes()).unwrap_err()
    }

    #[test]
    fn a_template_comes_back_as_it_was() {
        let texture = Picture::from_fn(30, 21, |x, y| [x as u8, y as u8, 5]);
        let files = template_to_files(&Template::thin_shell(texture, 297.5, 210.25).unwrap()).unwrap();
        let file = TemplateFile::parse(&files[TEMPLATE_FILE]).unwrap();
        let template = file.template(&files[file.texture()], None).unwrap();
        assert_eq!((template.size_mm().x, template.size_mm().y), (297.5, 210.25));
        assert_eq!(template.texture().pixel(29, 20), [29, 20, 5]);
        assert_eq!(files.len(), 2);
    }

    #[test]
    fn a_template_of_a_mesh_comes_back_as_it_was_and_needs_its_mesh() {
        let corners = [
            DVec3::ZERO,
            DVec3::X * 100.5,
            DVec3::new(0.25, 80.0, -1.0 / 3.0),
            DVec3::Z * 60.0,
        ];
        let faces = [[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]];
        // Each face a chart of its own.
        let vertices = faces.iter().flatten().map(|&v: &usize| corners[v]).collect();
        let chart = |k: usize| [(0.01, 0.1), (0.24, 0.1), (0.1, 0.9)].map(|(u, v)| DVec2::new(u + 0.25 * k as f64, v));
        let uv = (0..4).flat_map(chart).collect();
        let mesh = TriangleMesh::new(vertices, uv, (0..4).map(|k| [3 * k, 3 * k + 1, 3 * k + 2]).collect()).unwrap();
        let template = Template::of_mesh(mesh, Picture::from_fn(16, 8, |x, y| [x as u8, y as u8, 9])).unwrap();
        let files = template_to_files(&template).unwrap();
        let file = TemplateFile::parse(&files[TEMPLATE_FILE]).unwrap();
        let name = file.mesh().unwrap();
        let back = file.template(&files[file.texture()], Some(&files[name])).unwrap();
        assert!(!back.is_sheet());
        assert_eq!(back.mesh().vertices(), template.mesh().vertices());
        assert_eq!(back.mesh().faces(), template.mesh().faces());
        assert_eq!(back.texture().rgb(), template.texture().rgb());
        let refused = file.template(&files[file.texture()], None).unwrap_err();
        assert!(refused.to_string().contains("mesh.obj"), "{refused}");
        let outside = r#"{"format_version":1,"kind":"mesh","mesh":"../m.obj","texture":"t.png"}"#;
        assert!(error(outside).to_string().contains("own folder"));
    }

    #[test]
    fn a_newer_version_is_called_newer_even_when_its_fields_are_unknown() {
        let newer = r#"{"format_version":2,"rig":"bones.glb"}"#;
        assert!(matches!(
            error(newer),
            FormatError::TemplateVersion { actual: 2, expected: 1 }
        ));
    }

    #[test]
    fn a_template_without_a_size_is_refused() {
        assert!(
            error(&GOOD.replace("\"width_mm\":297,", ""))
                .to_string()
                .contains("missing field `width_mm`")
        );
        let file = TemplateFile::parse(GOOD.replace("297", "0").as_bytes()).unwrap();
        let texture = encode_png(&Picture::from_fn(2, 2, |_, _| [0; 3])).unwrap();
        let refused = file.template(&texture, None).unwrap_err();
        assert!(
            matches!(
                refused,
                FormatError::Geometry(GeometryError::TemplateSize { side: "width", .. })
            ),
            "{refused}"
        );
    }

    #[test]
    fn a_texture_outside_of_the_folder_and_an_unknown_kind_are_refused() {
        for path in [
            "../secret.png",
            "/etc/passwd",
            "a\\\\b.png",
            "C:x.png",
            "",
            "..",
            ".hidden",
        ] {
            let refused = error(&GOOD.replace("texture.png", path));
            assert!(refused.to_string().contains("own folder"), "{path}: {refused}");
        }
        assert!(
            error(&GOOD.replace("thin-shell", "volumic"))
                .to_string()
                .contains("volumic")
        );
    }
}
