//! Meshes and scans as OBJ files, with materials and textures beside them.

use crate::files::{join, parts};
use crate::{picture, template};
use anyhow::Result;
use deepsft::{encode_png, mesh_from_obj, mesh_to_obj};
use deepsft_formats::{FormatError, assemble_scan, read_scan};
use deepsft_geometry::Picture;
use std::path::{Component, Path};

/// The files are the mesh, its materials and its texture. Without materials the texture is that of all parts.
pub(crate) fn read(input: &[u8]) -> Result<()> {
    let [scan, materials, texture] = parts(input);
    if let Ok(mesh) = mesh_from_obj(&scan) {
        let again = mesh_from_obj(mesh_to_obj(&mesh).as_bytes());
        assert!(
            again.is_ok_and(|again| again.faces() == mesh.faces()),
            "written and read again it is another mesh"
        );
    }
    read_files("scan.obj", &scan, materials.is_empty(), &texture, &|path| {
        let is_materials = path.extension().is_some_and(|ending| ending == "mtl");
        if is_materials { &materials } else { &texture }.clone()
    })
}

/// Reads a scan and makes a template of it. `texture` is that of all parts if `of_all`.
pub(crate) fn read_files(
    name: &str,
    scan: &[u8],
    of_all: bool,
    texture: &[u8],
    beside: &dyn Fn(&Path) -> Vec<u8>,
) -> Result<()> {
    if picture::is_slow(texture) {
        return Ok(());
    }
    let of_all: Option<Picture> = of_all.then(|| deepsft::decode_picture(texture)).transpose()?;
    let scan = read_scan(name, scan, of_all, &deepsft::decode_picture, &|path| {
        let mut parts = path.components();
        let stays = parts.all(|part| matches!(part, Component::Normal(_) | Component::CurDir));
        assert!(stays, "it reads {}", path.display());
        Ok::<_, FormatError>(beside(path))
    })?;
    template::check(&assemble_scan(scan)?.template);
    Ok(())
}

pub(crate) fn seeds() -> Result<Vec<Vec<u8>>> {
    let texture = encode_png(&picture::small(4, 3))?;
    let own = mesh_to_obj(&template::small_mesh()?);
    let foreign = "mtllib a.mtl\no tent\nv 0 0 0\nv 2 0 0\nv 2 2 1 0.5 0.5 0.5\nv 0 2 0\nvt 0 0\nvt .1 0\nvt .1 .1\n\
        vn 0 0 1\ng front\nusemtl red\nf 1/1/1 2/2/1 -2/-1/-1\nusemtl blue\nf 1/1 3/3 4/2 # a comment\n";
    let materials = "newmtl red\nKd 1 0 0\nmap_Kd art.png\nnewmtl blue\nmap_Kd -s 1 1 1 other art.png\n";
    Ok(vec![
        join(&[own.as_bytes(), b"", &texture]),
        join(&[foreign.as_bytes(), materials.as_bytes(), &texture]),
    ])
}
