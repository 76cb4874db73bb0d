//! What EXIF data tell of the camera.

use ::exif::experimental::Writer;
use ::exif::{Field, In, Rational, Tag, Value};
use deepsft_formats::{camera_from_exif, decode_picture};
use deepsft_geometry::Camera;
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

/// The camera of the picture that the file holds.
fn camera_of(file: &[u8]) -> Option<Camera> {
    camera_from_exif(file, decode_picture(file).unwrap().size())
}

#[test]
fn an_equivalent_focal_length_has_the_angle_of_the_diagonal() {
    // 26 mm on a diagonal of 43.2666 mm; 400 x 300 has a diagonal of 500: 26 / 43.2666 * 500 = 300.46 px.
    let focal = (Tag::FocalLengthIn35mmFilm, short(26));
    let camera = camera_of(&photograph(400, 300, std::slice::from_ref(&focal))).unwrap();
    assert!((camera.focal().x - 300.46).abs() < 0.01 && camera.focal().x == camera.focal().y);
    assert_eq!(
        (camera.size(), camera.principal_point().to_array()),
        ((400, 300).into(), [200.0, 150.0])
    );
    // Turned upright as the picture is; EXIF goes on giving the sides as the sensor lies.
    let fields = [
        (Tag::Orientation, short(6)),
        focal,
        (Tag::PixelXDimension, short(4000)),
        (Tag::PixelYDimension, short(3000)),
    ];
    let upright = camera_of(&photograph(400, 300, &fields)).unwrap();
    assert_eq!(
        (upright.size(), upright.principal_point().to_array()),
        ((300, 400).into(), [150.0, 200.0])
    );
    assert_eq!(upright.focal(), camera.focal());
}

#[test]
fn a_focal_length_in_mm_needs_the_resolution_of_the_sensor() {
    let focal = (Tag::FocalLength, fraction(50, 10));
    assert_eq!(camera_of(&photograph(400, 300, std::slice::from_ref(&focal))), None);
    // 5 mm at 2540 pixels an inch, 100 a mm: 500 px in the 800 columns as taken, 250 in these 400.
    let mut fields = vec![
        focal,
        (Tag::FocalPlaneXResolution, fraction(2540, 1)),
        (Tag::FocalPlaneResolutionUnit, short(2)),
        (Tag::PixelXDimension, Value::Long(vec![800])),
        (Tag::PixelYDimension, Value::Long(vec![600])),
    ];
    let focal_px = |fields: &[(Tag, Value)]| camera_of(&photograph(400, 300, fields)).unwrap().focal().x;
    assert!((focal_px(&fields) - 250.0).abs() < 1e-9);
    // A crop has another shape than what was taken.
    assert_eq!(camera_of(&photograph(300, 300, &fields)), None);
    // What a digital zoom shows is a part of the sensor, enlarged; an equivalent focal length is that of what is shown.
    fields.push((Tag::DigitalZoomRatio, fraction(2, 1)));
    assert!((focal_px(&fields) - 500.0).abs() < 1e-9);
    fields.push((Tag::FocalLengthIn35mmFilm, short(52)));
    assert!((focal_px(&fields) - 600.92).abs() < 0.02);
}

#[test]
fn files_that_tell_nothing_or_nonsense_have_no_camera() {
    for focal in [0, 1, 60_000] {
        let jpeg = photograph(40, 30, &[(Tag::FocalLengthIn35mmFilm, short(focal))]);
        assert_eq!(camera_of(&jpeg), None, "{focal}");
    }
    assert_eq!(camera_of(&photograph(40, 30, &[(Tag::Orientation, short(1))])), None);
    assert_eq!(camera_from_exif(b"no picture", (40, 30)), None);
    assert_eq!(camera_from_exif(&[], (40, 30)), None);
}

/// Cameras write notes of their own, and editors cut files: what can be read still counts.
#[test]
fn a_field_that_cannot_be_read_does_not_hide_the_others() {
    let fields = [
        (Tag::FocalLengthIn35mmFilm, short(26)),
        (
            Tag::Copyright,
            Value::Ascii(vec![b"somebody with a long name".to_vec()]),
        ),
    ];
    let mut jpeg = photograph(400, 300, &fields);
    let tag = jpeg.windows(4).position(|window| window == [0x82, 0x98, 0, 2]).unwrap();
    jpeg[tag + 8..tag + 12].copy_from_slice(&[0x7F; 4]);
    assert!((camera_of(&jpeg).unwrap().focal().x - 300.46).abs() < 0.01);
}
