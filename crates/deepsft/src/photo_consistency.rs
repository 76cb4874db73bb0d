//! Photo-consistency: does the image look like the template seen through the registration?

use deepsft_geometry::{GreyMipmap, Maps, Picture, luma};

/// Side of the tiles that are compared, pixels of the canonical image.
const TILE: usize = 16;

/// Fewest pixels of a tile that the mask must cover.
const MIN_PIXELS: usize = 48;

/// Deviation of the template's luminance in a tile, grey levels, below which the tile says nothing.
const FLAT: f32 = 6.0;

/// Extra levels of the template's mipmap: compares what also a blurred camera shows, and lets a
/// registration that is right to a few pixels count as right.
const BLUR_LEVELS: f32 = 0.7;

/// The mipmap ends where the template's shorter side has this many texels.
const SHORTEST_SIDE: usize = 4;

/// The template's luminance at halving sizes, made once for each template.
#[derive(Clone, Debug)]
pub struct TemplateLuminance(GreyMipmap);

impl TemplateLuminance {
    /// The mipmap of `texture`.
    pub fn new(texture: &Picture) -> Self {
        Self(GreyMipmap::new(texture, SHORTEST_SIDE))
    }

    /// Mean normalised cross-correlation between the luminance of `image` and that of the template
    /// seen through `maps`, over tiles of 16 pixels weighted by their visible pixels: 1 where image and
    /// template agree up to brightness and contrast, around 0 where they have nothing in common. `None`
    /// when no tile has enough visible pixels and contrast. `image` has the maps' size.
    ///
    /// Brightness and contrast drop out a tile, so shading and gain do not matter (the paper's
    /// photometric error, equation (10), compares intensities and is reported by evaluation).
    pub fn consistency(&self, image: &Picture, maps: &Maps) -> Option<f64> {
        let (width, height) = (maps.size().width, maps.size().height);
        if (image.width(), image.height()) != (width, height) {
            return None;
        }
        let (mut sum, mut weight) = (0.0_f64, 0.0_f64);
        let mut pairs = Vec::with_capacity(TILE * TILE);
        for top in (0..height).step_by(TILE) {
            for left in (0..width).step_by(TILE) {
                self.tile(image, maps, left, top, &mut pairs);
                if pairs.len() >= MIN_PIXELS
                    && let Some(correlation) = correlation(&pairs)
                {
                    sum += pairs.len() as f64 * f64::from(correlation);
                    weight += pairs.len() as f64;
                }
            }
        }
        (weight > 0.0).then(|| sum / weight)
    }

    /// (image, template) luminances of the visible pixels of a tile.
    fn tile(&self, image: &Picture, maps: &Maps, left: usize, top: usize, pairs: &mut Vec<(f32, f32)>) {
        pairs.clear();
        let (right, bottom) = (
            (left + TILE).min(maps.size().width),
            (top + TILE).min(maps.size().height),
        );
        let level = self.0.level(self.level(maps, left, top, right, bottom));
        for y in top..bottom {
            for x in left..right {
                let pixel = y * maps.size().width + x;
                if maps.inside(pixel) {
                    pairs.push((luma(image.pixel(x, y)), level.sample(maps.registration()[pixel])));
                }
            }
        }
    }

    /// The mipmap level whose texels are about as large as the tile's pixels, from the mean length of
    /// the registration's steps between neighbours.
    fn level(&self, maps: &Maps, left: usize, top: usize, right: usize, bottom: usize) -> usize {
        let [width, height] = self.0.level(0).extent();
        let (mut texels, mut steps) = (0.0_f32, 0_u32);
        for y in top..bottom {
            for x in left..right.saturating_sub(1) {
                let pixel = y * maps.size().width + x;
                if maps.inside(pixel) && maps.inside(pixel + 1) {
                    let ([u, v], [p, q]) = (maps.registration()[pixel], maps.registration()[pixel + 1]);
                    texels += ((p - u) * width).hypot((q - v) * height);
                    steps += 1;
                }
            }
        }
        let size = if steps > 0 { texels / steps as f32 } else { 1.0 };
        (size.max(1.0).log2() + BLUR_LEVELS).round() as usize
    }
}

/// Normalised cross-correlation of pairs; `None` when the template is flat there.
fn correlation(pairs: &[(f32, f32)]) -> Option<f32> {
    let n = pairs.len() as f32;
    let (mean_a, mean_b) = pairs.iter().fold((0.0, 0.0), |(a, b), p| (a + p.0 / n, b + p.1 / n));
    let (mut aa, mut bb, mut ab) = (0.0, 0.0, 0.0);
    for &(a, b) in pairs {
        let (a, b) = (a - mean_a, b - mean_b);
        aa += a * a;
        bb += b * b;
        ab += a * b;
    }
    // An image that is flat where the template is not does not agree with it.
    ((bb / n).sqrt() >= FLAT).then(|| ab / (bb * aa.max(n)).sqrt())
}

#[cfg(test)]
#[path = "../tests/unit/photo_consistency.rs"]
mod tests;
