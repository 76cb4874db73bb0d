//! Template files: `template.json` and the texture beside it.

use crate::{DeepSftError, decode_picture, encode_png};
use deepsft_geometry::Template;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

/// Name of the description in a template's folder.
pub const TEMPLATE_FILE: &str = "template.json";

/// Name of the texture in a template's folder that we write.
const TEXTURE_FILE: &str = "texture.png";

/// The one version of the description that this version of the crate reads and writes.
const FORMAT_VERSION: u32 = 1;

/// The content of a `template.json`, read before the texture it names.
///
/// ```
/// use deepsft::{TemplateFile, encode_png};
/// use deepsft_geometry::Picture;
///
/// let json = br#"{"format_version": 1, "kind": "thin-shell", "width_mm": 297, "height_mm": 210, "texture": "art.png"}"#;
/// let file = TemplateFile::parse(json)?;
/// assert_eq!(file.texture(), "art.png");
/// let art = encode_png(&Picture::from_fn(4, 3, |_, _| [200; 3]))?; // the bytes of art.png
/// assert_eq!(file.template(&art)?.size_mm().x, 297.0);
/// # Ok::<(), deepsft::DeepSftError>(())
/// ```
#[derive(Clone, Debug, PartialEq, Deserialize, Serialize)]
pub struct TemplateFile {
    format_version: u32,
    kind: Kind,
    width_mm: f64,
    height_mm: f64,
    texture: String,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize, Serialize)]
#[serde(rename_all = "kebab-case")]
enum Kind {
    ThinShell,
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
    /// * [`DeepSftError::TemplateFile`] when it is not JSON, lacks a field, is of an unknown kind or
    ///   names a texture outside its own folder.
    /// * [`DeepSftError::TemplateVersion`] when it was written by a newer version.
    pub fn parse(json: &[u8]) -> Result<Self, DeepSftError> {
        let malformed = |error: serde_json::Error| DeepSftError::TemplateFile {
            reason: error.to_string(),
        };
        let Versioned { format_version: actual } = serde_json::from_slice(json).map_err(malformed)?;
        if actual != FORMAT_VERSION {
            return Err(DeepSftError::TemplateVersion {
                actual,
                expected: FORMAT_VERSION,
            });
        }
        let file: Self = serde_json::from_slice(json).map_err(malformed)?;
        if file.texture.is_empty() || file.texture.contains(['/', '\\', ':']) || file.texture.starts_with('.') {
            let reason = format!(
                "texture must be a file in the template's own folder, not {:?}",
                file.texture
            );
            return Err(DeepSftError::TemplateFile { reason });
        }
        Ok(file)
    }

    /// Name of the texture's file, in the folder of `template.json`.
    pub fn texture(&self) -> &str {
        &self.texture
    }

    /// The template, given the bytes of the texture's file (PNG or JPEG).
    ///
    /// # Errors
    /// [`DeepSftError::Geometry`] when the size is not positive and finite, or an error of
    /// [`decode_picture`].
    pub fn template(&self, texture: &[u8]) -> Result<Template, DeepSftError> {
        Ok(Template::thin_shell(
            decode_picture(texture)?,
            self.width_mm,
            self.height_mm,
        )?)
    }
}

/// The files of a template by name: `template.json` and `texture.png`.
///
/// # Errors
/// [`DeepSftError::PictureFile`] when the texture cannot be encoded.
pub fn template_to_files(template: &Template) -> Result<BTreeMap<String, Vec<u8>>, DeepSftError> {
    let size = template.size_mm();
    let file = TemplateFile {
        format_version: FORMAT_VERSION,
        kind: Kind::ThinShell,
        width_mm: size.x,
        height_mm: size.y,
        texture: TEXTURE_FILE.to_owned(),
    };
    let json = serde_json::to_vec_pretty(&file).map_err(|e| DeepSftError::TemplateFile { reason: e.to_string() })?;
    Ok(BTreeMap::from([
        (TEMPLATE_FILE.to_owned(), json),
        (TEXTURE_FILE.to_owned(), encode_png(template.texture())?),
    ]))
}

#[cfg(test)]
mod tests {
    use super::*;
    use deepsft_geometry::{GeometryError, Picture};

    const GOOD: &str =
        r#"{"format_version":1,"kind":"thin-shell","width_mm":297,"height_mm":210,"texture":"texture.png"}"#;

    fn error(json: &str) -> DeepSftError {
        TemplateFile::parse(json.as_bytes()).unwrap_err()
    }

    #[test]
    fn a_template_comes_back_as_it_was() {
        let texture = Picture::from_fn(30, 21, |x, y| [x as u8, y as u8, 5]);
        let files = template_to_files(&Template::thin_shell(texture, 297.5, 210.25).unwrap()).unwrap();
        let file = TemplateFile::parse(&files[TEMPLATE_FILE]).unwrap();
        let template = file.template(&files[file.texture()]).unwrap();
        assert_eq!((template.size_mm().x, template.size_mm().y), (297.5, 210.25));
        assert_eq!(template.texture().pixel(29, 20), [29, 20, 5]);
    }

    #[test]
    fn a_newer_version_is_called_newer_even_when_its_fields_are_unknown() {
        let newer = r#"{"format_version":2,"rig":"bones.glb"}"#;
        assert!(matches!(
            error(newer),
            DeepSftError::TemplateVersion { actual: 2, expected: 1 }
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
        let refused = file.template(&texture).unwrap_err();
        assert!(
            matches!(
                refused,
                DeepSftError::Geometry(GeometryError::TemplateSize { side: "width", .. })
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
