//! `deepsft poster`: the A4 poster as a template and as a page to print.

use crate::output::atomic;
use anyhow::Result;
use clap::Args;
use deepsft::{TEMPLATE_FILE, template_to_files};
use deepsft_geometry::Template;
use deepsft_synth::{POSTER_HEIGHT_MM, POSTER_PRINT_PIXELS_PER_MM, POSTER_WIDTH_MM, poster_a4_pdf, poster_a4_picture};
use std::path::PathBuf;

/// Name of the page to print.
const PDF_FILE: &str = "poster-a4.pdf";

#[derive(Args)]
#[command(after_help = "\
Writes DIR/template.json and DIR/texture.png, a template as `deepsft template new` makes, and
DIR/poster-a4.pdf: print it at 100 % (\"actual size\") and check the 100 mm bar with a ruler.")]
pub struct PosterArguments {
    /// Folder to write; an older template there is replaced
    #[arg(long, value_name = "DIR")]
    out: PathBuf,
}

pub fn run(arguments: &PosterArguments) -> Result<()> {
    atomic::check_folder(&arguments.out, &[TEMPLATE_FILE])?;
    let template = Template::thin_shell(poster_a4_picture()?, POSTER_WIDTH_MM, POSTER_HEIGHT_MM)?;
    let mut files = template_to_files(&template)?;
    files.insert(PDF_FILE.to_owned(), poster_a4_pdf(POSTER_PRINT_PIXELS_PER_MM)?);
    atomic::write_folder(&arguments.out, &[TEMPLATE_FILE], &files)?;
    println!("poster to print and template: {}", arguments.out.display());
    Ok(())
}
