//! The A4 poster: a harbour between day and night, drawn by code, the first template of the project.
//!
//! It is made to be registered: every place looks unlike every other, from the layout of the whole
//! sheet (readable 125 pixels wide) down to strokes of half a millimetre, and luminance carries all of
//! it. Nothing is random at run time: each element throws dice with a seed of its own.

pub(crate) mod canvas;
mod foliage;
mod inks;
mod land;
mod lettering;
mod night;
mod ornament;
mod pdf;
mod sea;
mod sky;
mod town;

use anyhow::{Context, Result, ensure};
use canvas::{Canvas, Shape};
use deepsft_geometry::Picture;
use lettering::Lettering;

/// Width of the poster in mm: A4 landscape.
pub const POSTER_WIDTH_MM: f64 = 297.0;

/// Height of the poster in mm.
pub const POSTER_HEIGHT_MM: f64 = 210.0;

/// White margin around the artwork in mm, as wide as office printers need; it holds the scale bar.
pub const POSTER_MARGIN_MM: f64 = 6.0;

/// Resolution of the poster as a template: strokes of 0.25 mm stay visible, and the closest view of the
/// training poses (250 mm, about 1.5 pixels a millimetre) is oversampled three times.
pub const POSTER_TEXTURE_PIXELS_PER_MM: f64 = 5.0;

/// Resolution of the printed poster: 305 dots an inch.
pub const POSTER_PRINT_PIXELS_PER_MM: f64 = 12.0;

/// The poster as a template's texture: 1485 x 1050 pixels, margins and scale bar included.
///
/// # Errors
/// When memory does not suffice.
pub fn poster_a4_picture() -> Result<Picture> {
    poster_a4_picture_at(POSTER_TEXTURE_PIXELS_PER_MM)
}

/// The same drawing at another resolution, from 0.5 to 24 pixels a millimetre.
///
/// # Errors
/// Outside that range or when memory does not suffice.
pub fn poster_a4_picture_at(pixels_per_mm: f64) -> Result<Picture> {
    ensure!(
        (0.5..=24.0).contains(&pixels_per_mm),
        "the poster at {pixels_per_mm} pixels per mm, expected 0.5 to 24"
    );
    let [width, height] = [POSTER_WIDTH_MM, POSTER_HEIGHT_MM].map(|side| (side * pixels_per_mm).round() as u32);
    let mut canvas = Canvas::new(width, height, pixels_per_mm as f32)
        .with_context(|| format!("no memory for {width} x {height} pixels"))?;
    let margin = POSTER_MARGIN_MM as f32;
    let [art_width, art_height] = [POSTER_WIDTH_MM, POSTER_HEIGHT_MM].map(|side| side as f32 - 2.0 * margin);
    canvas.clipped(&Shape::rectangle(margin, margin, art_width, art_height), |canvas| {
        sky::draw(canvas);
        land::draw(canvas);
        town::draw(canvas);
        sea::draw(canvas);
        foliage::draw(canvas);
    });
    scale_bar(&mut canvas);
    Ok(canvas.into_picture())
}

/// The poster as a PDF of one A4 landscape page at 100 % scale, to be printed without fitting to the
/// page; 12 pixels a millimetre suit a 300 dpi printer.
///
/// # Errors
/// As [`poster_a4_picture_at`].
pub fn poster_a4_pdf(pixels_per_mm: f64) -> Result<Vec<u8>> {
    pdf::page(
        &poster_a4_picture_at(pixels_per_mm)?,
        [POSTER_WIDTH_MM, POSTER_HEIGHT_MM],
    )
}

/// A line of exactly 100 mm in the bottom margin, to check the print with a ruler. It keeps 4.2 mm from
/// the edge of the paper, which laser printers leave blank.
fn scale_bar(canvas: &mut Canvas) {
    const LEFT: f32 = 20.0;
    const LINE: f32 = 205.6;
    canvas.stroke(&Shape::line(&[(LEFT, LINE), (LEFT + 100.0, LINE)]), inks::INK, 0.25);
    for mm in (0..=100).step_by(10) {
        let reach = if mm % 50 == 0 { 1.0 } else { 0.6 };
        let x = LEFT + mm as f32;
        canvas.stroke(&Shape::line(&[(x, LINE - reach), (x, LINE)]), inks::INK, 0.25);
    }
    let caption = Lettering {
        origin: (123.0, 205.75),
        angle: 0.0,
        x_height: 0.85,
        weight: 0.19,
        spacing: 0.45,
    };
    caption.draw(canvas, "100 mm: print at 100 %, landscape A4", &[inks::INK]);
}

#[cfg(test)]
mod tests;
