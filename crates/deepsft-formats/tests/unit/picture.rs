//! Pictures that are well made, odd, too large or cut.

use deepsft_formats::{FormatError, decode_as_stored, decode_image, decode_photograph, decode_picture, encode_png};
use deepsft_geometry::Picture;
use image::{DynamicImage, ImageFormat, Rgba};
use std::io::Cursor;

fn encoded(picture: &DynamicImage, format: ImageFormat) -> Vec<u8> {
    let mut bytes = Cursor::new(Vec::new());
    picture.write_to(&mut bytes, format).unwrap();
    bytes.into_inner()
}

/// A PNG file that claims to be `width` x `height` and has no pixels: signature and header chunk.
fn png_header(width: u32, height: u32) -> Vec<u8> {
    let small = encode_png(&Picture::from_fn(1, 1, |_, _| [0; 3])).unwrap();
    let mut header = small[12..29].to_vec();
    header[4..8].copy_from_slice(&width.to_be_bytes());
    header[8..12].copy_from_slice(&height.to_be_bytes());
    let mut bytes = [&small[..12], &header, &small[29..]].concat();
    checked(&mut bytes);
    bytes
}

/// Writes the checksum of a PNG file's header chunk.
fn checked(png: &mut [u8]) {
    let crc = crc(&png[12..29]);
    png[29..33].copy_from_slice(&crc);
}

/// The PNG specification's CRC-32 (reflected polynomial), over a chunk's type and content.
fn crc(chunk: &[u8]) -> [u8; 4] {
    let crc = !chunk.iter().fold(u32::MAX, |crc, &byte| {
        (0..8).fold(crc ^ u32::from(byte), |crc, _| {
            if crc & 1 == 1 { crc >> 1 ^ 0xEDB8_8320 } else { crc >> 1 }
        })
    });
    crc.to_be_bytes()
}

/// A PNG file of 2 x 1 pixels, the colours 0 and 1 of this palette, in one byte each.
fn palette_png(palette: &[u8]) -> Vec<u8> {
    // zlib with one stored block: the row's filter and its pixels, and their Adler-32 (2 and 4 are its sums).
    let pixels = [0x78, 1, 1, 3, 0, 0xFC, 0xFF, 0, 0, 1, 0, 4, 0, 2];
    let mut png = b"\x89PNG\r\n\x1a\n".to_vec();
    let header: &[u8] = &[0, 0, 0, 2, 0, 0, 0, 1, 8, 3, 0, 0, 0];
    for (name, content) in [
        (b"IHDR", header),
        (b"PLTE", palette),
        (b"IDAT", &pixels),
        (b"IEND", &[]),
    ] {
        let chunk = [name.as_slice(), content].concat();
        png.extend((content.len() as u32).to_be_bytes());
        png.extend_from_slice(&chunk);
        png.extend(crc(&chunk));
    }
    png
}

#[test]
fn a_png_comes_back_as_it_was() {
    let picture = Picture::from_fn(5, 3, |x, y| [x as u8 * 40, y as u8 * 80, 7]);
    assert_eq!(decode_picture(&encode_png(&picture).unwrap()).unwrap(), picture);
}

#[test]
fn a_file_of_no_bytes_is_called_empty() {
    let error = decode_picture(&[]).unwrap_err();
    assert_eq!(
        error.to_string(),
        "picture cannot be read: it is empty (0 bytes): copy it again from where it came"
    );
}

#[test]
fn a_picture_of_20000_by_20000_pixels_is_refused_before_it_is_decoded() {
    let refusal = |png: &[u8]| decode_picture(png).unwrap_err().to_string();
    assert_eq!(
        refusal(&png_header(20_000, 20_000)),
        "picture cannot be read: a size of 20000 x 20000 pixels is too large: make it smaller, a side has at most 16384 pixels"
    );
    // 15,000 x 15,000 RGB has short enough sides but 675 million bytes. So has a grey picture of one bit per pixel, whose
    // file and whose decoded bytes are smaller.
    let mut one_bit = png_header(15_000, 15_000);
    one_bit[24..26].copy_from_slice(&[1, 0]);
    checked(&mut one_bit);
    for png in [one_bit, png_header(15_000, 15_000)] {
        assert_eq!(
            refusal(&png),
            "picture cannot be read: a size of 15000 x 15000 pixels is too large: make it smaller, decoded it takes 644 MiB and at most 512 are read"
        );
    }
}

#[test]
fn a_text_and_a_cut_file_are_refused_with_a_reason() {
    let error = decode_picture(b"not a picture at all").unwrap_err();
    assert!(error.to_string().contains("no kind that is read: PNG, JPEG"), "{error}");
    let shaded = Picture::from_fn(64, 64, |x, y| [(x * y) as u8, (3 * x) as u8, (5 * y) as u8]);
    let jpeg = deepsft_formats::encode_jpeg(&shaded, 90).unwrap();
    let whole = decode_picture(&jpeg).unwrap();
    let cut = decode_picture(&jpeg[..6 * jpeg.len() / 10]);
    // Without the feature the decoder fills with grey what is missing.
    assert_eq!(
        cut.is_err_and(|error| error.to_string().contains("cut short")),
        cfg!(feature = "pictures")
    );
    // The end marker alone is missing.
    assert_eq!(decode_picture(&jpeg[..jpeg.len() - 2]).unwrap(), whole);
    let heic = decode_picture(b"\0\0\0\x24ftypheic\0\0\0\0mif1")
        .unwrap_err()
        .to_string();
    assert!(heic.contains("HEIC") && heic.contains("export it as JPEG"), "{heic}");
    let png = encode_png(&Picture::from_fn(64, 64, |x, y| [(x * y) as u8; 3])).unwrap();
    assert!(matches!(
        decode_picture(&png[..png.len() / 2]),
        Err(FormatError::PictureFile { .. })
    ));
}

#[test]
fn a_palette_that_ends_within_a_colour_is_refused_in_words() {
    let picture = decode_picture(&palette_png(&[10, 20, 30, 40, 50, 60])).unwrap();
    assert_eq!([picture.pixel(0, 0), picture.pixel(1, 0)], [[10, 20, 30], [40, 50, 60]]);
    // The decoder itself panics on some of these lengths.
    for length in (4..=800).chain(1..3).filter(|length| length % 3 != 0) {
        let png = palette_png(&vec![7; length]);
        let errors = [
            decode_picture(&png).unwrap_err(),
            decode_image(&png, picture.size()).unwrap_err(),
        ];
        let expected =
            format!("picture cannot be read: its palette has {length} bytes, expected three for each colour");
        assert_eq!(errors.map(|error| error.to_string()), [expected.clone(), expected]);
    }
}

#[test]
fn transparent_parts_become_white_and_half_transparent_ones_are_mixed() {
    let rgba = image::RgbaImage::from_fn(2, 1, |x, _| Rgba([0, 100, 200, if x == 0 { 0 } else { 51 }]));
    let picture = decode_picture(&encoded(&DynamicImage::ImageRgba8(rgba), ImageFormat::Png)).unwrap();
    // 51 / 255 = 1/5: 0.2 c + 0.8 * 255.
    assert_eq!([picture.pixel(0, 0), picture.pixel(1, 0)], [[255; 3], [204, 224, 244]]);
}

#[test]
fn a_jpeg_with_an_exif_orientation_is_turned_upright() {
    // 16 x 8, left half dark; orientation 6: the stored image is to be rotated clockwise by 90
    // degrees, so that its left side comes to the top.
    let stored = image::GrayImage::from_fn(16, 8, |x, _| image::Luma([if x < 8 { 20 } else { 220 }]));
    let jpeg = encoded(&DynamicImage::ImageLuma8(stored), ImageFormat::Jpeg);
    let tiff = [
        b"MM\0*".as_slice(),
        &[0, 0, 0, 8, 0, 1, 0x01, 0x12, 0, 3, 0, 0, 0, 1, 0, 6, 0, 0, 0, 0, 0, 0],
    ];
    let exif = [b"Exif\0\0".as_slice(), &tiff.concat()].concat();
    let length = (exif.len() as u16 + 2).to_be_bytes();
    let turned = [&jpeg[..2], &[0xFF, 0xE1], &length, &exif, &jpeg[2..]].concat();
    let picture = decode_picture(&turned).unwrap();
    assert_eq!((picture.width(), picture.height()), (8, 16));
    assert!(picture.pixel(4, 2)[0] < 40 && picture.pixel(4, 13)[0] > 200);
    assert_eq!(decode_photograph(&turned).unwrap(), (picture, 1));
    let stored = decode_as_stored(&turned).unwrap();
    assert_eq!((stored.width(), stored.height()), (16, 8));
    let half_turn = turned.iter().position(|&byte| byte == 6).unwrap();
    assert_eq!(turned[half_turn - 9..half_turn], tiff.concat()[10..19]);
    let upside_down = [&turned[..half_turn], &[3], &turned[half_turn + 1..]].concat();
    assert_eq!(decode_photograph(&upside_down).unwrap().1, 2);
    assert_eq!(decode_as_stored(&upside_down).unwrap(), stored);
}

#[test]
fn a_transparent_picture_is_put_on_white_without_a_copy_of_four_bytes_a_pixel() {
    // What the decoder needs beside the pixels.
    const BESIDE: u64 = 300_000;
    let side = 1000;
    let grey = image::GrayAlphaImage::from_pixel(side, side, image::LumaA([100, 51]));
    let color = image::RgbaImage::from_pixel(side, side, Rgba([100, 0, 255, 51]));
    // 51 of 255 is a fifth: 0.2 c + 0.8 x 255. Bytes of a pixel in the file's form, and three of RGB.
    for (picture, bytes, expected) in [
        (DynamicImage::ImageLumaA8(grey), 2 + 3, [224; 3]),
        (DynamicImage::ImageRgba8(color), 4 + 3, [224, 204, 255]),
    ] {
        let png = encoded(&picture, ImageFormat::Png);
        let mut decoded = None;
        let memory = allocation_counter::measure(|| decoded = decode_picture(&png).ok());
        assert_eq!(decoded.unwrap().pixel(7, 7), expected);
        let most = bytes * u64::from(side * side) + BESIDE;
        assert!(
            memory.bytes_max < most,
            "{} bytes, expected less than {most}",
            memory.bytes_max
        );
    }
}

#[cfg(feature = "pictures")]
/// Browsers take all JPEG files of four inks for inverted ones, as print shops' programs write them, with Adobe's marker or without.
#[test]
fn pictures_of_four_inks_have_the_colours_that_browsers_show() {
    // Cyan 30, magenta 200, yellow 60, black 25.
    let [cmyk, ycck] = [&include_bytes!("cmyk.jpg")[..], include_bytes!("ycck.jpg")];
    let marker = cmyk.windows(2).position(|bytes| bytes == [0xff, 0xee]).unwrap();
    let length = 2 + usize::from(u16::from_be_bytes([cmyk[marker + 2], cmyk[marker + 3]]));
    let mut unmarked = cmyk.to_vec();
    unmarked.drain(marker..marker + length);
    for file in [cmyk, ycck, &unmarked] {
        let picture = decode_picture(file).unwrap();
        for (color, expected) in picture.pixel(8, 8).into_iter().zip([203_u8, 50, 176]) {
            assert!(color.abs_diff(expected) < 8, "{:?}", picture.pixel(8, 8));
        }
    }
}

#[test]
fn other_kinds_of_pictures_are_read() {
    let picture = Picture::from_fn(40, 30, |x, y| {
        [if x < 20 { 10 } else { 240 }, if y < 15 { 240 } else { 10 }, 90]
    });
    let rgb = image::RgbImage::from_raw(40, 30, picture.rgb().to_vec()).unwrap();
    for format in [ImageFormat::WebP, ImageFormat::Bmp, ImageFormat::Tiff, ImageFormat::Gif] {
        let read = decode_picture(&encoded(&DynamicImage::ImageRgb8(rgb.clone()), format)).unwrap();
        assert_eq!(read.size(), picture.size(), "{format:?}");
        let differences = read.rgb().iter().zip(picture.rgb()).map(|(a, b)| a.abs_diff(*b));
        assert!(differences.max().unwrap() <= 8, "{format:?}");
    }
    for name in ["a.webp", "a.JFIF", "a.tif", "a.bmp", "a.gif"] {
        assert!(deepsft_formats::is_picture(name.as_ref()), "{name}");
    }
}
