//! The parts of a scan as one template: one mesh, one texture.

use super::atlas::atlas;
use super::mending::{Mended, mended};
use super::{Scan, ScanPart, refused};
use crate::error::FormatError;
use deepsft_geometry::glam::{DVec2, DVec3};
use deepsft_geometry::{DisjointSets, Template, TemplateError, Topology, TriangleMesh};
use std::collections::HashMap;

/// How far texture coordinates may pass the border of a texture and be moved onto it, texels; but no less and no more
/// than these fractions of the texture. Programs place charts up to the border and round.
const BORDER_TEXELS: f64 = 2.0;
const BORDER_FRACTIONS: [f64; 2] = [0.002, 0.01];

/// What counts as rounding and is not worth a word.
const ROUNDING: f64 = 1e-4;

/// A template made of a scan, and what its maker should know.
#[derive(Clone, Debug)]
#[non_exhaustive]
pub struct ScannedTemplate {
    /// The template.
    pub template: Template,
    /// Its holes, pieces, charts and seams.
    pub topology: Topology,
    /// What was put right or is doubtful.
    pub notes: Vec<String>,
}

/// Makes a template of a scan. Its axes become ours, its unit [`Scan::mm_per_unit`] millimetres, its middle the origin.
///
/// # Errors
/// [`FormatError::Scan`] says what keeps it from being a template; [`FormatError::Geometry`].
pub fn assemble_scan(scan: Scan) -> Result<ScannedTemplate, FormatError> {
    let Scan {
        mut parts,
        textures,
        mm_per_unit,
        mut notes,
    } = scan;
    parts.retain(|part| !part.faces.is_empty());
    if parts.is_empty() {
        notes.insert(0, "it has no faces with a place in a texture".to_owned());
        return refused(notes.join("; "));
    }
    let (textured, bare): (Vec<_>, Vec<_>) = parts.into_iter().partition(|part| part.texture.is_some());
    let names = bare
        .iter()
        .map(|part| format!("{:?}", part.name))
        .collect::<Vec<_>>()
        .join(", ");
    parts = textured;
    if parts.is_empty() {
        notes.insert(
            0,
            format!("its part {names} names no texture: give one (on the command line with --texture)"),
        );
        return refused(notes.join("; "));
    }
    if !bare.is_empty() {
        notes.push(format!("what has no texture was left out: its part {names}"));
    }
    let mut broken = 0;
    for part in &mut parts {
        let is_finite = |i: usize| part.positions[i].is_finite() && part.texture_coordinates[i].is_finite();
        let all = part.faces.len();
        part.faces.retain(|face| face.iter().all(|&i| is_finite(i)));
        broken += all - part.faces.len();
    }
    if broken > 0 {
        notes.push(format!(
            "{broken} faces have vertices that are no finite numbers and were left out"
        ));
    }
    for part in &mut parts {
        let texture = part.texture.and_then(|number| textures.get(number));
        let texels = texture.map_or(DVec2::ONE, |texture| texture.size().as_dvec2());
        let moved = into_first_tile(part, texels)?;
        if moved > ROUNDING {
            notes.push(format!(
                "texture coordinates of the part {:?} pass the texture's border by up to {moved:.4} and were moved onto it",
                part.name
            ));
        }
    }
    let (texture, regions) = atlas(textures)?;
    if regions.len() > 1 {
        notes.push(format!("{} textures were put into one", regions.len()));
    }
    let mut welder = Welder::default();
    for part in &parts {
        let region = regions[part.texture.unwrap_or(0)];
        let vertex = |i: usize| {
            // y up and the viewer on the +z side become y down and the viewer on the -z side.
            let p = part.positions[i] * DVec3::new(1.0, -1.0, -1.0) * mm_per_unit;
            (p, region.corner + part.texture_coordinates[i] * region.size)
        };
        part.faces.iter().for_each(|face| welder.add(face.map(vertex)));
    }
    if welder.faces.is_empty() {
        return refused("none of its faces has an area");
    }
    if welder.dropped > 0 {
        notes.push(format!("{} faces without area were left out", welder.dropped));
    }
    let Mended { faces, turned, crumbs } = mended(&welder.vertices, &welder.faces);
    if turned > 0 {
        notes.push(format!(
            "{turned} faces had their fronts on the other side than those around them and were turned"
        ));
    }
    if crumbs > 0 {
        notes.push(format!("{crumbs} small pieces beside it were left out"));
    }
    // Without the vertices of crumbs.
    let mut kept = Welder::default();
    faces.iter().for_each(|face| kept.add(face.map(|v| welder.vertices[v])));
    let Welder { vertices, faces, .. } = kept;
    let (low, high) = (vertices.iter()).fold((DVec3::INFINITY, DVec3::NEG_INFINITY), |(low, high), (p, _)| {
        (low.min(*p), high.max(*p))
    });
    let middle = (low + high) / 2.0;
    let (vertices, uv): (Vec<DVec3>, Vec<DVec2>) = vertices.iter().map(|(p, uv)| (*p - middle, *uv)).unzip();
    let mut mesh = TriangleMesh::new(vertices, uv, faces)?;
    let topology = match Topology::of(&mesh) {
        Err(error @ TemplateError::FaceOrientation { .. }) => {
            return refused(format!(
                "{error}: let the program that made it turn all normals outside"
            ));
        }
        topology => topology?,
    };
    let volume = |[a, b, c]: [DVec3; 3]| a.dot(b.cross(c));
    let volumes = mesh.faces().iter().map(|face| volume(face.map(|v| mesh.vertices()[v])));
    if topology.border_edges == 0 && volumes.sum::<f64>() < 0.0 {
        let faces = mesh.faces().iter().map(|&[a, b, c]| [a, c, b]).collect();
        mesh = TriangleMesh::new(mesh.vertices().to_vec(), mesh.texture_coordinates().to_vec(), faces)?;
        notes.push("the fronts of its faces were inside and have been turned outside".to_owned());
    }
    let (edges, pieces) = (topology.non_manifold_edges, topology.pieces);
    if edges > 0 {
        notes.push(format!("{edges} edges belong to more than two faces"));
    }
    if pieces > 1 {
        notes.push(format!("it is in {pieces} pieces, which move apart when they deform"));
    }
    Ok(ScannedTemplate {
        template: Template::of_mesh(mesh, texture)?,
        topology,
        notes,
    })
}

/// Moves each chart of a part by whole tiles into the unit square, and what passes its border by a hair onto it. Gives the
/// longest way of the latter. `texels`: size of the texture.
fn into_first_tile(part: &mut ScanPart, texels: DVec2) -> Result<f64, FormatError> {
    let [least, most] = BORDER_FRACTIONS.map(DVec2::splat);
    let hair = (BORDER_TEXELS / texels).clamp(least, most);
    let mut moved: f64 = 0.0;
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
        let fits = |tile: DVec2| (low - tile).cmpge(-hair) & (high - tile).cmple(DVec2::ONE + hair);
        // Its own tile, or the next where it begins a hair before that.
        let tile = DVec2::select(fits(low.floor()), low.floor(), (low + hair).floor());
        if !fits(tile).all() {
            return refused(format!(
                "the texture of its part {:?} is repeated (u from {:.3} to {:.3}, v from {:.3} to {:.3}), and every place of \
                 a texture must be one place of the surface: in the program that made it, unwrap the part again into one \
                 tile (u and v from 0 to 1) and bake its texture",
                part.name,
                low.x,
                high.x,
                1.0 - high.y,
                1.0 - low.y
            ));
        }
        let uv = part.texture_coordinates[vertex] - tile;
        let inside = uv.clamp(DVec2::ZERO, DVec2::ONE);
        moved = moved.max((uv - inside).abs().max_element());
        part.texture_coordinates[vertex] = inside;
    }
    Ok(moved)
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
