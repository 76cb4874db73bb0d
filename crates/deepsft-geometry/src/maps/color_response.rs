//! The colours of a template as a camera shows them.

use super::depth_and_registration::Maps;
use super::photo_consistency::drawn_colors;
use crate::error::{GeometryError, check_size};
use crate::image::Picture;

/// How a camera, with the print and the light before it, shows the colours of a template: each colour's intensity times a
/// gain, plus an offset, on 0..=255.
///
/// Texture maps that were taken by the camera that records (an RGB-D sensor is one of the paper's ways to a template) have
/// the camera's colours. A template that was made from the file that was printed has the file's, which no camera shows.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ColorResponse {
    /// Factor of red, green and blue.
    pub gain: [f64; 3],
    /// What is added to red, green and blue, grey levels.
    pub offset: [f64; 3],
}

impl ColorResponse {
    /// What leaves every colour as it is.
    pub const IDENTITY: Self = Self {
        gain: [1.0; 3],
        offset: [0.0; 3],
    };

    /// A texture in the colours that the camera shows it in.
    pub fn apply(&self, texture: &Picture) -> Picture {
        Picture::from_fn(texture.width(), texture.height(), |x, y| {
            let color = texture.pixel(x, y);
            // `as` saturates.
            [0, 1, 2].map(|k| (self.gain[k] * f64::from(color[k]) + self.offset[k]).round() as u8)
        })
    }
}

/// Finds the [`ColorResponse`] of a recording: it gives the template, drawn through registrations, the mean and the
/// spread that each colour has in the images.
///
/// Mean and spread and not the line of least squares, because registrations are not exact: where the drawn texture is not
/// the one that is seen, least squares make the contrast too small. The spread is that within a frame, its square averaged
/// over frames as the means are, so that light that changes between frames is not taken for contrast.
#[derive(Clone, Debug, Default)]
pub struct ColorMatch {
    frames: f64,
    drawn: [Moments; 3],
    seen: [Moments; 3],
}

/// Sums over frames.
#[derive(Clone, Copy, Debug, Default)]
struct Moments {
    mean: f64,
    variance: f64,
}

/// Variance of a colour in the template, grey levels^2, below which a gain would be made of noise and shading.
const LEAST_VARIANCE: f64 = 25.0;
/// Gains beyond these are no light on a print.
const GAINS: [f64; 2] = [0.1, 3.0];

impl ColorMatch {
    /// Takes a frame into account: an image, and the maps of the object in it. Only pixels inside the maps' mask count; a
    /// frame without any does not.
    ///
    /// # Errors
    /// [`GeometryError::MapSize`] when the maps are not of the image's size.
    pub fn add(&mut self, image: &Picture, texture: &Picture, maps: &Maps) -> Result<(), GeometryError> {
        check_size(maps.size(), image.size())?;
        if maps.area() == 0 {
            return Ok(());
        }
        let mut sums = [[[0.0_f64; 2]; 3]; 2];
        for (pixel, drawn) in drawn_colors(texture, maps) {
            let seen = image.pixel(pixel % maps.width(), pixel / maps.width());
            for k in 0..3 {
                for (sums, value) in sums.iter_mut().zip([f64::from(drawn[k]), f64::from(seen[k])]) {
                    sums[k][0] += value;
                    sums[k][1] += value * value;
                }
            }
        }
        let count = maps.area() as f64;
        for (moments, sums) in [&mut self.drawn, &mut self.seen].into_iter().zip(sums) {
            for (moments, [sum, squares]) in moments.iter_mut().zip(sums) {
                let mean = sum / count;
                moments.mean += mean;
                moments.variance += (squares / count - mean * mean).max(0.0);
            }
        }
        self.frames += 1.0;
        Ok(())
    }

    /// The response, [`ColorResponse::IDENTITY`] without frames. A colour in which the template has next to no contrast
    /// keeps the gain 1.
    pub fn response(&self) -> ColorResponse {
        let mut response = ColorResponse::IDENTITY;
        if self.frames == 0.0 {
            return response;
        }
        for k in 0..3 {
            let (drawn, seen) = (self.drawn[k], self.seen[k]);
            if drawn.variance > LEAST_VARIANCE * self.frames {
                response.gain[k] = (seen.variance / drawn.variance).sqrt().clamp(GAINS[0], GAINS[1]);
            }
            response.offset[k] = (seen.mean - response.gain[k] * drawn.mean) / self.frames;
        }
        response
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::maps::photo_consistency_error;

    /// 60 x 40 texels with contrast in every colour.
    fn texture() -> Picture {
        Picture::from_fn(60, 40, |x, y| {
            [x, y, x + y].map(|value| if (value / 7) % 2 == 0 { 40 } else { 220 })
        })
    }

    /// Maps of a camera that sees texel (x, y) at the pixel (x + 10, y + 5).
    fn maps() -> Maps {
        let mut maps = Maps::empty(100, 50);
        for y in 0..40 {
            for x in 0..60 {
                let uv = [(x as f32 + 0.5) / 60.0, (y as f32 + 0.5) / 40.0];
                maps.set((y + 5) * 100 + x + 10, 400.0, uv);
            }
        }
        maps
    }

    /// What that camera, with this `response`, shows of the texture under a light that adds `light` grey levels.
    fn image(response: &ColorResponse, light: u8) -> Picture {
        let shown = response.apply(&texture());
        Picture::from_fn(100, 50, |x, y| {
            if (10..70).contains(&x) && (5..45).contains(&y) {
                shown.pixel(x - 10, y - 5).map(|value| value + light)
            } else {
                [7; 3]
            }
        })
    }

    const DULL: ColorResponse = ColorResponse {
        gain: [0.5, 0.6, 0.4],
        offset: [50.0, 30.0, 60.0],
    };

    #[test]
    fn a_cameras_gains_and_offsets_are_found_whatever_the_light_of_each_frame() {
        let mut found = ColorMatch::default();
        assert_eq!(found.response(), ColorResponse::IDENTITY);
        // Light of 0 and 20 levels is an offset of 10 in the mean, and no contrast.
        for light in [0, 20] {
            found.add(&image(&DULL, light), &texture(), &maps()).unwrap();
        }
        let found = found.response();
        for k in 0..3 {
            assert!((found.gain[k] - DULL.gain[k]).abs() < 0.01, "{found:?}");
            assert!((found.offset[k] - DULL.offset[k] - 10.0).abs() < 1.0, "{found:?}");
        }
    }

    #[test]
    fn a_registration_that_is_off_leaves_the_contrast_as_it_is() {
        // Three texels off, of fields of seven: least squares would find a gain of a seventh of the true one.
        let mut found = ColorMatch::default();
        let mut off = maps();
        for pixel in (0..5000).filter(|&pixel| maps().inside(pixel)) {
            let [u, v] = maps().registration()[pixel];
            off.set(pixel, 400.0, [(u + 3.0 / 60.0) % 1.0, v]);
        }
        found.add(&image(&DULL, 0), &texture(), &off).unwrap();
        let found = found.response();
        for k in 0..3 {
            assert!((found.gain[k] / DULL.gain[k] - 1.0).abs() < 0.05, "{found:?}");
        }
    }

    #[test]
    fn in_the_cameras_colours_the_exact_registration_has_no_photo_consistency_error() {
        let image = image(&DULL, 0);
        let error = |texture: &Picture| photo_consistency_error(&image, texture, &maps()).unwrap();
        assert!(error(&texture()) > 0.15);
        assert!(error(&DULL.apply(&texture())) < 1e-6);
    }

    #[test]
    fn a_template_without_contrast_keeps_its_gain_and_frames_without_the_object_do_not_count() {
        let grey = Picture::from_fn(60, 40, |x, _| [98 + 4 * (x % 2) as u8; 3]);
        let mut found = ColorMatch::default();
        assert!(found.add(&grey, &grey, &maps()).is_err(), "an image of another size");
        found.add(&image(&DULL, 0), &grey, &Maps::empty(100, 50)).unwrap();
        assert_eq!(found.response(), ColorResponse::IDENTITY);
        // What contrast the picture has is the sensor's noise.
        let noisy = Picture::from_fn(100, 50, |x, y| [if (x + y) % 2 == 0 { 110 } else { 150 }; 3]);
        found.add(&noisy, &grey, &maps()).unwrap();
        let found = found.response();
        assert_eq!(found.gain, [1.0; 3]);
        assert!(
            found.offset.iter().all(|offset| (offset - 30.0).abs() < 1e-3),
            "{found:?}"
        );
        // More contrast than any light makes of a print.
        let pale = Picture::from_fn(60, 40, |x, _| [90 + 20 * (x % 2) as u8; 3]);
        let shown = Picture::from_fn(100, 50, |x, _| [255 * (x % 2) as u8; 3]);
        let mut found = ColorMatch::default();
        found.add(&shown, &pale, &maps()).unwrap();
        assert_eq!(found.response().gain, [3.0; 3]);
    }
}
