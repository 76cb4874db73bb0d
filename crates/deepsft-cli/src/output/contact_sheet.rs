//! Synthetic samples on one sheet: each image over its depth and its registration.

use super::canvas::Canvas;
use super::color_map::ColorMap;
use deepsft_geometry::Picture;
use deepsft_synth::Sample;

/// Samples on a sheet.
pub const SAMPLES: usize = 12;

const COLUMNS: usize = 4;

/// Between the pictures, pixels.
const GAP: usize = 6;

const GROUND: [u8; 3] = [255; 3];

/// Colour of what is outside the object.
const OUTSIDE: [u8; 3] = [40; 3];

/// The sheet of the first [`SAMPLES`] of some samples of one size. Depth goes from bright (near) to dark (far) between
/// the nearest and the farthest point of all; registration is u in red and v in green.
pub fn draw(samples: &[Sample]) -> Picture {
    let samples = &samples[..samples.len().min(SAMPLES)];
    let Some(first) = samples.first() else {
        return Picture::from_fn(1, 1, |_, _| GROUND);
    };
    let (width, height) = (first.image.width(), first.image.height());
    let (half_width, half_height) = (width.saturating_sub(GAP) / 2, height / 2);
    let tile = (width + GAP, height + half_height + 3 * GAP);
    let columns = samples.len().min(COLUMNS);
    let rows = samples.len().div_ceil(COLUMNS);
    let mut canvas = Canvas::new(columns * tile.0 - GAP, rows * tile.1 - 2 * GAP, GROUND);
    let depths = samples
        .iter()
        .flat_map(|sample| sample.truth.depth())
        .filter(|&&depth| depth > 0.0);
    let (near, far) = depths.fold((f32::INFINITY, 0.0_f32), |(near, far), &depth| {
        (near.min(depth), far.max(depth))
    });
    for (number, sample) in samples.iter().enumerate() {
        let (left, top) = (number % COLUMNS * tile.0, number / COLUMNS * tile.1);
        canvas.draw(&sample.image, left, top);
        let small = |color: &dyn Fn(usize) -> [u8; 3]| {
            Picture::from_fn(half_width, half_height, |x, y| {
                let pixel = (2 * y).min(height - 1) * width + (2 * x).min(width - 1);
                if sample.truth.inside(pixel) {
                    color(pixel)
                } else {
                    OUTSIDE
                }
            })
        };
        let depth = |pixel: usize| {
            let fraction = (sample.truth.depth()[pixel] - near) / (far - near).max(1.0);
            ColorMap::Viridis.color(1.0 - f64::from(fraction))
        };
        let registration = |pixel: usize| {
            let [u, v] = sample.truth.registration()[pixel].map(|c| (255.0 * c) as u8);
            [u, v, 128]
        };
        canvas.draw(&small(&depth), left, top + height + GAP);
        canvas.draw(&small(&registration), left + width - half_width, top + height + GAP);
    }
    canvas.into_picture()
}

#[cfg(test)]
mod tests {
    use super::*;
    use deepsft_geometry::glam::DVec3;
    use deepsft_geometry::{Maps, training_camera};

    fn sample(depth_mm: f32) -> Sample {
        let mut truth = Maps::empty(480, 270);
        for pixel in 0..480 * 100 {
            truth.set(pixel, depth_mm, [1.0, 0.0]);
        }
        Sample {
            image: Picture::from_fn(480, 270, |_, _| [9, 90, 200]),
            truth,
            vertices_camera: Vec::new(),
            camera: training_camera(),
            has_template: true,
            towards_light: DVec3::NEG_Z,
        }
    }

    #[test]
    fn each_image_stands_over_its_depth_and_registration() {
        let sheet = draw(&[sample(400.0), sample(900.0)]);
        assert_eq!((sheet.width(), sheet.height()), (966, 270 + 6 + 135));
        assert_eq!(sheet.pixel(0, 0), [9, 90, 200]);
        // Near is the bright end of the ramp, far the dark one.
        assert_eq!(sheet.pixel(5, 280), ColorMap::Viridis.color(1.0));
        assert_eq!(sheet.pixel(486 + 5, 280), ColorMap::Viridis.color(0.0));
        assert_eq!(sheet.pixel(479, 280), [255, 0, 128]);
        assert_eq!(sheet.pixel(479, 270 + 6 + 134), OUTSIDE);
        assert_eq!(draw(&[]).width(), 1);
    }
}
