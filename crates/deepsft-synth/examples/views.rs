//! The soft toy from eight sides, and its texture: `cargo run --release --example views -p deepsft-synth OUT.png TEXTURE.png`.

use deepsft_geometry::glam::{DQuat, DVec3};
use deepsft_geometry::{Template, training_camera};
use deepsft_synth::{SynthConfig, Synthesizer, toy_template};
use std::error::Error;
use std::f64::consts::TAU;

fn main() -> Result<(), Box<dyn Error>> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let [out, texture] = arguments.as_slice() else {
        return Err("usage: views OUT.png TEXTURE.png".into());
    };
    let toy: Template = toy_template()?;
    println!(
        "{} vertices, {} faces",
        toy.mesh().vertices().len(),
        toy.mesh().faces().len()
    );
    let art = toy.texture();
    image::save_buffer(
        texture,
        art.rgb(),
        art.width() as u32,
        art.height() as u32,
        image::ColorType::Rgb8,
    )?;
    let mut config = SynthConfig::default();
    config.camera = deepsft_geometry::Camera::pinhole(480, 640, 700.0, 700.0, 240.0, 320.0)?;
    let _ = training_camera();
    let synthesizer = Synthesizer::new(&toy, config)?;
    let mut sheet = image::RgbImage::new(4 * 480, 2 * 640);
    for k in 0..8 {
        let turn = DQuat::from_rotation_x(0.15) * DQuat::from_rotation_y(TAU * f64::from(k) / 8.0);
        let vertices = toy
            .mesh()
            .vertices()
            .iter()
            .map(|p| turn * *p + DVec3::new(0.0, 10.0, 400.0));
        let sample = synthesizer.render_clean(vertices.collect())?;
        for y in 0..640 {
            for x in 0..480 {
                let pixel = image::Rgb(sample.image.pixel(x as usize, y as usize));
                sheet.put_pixel(k % 4 * 480 + x, k / 4 * 640 + y, pixel);
            }
        }
    }
    sheet.save(out)?;
    Ok(())
}
