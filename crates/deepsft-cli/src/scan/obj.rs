//! Wavefront OBJ with its materials (MTL).

use super::{Part, Scan, texture_beside};
use anyhow::{Context, Result, anyhow, bail};
use deepsft_geometry::Picture;
use deepsft_geometry::glam::{DVec2, DVec3};
use std::cell::RefCell;
use std::fs::File;
use std::io::BufReader;
use std::path::{Path, PathBuf};

/// Reads the triangles and polygons of an OBJ file (polygons as fans), and if asked the textures its materials name.
pub fn read(path: &Path, textures_wanted: bool) -> Result<Scan> {
    // One vertex for each pair of position and texture coordinates; normals are ours.
    let options = tobj::LoadOptions {
        single_index: true,
        triangulate: true,
        ignore_points: true,
        ignore_lines: true,
    };
    let folder = path.parent().unwrap_or(Path::new("."));
    let material_file: RefCell<Option<PathBuf>> = RefCell::default();
    let mut reader = BufReader::new(File::open(path)?);
    let (models, materials) = tobj::load_obj_buf(&mut reader, &options, |name| {
        let place = folder.join(name);
        *material_file.borrow_mut() = Some(place.clone());
        tobj::load_mtl(&place)
    })?;
    let materials = match materials {
        Ok(materials) => materials,
        Err(_) if !textures_wanted => Vec::new(),
        Err(error) => {
            let file = material_file.take().unwrap_or_default();
            bail!("its material file {} cannot be read: {error}", file.display());
        }
    };
    let mut named: Vec<String> = Vec::new();
    let mut textures: Vec<Picture> = Vec::new();
    let mut parts = Vec::new();
    for model in models.into_iter().filter(|model| !model.mesh.indices.is_empty()) {
        let tobj::Model { mesh, name } = model;
        let material = mesh.material_id.and_then(|id| materials.get(id));
        let mut texture = None;
        if let Some(file) = material
            .and_then(|m| m.diffuse_texture.as_deref())
            .filter(|_| textures_wanted)
        {
            // Options may stand before the file's name.
            let file = if folder.join(file.replace('\\', "/")).is_file() {
                file
            } else {
                file.split_ascii_whitespace().last().unwrap_or(file)
            };
            let number = match named.iter().position(|known| known == file) {
                Some(number) => number,
                None => {
                    textures.push(texture_beside(path, file)?);
                    named.push(file.to_owned());
                    named.len() - 1
                }
            };
            texture = Some(number);
        }
        parts.push(part(name, &mesh, texture)?);
    }
    Ok(Scan {
        parts,
        textures,
        mm_per_unit: 1.0,
    })
}

fn part(name: String, mesh: &tobj::Mesh, texture: Option<usize>) -> Result<Part> {
    let positions: Vec<DVec3> = mesh.positions.chunks_exact(3).map(DVec3::from_slice).collect();
    // OBJ's v points up.
    let texture_coordinates: Vec<DVec2> = (mesh.texcoords.chunks_exact(2))
        .map(|uv| DVec2::new(uv[0], 1.0 - uv[1]))
        .collect();
    if texture_coordinates.len() != positions.len() {
        bail!(
            "{} of its part {name:?} have no texture coordinates (vt): a template needs them for all",
            if texture_coordinates.is_empty() {
                "the faces"
            } else {
                "some faces"
            }
        );
    }
    let corners: Vec<usize> = (mesh.indices.iter())
        .map(|&index| usize::try_from(index))
        .collect::<Result<_, _>>()
        .map_err(|_| anyhow!("an index is too large"))
        .with_context(|| format!("part {name:?}"))?;
    Ok(Part {
        name,
        positions,
        texture_coordinates,
        faces: corners.chunks_exact(3).map(|c| [c[0], c[1], c[2]]).collect(),
        texture,
    })
}
