//! Templates of the disk.

use crate::error::FormatError;
use crate::picture::decode_picture;
use crate::template::{TEMPLATE_FILE, TemplateFile};
use deepsft_geometry::Template;
use std::fs;
use std::path::Path;

/// Reads the template in `folder`: `template.json` and the files that it names.
///
/// # Errors
/// [`FormatError::Unusable`] with the file that is missing, corrupt or unfit.
pub fn read_template(folder: &Path) -> Result<Template, FormatError> {
    let read = |what, path: &Path| fs::read(path).map_err(|error| FormatError::unusable(what, path, error));
    let description = folder.join(TEMPLATE_FILE);
    let file = TemplateFile::parse(&read("template", &description)?)
        .map_err(|error| FormatError::unusable("template", &description, error))?;
    let texture = folder.join(file.texture());
    let (with_texture, with_mesh) = ("template with the texture", "template with the mesh");
    let pixels = read(with_texture, &texture)?;
    let unfit = |error| FormatError::unusable(with_texture, &texture, error);
    let Some(name) = file.mesh() else {
        // The size stands in the description, the rest of what can be wrong in the texture.
        return file.template(&pixels, None).map_err(unfit);
    };
    let mesh = folder.join(name);
    let triangles = read(with_mesh, &mesh)?;
    decode_picture(&pixels).map_err(unfit)?;
    file.template(&pixels, Some(&triangles))
        .map_err(|error| FormatError::unusable(with_mesh, &mesh, error))
}
