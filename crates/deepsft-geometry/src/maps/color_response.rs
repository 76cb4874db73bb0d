//! The colours of a template as a camera shows them.

use super::depth_and_registration::Maps;
use super::photo_consistency::color_pairs;
use crate::error::{GeometryError, check_size};
use crate::image::Picture;

/// A linear colour response: each colour of the template times a gain, plus an offset, on 0..=255. It stands for
/// camera, print and light together.
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

/// Estimates the [`ColorResponse`] of a recording by matching mean and spread of each colour. Compared are the images
/// and the template as drawn through their registrations.
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

#[derive(Clone, Copy, Debug, Default)]
struct Moments {
    mean: f64,
    variance: f64,
}

/// Variance of a colour in the template, grey levels^2, below which a gain would be made of noise and shading.
const MIN_VARIANCE: f64 = 25.0;
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
        for (drawn, seen) in color_pairs(image, texture, maps).into_iter().flatten() {
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
            if drawn.variance > MIN_VARIANCE * self.frames {
                response.gain[k] = (seen.variance / drawn.variance).sqrt().clamp(GAINS[0], GAINS[1]);
            }
            response.offset[k] = (seen.mean - response.gain[k] * drawn.mean) / self.frames;
        }
        response
    }
}
