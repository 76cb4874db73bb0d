//! Disturbances of a known size: what a method is put to the test with.

use deepsft_geometry::glam::{DVec2, Vec2};
use deepsft_geometry::metrics::frame_metrics;
use deepsft_geometry::{GeometryError, Maps, Picture};
use deepsft_synth::Sample;
use deepsft_synth::painting::{ValueNoise, any_color, srgb8_from_linear};
use deepsft_synth::random::{Stream, between, generator};
use rand_pcg::Pcg64Mcg;
use std::f64::consts::TAU;

/// Waves of a registration's error, and their lengths as fractions of the template's diagonal.
const WAVES: usize = 4;
const WAVELENGTH: [f64; 2] = [0.5, 2.0];

/// Size of the noise on top of the waves, relative to one wave's height, and its grain in pixels: that of a
/// network which answers once in eight pixels.
const NOISE: f64 = 1.2;
const NOISE_GRAIN_PX: f32 = 8.0;

/// Largest error of the depth's scale, and of its slope across half the image, relative.
const DEPTH_SCALE: f64 = 0.05;
const DEPTH_SLOPE: f64 = 0.03;

/// The true maps of `sample` with a registration that is wrong by `rmse_px` pixels (exactly: the registration RMSE of
/// [`frame_metrics`]) and a depth that is wrong by an affine factor of up to 5 % and a slope of 3 %: as a network
/// errs, whose errors go together over the sheet. The registration's error is a sum of waves over the
/// template and of noise in grains of 8 pixels (our choice). Deterministic in `seed` and `index`.
///
/// # Errors
/// [`GeometryError::MapSize`] when the sample's truth is not of its camera's size.
pub fn disturbed_maps(
    sample: &Sample,
    template_size_mm: DVec2,
    rmse_px: f64,
    seed: u64,
    index: u64,
) -> Result<Maps, GeometryError> {
    let mut rng = generator(seed, index, Stream::Disturbance);
    let truth = &sample.truth;
    let error = ErrorField::draw(template_size_mm, &mut rng);
    let scale = 1.0 + between([-DEPTH_SCALE, DEPTH_SCALE], &mut rng);
    let slope = DVec2::from_angle(between([0.0, TAU], &mut rng)) * between([0.0, DEPTH_SLOPE], &mut rng);
    let centre = DVec2::new(truth.width() as f64, truth.height() as f64) / 2.0;
    let moved = |height: f64| {
        let mut maps = truth.clone();
        for pixel in (0..truth.depth().len()).filter(|&pixel| truth.inside(pixel)) {
            let at = DVec2::new((pixel % truth.width()) as f64, (pixel / truth.width()) as f64);
            let uv = DVec2::from_array(truth.registration()[pixel].map(f64::from));
            let wrong = uv + height * error.at(uv, at) / template_size_mm;
            let factor = scale + slope.dot((at - centre) / centre.x);
            let depth = (f64::from(truth.depth()[pixel]) * factor) as f32;
            maps.set(pixel, depth, wrong.as_vec2().to_array());
        }
        maps
    };
    // The RMSE is proportional to the error's height.
    let unit = frame_metrics(&moved(1.0), truth, &sample.camera, template_size_mm)?;
    let height = unit.registration_rmse_px.map_or(0.0, |unit| rmse_px / unit.max(1e-6));
    Ok(moved(height))
}

/// A smooth random displacement on the template, of about 1 mm.
struct ErrorField {
    size_mm: DVec2,
    /// Wave vector, phase and direction of each wave.
    waves: [(DVec2, f64, DVec2); WAVES],
    noise: [ValueNoise; 2],
}

impl ErrorField {
    fn draw(size_mm: DVec2, rng: &mut Pcg64Mcg) -> Self {
        let mut wave = || {
            let frequency = TAU / (between(WAVELENGTH, rng) * size_mm.length());
            (
                DVec2::from_angle(between([0.0, TAU], rng)) * frequency,
                between([0.0, TAU], rng),
                DVec2::from_angle(between([0.0, TAU], rng)),
            )
        };
        let waves = std::array::from_fn(|_| wave());
        Self {
            size_mm,
            waves,
            noise: [ValueNoise::new(rng), ValueNoise::new(rng)],
        }
    }

    /// mm at texture position `uv`, seen at pixel `at`.
    fn at(&self, uv: DVec2, at: DVec2) -> DVec2 {
        let place = uv * self.size_mm;
        let smooth: DVec2 = (self.waves.iter())
            .map(|&(vector, phase, direction)| direction * (vector.dot(place) + phase).sin())
            .sum();
        let grain = at.as_vec2() / NOISE_GRAIN_PX;
        let noise = Vec2::from_array([0, 1].map(|k| self.noise[k].at(grain)));
        smooth + NOISE * noise.as_dvec2()
    }
}

/// Something in front of a sheet.
#[derive(Clone, Debug)]
pub struct Cover {
    /// The picture with it.
    pub image: Picture,
    /// Where it is: one flag a pixel, row-major.
    pub hidden: Vec<bool>,
}

/// Grain of a cover's texture, pixels, and how far its colours differ from their mean.
const COVER_GRAIN_PX: f32 = 14.0;
const COVER_CONTRAST: f32 = 0.6;

/// Most of a cover's radius that its outline swings, and in how many lobes.
const LOBE: f64 = 0.25;
const LOBES: [f64; 2] = [2.0, 5.0];

/// Lays one contiguous, textured thing before `fraction` (0 to 1) of the pixels in which `sample` shows the object:
/// around a random point of it, with a wavy outline. It grows until it hides that fraction (to a pixel), beside
/// the object as well. Deterministic in `seed` and `index`; a larger fraction of the same two grows the same thing.
pub fn covered(sample: &Sample, fraction: f64, seed: u64, index: u64) -> Cover {
    let mut rng = generator(seed, index, Stream::Disturbance);
    let (width, truth) = (sample.truth.width(), &sample.truth);
    let inside: Vec<usize> = (0..truth.depth().len()).filter(|&pixel| truth.inside(pixel)).collect();
    let place = |pixel: usize| DVec2::new((pixel % width) as f64, (pixel / width) as f64);
    let number = (between([0.0, 1.0], &mut rng) * inside.len() as f64) as usize;
    let centre = inside.get(number).map_or(DVec2::ZERO, |&pixel| place(pixel));
    let stretch = DVec2::new(1.0, between([0.5, 1.0], &mut rng));
    let turn = DVec2::from_angle(between([0.0, TAU], &mut rng));
    let (lobes, phase) = (between(LOBES, &mut rng).round(), between([0.0, TAU], &mut rng));
    let reach = |pixel: usize| {
        let d = turn.rotate(place(pixel) - centre) * stretch;
        d.length() / (1.0 + LOBE * (lobes * d.y.atan2(d.x) + phase).sin())
    };
    let mut reaches: Vec<f64> = inside.iter().map(|&pixel| reach(pixel)).collect();
    reaches.sort_unstable_by(f64::total_cmp);
    let count = (fraction.clamp(0.0, 1.0) * reaches.len() as f64).round() as usize;
    let limit = count.checked_sub(1).and_then(|last| reaches.get(last)).copied();
    let hidden: Vec<bool> = (0..truth.depth().len())
        .map(|pixel| limit.is_some_and(|limit| reach(pixel) <= limit))
        .collect();
    let (color, noise) = (any_color(&mut rng) * 0.6 + 0.1, ValueNoise::new(&mut rng));
    let image = Picture::from_fn(sample.image.width(), sample.image.height(), |x, y| {
        if !hidden[y * width + x] {
            return sample.image.pixel(x, y);
        }
        let shade = 1.0 + COVER_CONTRAST * noise.fractal(Vec2::new(x as f32, y as f32) / COVER_GRAIN_PX, 3);
        srgb8_from_linear(color * shade)
    });
    Cover { image, hidden }
}

impl Cover {
    /// `maps` without what is hidden. With `leak_px` above 0 the mask is as wrong as a careless one: it still holds
    /// what lies within so many pixels of the cover's outline, and with it pixels that show the cover.
    pub fn cut(&self, maps: &Maps, leak_px: usize) -> Maps {
        let (width, height) = (maps.width(), maps.height());
        // Hidden with all pixels within reach: first along rows, then along columns.
        let erode = |flags: &[bool], along: usize, length: usize| -> Vec<bool> {
            (0..flags.len())
                .map(|pixel| {
                    let at = pixel / along % length;
                    let (before, after) = (leak_px.min(at), leak_px.min(length - 1 - at));
                    (pixel - before * along..=pixel + after * along)
                        .step_by(along)
                        .all(|other| flags[other])
                })
                .collect()
        };
        let deep = erode(&erode(&self.hidden, 1, width), width, height);
        let mut cut = maps.clone();
        (0..deep.len())
            .filter(|&pixel| deep[pixel])
            .for_each(|pixel| cut.clear(pixel));
        cut
    }
}

/// `picture` with the given fraction of its contrast: every colour moved towards the mean of all.
pub fn faded(picture: &Picture, contrast: f64) -> Picture {
    let count = (picture.width() * picture.height()) as f64;
    let sum = |k: usize| {
        picture
            .rgb()
            .iter()
            .skip(k)
            .step_by(3)
            .map(|&c| f64::from(c))
            .sum::<f64>()
    };
    let mean = [0, 1, 2].map(|k| sum(k) / count);
    Picture::from_fn(picture.width(), picture.height(), |x, y| {
        let color = picture.pixel(x, y);
        std::array::from_fn(|k| (mean[k] + contrast * (f64::from(color[k]) - mean[k])).round() as u8)
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use deepsft_geometry::Template;
    use deepsft_synth::{SynthConfig, Synthesizer};

    fn sheet() -> Template {
        let art = Picture::from_fn(60, 45, |x, y| [(4 * x) as u8, (5 * y) as u8, ((x * y) % 200) as u8]);
        Template::thin_shell(art, 200.0, 150.0).unwrap()
    }

    fn sample() -> Sample {
        let config = SynthConfig {
            empty_probability: 0.0,
            ..SynthConfig::default()
        };
        Synthesizer::new(&sheet(), config).unwrap().sample(3, 1)
    }

    #[test]
    fn the_registration_is_wrong_by_as_much_as_was_asked() {
        let sample = sample();
        for asked in [0.0, 2.0, 16.0] {
            let maps = disturbed_maps(&sample, sheet().size_mm(), asked, 1, 2).unwrap();
            let metrics = frame_metrics(&maps, &sample.truth, &sample.camera, sheet().size_mm()).unwrap();
            // Texture coordinates are f32.
            assert!(
                (metrics.registration_rmse_px.unwrap() - asked).abs() < 1e-3,
                "{metrics:?}"
            );
            assert_eq!(metrics.mask_iou, Some(1.0));
            let fraction = metrics.depth_rmse_mm.unwrap() / f64::from(sample.truth.depth()[inside(&sample)]);
            assert!(fraction > 0.0 && fraction < 0.15, "{fraction}");
        }
        let other = disturbed_maps(&sample, sheet().size_mm(), 2.0, 1, 3).unwrap();
        assert_ne!(other, disturbed_maps(&sample, sheet().size_mm(), 2.0, 1, 2).unwrap());
    }

    fn inside(sample: &Sample) -> usize {
        (0..480 * 270).find(|&pixel| sample.truth.inside(pixel)).unwrap()
    }

    #[test]
    fn a_cover_hides_the_fraction_asked_for_and_only_there_the_picture_changes() {
        let sample = sample();
        let area = sample.truth.area();
        for fraction in [0.0, 0.3, 0.6] {
            let cover = covered(&sample, fraction, 1, 2);
            let cut = cover.cut(&sample.truth, 0);
            let hidden = (area - cut.area()) as f64;
            // Pixels at the same reach come together: at most a few.
            assert!((hidden - fraction * area as f64).abs() <= 4.0, "{hidden} of {area}");
            for pixel in 0..480 * 270 {
                let (x, y) = (pixel % 480, pixel / 480);
                let changed = cover.image.pixel(x, y) != sample.image.pixel(x, y);
                assert!(cover.hidden[pixel] || !changed);
            }
        }
    }

    #[test]
    fn a_careless_mask_leaves_a_rim_of_the_cover() {
        let mut hidden = vec![false; 60 * 40];
        (10..30).for_each(|y| (20..50).for_each(|x| hidden[y * 60 + x] = true));
        let image = Picture::from_fn(60, 40, |_, _| [0; 3]);
        let cover = Cover { image, hidden };
        let mut maps = Maps::empty(60, 40);
        (0..60 * 40).for_each(|pixel| maps.set(pixel, 500.0, [0.5; 2]));
        assert_eq!(cover.cut(&maps, 0).area(), 60 * 40 - 30 * 20);
        assert_eq!(cover.cut(&maps, 5).area(), 60 * 40 - 20 * 10);
        assert!(!cover.cut(&maps, 5).inside(15 * 60 + 25) && cover.cut(&maps, 5).inside(14 * 60 + 25));
    }

    #[test]
    fn a_faded_picture_keeps_its_mean_and_loses_contrast() {
        let art = Picture::from_fn(10, 10, |x, _| [20 * x as u8, 100, 255 - 20 * x as u8]);
        let pale = faded(&art, 0.25);
        // Mean 90 and 165; 0.25 of the distances, rounded to whole levels.
        assert_eq!(pale.pixel(0, 3), [68, 100, 188]);
        assert_eq!(pale.pixel(9, 3), [113, 100, 143]);
        assert_eq!(faded(&art, 1.0), art);
    }
}
