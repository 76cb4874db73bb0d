//! Templates: `template.json`, the texture, the mesh.

use crate::files::{join, parts};
use crate::picture;
use anyhow::Result;
use deepsft::{TEMPLATE_FILE, TemplateFile, template_to_files};
use deepsft_geometry::glam::{DVec2, DVec3};
use deepsft_geometry::{Template, Topology, TriangleMesh};

pub(crate) fn read(input: &[u8]) -> Result<()> {
    let [description, texture, mesh] = parts(input);
    let file = TemplateFile::parse(&description)?;
    if picture::is_slow(&texture) {
        return Ok(());
    }
    check(&file.template(&texture, file.mesh().map(|_| &mesh[..]))?);
    Ok(())
}

/// What is promised of a template.
pub(crate) fn check(template: &Template) {
    let mesh = template.mesh();
    assert!(!mesh.faces().is_empty() && template.extent_mm().is_finite());
    let uv = mesh.texture_coordinates().iter().copied().take(4);
    for uv in uv.chain([DVec2::splat(0.5), DVec2::splat(1e9)]) {
        let point = template.point_template(uv);
        assert!(point.is_none_or(DVec3::is_finite), "a point at no place");
    }
    let is_whole = template.is_sheet() || Topology::of(mesh).is_ok();
    assert!(is_whole, "the mesh of a template cannot be taken apart");
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
    let vertices = points.map(|(x, y, z)| DVec3::new(x.into(), y.into(), z.into()));
    let uv = uv.map(|(u, v)| DVec2::new(u.into(), v.into()) / 32.0);
    let faces = vec![[0, 1, 2], [3, 4, 5]];
    Ok(TriangleMesh::new(vertices.into(), uv.into(), faces)?)
}

/// A sheet, and a mesh.
pub(crate) fn small() -> Result<[Template; 2]> {
    let texture = picture::small(4, 3);
    Ok([
        Template::thin_shell(texture.clone(), 40.0, 30.0)?,
        Template::of_mesh(small_mesh()?, texture)?,
    ])
}

pub(crate) fn seeds() -> Result<Vec<Vec<u8>>> {
    let seed = |template: &Template| -> Result<Vec<u8>> {
        let files = template_to_files(template)?;
        let file = TemplateFile::parse(&files[TEMPLATE_FILE])?;
        let mesh = file.mesh().map_or(&[][..], |name| &files[name]);
        Ok(join(&[&files[TEMPLATE_FILE], &files[file.texture()], mesh]))
    };
    small()?.iter().map(seed).collect()
}
