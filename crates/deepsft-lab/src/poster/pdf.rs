//! The printable sheet: one A4 landscape page that shows the drawing at exactly 100 %.

use anyhow::{Context, Result};
use deepsft_geometry::Picture;
use image::codecs::png::{CompressionType, FilterType, PngEncoder};
use image::{ExtendedColorType, ImageEncoder};
use pdf_writer::types::Predictor;
use pdf_writer::{Content, Filter, Name, Pdf, Rect, Ref, TextStr};

/// PDF user units (1/72 inch) in a millimetre.
const POINTS_PER_MM: f64 = 72.0 / 25.4;

/// A page of `size_mm` (width, height) that `picture` covers, with the request to print it unscaled.
pub(super) fn page(picture: &Picture, size_mm: [f64; 2]) -> Result<Vec<u8>> {
    let [catalog, pages, page, artwork, content, information] = [1, 2, 3, 4, 5, 6].map(Ref::new);
    let name = Name(b"Poster");
    let [width, height] = size_mm.map(|side| (side * POINTS_PER_MM) as f32);
    let [columns, rows] = [picture.width(), picture.height()].map(|side| i32::try_from(side).unwrap_or(i32::MAX));

    let mut pdf = Pdf::new();
    {
        let mut catalog = pdf.catalog(catalog);
        catalog.pages(pages);
        catalog.viewer_preferences().pair(Name(b"PrintScaling"), Name(b"None"));
    }
    pdf.document_info(information).title(TextStr("deepsft poster A4"));
    pdf.pages(pages).kids([page]).count(1);
    {
        let mut page = pdf.page(page);
        page.media_box(Rect::new(0.0, 0.0, width, height))
            .parent(pages)
            .contents(content);
        page.resources().x_objects().pair(name, artwork);
    }
    let samples = deflated_rows(picture)?;
    {
        let mut image = pdf.image_xobject(artwork, &samples);
        image.filter(Filter::FlateDecode);
        image
            .decode_parms()
            .predictor(Predictor::PngOptimum)
            .colors(3)
            .bits_per_component(8)
            .columns(columns);
        image.width(columns).height(rows).bits_per_component(8);
        image.color_space().device_rgb();
    }
    let mut drawing = Content::new();
    drawing.save_state();
    drawing.transform([width, 0.0, 0.0, height, 0.0, 0.0]);
    drawing.x_object(name);
    drawing.restore_state();
    pdf.stream(content, &drawing.finish());
    Ok(pdf.finish())
}

/// The pixels as a zlib stream of rows with PNG predictors: PDF's Flate filter and PNG's image chunks
/// hold the same bytes.
fn deflated_rows(picture: &Picture) -> Result<Vec<u8>> {
    let [width, height] = [picture.width(), picture.height()].map(|side| u32::try_from(side).unwrap_or(u32::MAX));
    let mut png = Vec::new();
    PngEncoder::new_with_quality(&mut png, CompressionType::Best, FilterType::Adaptive)
        .write_image(picture.rgb(), width, height, ExtendedColorType::Rgb8)
        .context("the poster cannot be packed")?;
    let mut samples = Vec::with_capacity(png.len());
    // After the signature of 8 bytes, each chunk is: length, kind, that many bytes, checksum.
    let mut rest = png.get(8..).unwrap_or_default();
    while let Some((head, body)) = rest.split_first_chunk::<8>() {
        let [a, b, c, d, kind @ ..] = *head;
        let length = u32::from_be_bytes([a, b, c, d]) as usize;
        if &kind == b"IDAT" {
            samples.extend_from_slice(body.get(..length).unwrap_or_default());
        }
        rest = body.get(length + 4..).unwrap_or_default();
    }
    Ok(samples)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn png_chunk(kind: &[u8; 4], body: &[u8]) -> Vec<u8> {
        let checked = [kind.as_slice(), body].concat();
        let checksum = !checked.iter().fold(u32::MAX, |crc, &byte| {
            (0..8).fold(crc ^ u32::from(byte), |crc, _| {
                (crc >> 1) ^ (0xedb8_8320 & (crc & 1).wrapping_neg())
            })
        });
        [
            &(body.len() as u32).to_be_bytes(),
            checked.as_slice(),
            &checksum.to_be_bytes(),
        ]
        .concat()
    }

    #[test]
    fn the_embedded_rows_decode_to_the_picture() {
        let picture = Picture::from_fn(37, 23, |x, y| [(7 * x) as u8, (11 * y) as u8, (x * y) as u8]);
        let samples = deflated_rows(&picture).unwrap();
        let header = [&37u32.to_be_bytes()[..], &23u32.to_be_bytes()[..], &[8, 2, 0, 0, 0]].concat();
        let png = [
            b"\x89PNG\r\n\x1a\n".to_vec(),
            png_chunk(b"IHDR", &header),
            png_chunk(b"IDAT", &samples),
            png_chunk(b"IEND", &[]),
        ]
        .concat();
        assert_eq!(image::load_from_memory(&png).unwrap().to_rgb8().as_raw(), picture.rgb());
    }

    #[test]
    fn the_page_is_a4_landscape_and_the_picture_covers_it_at_full_scale() {
        let pdf = page(&Picture::from_fn(2, 2, |_, _| [0; 3]), [297.0, 210.0]).unwrap();
        let text = String::from_utf8_lossy(&pdf);
        let numbers = |from: &str, to: &str| -> Vec<f64> {
            let start = text.find(from).unwrap() + from.len();
            let end = start + text[start..].find(to).unwrap();
            text[start..end]
                .split_whitespace()
                .map(|word| word.parse().unwrap())
                .collect()
        };
        // 297 mm and 210 mm in units of 1/72 inch; a thousandth of one is 0.4 micrometres.
        let expected = [841.8898, 595.2756];
        let media_box = numbers("/MediaBox [", "]");
        let matrix = numbers("q\n", " cm");
        for (actual, expected) in [media_box[2], media_box[3], matrix[0], matrix[3]]
            .into_iter()
            .zip(expected.into_iter().cycle())
        {
            assert!((actual - expected).abs() < 1e-3, "{actual} is not {expected}");
        }
        assert_eq!(
            [media_box[0], media_box[1], matrix[1], matrix[2], matrix[4], matrix[5]],
            [0.0; 6]
        );
        assert!(text.contains("/Count 1") && text.contains("/PrintScaling /None"));
    }
}
