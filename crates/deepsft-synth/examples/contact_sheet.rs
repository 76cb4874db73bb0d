//! A sheet of samples to look at: `cargo run --release --example contact_sheet -p deepsft-synth PICTURE|toy OUT.png [SEED [FIRST]]`.
//! Each sample is shown with its truth beside it: u in red, v in green, nearness in blue.

use deepsft_geometry::{Picture, Template};
use deepsft_synth::{Sample, SynthConfig, Synthesizer, toy_template};
use std::error::Error;

const COLUMNS: u32 = 3;
const ROWS: u32 = 6;

fn truth_color(sample: &Sample, pixel: usize) -> [u8; 3] {
    if !sample.truth.inside(pixel) {
        return [30; 3];
    }
    let [u, v] = sample.truth.registration()[pixel];
    [
        255.0 * u,
        255.0 * v,
        (40_000.0 / sample.truth.depth()[pixel]).min(255.0),
    ]
    .map(|c| c as u8)
}

fn main() -> Result<(), Box<dyn Error>> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let [picture, out, numbers @ ..] = arguments.as_slice() else {
        return Err("usage: contact_sheet PICTURE OUT.png [SEED [FIRST]]".into());
    };
    let number = |k: usize| numbers.get(k).map_or(Ok(0), |text| text.parse::<u64>());
    let (seed, first) = (number(0)?, number(1)?);
    let template = if picture == "toy" {
        toy_template()?
    } else {
        let picture = image::open(picture)?.to_rgb8();
        let (width, height) = picture.dimensions();
        Template::thin_shell(
            Picture::new(width as usize, height as usize, picture.into_raw())?,
            297.0,
            297.0 * f64::from(height) / f64::from(width),
        )?
    };
    let synthesizer = Synthesizer::new(&template, SynthConfig::default())?;
    let mut sheet = image::RgbImage::new(COLUMNS * 960, ROWS * 270);
    for tile in 0..COLUMNS * ROWS {
        let sample = synthesizer.sample(seed, first + u64::from(tile));
        let (x0, y0) = (tile % COLUMNS * 960, tile / COLUMNS * 270);
        for y in 0..270 {
            for x in 0..480 {
                let pixel = (y * 480 + x) as usize;
                sheet.put_pixel(x0 + x, y0 + y, image::Rgb(sample.image.pixel(x as usize, y as usize)));
                sheet.put_pixel(x0 + 480 + x, y0 + y, image::Rgb(truth_color(&sample, pixel)));
            }
        }
    }
    sheet.save(out)?;
    Ok(())
}
