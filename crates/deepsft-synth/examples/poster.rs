//! Writes the A4 poster as a template (`template/texture.png`, `template/template.json`) and as a
//! printable sheet (`poster.pdf`) into the folder given on the command line.
//!
//! ```text
//! cargo run --release -p deepsft-synth --example poster -- models/poster-a4
//! ```

use deepsft_synth::{POSTER_HEIGHT_MM, POSTER_PRINT_PIXELS_PER_MM, POSTER_WIDTH_MM, poster_a4_pdf, poster_a4_picture};
use image::codecs::png::{CompressionType, FilterType, PngEncoder};
use image::{ExtendedColorType, ImageEncoder};
use std::fs;
use std::path::PathBuf;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let folder = PathBuf::from(std::env::args().nth(1).ok_or("usage: poster FOLDER")?);
    let template = folder.join("template");
    fs::create_dir_all(&template)?;

    let picture = poster_a4_picture()?;
    let mut png = Vec::new();
    PngEncoder::new_with_quality(&mut png, CompressionType::Best, FilterType::Adaptive).write_image(
        picture.rgb(),
        picture.width().try_into()?,
        picture.height().try_into()?,
        ExtendedColorType::Rgb8,
    )?;
    fs::write(template.join("texture.png"), png)?;
    let description = format!(
        "{{\n  \"format_version\": 1,\n  \"kind\": \"thin-shell\",\n  \"width_mm\": {POSTER_WIDTH_MM},\n  \
         \"height_mm\": {POSTER_HEIGHT_MM},\n  \"texture\": \"texture.png\"\n}}\n"
    );
    fs::write(template.join("template.json"), description)?;
    fs::write(folder.join("poster.pdf"), poster_a4_pdf(POSTER_PRINT_PIXELS_PER_MM)?)?;
    Ok(())
}
