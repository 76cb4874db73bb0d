//! The parts of a scan as one template: one mesh, one texture.

use super::{Part, Scan};
use anyhow::{Result, bail};
use deepsft_geometry::glam::{DVec2, DVec3};
use deepsft_geometry::{DisjointSets, GeometryError, Picture, Template, Topology, TriangleMesh};
use deepsft_synth::pack_rectangles;
use std::collections::HashMap;

/// Longest side of a template's texture, texels.
const LONGEST_SIDE: usize = 4096;

/// Texels between two textures in the common one; each continues over half of them.
const GAP: usize = 16;

/// How far outside a tile of a repeated texture counts as rounding.
const TILE_ROUNDING: f64 = 1e-4;

/// A template made of a scan, and what its maker should know.
pub struct Import {
    pub template: Template,
    pub topology: Topology,
    /// What was put right or is doubtful.
    pub notes: Vec<String>,
}

/// Makes a template of a scan. Its axes become ours, its unit `mm_per_unit` millimetres, its middle the origin.
pub fn assemble(scan: Scan, mm_per_unit: f64) -> Result<Import> {
    let Scan {
        mut parts, textures, ..
    } = scan;
    parts.retain(|part| !part.faces.is_empty());
    if parts.is_empty() {
        bail!("it has no faces");
    }
    for part in &parts {
        if part.texture.is_none() {
            bail!("its part {:?} names no texture: give one with --texture", part.name);
        }
        let finite = |i: &usize| part.positions[*i].is_finite() && part.texture_coordinates[*i].is_finite();
        if let Some(vertex) = (0..part.positions.len()).find(|i| !finite(i)) {
            bail!("vertex {vertex} of its part {:?} is not a finite number", part.name);
        }
    }
    let mut notes = Vec::new();
    parts.iter_mut().try_for_each(into_first_tile)?;
    let (texture, places) = atlas(textures)?;
    if places.len() > 1 {
        notes.push(format!("{} textures were put into one", places.len()));
    }
    let mut welder = Welder::default();
    for part in &parts {
        let place = places[part.texture.unwrap_or(0)];
        let vertex = |i: usize| {
            // y up and the viewer on the +z side become y down and the viewer on the -z side.
            let p = part.positions[i] * DVec3::new(1.0, -1.0, -1.0) * mm_per_unit;
            (
                p,
                place.corner + part.texture_coordinates[i].clamp(DVec2::ZERO, DVec2::ONE) * place.size,
            )
        };
        part.faces.iter().for_each(|face| welder.add(face.map(vertex)));
    }
    if welder.faces.is_empty() {
        bail!("none of its faces has an area");
    }
    if welder.dropped > 0 {
        notes.push(format!("{} faces without area were left out", welder.dropped));
    }
    let (low, high) = (welder.vertices.iter()).fold((DVec3::INFINITY, DVec3::NEG_INFINITY), |(low, high), (p, _)| {
        (low.min(*p), high.max(*p))
    });
    let middle = (low + high) / 2.0;
    let (vertices, uv): (Vec<DVec3>, Vec<DVec2>) = welder.vertices.iter().map(|(p, uv)| (*p - middle, *uv)).unzip();
    let mut faces = welder.faces;
    let volume = |faces: &[[usize; 3]]| -> f64 {
        faces
            .iter()
            .map(|&[a, b, c]| vertices[a].dot(vertices[b].cross(vertices[c])))
            .sum()
    };
    let mesh = TriangleMesh::new(vertices.clone(), uv.clone(), faces.clone())?;
    let topology = match Topology::of(&mesh) {
        Err(error @ GeometryError::FaceOrientation { .. }) => {
            bail!("{error}: let the program that made it turn all normals outside")
        }
        topology => topology?,
    };
    if topology.border_edges == 0 && volume(&faces) < 0.0 {
        faces.iter_mut().for_each(|face| face.swap(1, 2));
        notes.push("the fronts of its faces were inside and have been turned outside".to_owned());
    }
    let mesh = TriangleMesh::new(vertices, uv, faces)?;
    if topology.non_manifold_edges > 0 {
        notes.push(format!(
            "{} edges belong to more than two faces",
            topology.non_manifold_edges
        ));
    }
    if topology.pieces > 1 {
        notes.push(format!(
            "it is in {} pieces, which move apart when they deform",
            topology.pieces
        ));
    }
    Ok(Import {
        template: Template::of_mesh(mesh, texture)?,
        topology,
        notes,
    })
}

/// Moves each chart of a part by whole tiles into the unit square.
fn into_first_tile(part: &mut Part) -> Result<()> {
    // Copies of a vertex for the sake of normals belong together.
    let mut same: HashMap<[u64; 5], usize> = HashMap::new();
    let mut charts = DisjointSets::new(part.positions.len());
    for (vertex, (p, uv)) in part.positions.iter().zip(&part.texture_coordinates).enumerate() {
        charts.join(vertex, *same.entry(key(*p, *uv)).or_insert(vertex));
    }
    for &[a, b, c] in &part.faces {
        charts.join(a, b);
        charts.join(a, c);
    }
    let mut bounds: HashMap<usize, (DVec2, DVec2)> = HashMap::new();
    for &vertex in part.faces.iter().flatten() {
        let uv = part.texture_coordinates[vertex];
        let (low, high) = bounds.entry(charts.first(vertex)).or_insert((uv, uv));
        (*low, *high) = (low.min(uv), high.max(uv));
    }
    for vertex in 0..part.positions.len() {
        let Some(&(low, high)) = bounds.get(&charts.first(vertex)) else {
            continue;
        };
        let tile = (low + TILE_ROUNDING).floor();
        if (high - tile).max_element() > 1.0 + TILE_ROUNDING {
            bail!(
                "the texture of its part {:?} is repeated (u from {:.3} to {:.3}, v from {:.3} to {:.3}): no place of it \
                 would be one place of the surface",
                part.name,
                low.x,
                high.x,
                1.0 - high.y,
                1.0 - low.y
            );
        }
        part.texture_coordinates[vertex] -= tile;
    }
    Ok(())
}

/// Numbers by which equal vertices are known.
fn key(p: DVec3, uv: DVec2) -> [u64; 5] {
    // Adding 0 makes one of 0 and -0.
    [p.x, p.y, p.z, uv.x, uv.y].map(|number| (number + 0.0).to_bits())
}

/// Vertices that are equal become one; faces without area are left out.
#[derive(Default)]
struct Welder {
    known: HashMap<[u64; 5], usize>,
    vertices: Vec<(DVec3, DVec2)>,
    faces: Vec<[usize; 3]>,
    dropped: usize,
}

impl Welder {
    fn add(&mut self, corners: [(DVec3, DVec2); 3]) {
        let [a, b, c] = corners.map(|(p, _)| p);
        if (b - a).cross(c - a) == DVec3::ZERO {
            self.dropped += 1;
            return;
        }
        let face = corners.map(|(p, uv)| {
            *self.known.entry(key(p, uv)).or_insert_with(|| {
                self.vertices.push((p, uv));
                self.vertices.len() - 1
            })
        });
        self.faces.push(face);
    }
}

/// Where a texture lies in the common one: corner and size, shares of it.
#[derive(Clone, Copy)]
struct Place {
    corner: DVec2,
    size: DVec2,
}

/// All textures in one, and where each lies.
fn atlas(mut textures: Vec<Picture>) -> Result<(Picture, Vec<Place>)> {
    if let [texture] = textures.as_mut_slice() {
        while texture.width().max(texture.height()) > LONGEST_SIDE {
            *texture = texture.halved();
        }
        let whole = Place {
            corner: DVec2::ZERO,
            size: DVec2::ONE,
        };
        return Ok((texture.clone(), vec![whole]));
    }
    loop {
        let sizes: Vec<(usize, usize)> = textures.iter().map(|t| (t.width(), t.height())).collect();
        let area: usize = sizes.iter().map(|(w, h)| (w + GAP) * (h + GAP)).sum();
        let mut width = ((area as f64).sqrt() as usize).max(2 * GAP);
        while width <= LONGEST_SIDE {
            if let Some((corners, height)) = pack_rectangles(&sizes, width, GAP)
                && height <= width
            {
                return Ok(paint_atlas(&textures, &corners, width, height));
            }
            width += width / 16 + 1;
        }
        if textures.iter().all(|t| t.width() == 1 && t.height() == 1) {
            bail!("it has too many textures ({})", textures.len());
        }
        textures.iter_mut().for_each(|texture| *texture = texture.halved());
    }
}

fn paint_atlas(textures: &[Picture], corners: &[(usize, usize)], width: usize, height: usize) -> (Picture, Vec<Place>) {
    let mut rgb = vec![128; 3 * width * height];
    let mut places = Vec::new();
    for (texture, &(left, top)) in textures.iter().zip(corners) {
        // The border's colours go on into the gap, so that filters do not mix two textures.
        for y in top - GAP / 2..top + texture.height() + GAP / 2 {
            for x in left - GAP / 2..left + texture.width() + GAP / 2 {
                let inside = |at: usize, from: usize, size: usize| at.saturating_sub(from).min(size - 1);
                let (i, j) = (inside(x, left, texture.width()), inside(y, top, texture.height()));
                rgb[3 * (y * width + x)..][..3].copy_from_slice(&texture.pixel(i, j));
            }
        }
        let all = DVec2::new(width as f64, height as f64);
        places.push(Place {
            corner: DVec2::new(left as f64, top as f64) / all,
            size: DVec2::new(texture.width() as f64, texture.height() as f64) / all,
        });
    }
    let pixel = |x: usize, y: usize| std::array::from_fn(|k| rgb[3 * (y * width + x) + k]);
    (Picture::from_fn(width, height, pixel), places)
}
