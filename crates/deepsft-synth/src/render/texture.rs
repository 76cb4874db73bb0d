//! Mip-mapped texture, filtered in linear light.

use crate::render::color::linear_from_srgb8;
use deepsft_geometry::Picture;
use deepsft_geometry::glam::{Vec2, Vec3, Vec4};

/// Most taps along the long axis of a pixel's footprint (the anisotropic filter's degree).
const MAX_TAPS: f32 = 4.0;

/// Added to the level of detail: a level's bilinear tent is two texels wide, a sensor pixel's box one
/// pixel; a quarter of a level finer is sharper at little aliasing.
const LEVEL_BIAS: f32 = -0.25;

/// Longest side of the finest level that is kept, texels. Even a sheet that fills a 1920-pixel frame
/// is sampled below one texel per pixel.
const LONGEST_SIDE: usize = 2048;

/// A picture and its successive halvings, filtered in linear light.
#[derive(Clone, Debug)]
pub(crate) struct Texture {
    levels: Vec<Level>,
}

#[derive(Clone, Debug)]
struct Level {
    /// Columns and rows.
    side: [usize; 2],
    /// Texels in the picture's width and height. Not `side` where a finer level had an odd one: its last texels then
    /// reach beyond the picture.
    extent: Vec2,
    /// Square roots of the linear light in bytes (gamma 2): as fine as sRGB to the eye and decoded by one product.
    /// The fourth byte fills the register. One column and one row more than `side`, repeating the last.
    texels: Vec<[u8; 4]>,
}

impl Texture {
    /// The mipmap of a picture. Pictures longer than 2048 pixels start at their first halving that is not.
    pub(crate) fn new(picture: &Picture) -> Self {
        let extent = Vec2::new(picture.width() as f32, picture.height() as f32);
        let mut level = Level::from_fn([picture.width(), picture.height()], extent, |x, y| {
            linear_from_srgb8(picture.pixel(x, y)).extend(0.0)
        });
        let mut levels = Vec::new();
        loop {
            let [width, height] = level.side;
            let coarser = (width > 1 || height > 1).then(|| level.halved());
            if width.max(height) <= LONGEST_SIDE {
                levels.push(level);
            }
            match coarser {
                Some(next) => level = next,
                None => return Self { levels },
            }
        }
    }

    /// Memory of the texels, bytes.
    pub(crate) fn bytes(&self) -> usize {
        self.levels.iter().map(|level| size_of_val(&*level.texels)).sum()
    }

    /// Width and height of the picture, texels of the finest level.
    pub(crate) fn size(&self) -> Vec2 {
        self.levels[0].extent
    }

    /// Linear colour (0 to 1) at `uv` with an isotropic footprint of `texels` texels of the finest
    /// level a pixel: trilinear. Edges are repeated.
    pub(crate) fn trilinear(&self, uv: Vec2, texels: f32) -> Vec3 {
        let level = (fast_log2(texels) + LEVEL_BIAS).clamp(0.0, (self.levels.len() - 1) as f32);
        let fine = level as i32 as usize;
        let blend = level - fine as f32;
        let color = self.levels[fine].bilinear(uv);
        if blend < 0.02 {
            return color.truncate();
        }
        color
            .lerp(self.levels[(fine + 1).min(self.levels.len() - 1)].bilinear(uv), blend)
            .truncate()
    }

    /// Linear colour (0 to 1) of the pixel whose footprint in the texture is spanned by `du_dx` and
    /// `du_dy` (change of (u, v) for one pixel to the right and down): trilinear taps along the long axis of the
    /// footprint ellipse.
    pub(crate) fn anisotropic(&self, uv: Vec2, duv_dx: Vec2, duv_dy: Vec2) -> Vec3 {
        let size = self.size();
        let (dx, dy) = (duv_dx * size, duv_dy * size);
        // Axes of the ellipse: eigenvectors of J J^T, J = [dx dy].
        let (a, b, c) = (
            dx.x * dx.x + dy.x * dy.x,
            dx.x * dx.y + dy.x * dy.y,
            dx.y * dx.y + dy.y * dy.y,
        );
        let root = (0.25 * (a - c) * (a - c) + b * b).sqrt();
        let major = (0.5 * (a + c) + root).max(0.0).sqrt();
        let minor = (0.5 * (a + c) - root).max(0.0).sqrt();
        let taps = ((major / minor.max(1e-6)).min(MAX_TAPS) + 0.5) as i32;
        if taps <= 1 || major <= 1.0 {
            return self.trilinear(uv, major);
        }
        let axis = if a >= c {
            Vec2::new(0.5 * (a - c) + root, b)
        } else {
            Vec2::new(b, 0.5 * (c - a) + root)
        };
        let fraction = major / taps as f32;
        let step = axis.normalize_or_zero() * fraction / size;
        let mut sum = Vec3::ZERO;
        for tap in 0..taps {
            sum += self.trilinear(uv + step * (tap as f32 - 0.5 * (taps - 1) as f32), fraction);
        }
        sum / taps as f32
    }
}

impl Level {
    /// The level whose texel (x, y) has the given linear light.
    fn from_fn(side: [usize; 2], extent: Vec2, light: impl Fn(usize, usize) -> Vec4) -> Self {
        let [width, height] = side;
        let mut texels = Vec::with_capacity((width + 1) * (height + 1));
        for y in 0..=height {
            for x in 0..=width {
                texels.push(texel(light(x.min(width - 1), y.min(height - 1))));
            }
        }
        Self { side, extent, texels }
    }

    fn bilinear(&self, uv: Vec2) -> Vec4 {
        // Through i32: conversions from and to usize are many times slower on plain x86-64.
        let (width, height) = (self.side[0] as i32, self.side[1] as i32);
        let x = (uv.x * self.extent.x - 0.5).max(0.0).min((width - 1) as f32);
        let y = (uv.y * self.extent.y - 0.5).max(0.0).min((height - 1) as f32);
        let (x0, y0) = (x as i32, y as i32);
        let (ax, ay) = (x - x0 as f32, y - y0 as f32);
        let above = (y0 * (width + 1) + x0) as usize;
        let below = above + self.side[0] + 1;
        let (upper, lower) = (&self.texels[above..above + 2], &self.texels[below..below + 2]);
        let a = square(upper[0]) * (1.0 - ax) + square(upper[1]) * ax;
        let b = square(lower[0]) * (1.0 - ax) + square(lower[1]) * ax;
        (a * (1.0 - ay) + b * ay) * LIGHT_OF_SQUARE
    }

    /// Half the size (rounded up), each texel the mean in linear light of the (up to) four it covers.
    fn halved(&self) -> Self {
        let [width, height] = self.side;
        Self::from_fn([width.div_ceil(2), height.div_ceil(2)], self.extent / 2.0, |x, y| {
            let at = |i: usize, j: usize| {
                let (x, y) = ((2 * x + i).min(width - 1), (2 * y + j).min(height - 1));
                square(self.texels[y * (width + 1) + x])
            };
            (at(0, 0) + at(1, 0) + at(0, 1) + at(1, 1)) * (LIGHT_OF_SQUARE / 4.0)
        })
    }
}

/// Linear light (0 to 1) of the square of a texel's byte.
const LIGHT_OF_SQUARE: f32 = 1.0 / (255.0 * 255.0);

/// The squares of a texel's bytes, proportional to its light.
fn square(texel: [u8; 4]) -> Vec4 {
    let root = Vec4::from_array(texel.map(f32::from));
    root * root
}

/// The texel of linear light.
fn texel(light: Vec4) -> [u8; 4] {
    light.to_array().map(|x| (x.sqrt() * 255.0 + 0.5) as u8)
}

/// Binary logarithm to 0.09 from the exponent and a straight line through the mantissa; below 2^-126 less than -126.
fn fast_log2(x: f32) -> f32 {
    let bits = x.max(0.0).to_bits();
    (bits >> 23) as f32 - 127.0 + (bits & 0x7f_ffff) as f32 / (1 << 23) as f32
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_texel_centre_gives_the_texel_and_a_midpoint_the_mean_in_linear_light() {
        let picture = Picture::from_fn(2, 1, |x, _| [255 * x as u8; 3]);
        let texture = Texture::new(&picture);
        assert!(texture.trilinear(Vec2::new(0.25, 0.5), 1.0).x < 1e-6);
        assert!((texture.trilinear(Vec2::new(0.75, 0.5), 1.0).x - 1.0).abs() < 1e-6);
        assert!((texture.trilinear(Vec2::new(0.5, 0.5), 1.0).x - 0.5).abs() < 1e-6);
    }

    #[test]
    fn a_one_pixel_picture_has_one_level() {
        let texture = Texture::new(&Picture::from_fn(1, 1, |_, _| [255; 3]));
        assert!((texture.trilinear(Vec2::new(3.0, -2.0), 50.0).x - 1.0).abs() < 1e-6);
    }

    #[test]
    fn an_edge_stays_where_it_is_on_every_level_also_of_an_odd_size() {
        // Black up to u = 0.8. A level of 46.4 texels that is taken for one of 46 has its edge 0.3 texels off.
        let texture = Texture::new(&Picture::from_fn(1485, 4, |x, _| [if x < 1188 { 0 } else { 255 }; 3]));
        for level in &texture.levels[..6] {
            let mut u = 0.0;
            while level.bilinear(Vec2::new(u, 0.5)).x < 0.5 {
                u += 1e-4;
            }
            let off = (u - 0.8) * level.extent.x;
            // An edge within a texel makes it grey: interpolation finds the edge to a quarter of a texel.
            assert!(off.abs() < 0.26, "{off} texels of {}", level.extent.x);
        }
    }

    #[test]
    fn fine_black_and_white_stripes_far_away_look_like_half_the_light() {
        // Half the light is 188 of 255 in sRGB; averaging bytes would give 127, linear 0.21.
        let texture = Texture::new(&Picture::from_fn(256, 256, |x, _| {
            [if x % 2 == 0 { 0 } else { 255 }; 3]
        }));
        let far = texture.trilinear(Vec2::splat(0.4), 8.0);
        assert!((far.x - 0.5).abs() < 0.01, "{far}");
    }

    #[test]
    fn a_tilted_footprint_keeps_detail_across_its_short_axis() {
        // Stripes of 4 texels; footprint 1 texel across the stripes and 16 along them.
        let texture = Texture::new(&Picture::from_fn(256, 256, |x, _| [if x % 8 < 4 { 0 } else { 255 }; 3]));
        let uv = Vec2::new(130.0 / 256.0, 0.5);
        let (dx, dy) = (Vec2::new(1.0 / 256.0, 0.0), Vec2::new(0.0, 16.0 / 256.0));
        let contrast = |sample: &dyn Fn(Vec2) -> Vec3| sample(uv + Vec2::new(4.0 / 256.0, 0.0)).x - sample(uv).x;
        assert!(contrast(&|uv| texture.anisotropic(uv, dx, dy)) > 0.9);
        assert!(contrast(&|uv| texture.trilinear(uv, 16.0)) < 0.1);
    }

    #[test]
    fn every_byte_comes_back_within_one() {
        for byte in 0..=255 {
            let texture = Texture::new(&Picture::from_fn(1, 1, |_, _| [byte; 3]));
            let back = crate::render::color::srgb8_from_linear(texture.trilinear(Vec2::splat(0.5), 1.0));
            assert!(back[0].abs_diff(byte) <= 1, "{byte} became {}", back[0]);
        }
    }

    #[test]
    fn the_fast_logarithm_is_within_0_09() {
        for i in 1..2000 {
            let x = i as f32 * 0.037;
            assert!((fast_log2(x) - x.log2()).abs() < 0.09);
        }
        assert!(fast_log2(0.0) < -126.0);
    }
}
