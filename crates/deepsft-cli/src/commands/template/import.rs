//! `deepsft template import`: a template out of a scan.

use crate::failure::BlameInput;
use crate::numbers::positive;
use crate::output::turntable;
use anyhow::Result;
use clap::Args;
use deepsft::template_to_files;
use deepsft_formats::{
    FolderKind, ScannedTemplate, TEXTURE_FILE, assemble_scan, check_folder, read_scan_file, write_folder,
};
use deepsft_geometry::glam::DVec3;
use deepsft_geometry::{UnrolledSheet, unroll};
use std::path::{Path, PathBuf};

/// Longest sides outside of these, mm, are probably in another unit.
const LIKELY_MM: [f64; 2] = [20.0, 2000.0];

pub const AFTER_HELP: &str = "\
The command reads Wavefront OBJ with its MTL and textures, PLY with a texture or with colours of its vertices, and glTF 2.0
(.glb, or .gltf with its files). It cuts polygons into triangles and puts the textures of several materials into one. Where
textures repeat, mirror or lie on several places of the surface, and where parts have colours without a texture, it lays the
surface out anew and bakes the colours into a new texture: look at DIR/texture.png. What has neither texture nor colour, crumbs
beside the object and broken faces are left out, turned faces are turned back, and a texture whose path is of another disk is
taken from beside the scan, as is the one picture there where the scan names none: notes tell. The object should stand upright (y up) and look at the viewer (+z).

Examples:
  deepsft template import shoe.glb --out shoe
  deepsft template import bent-poster.glb --sheet --out poster
  deepsft template import mug.obj --scale 10 --texture mug.jpg --out mug      # the file counts in centimetres

The command writes DIR/template.json, DIR/mesh.obj, DIR/texture.png and DIR/views.png. Check in that picture that the texture
sits where it should. With --sheet it writes DIR/template.json and DIR/texture.png, the flat picture. Next: deepsft reconstruct --template DIR photo.jpg --out RESULTS";

#[derive(Args)]
pub struct ImportArguments {
    /// The scan: .obj, .ply, .glb or .gltf
    #[arg(value_name = "SCAN")]
    scan: PathBuf,
    /// Folder to write; an older template there is replaced
    #[arg(long, value_name = "DIR")]
    out: PathBuf,
    /// Millimetres of the file's unit [default: 1 for OBJ and PLY, which do not say, 1000 for glTF, which counts in metres]
    #[arg(long, value_name = "MM", value_parser = positive)]
    scale: Option<f64>,
    /// Texture (PNG, JPEG, WebP, ...) of the whole object, in place of those the file names
    #[arg(long, value_name = "FILE")]
    texture: Option<PathBuf>,
    /// Lay the scan of a bent sheet, label or plate flat, and write the template of that sheet: it is found without training. Of a sheet
    /// scanned from both sides the printed one is taken
    #[arg(long)]
    sheet: bool,
}

pub fn run(arguments: &ImportArguments) -> Result<()> {
    check_folder(&arguments.out, &FolderKind::TEMPLATE)?;
    let read = || {
        let mut scan = read_scan_file(&arguments.scan, arguments.texture.as_deref())?;
        scan.mm_per_unit = arguments.scale.unwrap_or(scan.mm_per_unit);
        assemble_scan(scan)
    };
    let ScannedTemplate {
        template,
        topology,
        is_baked,
        notes,
        ..
    } = read().blame("scan", &arguments.scan)?;
    for note in notes.iter().chain(size_warning(template.extent_mm()).as_ref()) {
        eprintln!("note: {note}");
    }
    if is_baked {
        eprintln!(
            "note: look at what was baked: {}",
            arguments.out.join(TEXTURE_FILE).display()
        );
    }
    let shape = match topology.genus() {
        Some(0) => "closed, without holes through it".to_owned(),
        Some(genus) => format!("closed, with {genus} holes through it"),
        None => format!(
            "open or in pieces: {} border edges, {} pieces",
            topology.border_edges, topology.pieces
        ),
    };
    println!(
        "{} charts, {} seam edges; {shape}",
        topology.charts, topology.seam_edges
    );
    if arguments.sheet {
        return write_sheet(&arguments.out, &unroll(&template).blame("scan", &arguments.scan)?);
    }
    turntable::write_template(&arguments.out, &template)
}

fn write_sheet(out: &Path, sheet: &UnrolledSheet) -> Result<()> {
    let UnrolledSheet {
        template,
        stretch,
        back_mm,
    } = sheet;
    if let Some(mm) = back_mm {
        eprintln!(
            "note: it has two sides, {mm:.1} mm apart: the one with more on it was taken, and the other left out"
        );
    }
    write_folder(out, &FolderKind::TEMPLATE, &template_to_files(template)?)?;
    let (size, pixels, percent) = (template.size_mm(), template.texture().size(), 100.0 * stretch);
    println!(
        "flat sheet of {:.1} x {:.1} mm with {pixels} pixels, laid flat with {percent:.1} % of stretching: {}",
        size.x,
        size.y,
        out.display()
    );
    Ok(())
}

fn size_warning(extent: DVec3) -> Option<String> {
    let longest = extent.max_element();
    let [least, most] = LIKELY_MM;
    (longest < least || longest > most)
        .then(|| format!(
            "its longest side is {longest:.1} mm: is --scale (millimetres of the file's unit) right? 10 is for centimetres, 1000 for metres"
        ))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_size_in_another_unit_is_doubted() {
        assert!(size_warning(DVec3::new(0.2, 0.3, 0.1)).unwrap().contains("0.3 mm"));
        assert!(size_warning(DVec3::new(200.0, 300.0, 100.0)).is_none());
    }
}
