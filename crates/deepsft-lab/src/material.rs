//! `deepsft-lab poster` and `deepsft-lab toy`: the templates that we made ourselves, written as folders.

use crate::poster::{POSTER_HEIGHT_MM, POSTER_PRINT_PIXELS_PER_MM, POSTER_WIDTH_MM, poster_a4_pdf, poster_a4_picture};
use crate::toy::toy_template;
use anyhow::Result;
use clap::Args;
use deepsft::template_to_files;
use deepsft_cli::output::turntable;
use deepsft_formats::{FolderKind, check_folder, write_folder};
use deepsft_geometry::Template;
use std::path::PathBuf;

/// Name of the page to print.
const PDF_FILE: &str = "poster-a4.pdf";

#[derive(Args)]
#[command(after_help = "\
The command writes DIR/template.json and DIR/texture.png, a template as `deepsft template new` makes, and
DIR/poster-a4.pdf. Print the page at 100 % (\"actual size\") and check the 100 mm bar with a ruler.")]
pub struct PosterArguments {
    /// Folder to write; an older template there is replaced
    #[arg(long, value_name = "DIR")]
    out: PathBuf,
}

#[derive(Args)]
#[command(after_help = "\
Example:
  deepsft-lab toy --out toy
  deepsft synth --template toy --count 100 --seed 7 --out toy-data

The command writes DIR/template.json, DIR/mesh.obj, DIR/texture.png and DIR/views.png, a picture of the toy from six
sides.")]
pub struct ToyArguments {
    /// Folder to write; an older template there is replaced
    #[arg(long, value_name = "DIR")]
    out: PathBuf,
}

pub fn write_poster(arguments: &PosterArguments) -> Result<()> {
    check_folder(&arguments.out, &FolderKind::TEMPLATE)?;
    let template = Template::thin_shell(poster_a4_picture()?, POSTER_WIDTH_MM, POSTER_HEIGHT_MM)?;
    let mut files = template_to_files(&template)?;
    files.insert(PDF_FILE.to_owned(), poster_a4_pdf(POSTER_PRINT_PIXELS_PER_MM)?);
    write_folder(&arguments.out, &FolderKind::TEMPLATE, &files)?;
    println!("poster to print and template: {}", arguments.out.display());
    Ok(())
}

pub fn write_toy(arguments: &ToyArguments) -> Result<()> {
    check_folder(&arguments.out, &FolderKind::TEMPLATE)?;
    turntable::write_template(&arguments.out, &toy_template()?)
}
