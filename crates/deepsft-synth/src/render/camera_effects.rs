//! Camera effects: from the light of a scene to the 8-bit picture a camera delivers.

use crate::random::{draw_or, mix, uniform, unit_vector};
use crate::render::color::srgb_from_linear;
use crate::render::frame::Frame;
use deepsft_formats::{decode_picture, encode_jpeg};
use deepsft_geometry::Picture;
use deepsft_geometry::glam::{Vec2, Vec3};
use rand::{Rng, RngExt};
use serde::Serialize;

/// Camera effects of [`crate::SynthConfig`].
#[derive(Clone, Debug, Serialize)]
pub struct EffectsConfig {
    /// Gain on the linear image. Default [0.7, 1.3].
    pub gain: [f64; 2],
    /// Largest relative error of the red and blue white-balance gains. Default 0.12.
    pub white_balance: f64,
    /// Exponent on the sRGB image. Default [0.8, 1.25].
    pub gamma: [f64; 2],
    /// Contrast about mid grey of the sRGB image. Default [0.8, 1.25].
    pub contrast: [f64; 2],
    /// Saturation of colours; 0 is grey. Default [0.6, 1.4].
    pub saturation: [f64; 2],
    /// Standard deviation of the Gaussian defocus, pixels. Default [0.3, 1.2].
    pub defocus_px: [f64; 2],
    /// Probability of motion blur. Default 0.2.
    pub motion_probability: f64,
    /// Length of the motion, pixels. Default [1.5, 7].
    pub motion_px: [f64; 2],
    /// Probability that the camera sharpens (unsharp mask with haloes). Default 0.3.
    pub sharpening_probability: f64,
    /// Standard deviation of the sensor noise at mid grey, grey levels of 255. Default [0.3, 6].
    pub noise_levels: [f64; 2],
    /// Darkening of the corners, relative. Default [0, 0.25].
    pub vignetting: [f64; 2],
    /// Probability of JPEG compression. Default 0.5.
    pub jpeg_probability: f64,
    /// JPEG quality, 1 to 100. Default [35, 95].
    pub jpeg_quality: [f64; 2],
    /// Probability of black bars, as the canonical warp of a narrower or upright camera leaves. Default 0.1.
    pub bars_probability: f64,
}

impl Default for EffectsConfig {
    fn default() -> Self {
        Self {
            gain: [0.7, 1.3],
            white_balance: 0.12,
            gamma: [0.8, 1.25],
            contrast: [0.8, 1.25],
            saturation: [0.6, 1.4],
            defocus_px: [0.3, 1.2],
            motion_probability: 0.2,
            motion_px: [1.5, 7.0],
            sharpening_probability: 0.3,
            noise_levels: [0.3, 6.0],
            vignetting: [0.0, 0.25],
            jpeg_probability: 0.5,
            jpeg_quality: [35.0, 95.0],
            bars_probability: 0.1,
        }
    }
}

impl EffectsConfig {
    /// The ideal camera: what it sees is what it delivers.
    pub fn none() -> Self {
        Self {
            gain: [1.0, 1.0],
            white_balance: 0.0,
            gamma: [1.0, 1.0],
            contrast: [1.0, 1.0],
            saturation: [1.0, 1.0],
            defocus_px: [0.0, 0.0],
            motion_probability: 0.0,
            motion_px: [0.0, 0.0],
            sharpening_probability: 0.0,
            noise_levels: [0.0, 0.0],
            vignetting: [0.0, 0.0],
            jpeg_probability: 0.0,
            jpeg_quality: [100.0, 100.0],
            bars_probability: 0.0,
        }
    }
}

/// Entries of the tone curve's table less one, indexed by the square root of the light.
const TONE_STEPS: f32 = 4095.0;

/// The effects of one camera in one scene.
#[derive(Clone, Debug)]
pub(crate) struct CameraEffects {
    /// Gains of red, green and blue on the linear image.
    gain: Vec3,
    gamma: f32,
    contrast: f32,
    saturation: f32,
    /// Standard deviation of the defocus, pixels.
    defocus_px: f32,
    /// Displacement during the exposure, pixels.
    motion_px: Vec2,
    /// Height of the unsharp mask.
    sharpening: f32,
    /// Standard deviation of the noise at mid grey, grey levels.
    noise_levels: f32,
    vignetting: f32,
    jpeg_quality: Option<u8>,
}

impl CameraEffects {
    pub(crate) fn sample<R: Rng + ?Sized>(config: &EffectsConfig, rng: &mut R) -> Self {
        let gain = uniform(rng, config.gain);
        let mut balance = || 1.0 + uniform(rng, [-config.white_balance, config.white_balance]);
        let gain = Vec3::new(balance(), 1.0, balance()) * gain;
        // Little noise is more common than much.
        let noise = rng.random::<f64>().powf(1.5);
        let noise_levels = config.noise_levels[0] + (config.noise_levels[1] - config.noise_levels[0]) * noise;
        let motion = unit_vector(rng) * uniform(rng, config.motion_px);
        Self {
            gain,
            gamma: uniform(rng, config.gamma),
            contrast: uniform(rng, config.contrast),
            saturation: uniform(rng, config.saturation),
            defocus_px: uniform(rng, config.defocus_px),
            motion_px: draw_or(rng, config.motion_probability, Vec2::ZERO, |_| motion),
            sharpening: draw_or(rng, config.sharpening_probability, 0.0, |rng| uniform(rng, [0.2, 1.0])),
            noise_levels: noise_levels as f32,
            vignetting: uniform(rng, config.vignetting),
            jpeg_quality: {
                let quality = uniform(rng, config.jpeg_quality).round().clamp(1.0, 100.0) as u8;
                rng.random_bool(config.jpeg_probability).then_some(quality)
            },
        }
    }

    /// The picture of a frame. `noise_seed` chooses the sensor noise.
    pub(crate) fn expose(&self, mut frame: Frame, noise_seed: u64) -> Picture {
        if self.motion_px.length_squared() > 0.25 {
            frame = convolved(&frame, &motion_kernel(self.motion_px));
        }
        if self.defocus_px >= 0.2 {
            frame = blurred(&frame, self.defocus_px);
        }
        if self.sharpening > 0.0 {
            let smooth = blurred(&frame, 1.0);
            for (value, smooth) in frame.rgb.iter_mut().zip(smooth.rgb) {
                *value = (*value + self.sharpening * (*value - smooth)).max(0.0);
            }
        }
        let bytes = self.develop(&frame, noise_seed);
        let mut pixels = bytes.chunks_exact(3);
        let picture = Picture::from_fn(frame.width, frame.height, |_, _| {
            pixels.next().map_or([0; 3], |c| [c[0], c[1], c[2]])
        });
        match self.jpeg_quality {
            Some(quality) => through_jpeg(picture, quality),
            None => picture,
        }
    }

    /// The picture's bytes after vignetting, gains, tone curve and noise.
    fn develop(&self, frame: &Frame, noise_seed: u64) -> Vec<u8> {
        let tone = self.tone_curve();
        let centre = Vec2::new(frame.width as f32, frame.height as f32) / 2.0;
        let darkening = self.vignetting / centre.length_squared();
        let mut noise = NoiseSource { state: mix(noise_seed) };
        let mut bytes = Vec::with_capacity(frame.rgb.len());
        let mut steps = vec![0.0_f32; 3 * frame.width];
        for (row, lights) in frame.rgb.chunks_exact(3 * frame.width).enumerate() {
            let down2 = (row as f32 + 0.5 - centre.y).powi(2);
            for (column, (light, step)) in lights.chunks_exact(3).zip(steps.chunks_exact_mut(3)).enumerate() {
                let radius2 = (column as f32 + 0.5 - centre.x).powi(2) + down2;
                let light = Vec3::from_slice(light) * self.gain * (1.0 - darkening * radius2);
                let light = light.min(Vec3::ONE);
                let grey = Vec3::splat(light.dot(Vec3::new(0.2126, 0.7152, 0.0722)));
                (grey + (light - grey) * self.saturation).write_to_slice(step);
            }
            for step in &mut steps {
                *step = step.clamp(0.0, 1.0).sqrt() * TONE_STEPS + 0.5;
            }
            for step in steps.chunks_exact(3) {
                for (&step, noise) in step.iter().zip(noise.next()) {
                    let level = tone[step as i32 as usize];
                    // Shot noise grows with the root of the light, the tone curve flattens it: what is left in the
                    // picture is weakest in the highlights.
                    let sigma = (1.35 - 0.7 / 255.0 * level) * self.noise_levels;
                    bytes.push((level + sigma * noise + 0.5).clamp(0.0, 255.0) as i32 as u8);
                }
            }
        }
        bytes
    }

    /// Grey level (0 to 255) of linear light, by the square root of the light in [`TONE_STEPS`].
    fn tone_curve(&self) -> Vec<f32> {
        (0..=TONE_STEPS as usize)
            .map(|i| {
                let value = srgb_from_linear((i as f32 / TONE_STEPS).powi(2)).powf(self.gamma);
                255.0 * ((value - 0.5) * self.contrast + 0.5).clamp(0.0, 1.0)
            })
            .collect()
    }
}

/// Approximately normal numbers, fast: each the sum of three uniform 7-bit numbers (Irwin-Hall, limited to
/// 3 sigma in steps of 1/64 sigma), which is as good as a normal one before rounding to grey levels.
struct NoiseSource {
    state: u64,
}

impl NoiseSource {
    fn next(&mut self) -> [f32; 3] {
        self.state = self.state.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let z = (self.state ^ (self.state >> 32)).wrapping_mul(0xd6e8_feb8_6659_fd93);
        let z = (z ^ (z >> 32)).wrapping_mul(0xd6e8_feb8_6659_fd93);
        let bits = z ^ (z >> 32);
        let uniform = |k: u32| ((bits >> (7 * k)) & 127) as i32;
        // Mean 3 * 127 / 2, variance 3 (128^2 - 1) / 12.
        let normal = |k: u32| ((uniform(k) + uniform(k + 1) + uniform(k + 2)) as f32 - 190.5) * (2.0 / 127.996_09);
        [normal(0), normal(3), normal(6)]
    }
}

/// A sparse convolution kernel: (columns to the right, rows down, weight).
type Kernel = Vec<(isize, isize, f32)>;

/// Taps no lighter than this are kept; the rest are renormalised.
const MIN_WEIGHT: f32 = 1e-3;

/// The box along a straight motion, splatted bilinearly.
fn motion_kernel(motion_px: Vec2) -> Kernel {
    let steps = (2.0 * motion_px.length()).ceil().max(1.0) as usize;
    let mut taps: Kernel = Vec::new();
    for step in 0..steps {
        let p = motion_px * ((step as f32 + 0.5) / steps as f32 - 0.5);
        let cell = p.floor();
        let t = p - cell;
        for (i, j, weight) in [
            (0, 0, (1.0 - t.x) * (1.0 - t.y)),
            (1, 0, t.x * (1.0 - t.y)),
            (0, 1, (1.0 - t.x) * t.y),
            (1, 1, t.x * t.y),
        ] {
            let (x, y) = (cell.x as isize + i, cell.y as isize + j);
            match taps.iter_mut().find(|tap| (tap.0, tap.1) == (x, y)) {
                Some(tap) => tap.2 += weight / steps as f32,
                None => taps.push((x, y, weight / steps as f32)),
            }
        }
    }
    normalised(taps)
}

fn normalised(mut taps: Kernel) -> Kernel {
    taps.retain(|tap| tap.2 >= MIN_WEIGHT);
    let sum: f32 = taps.iter().map(|tap| tap.2).sum();
    taps.iter_mut().for_each(|tap| tap.2 /= sum);
    taps
}

fn blurred(frame: &Frame, sigma_px: f32) -> Frame {
    let reach = (3.0 * sigma_px).ceil() as isize;
    let bell = |i: isize| (-0.5 * (i as f32 / sigma_px).powi(2)).exp();
    let across = normalised((-reach..=reach).map(|i| (i, 0, bell(i))).collect());
    let down = across.iter().map(|&(i, _, weight)| (0, i, weight)).collect();
    convolved(&convolved(frame, &across), &down)
}

/// The frame convolved with a kernel, edges repeated.
fn convolved(frame: &Frame, kernel: &Kernel) -> Frame {
    let (width, height) = (frame.width, frame.height);
    let mut result = Frame::filled(width, height, Vec3::ZERO);
    let stride = 3 * width;
    let reach = kernel.iter().map(|tap| tap.0.unsigned_abs()).max().unwrap_or(0);
    // The columns that need no clamping: one contiguous run.
    let inner = if 2 * reach < width {
        reach..width - reach
    } else {
        width..width
    };
    for row in 0..height {
        let target = &mut result.rgb[row * stride..(row + 1) * stride];
        for &(dx, dy, weight) in kernel {
            let source_row = (row as isize + dy).clamp(0, height as isize - 1) as usize;
            let source = &frame.rgb[source_row * stride..(source_row + 1) * stride];
            if !inner.is_empty() {
                let shifted = &source[3 * inner.start.wrapping_add_signed(dx)..];
                for (t, s) in target[3 * inner.start..3 * inner.end].iter_mut().zip(shifted) {
                    *t += weight * s;
                }
            }
            for column in (0..inner.start).chain(inner.end..width) {
                let from = 3 * (column as isize + dx).clamp(0, width as isize - 1) as usize;
                for k in 0..3 {
                    target[3 * column + k] += weight * source[from + k];
                }
            }
        }
    }
    result
}

/// A picture after a JPEG round trip at `quality`. A codec failure (none is known for such pictures) leaves it as it was:
/// JPEG is a disturbance here, not a format.
fn through_jpeg(picture: Picture, quality: u8) -> Picture {
    let round_trip = encode_jpeg(&picture, quality).and_then(|coded| decode_picture(&coded));
    round_trip.unwrap_or(picture)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::random::{Stream, generator};
    use crate::render::color::linear_from_srgb8;

    fn neutral() -> CameraEffects {
        CameraEffects::sample(&EffectsConfig::none(), &mut generator(1, 0, Stream::Scene))
    }

    fn light_of(picture: &Picture) -> Frame {
        let rgb = picture
            .rgb()
            .chunks_exact(3)
            .flat_map(|c| linear_from_srgb8([c[0], c[1], c[2]]).to_array());
        Frame {
            width: picture.width(),
            height: picture.height(),
            rgb: rgb.collect(),
        }
    }

    fn impulse() -> Frame {
        let mut frame = Frame::filled(41, 31, Vec3::ZERO);
        frame.set(15 * 41 + 20, Vec3::ONE);
        frame
    }

    /// Mean position and covariance (xx, xy, yy) of the light.
    fn moments(frame: &Frame) -> (f32, Vec2, [f32; 3]) {
        let light = |pixel: usize| frame.color(pixel).x;
        let pixels = 0..frame.width * frame.height;
        let sum: f32 = pixels.clone().map(light).sum();
        let mean = pixels.clone().map(|i| frame.centre(i) * light(i)).sum::<Vec2>() / sum;
        let mut covariance = [0.0; 3];
        for pixel in pixels {
            let d = frame.centre(pixel) - mean;
            for (c, product) in covariance.iter_mut().zip([d.x * d.x, d.x * d.y, d.y * d.y]) {
                *c += product * light(pixel) / sum;
            }
        }
        (sum, mean, covariance)
    }

    #[test]
    fn a_neutral_camera_shows_every_byte_as_it_is() {
        let picture = Picture::from_fn(16, 16, |x, y| [(16 * y + x) as u8; 3]);
        assert_eq!(neutral().expose(light_of(&picture), 1), picture);
    }

    #[test]
    fn defocus_spreads_a_point_by_its_sigma_and_loses_no_light() {
        let (sum, mean, [xx, xy, yy]) = moments(&blurred(&impulse(), 1.2));
        assert!((sum - 1.0).abs() < 1e-5);
        assert!((mean - Vec2::new(20.5, 15.5)).length() < 1e-4);
        // The bell is cut at 3 sigma and at weights of 1e-3, which takes at most 5 % of its variance.
        assert!(
            (xx / 1.44 - 1.0).abs() < 0.05 && (yy / 1.44 - 1.0).abs() < 0.05 && xy.abs() < 1e-4,
            "{xx} {yy}"
        );
    }

    #[test]
    fn motion_spreads_a_point_along_the_motion() {
        let motion = Vec2::new(4.0, 3.0);
        let (sum, mean, [xx, xy, yy]) = moments(&convolved(&impulse(), &motion_kernel(motion)));
        assert!((sum - 1.0).abs() < 1e-5);
        assert!((mean - Vec2::new(20.5, 15.5)).length() < 1e-3);
        // A box of length L along (0.8, 0.6): L^2/12 = 25/12; bilinear splatting adds at most 1/4 a side.
        let along = 0.64 * xx + 0.96 * xy + 0.36 * yy;
        let across = 0.36 * xx - 0.96 * xy + 0.64 * yy;
        assert!((along - 25.0 / 12.0).abs() < 0.3 && across < 0.3, "{along} {across}");
    }

    #[test]
    fn an_even_frame_stays_even_under_every_convolution() {
        let frame = Frame::filled(9, 7, Vec3::new(0.2, 0.4, 0.8));
        for frame_after in [
            blurred(&frame, 3.0),
            convolved(&frame, &motion_kernel(Vec2::new(-5.0, 6.5))),
        ] {
            for pixel in 0..63 {
                assert!((frame_after.color(pixel) - frame.color(pixel)).length() < 1e-5);
            }
        }
    }

    #[test]
    fn noise_has_the_asked_deviation_and_no_bias() {
        // Light of byte 128, where sigma = noise_levels (1.35 - 0.7 * 0.5).
        let frame = light_of(&Picture::from_fn(200, 200, |_, _| [128; 3]));
        let picture = CameraEffects {
            noise_levels: 4.0,
            ..neutral()
        }
        .expose(frame, 3);
        let values: Vec<f64> = picture.rgb().iter().map(|&v| f64::from(v) - 128.0).collect();
        let mean = values.iter().sum::<f64>() / values.len() as f64;
        let deviation = (values.iter().map(|v| v * v).sum::<f64>() / values.len() as f64 - mean * mean).sqrt();
        // 120,000 values: standard error of mean 0.012, of the deviation 0.008; rounding adds 1/12 of variance.
        assert!(mean.abs() < 0.06, "{mean}");
        assert!((deviation - 4.0).abs() < 0.06, "{deviation}");
    }

    #[test]
    fn jpeg_keeps_the_size_and_the_picture_nearly() {
        let picture = Picture::from_fn(64, 48, |x, y| [2 * x as u8, 3 * y as u8, 90]);
        let coded = through_jpeg(picture.clone(), 90);
        assert_ne!(coded, picture);
        let pairs = coded.rgb().iter().zip(picture.rgb());
        let worst = pairs.map(|(a, b)| a.abs_diff(*b)).max().unwrap();
        assert!(worst < 25, "{worst}");
    }
}
