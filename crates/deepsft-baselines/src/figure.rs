//! The picture of some frames: the image, and the depth error of each method.

use ab_glyph::{Font, FontRef, PxScale, ScaleFont, point};
use anyhow::Result;
use deepsft_formats::{encode_png, write_file};
use deepsft_geometry::{ImageSize, Maps, Picture};
use deepsft_synth::Sample;
use std::path::Path;

/// The font of the program `deepsft`.
const FONT: &[u8] = include_bytes!("../../deepsft-cli/fonts/Inter-Regular.ttf");

/// Depth error of the brightest colour, mm.
pub const SCALE_MM: f64 = 20.0;

/// Colours of errors from 0 to the scale: inferno of matplotlib, every quarter.
const INFERNO: [[f64; 3]; 5] = [
    [0.0, 0.0, 4.0],
    [87.0, 16.0, 110.0],
    [188.0, 55.0, 84.0],
    [249.0, 142.0, 9.0],
    [252.0, 255.0, 164.0],
];

const PAPER: [u8; 3] = [24, 24, 28];
const OUTSIDE: [u8; 3] = [60, 62, 70];
const INK: [u8; 3] = [236, 236, 236];

/// Between panels, the height of a line and of its letters, pixels.
const GAP: usize = 6;
const LINE: usize = 20;
const LETTERS_PX: f32 = 15.0;

/// A panel: the line above it, and its picture.
pub type Panel = (String, Picture);

/// The image of a sample.
pub fn image(sample: &Sample) -> Panel {
    ("image".to_owned(), sample.image.halved())
}

/// The depth error of `answer` where it and the truth see the object, black for none, with its RMSE in the title.
pub fn depth_error(label: &str, answer: Option<&Maps>, truth: &Maps, rmse_mm: Option<f64>) -> Panel {
    let ImageSize { width, height } = truth.size();
    let color = |x: usize, y: usize| {
        let pixel = y * width + x;
        let answered = answer.filter(|answer| answer.inside(pixel) && truth.inside(pixel));
        answered.map_or(if truth.inside(pixel) { OUTSIDE } else { PAPER }, |answer| {
            error_color(f64::from((answer.depth()[pixel] - truth.depth()[pixel]).abs()) / SCALE_MM)
        })
    };
    let title = rmse_mm.map_or_else(|| format!("{label}: none"), |rmse| format!("{label}: {rmse:.1} mm"));
    (title, Picture::from_fn(width, height, color).halved())
}

fn error_color(fraction: f64) -> [u8; 3] {
    let at = fraction.clamp(0.0, 1.0) * (INFERNO.len() - 1) as f64;
    let first = (at as usize).min(INFERNO.len() - 2);
    let between = at - first as f64;
    std::array::from_fn(|k| (INFERNO[first][k] * (1.0 - between) + INFERNO[first + 1][k] * between + 0.5) as u8)
}

/// Writes figure.png, the rows of panels as one picture, into `folder`. Fails when it cannot be written.
pub fn write(folder: &Path, rows: &[Vec<Panel>]) -> Result<()> {
    Ok(write_file(&folder.join("figure.png"), &encode_png(&sheet(rows)?)?)?)
}

fn sheet(rows: &[Vec<Panel>]) -> Result<Picture> {
    let first = rows.iter().flatten().next();
    let (width, height) = first.map_or((1, 1), |(_, picture)| (picture.width(), picture.height()));
    let columns = rows.iter().map(Vec::len).max().unwrap_or(0);
    let (step_x, step_y) = (width + GAP, height + LINE + GAP);
    let (all_width, all_height) = (columns * step_x + GAP, rows.len() * step_y + GAP);
    let mut rgb: Vec<u8> = PAPER.repeat(all_width * all_height);
    let font = FontRef::try_from_slice(FONT)?;
    for (row, panels) in rows.iter().enumerate() {
        for (column, (title, picture)) in panels.iter().enumerate() {
            let (left, top) = (GAP + column * step_x, GAP + row * step_y);
            let mut set = |x: usize, y: usize, color: [u8; 3]| {
                rgb[3 * (y * all_width + x)..][..3].copy_from_slice(&color);
            };
            letter(&font, title, width, |x, y, color| set(left + x, top + y, color));
            for y in 0..height {
                (0..width).for_each(|x| set(left + x, top + LINE + y, picture.pixel(x, y)));
            }
        }
    }
    Ok(Picture::new(all_width, all_height, rgb)?)
}

/// Writes a line of at most `width` pixels: what is longer is cut.
fn letter(font: &FontRef<'_>, text: &str, width: usize, mut set: impl FnMut(usize, usize, [u8; 3])) {
    let scale = PxScale::from(LETTERS_PX);
    let mut x = 0.0;
    for character in text.chars() {
        let id = font.glyph_id(character);
        let glyph = id.with_scale_and_position(scale, point(x, LETTERS_PX));
        x += font.as_scaled(scale).h_advance(id);
        let Some(outline) = font.outline_glyph(glyph) else {
            continue;
        };
        let corner = outline.px_bounds().min;
        outline.draw(|column, row, covered| {
            let (column, row) = (corner.x as usize + column as usize, corner.y as usize + row as usize);
            if column < width && row < LINE {
                let mixed = |k: usize| f32::from(PAPER[k]) * (1.0 - covered) + f32::from(INK[k]) * covered;
                set(column, row, std::array::from_fn(|k| mixed(k) as u8));
            }
        });
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn no_error_is_black_the_scale_is_the_last_colour_and_what_is_not_answered_is_grey() {
        let mut truth = Maps::empty((4, 2));
        (0..6).for_each(|pixel| truth.set(pixel, 500.0, [0.5; 2]));
        let mut answer = truth.clone();
        for pixel in [0, 1, 4, 5] {
            answer.set(pixel, 550.0, [0.5; 2]);
        }
        (2..4).for_each(|pixel| answer.clear(pixel));
        let (title, picture) = depth_error("CH17", Some(&answer), &truth, Some(50.0));
        assert_eq!(title, "CH17: 50.0 mm");
        assert_eq!(picture.pixel(0, 0), [252, 255, 164]);
        let sheet = sheet(&[vec![(title, picture)]]).unwrap();
        assert_eq!((sheet.width(), sheet.height()), (2 + 2 * GAP, 1 + LINE + 2 * GAP));
        assert_eq!(sheet.pixel(GAP, GAP + LINE), [252, 255, 164]);
        assert_eq!(error_color(0.0), [0, 0, 4]);
    }
}
