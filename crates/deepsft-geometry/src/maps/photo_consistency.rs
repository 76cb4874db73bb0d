//! The template seen through the registration, and how it differs from the image.

use super::depth_and_registration::Maps;
use super::metrics::{MeanSquare, central_differences};
use super::paired_sums::PairedSums;
use crate::image::{MipLevel, Picture};

/// The template as the registration places it in the image: the paper's rendered image I', black
/// outside the mask, of the maps' size. Nothing corrects for light.
///
/// `texture` is sampled at the mipmap level nearest to the frame's mean resolution, so that a texture
/// finer than the image is averaged as the camera averaged it (our choice; the paper is silent).
pub fn draw_template(texture: &Picture, maps: &Maps) -> Picture {
    let mut drawn = drawn_colors(texture, maps).peekable();
    Picture::from_fn(maps.width(), maps.height(), |x, y| {
        match drawn.next_if(|d| d.0 == y * maps.width() + x) {
            Some((_, color)) => color.map(|c| (c + 0.5) as u8),
            None => [0; 3],
        }
    })
}

/// The photo-consistency error E_pr of the paper (its equation `photoerrors`): the root mean square
/// difference between `image` and the template drawn through the registration as [`draw_template`] does, over
/// the pixels inside the maps' mask and the three colours, intensities in 0..=1.
///
/// `None` when the mask is empty or the image is not of the maps' size.
pub fn photo_consistency_error(image: &Picture, texture: &Picture, maps: &Maps) -> Option<f64> {
    if (image.width(), image.height()) != (maps.width(), maps.height()) {
        return None;
    }
    let mut squares = MeanSquare::default();
    for (pixel, drawn) in drawn_colors(texture, maps) {
        let seen = image.pixel(pixel % maps.width(), pixel / maps.width());
        for (drawn, seen) in drawn.into_iter().zip(seen) {
            squares.add(((f64::from(drawn) - f64::from(seen)) / 255.0).powi(2));
        }
    }
    squares.root()
}

/// [`photo_consistency_error`] after the drawn template was given the gain and the offset of each colour that bring it closest to
/// the image: what is left when light, paper and camera are taken away as far as they are the same all over the object.
/// E_pr itself is mostly these where nobody controlled the light (our addition to the paper's figure).
///
/// `None` as there.
pub fn relit_photo_consistency_error(image: &Picture, texture: &Picture, maps: &Maps) -> Option<f64> {
    if (image.width(), image.height()) != (maps.width(), maps.height()) {
        return None;
    }
    let mut colors = [PairedSums::default(); 3];
    for (pixel, drawn) in drawn_colors(texture, maps) {
        let seen = image.pixel(pixel % maps.width(), pixel / maps.width());
        for ((sums, drawn), seen) in colors.iter_mut().zip(drawn).zip(seen) {
            sums.add(f64::from(drawn) / 255.0, f64::from(seen) / 255.0);
        }
    }
    let count = colors[0].count();
    let sum: f64 = colors.iter().map(PairedSums::residual).sum();
    (count > 0.0).then(|| (sum / (3.0 * count)).sqrt())
}

/// Row-major index and drawn colour (0..=255) of every pixel inside the mask, in order.
pub(crate) fn drawn_colors(texture: &Picture, maps: &Maps) -> impl Iterator<Item = (usize, [f32; 3])> {
    let halvings = mipmap_level(texture, maps);
    let level = (0..halvings).fold(MipLevel::finest(texture.clone()), |level, _| {
        level.coarser().unwrap_or(level)
    });
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

#[cfg(test)]
mod tests {
    use super::*;

    /// One texel of a 200 x 100 texture per pixel: texel (x, y) is seen at pixel (x + 100, y + 50).
    fn frontal(shift_px: f32) -> Maps {
        let mut maps = Maps::empty(480, 270);
        for y in 0..100 {
            for x in 0..200 {
                let uv = [(x as f32 + 0.5 + shift_px) / 200.0, (y as f32 + 0.5) / 100.0];
                maps.set((y + 50) * 480 + x + 100, 380.0, uv);
            }
        }
        maps
    }

    #[test]
    fn the_photo_consistency_error_of_a_grey_that_is_51_levels_off_is_one_fifth() {
        let image = Picture::from_fn(480, 270, |_, _| [151; 3]);
        let texture = Picture::from_fn(20, 10, |_, _| [100; 3]);
        assert!((photo_consistency_error(&image, &texture, &frontal(0.0)).unwrap() - 0.2).abs() < 1e-6);
        assert_eq!(photo_consistency_error(&image, &texture, &Maps::empty(480, 270)), None);
        assert_eq!(
            photo_consistency_error(&texture, &texture, &frontal(0.0)),
            None,
            "an image of another size"
        );
    }

    #[test]
    fn a_picture_drawn_through_the_registration_has_no_photo_consistency_error() {
        let color = |x: usize, y: usize| [(x % 7 * 30) as u8, (y % 5 * 50) as u8, ((x + y) % 3 * 80) as u8];
        let texture = Picture::from_fn(200, 100, color);
        let drawn = draw_template(&texture, &frontal(0.0));
        assert_eq!((drawn.width(), drawn.height()), (480, 270));
        assert_eq!(
            [drawn.pixel(100, 50), drawn.pixel(299, 149)],
            [color(0, 0), color(199, 99)]
        );
        assert_eq!([drawn.pixel(99, 50), drawn.pixel(300, 149)], [[0; 3]; 2]);
        assert!(
            photo_consistency_error(&drawn, &texture, &frontal(0.0)).unwrap() < 1e-5,
            "bilinear weights are f32"
        );
        assert!(
            photo_consistency_error(&drawn, &texture, &frontal(1.0)).unwrap() > 0.1,
            "a shift of a pixel is seen"
        );
    }

    #[test]
    fn light_that_is_the_same_all_over_is_taken_away_and_a_shift_is_not() {
        let color = |x: usize, y: usize| [(x % 7 * 30) as u8, (y % 5 * 50) as u8, ((x + y) % 3 * 80) as u8];
        let texture = Picture::from_fn(200, 100, color);
        let lit = draw_template(&texture, &frontal(0.0));
        let lit = Picture::from_fn(480, 270, |x, y| lit.pixel(x, y).map(|c| c / 2 + 40));
        assert!(photo_consistency_error(&lit, &texture, &frontal(0.0)).unwrap() > 0.05);
        // Halving rounds by half a level at most.
        assert!(relit_photo_consistency_error(&lit, &texture, &frontal(0.0)).unwrap() < 0.5 / 255.0);
        assert!(relit_photo_consistency_error(&lit, &texture, &frontal(1.0)).unwrap() > 0.05);
        assert_eq!(
            relit_photo_consistency_error(&lit, &texture, &Maps::empty(480, 270)),
            None
        );
    }

    #[test]
    fn a_texture_finer_than_the_image_is_averaged() {
        // Four texels along each side of a pixel, a checkerboard: every pixel sees grey.
        let texture = Picture::from_fn(800, 400, |x, y| [if (x + y) % 2 == 0 { 0 } else { 200 }; 3]);
        let image = Picture::from_fn(480, 270, |_, _| [100; 3]);
        assert!(
            photo_consistency_error(&image, &texture, &frontal(0.0)).unwrap() < 1e-6,
            "bilinear weights are f32"
        );
    }
}
