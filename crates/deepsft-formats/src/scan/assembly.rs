//! The parts of a scan as one template: one mesh, one texture.

use super::atlas::atlas;
use super::baking::baked;
use super::first_tile::first_tile;
use super::surface::Surface;
use super::{Scan, ScanPart, refused};
use crate::error::FormatError;
use deepsft_geometry::{Picture, Template, TemplateError, Topology};

/// What counts as rounding and is not worth a word.
const ROUNDING: f64 = 1e-4;

/// The least that a colour is to count as white: it changes nothing of a texture.
const NEARLY_WHITE: u8 = 250;

/// Area of a face in its texture, texels, below which it is one point of it or a line.
const POINT: f64 = 1e-4;

/// Fraction of the surface that may be such points.
const POINTS: f64 = 0.2;

/// Notes that are told with a refusal, at most.
const TOLD: usize = 4;

/// A template made of a scan, and what its maker should know.
#[derive(Clone, Debug)]
#[non_exhaustive]
pub struct ScannedTemplate {
    /// The template.
    pub template: Template,
    /// Its holes, pieces, charts and seams.
    pub topology: Topology,
    /// Whether its texture was made anew: look at it.
    pub is_baked: bool,
    /// What was put right or is doubtful.
    pub notes: Vec<String>,
}

/// Makes a template of a scan. Its axes become ours, its unit [`Scan::mm_per_unit`] millimetres, its middle the origin.
///
/// Every place of a template's texture is one place of its surface. Where the file's are not (it repeats, mirrors or shares its texture),
/// and where faces have colours without a texture, charts are laid out anew and the colours of the file baked into a new texture.
///
/// # Errors
/// [`FormatError::Scan`] says what keeps it from being a template; [`FormatError::Geometry`].
pub fn assemble_scan(scan: Scan) -> Result<ScannedTemplate, FormatError> {
    let Scan {
        parts,
        textures,
        mm_per_unit,
        mut notes,
    } = scan;
    let parts = colored(parts, &mut notes)?;
    let surface = Surface::of(&parts, mm_per_unit, &mut notes)?;
    drop(parts);
    let as_it_is = match unplain(&surface, &textures) {
        Some(reason) => Err(reason),
        None => match first_tile(&surface, &textures) {
            Err(reason) => Err(reason),
            Ok((placed, moved)) => {
                let (texture, regions) = atlas(&textures)?;
                let in_region = |(at, uv)| {
                    let region = regions[surface.texture_of(at).unwrap_or(0)];
                    region.corner + uv * region.size
                };
                let placed = surface.vertices.iter().zip(placed).map(in_region).collect();
                match Template::of_mesh(surface.mesh(placed)?, texture) {
                    Ok(template) => Ok((template, moved, regions.len())),
                    Err(TemplateError::ChartsOverlap(percent)) => Err(format!(
                        "{percent:.1} % of its texture belongs to several places of its surface"
                    )),
                    Err(error) => return Err(error.into()),
                }
            }
        },
    };
    let is_baked = as_it_is.is_err();
    let template = match as_it_is {
        Ok((template, moved, textures)) => {
            if moved > ROUNDING {
                notes.push(format!(
                    "texture coordinates pass the texture's border by up to {moved:.4} and were moved onto it"
                ));
            }
            if textures > 1 {
                notes.push(format!("{textures} textures were put into one"));
            }
            template
        }
        Err(reason) => {
            let (mesh, texture) = baked(&surface, &textures)?;
            let size = texture.size();
            notes.push(format!(
                "{reason}: it was laid out anew, every place of the surface once, and its colours baked into a texture of {size}"
            ));
            Template::of_mesh(mesh, texture)?
        }
    };
    let topology = Topology::of(template.mesh())?;
    let (edges, pieces) = (topology.non_manifold_edges, topology.pieces);
    if edges > 0 {
        notes.push(format!("{edges} edges belong to more than two faces"));
    }
    if pieces > 1 {
        notes.push(format!("it is in {pieces} pieces, which move apart when they deform"));
    }
    Ok(ScannedTemplate {
        template,
        topology,
        is_baked,
        notes,
    })
}

/// The parts that have faces, and colours from a texture or of their own.
fn colored(parts: Vec<ScanPart>, notes: &mut Vec<String>) -> Result<Vec<ScanPart>, FormatError> {
    let parts = parts.into_iter().filter(|part| !part.faces.is_empty());
    let (colored, bare): (Vec<_>, Vec<_>) =
        parts.partition(|part| part.texture.is_some() || part.colors.len() == part.positions.len());
    let is_of_one_color = {
        let mut colors = colored.iter().flat_map(|part| &part.colors);
        let first = colors.next();
        colored.iter().all(|part| part.texture.is_none()) && colors.all(|color| Some(color) == first)
    };
    let names = |parts: &[ScanPart]| {
        let named = parts.iter().filter(|part| !part.name.is_empty());
        let mut names: Vec<String> = named.map(|part| format!("{:?}", part.name)).collect();
        names.dedup();
        match names.is_empty() {
            true => "a part of it".to_owned(),
            false => format!("its part {}", names.join(", ")),
        }
    };
    let refusal = match (colored.is_empty(), bare.is_empty()) {
        (true, true) => {
            "it has no faces with a place in a texture or a colour: export it as a mesh with texture coordinates"
                .to_owned()
        }
        (true, false) => format!(
            "{} has no texture: give one (on the command line with --texture)",
            names(&bare)
        ),
        (false, _) if is_of_one_color => format!(
            "{} has one colour and no texture, so that nothing on it can be told apart: give a texture (on the command line with --texture)",
            names(&colored)
        ),
        (false, false) => {
            notes.push(format!("what has no texture was left out: {}", names(&bare)));
            return Ok(colored);
        }
        (false, true) => return Ok(colored),
    };
    let more = notes.len().saturating_sub(TOLD);
    notes.truncate(TOLD);
    notes.insert(0, refusal);
    notes.extend((more > 0).then(|| format!("and {more} notes more")));
    refused(notes.join("; "))
}

/// Why the texture coordinates of the file cannot be a template's, of what is seen before they are placed.
fn unplain(surface: &Surface, textures: &[Picture]) -> Option<String> {
    if (surface.vertices.iter()).any(|at| surface.texture_of(at).is_none()) {
        return Some("parts of it have colours without a texture".to_owned());
    }
    if (surface.vertices.iter()).any(|at| at.color.iter().any(|&part| part < NEARLY_WHITE)) {
        return Some("its textures are coloured by its materials or vertices".to_owned());
    }
    let (mut whole, mut points) = (0.0, 0.0);
    for face in 0..surface.faces.len() {
        let texture = surface
            .texture_of(&surface.corners(face)[0])
            .and_then(|number| textures.get(number));
        let texels = surface.texture_area(face) * texture.map_or(1, |texture| texture.size().area()) as f64 / 2.0;
        let area = surface.normal(face).length();
        whole += area;
        points += if texels.abs() > POINT { 0.0 } else { area };
    }
    let percent = 100.0 * points / whole;
    (points > POINTS * whole)
        .then(|| format!("{percent:.0} % of it are points or lines in its texture, as of a palette"))
}
