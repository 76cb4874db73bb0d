//! What EXIF data tell of the camera.

use ::exif::experimental::Writer;
use ::exif::{Field, In, Rational, Tag, Value};
use deepsft_formats::camera_from_exif;
use image::codecs::jpeg::JpegEncoder;
use image::{ExtendedColorType, ImageEncoder};
use std::io::Cursor;

/// A JPEG file of so many pixels with these fields.
fn photograph(width: u32, height: u32, fields: &[(Tag, Value)]) -> Vec<u8> {
    let fields: Vec<Field> = fields
        .iter()
        .map(|(tag, value)| Field {
            tag: *tag,
            ifd_num: In::PRIMARY,
            value: value.clone(),
        })
        .collect();
    let mut writer = Writer::new();
    fields.iter().for_each(|field| writer.push_field(field));
    let mut raw = Cursor::new(Vec::new());
    writer.write(&mut raw, false).unwrap();
    let mut jpeg = Vec::new();
    let mut encoder = JpegEncoder::new(&mut jpeg);
    encoder.set_exif_metadata(raw.into_inner()).unwrap();
    let pixels = vec![128; (width * height) as usize];
    encoder
        .write_image(&pixels, width, height, ExtendedColorType::L8)
        .unwrap();
    jpeg
}

fn short(number: u16) -> Value {
    Value::Short(vec![number])
}

fn fraction(num: u32, denom: u32) -> Value {
    Value::Rational(vec![Rational { num, denom }])
}

#[test]
fn an_equivalent_focal_length_has_the_angle_of_the_diagonal() {
    // 26 mm on a diagonal of 43.2666 mm; 400 x 300 has a diagonal of 500: 26 / 43.2666 * 500 = 300.46 px.
    let jpeg = photograph(400, 300, &[(Tag::FocalLengthIn35mmFilm, short(26))]);
    let camera = camera_from_exif(&jpeg).unwrap();
    assert!((camera.focal().x - 300.46).abs() < 0.01 && camera.focal().x == camera.focal().y);
    assert_eq!(
        (camera.size(), camera.principal_point().to_array()),
        ((400, 300), [200.0, 150.0])
    );
    // Turned upright as the picture is.
    let upright = photograph(
        400,
        300,
        &[(Tag::Orientation, short(6)), (Tag::FocalLengthIn35mmFilm, short(26))],
    );
    let camera = camera_from_exif(&upright).unwrap();
    assert_eq!(
        (camera.size(), camera.principal_point().to_array()),
        ((300, 400), [150.0, 200.0])
    );
    assert_eq!(deepsft_formats::decode_picture(&upright).unwrap().size(), camera.size());
}

#[test]
fn a_focal_length_in_mm_needs_the_resolution_of_the_sensor() {
    let focal = (Tag::FocalLength, fraction(50, 10));
    assert_eq!(
        camera_from_exif(&photograph(400, 300, std::slice::from_ref(&focal))),
        None
    );
    // 5 mm at 2540 pixels an inch, 100 a mm: 500 px in the 800 columns as taken, 250 in these 400.
    let fields = [
        focal,
        (Tag::FocalPlaneXResolution, fraction(2540, 1)),
        (Tag::FocalPlaneResolutionUnit, short(2)),
        (Tag::PixelXDimension, Value::Long(vec![800])),
        (Tag::PixelYDimension, Value::Long(vec![600])),
    ];
    assert!((camera_from_exif(&photograph(400, 300, &fields)).unwrap().focal().x - 250.0).abs() < 1e-9);
    // A crop has another shape than what was taken.
    assert_eq!(camera_from_exif(&photograph(300, 300, &fields)), None);
}

#[test]
fn files_that_tell_nothing_or_nonsense_have_no_camera() {
    for focal in [0, 1, 60_000] {
        let jpeg = photograph(40, 30, &[(Tag::FocalLengthIn35mmFilm, short(focal))]);
        assert_eq!(camera_from_exif(&jpeg), None, "{focal}");
    }
    assert_eq!(
        camera_from_exif(&photograph(40, 30, &[(Tag::Orientation, short(1))])),
        None
    );
    assert_eq!(camera_from_exif(b"no picture"), None);
    assert_eq!(camera_from_exif(&[]), None);
}
