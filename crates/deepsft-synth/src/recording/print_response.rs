//! How a printer and its paper change a template's picture: part of the gap between synthetic and recorded images.

use crate::random::uniform;
use crate::render::{linear_from_srgb8, srgb8_from_linear};
use deepsft_geometry::Picture;
use deepsft_geometry::glam::Vec3;
use rand::Rng;

/// Size of a print, as a fraction of the template's. It lies on both sides of 1, so that nothing is gained by shrinking
/// alone.
const SCALE: [f64; 2] = [0.95, 1.05];

/// The response of a print, on linear light: reflectance = black + (white - black) mix(colour ^ gain).
///
/// Training images show the template's picture as it is. This one was "printed": black is grey, colours are duller and
/// have a cast, middle tones are darker (dot gain). Its size differs a little from the template's, because printers fit
/// pages into their margins or scale them up to the paper.
#[derive(Clone, Debug, PartialEq)]
pub struct PrintResponse {
    /// Reflectance of the darkest ink, by colour.
    pub black: [f32; 3],
    /// Reflectance of the paper, by colour.
    pub white: [f32; 3],
    /// Exponent on the reflectance; above 1 middle tones get darker.
    pub gain: f32,
    /// Saturation of colours; 1 keeps them.
    pub saturation: f32,
    /// Size of the print, as a fraction of the template's.
    pub scale: f64,
}

impl PrintResponse {
    /// An ordinary printer on ordinary paper: black 2 to 6 %, a cast of up to 8 %, dot gain 1.05 to 1.3, saturation 0.65
    /// to 0.9, size 95 to 105 %.
    pub(super) fn sample<R: Rng + ?Sized>(rng: &mut R) -> Self {
        let black = uniform(rng, [0.02, 0.06]);
        let mut cast = || 1.0 - uniform(rng, [0.0, 0.08]);
        let white = [cast(), cast(), cast()];
        Self {
            black: white.map(|w| w * black),
            white,
            gain: uniform(rng, [1.05, 1.3]),
            saturation: uniform(rng, [0.65, 0.9]),
            scale: f64::from(uniform(rng, SCALE)),
        }
    }

    /// The picture as it is printed.
    pub fn apply(&self, picture: &Picture) -> Picture {
        let (black, white) = (Vec3::from_array(self.black), Vec3::from_array(self.white));
        Picture::from_fn(picture.width(), picture.height(), |x, y| {
            let light = linear_from_srgb8(picture.pixel(x, y)).powf(self.gain);
            let grey = Vec3::splat(light.dot(Vec3::new(0.2126, 0.7152, 0.0722)));
            srgb8_from_linear(black + (white - black) * (grey + (light - grey) * self.saturation))
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::random::{Stream, generator};

    #[test]
    fn prints_are_smaller_as_often_as_larger_than_the_template() {
        let scale = |seed| PrintResponse::sample(&mut generator(seed, 0, Stream::Recording)).scale;
        let scales: Vec<f64> = (0..400).map(scale).collect();
        assert!(scales.iter().all(|scale| (0.95..=1.05).contains(scale)));
        // A fair coin thrown 400 times: 200 +- 10; five standard deviations.
        let larger = scales.iter().filter(|&&scale| scale > 1.0).count();
        assert!((150..250).contains(&larger), "{larger}");
    }
}
