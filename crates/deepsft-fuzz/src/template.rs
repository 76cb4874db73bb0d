//! Templates: `template.json`, the texture, the mesh.

use crate::files::{join, split};
use crate::picture;
use crate::png;
use anyhow::Result;
use deepsft::{TEMPLATE_FILE, TemplateFile, template_to_files};
use deepsft_geometry::glam::{DVec2, DVec3};
use deepsft_geometry::{Picture, Template, Topology, TriangleMesh};

pub(crate) fn read(input: &[u8]) -> Result<()> {
    let parts = split(input);
    let part = |number: usize| parts.get(number).copied().unwrap_or_default();
    let file = TemplateFile::parse(part(0))?;
    let texture = png::repaired(part(1));
    if picture::is_slow(&texture) {
        return Ok(());
    }
    check(&file.template(&texture, file.mesh().map(|_| part(2)))?);
    Ok(())
}

/// What is promised of a template.
pub(crate) fn check(template: &Template) {
    let mesh = template.mesh();
    assert!(!mesh.faces().is_empty() && template.extent_mm().is_finite());
    for uv in mesh
        .texture_coordinates()
        .iter()
        .take(4)
        .chain([&DVec2::splat(0.5), &DVec2::splat(1e9)])
    {
        assert!(
            template.point_template(*uv).is_none_or(DVec3::is_finite),
            "a point at no place"
        );
    }
    if !template.is_sheet() {
        assert!(
            Topology::of(mesh).is_ok(),
            "the mesh of a template cannot be taken apart"
        );
    }
    let files = template_to_files(template);
    let files = files.expect("a template that was read can be written");
    let file = TemplateFile::parse(&files[TEMPLATE_FILE]).expect("a template that was written can be read");
    let mesh_file = file.mesh().map(|name| files[name].as_slice());
    let again = file
        .template(&files[file.texture()], mesh_file)
        .expect("a template that was written can be read");
    assert_eq!(again.mesh().faces(), mesh.faces());
    assert_eq!(again.texture(), template.texture());
}

/// Two triangles that are two charts in a small part of a texture.
pub(crate) fn small_mesh() -> Result<TriangleMesh> {
    let points = [(0, 0, 0), (30, 0, 0), (0, 20, 0), (30, 0, 0), (30, 20, 5), (0, 20, 0)];
    let uv = [(0, 0), (3, 0), (0, 2), (6, 0), (6, 2), (3, 2)];
    Ok(TriangleMesh::new(
        points
            .iter()
            .map(|&(x, y, z)| DVec3::new(x.into(), y.into(), z.into()))
            .collect(),
        uv.iter().map(|&(u, v)| DVec2::new(u.into(), v.into()) / 32.0).collect(),
        vec![[0, 1, 2], [3, 4, 5]],
    )?)
}

/// A sheet, and a mesh.
pub(crate) fn small() -> Result<[Template; 2]> {
    let texture: Picture = picture::small(4, 3);
    Ok([
        Template::thin_shell(texture.clone(), 40.0, 30.0)?,
        Template::of_mesh(small_mesh()?, texture)?,
    ])
}

pub(crate) fn seeds() -> Result<Vec<Vec<u8>>> {
    let seed = |template: &Template| -> Result<Vec<u8>> {
        let files = template_to_files(template)?;
        let file = TemplateFile::parse(&files[TEMPLATE_FILE])?;
        let mesh = file.mesh().map(|name| files[name].as_slice());
        Ok(join(&[
            &files[TEMPLATE_FILE],
            &files[file.texture()],
            mesh.unwrap_or_default(),
        ]))
    };
    small()?.iter().map(seed).collect()
}
