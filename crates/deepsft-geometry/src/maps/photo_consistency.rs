//! The template seen through the registration, and how it differs from the image.

use super::depth_and_registration::Maps;
use super::metrics::{MeanSquare, central_differences};
use crate::image::{MipLevel, Picture};

/// Renders the template through the registration: the paper's image I', of the maps' size, black outside the mask.
/// Nothing corrects for light.
///
/// `texture` is sampled at the mipmap level nearest to the frame's mean resolution, so that a texture
/// finer than the image is averaged as the camera averaged it (our choice; the paper is silent).
pub fn draw_template(texture: &Picture, maps: &Maps) -> Picture {
    let mut drawn = drawn_colors(texture, maps).peekable();
    Picture::from_fn(maps.size().width, maps.size().height, |x, y| {
        let drawn = drawn.next_if(|d| d.0 == y * maps.size().width + x);
        drawn.map_or([0; 3], |(_, color)| color.map(|c| (c + 0.5) as u8))
    })
}

/// Returns the paper's photo-consistency error E_pr (its equation `photoerrors`). It is the root mean square
/// difference between `image` and the template drawn as [`draw_template`] does, over the pixels inside the maps' mask
/// and the three colours, intensities in 0..=1.
///
/// `None` when the mask is empty or the image is not of the maps' size.
pub fn photo_consistency_error(image: &Picture, texture: &Picture, maps: &Maps) -> Option<f64> {
    let mut squares = MeanSquare::default();
    for (drawn, seen) in color_pairs(image, texture, maps)? {
        for (drawn, seen) in drawn.into_iter().zip(seen) {
            squares.add(((f64::from(drawn) - f64::from(seen)) / 255.0).powi(2));
        }
    }
    squares.root()
}

/// Returns [`photo_consistency_error`] after the best gain and offset of each colour. What is left has no light,
/// paper and camera in it as far as they are the same all over the object. E_pr itself is mostly these where nobody
/// controlled the light (our addition to the paper's figure).
///
/// `None` as there.
pub fn relit_photo_consistency_error(image: &Picture, texture: &Picture, maps: &Maps) -> Option<f64> {
    let mut colors = [PairedSums::default(); 3];
    for (drawn, seen) in color_pairs(image, texture, maps)? {
        for ((sums, drawn), seen) in colors.iter_mut().zip(drawn).zip(seen) {
            sums.add(f64::from(drawn) / 255.0, f64::from(seen) / 255.0);
        }
    }
    let count = colors[0].count;
    let sum: f64 = colors.iter().map(PairedSums::residual).sum();
    (count > 0.0).then(|| (sum / (3.0 * count)).sqrt())
}

/// The drawn and the seen colour of every pixel inside the mask; `None` when the image is not of the maps' size.
pub(crate) fn color_pairs(
    image: &Picture,
    texture: &Picture,
    maps: &Maps,
) -> Option<impl Iterator<Item = ([f32; 3], [u8; 3])>> {
    let seen = |pixel: usize| image.pixel(pixel % maps.size().width, pixel / maps.size().width);
    let pairs = || drawn_colors(texture, maps).map(move |(pixel, drawn)| (drawn, seen(pixel)));
    (image.size() == maps.size()).then(pairs)
}

/// Row-major index and drawn colour (0..=255) of every pixel inside the mask, in order.
fn drawn_colors(texture: &Picture, maps: &Maps) -> impl Iterator<Item = (usize, [f32; 3])> {
    let level = MipLevel::halved(texture.clone(), mipmap_level(texture, maps));
    let inside = (0..maps.depth().len()).filter(|&pixel| maps.inside(pixel));
    inside.map(move |pixel| (pixel, level.sample(maps.uv(pixel))))
}

/// Change of the registration per pixel beyond which it is a jump, over a seam of the texture or to another part.
const JUMP: f64 = 0.1;

/// How often `texture` is to be halved before one of its texels covers about a pixel of the frame.
pub fn mipmap_level(texture: &Picture, maps: &Maps) -> u32 {
    let (mut area, mut count) = (0.0, 0_usize);
    for pixel in (0..maps.depth().len()).filter(|&pixel| maps.inside(pixel)) {
        if let Some([dx, dy]) = central_differences(maps, pixel)
            && dx.length().max(dy.length()) < JUMP
        {
            area += dx.perp_dot(dy).abs();
            count += 1;
        }
    }
    let texels = area / count.max(1) as f64 * (texture.width() * texture.height()) as f64;
    let most = texture.width().max(texture.height()).ilog2();
    // Halving divides the texels per pixel by four. 0 when there is no difference: `as` saturates.
    ((texels.log2() / 2.0).round() as u32).min(most)
}

/// Sums over pairs (a, b), for the straight line from a to b and for their correlation.
#[derive(Clone, Copy, Default)]
pub(crate) struct PairedSums {
    pub(crate) count: f64,
    a: f64,
    b: f64,
    aa: f64,
    bb: f64,
    ab: f64,
}

impl PairedSums {
    pub(crate) fn add(&mut self, a: f64, b: f64) {
        self.count += 1.0;
        self.a += a;
        self.b += b;
        self.aa += a * a;
        self.ab += a * b;
        self.bb += b * b;
    }

    /// Sum of the squared distances of the b from the best line. Where all a are alike the line is level.
    pub(crate) fn residual(&self) -> f64 {
        let spread = |a: f64, b: f64, ab: f64| ab - a * b / self.count.max(1.0);
        let (along, across) = (spread(self.a, self.a, self.aa), spread(self.b, self.b, self.bb));
        let together = spread(self.a, self.b, self.ab);
        let explained = if along > 1e-9 { together * together / along } else { 0.0 };
        (across - explained).max(0.0)
    }

    /// -1 to 1; a grey level squared of variance is added to both, so that even surfaces correlate with nothing.
    pub(crate) fn correlation(&self) -> f64 {
        let (n, mean_a, mean_b) = (self.count, self.a / self.count, self.b / self.count);
        let (aa, bb) = (self.aa / n - mean_a * mean_a, self.bb / n - mean_b * mean_b);
        (self.ab / n - mean_a * mean_b) / ((aa + 1.0) * (bb + 1.0)).sqrt()
    }
}
