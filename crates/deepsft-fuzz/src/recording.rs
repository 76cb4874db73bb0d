//! RGB-D recordings.

use crate::files::{join, parts, with_folder};
use crate::picture;
use crate::png;
use anyhow::Result;
use deepsft_geometry::glam::DVec2;
use deepsft_geometry::{Camera, ImageSize};
use deepsft_synth::{Recording, RgbdSensor, encode_depth_png, encode_mask_png};

const FILES: [&str; 5] = [
    "camera.json",
    "associations.txt",
    "rgb/a.png",
    "depth/a.png",
    "mask/a.png",
];

/// The files are those of a recording of one frame; an empty one is not there.
pub(crate) fn read(input: &[u8]) -> Result<()> {
    let files = parts::<5>(input);
    if files.iter().any(|file| picture::is_slow(file)) {
        return Ok(());
    }
    with_folder(FILES.into_iter().zip(files), |folder| {
        let recording = Recording::open(folder)?;
        let sensor = recording.sensor();
        let again = RgbdSensor::from_json(&sensor.to_json());
        assert!(again.is_ok(), "a sensor that was written cannot be read: {again:?}");
        let canonical = Camera::pinhole((16, 9), DVec2::new(12.0, 12.0), DVec2::new(8.0, 4.5))?;
        let pixels = 16 * 9;
        let frame = recording.frame(0, &canonical)?;
        assert_eq!((frame.image.size(), frame.depth_mm.len()), ((16, 9).into(), pixels));
        let is_depth = |depth: &f32| depth.is_finite() && *depth >= 0.0;
        assert!(frame.depth_mm.iter().all(is_depth), "{:?}", frame.depth_mm);
        let masked = frame.mask.map(|mask| mask.len());
        assert_eq!(masked, recording.has_masks().then_some(pixels));
        Ok(())
    })
}

pub(crate) fn seeds() -> Result<Vec<Vec<u8>>> {
    let color = Camera::pinhole((6, 4), DVec2::new(5.0, 5.0), DVec2::new(3.0, 2.0))?;
    let depth_camera = Camera::pinhole((4, 3), DVec2::new(3.0, 3.0), DVec2::new(2.0, 1.5))?
        .with_distortion([0.01, 0.0, 0.0, 0.001, 0.0])?;
    let together = RgbdSensor::registered(color);
    let apart = RgbdSensor {
        depth: depth_camera,
        simulated: true,
        ..together.clone()
    };
    let image = deepsft::encode_png(&picture::small(6, 4))?;
    let mask: Vec<bool> = (0..24).map(|pixel| pixel % 3 > 0).collect();
    let depth = |camera: &Camera| -> Result<Vec<u8>> {
        let ImageSize { width, height } = camera.size();
        let units: Vec<u8> = (0..width * height)
            .flat_map(|pixel| (500 + 100 * pixel as u16).to_be_bytes())
            .collect();
        let rows: Vec<u8> = units.chunks(2 * width).flat_map(|row| [&[0], row].concat()).collect();
        Ok(png::stored([width as u32, height as u32], [16, 0, 0], &[], &rows))
    };
    let coded = encode_depth_png(&[700; 24], &color)?;
    Ok(vec![
        join(&[together.to_json().as_bytes(), b"", &image, &coded]),
        join(&[
            apart.to_json().as_bytes(),
            b"# time rgb time depth\n0.1 rgb/a.png 0.2 depth/a.png\n",
            &image,
            &depth(&apart.depth)?,
            &encode_mask_png(&mask, &color)?,
        ]),
    ])
}
