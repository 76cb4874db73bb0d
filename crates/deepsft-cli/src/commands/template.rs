//! `deepsft template`: a template out of a picture and a size, or out of a scan.

mod import;

use crate::failure::BlameInput;
use crate::input;
use crate::numbers::{SizeMm, positive};
use crate::object_choice::warn_of_print;
use crate::output::turntable;
use anyhow::Result;
use clap::{Args, Subcommand};
use deepsft::template_to_files;
use deepsft_formats::{FolderKind, check_folder, write_folder};
use deepsft_geometry::{Picture, Template};
use std::path::PathBuf;

/// Longest side of a texture, pixels: six per millimetre of a sheet 680 mm wide, and more than a 480-pixel
/// image of it can show.
const LONGEST_SIDE: usize = 4096;

/// Fraction by which the sides' ratio of picture and size may differ before a warning.
const RATIO_TOLERANCE: f64 = 0.05;

#[derive(Subcommand)]
pub enum TemplateCommand {
    /// Make the template of a flat object from a picture of it and its size.
    ///
    /// The picture shows the front of the object from edge to edge and nothing else: a scan, the artwork
    /// it was printed from, or a photograph cropped and straightened. It may be PNG, JPEG, WebP, BMP, TIFF or GIF.
    #[command(after_help = "\
Examples: an A4 sheet in landscape, and the label of a tin 84 mm thick
  deepsft template new --image sheet.png --size-mm 297x210 --out sheet
  deepsft template new --image label.png --size-mm 260x105 --around-mm 84 --out tin

The command writes DIR/template.json and DIR/texture.png, of a label DIR/mesh.obj and DIR/views.png too. Next:
deepsft reconstruct --template DIR photo.jpg --out RESULTS")]
    New(NewArguments),
    /// Make the template of an object of any shape from a scan or model of it (OBJ, PLY or glTF with a texture or colours).
    #[command(after_help = import::AFTER_HELP)]
    Import(import::ImportArguments),
}

#[derive(Args)]
pub struct NewArguments {
    /// Picture of the object's front (PNG, JPEG, WebP, ...)
    #[arg(long, value_name = "FILE")]
    image: PathBuf,
    /// Width x height of the object in millimetres, as the picture shows it
    #[arg(long, value_name = "WxH")]
    size_mm: SizeMm,
    /// Diameter of the tin, bottle or tube that the print goes around, mm; a print longer than one turn covers its own end
    #[arg(long, value_name = "MM", value_parser = positive)]
    around_mm: Option<f64>,
    /// Folder to write; an older template there is replaced
    #[arg(long, value_name = "DIR")]
    out: PathBuf,
}

pub fn run(command: &TemplateCommand) -> Result<()> {
    match command {
        TemplateCommand::New(arguments) => new(arguments),
        TemplateCommand::Import(arguments) => import::run(arguments),
    }
}

fn new(arguments: &NewArguments) -> Result<()> {
    check_folder(&arguments.out, &FolderKind::TEMPLATE)?;
    let picture = input::picture(&arguments.image)?;
    let [width, height] = arguments.size_mm.of(&picture);
    if let Some(warning) = stretch_warning(&picture, [width, height]) {
        eprintln!("warning: {warning}");
    }
    let mut texture = picture;
    while texture.width().max(texture.height()) > LONGEST_SIDE {
        texture = texture.halved();
    }
    let size = texture.size();
    if let Some(diameter) = arguments.around_mm {
        let template =
            Template::around_cylinder(texture, [width, height], diameter).blame("image", &arguments.image)?;
        return turntable::write_template(&arguments.out, &template);
    }
    let template = Template::thin_shell(texture, width, height).blame("image", &arguments.image)?;
    warn_of_print(&template);
    write_folder(&arguments.out, &FolderKind::TEMPLATE, &template_to_files(&template)?)?;
    let out = arguments.out.display();
    println!("template of {width} x {height} mm with {size} pixels: {out}");
    Ok(())
}

/// What is wrong where the picture has not the proportions of the object.
fn stretch_warning(picture: &Picture, [width, height]: [f64; 2]) -> Option<String> {
    let pixels = picture.width() as f64 / picture.height() as f64;
    let ratio = pixels / (width / height);
    if ratio.max(1.0 / ratio) <= 1.0 + RATIO_TOLERANCE {
        return None;
    }
    let turned = if (pixels > 1.0) == (width > height) {
        ""
    } else {
        " (are width and height exchanged?)"
    };
    Some(format!(
        "the picture has {} x {} pixels but the object {width} x {height} mm: it will be stretched{turned}",
        picture.width(),
        picture.height(),
    ))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_stretched_picture_is_warned_of() {
        let picture = |width, height| Picture::from_fn(width, height, |_, _| [0; 3]);
        let size = [297.0, 210.0];
        assert_eq!(stretch_warning(&picture(297, 210), size), None);
        assert!(stretch_warning(&picture(210, 297), size).unwrap().contains("exchanged"));
        let stretched = stretch_warning(&picture(400, 210), size).unwrap();
        assert!(stretched.contains("stretched") && !stretched.contains("exchanged"));
    }
}
