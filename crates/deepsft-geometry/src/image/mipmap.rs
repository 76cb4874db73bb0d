//! A picture at halving sizes.

use super::grey_image::GreyImage;
use super::picture::Picture;
use glam::DVec2;

/// One level of a picture's mipmap.
#[derive(Clone, Debug)]
pub struct MipLevel {
    /// The picture, halved as often as the level says.
    pub picture: Picture,
    /// Texels of this level in the whole picture's width and height. More than the level has columns and rows where a
    /// finer level had an odd number of them: halving leaves the last one out, and it counts here.
    pub extent: DVec2,
}

impl MipLevel {
    /// Level 0: the picture itself.
    pub fn finest(picture: Picture) -> Self {
        Self {
            extent: DVec2::new(picture.width() as f64, picture.height() as f64),
            picture,
        }
    }

    /// The next level; `None` after the level of a single pixel.
    pub fn coarser(&self) -> Option<Self> {
        (self.picture.width().max(self.picture.height()) > 1).then(|| Self {
            picture: self.picture.halved(),
            extent: self.extent / 2.0,
        })
    }

    /// Bilinear value in 0..=255 at texture position `uv`, edges repeated.
    pub fn sample(&self, uv: DVec2) -> [f32; 3] {
        let at = uv * self.extent;
        self.picture.sample(at.x, at.y)
    }
}

/// The mipmap of a picture's grey values.
#[derive(Clone, Debug)]
pub struct GreyMipmap {
    levels: Vec<GreyLevel>,
}

/// One level of a [`GreyMipmap`].
#[derive(Clone, Debug)]
pub struct GreyLevel {
    image: GreyImage,
    /// As [`MipLevel::extent`].
    extent: [f32; 2],
}

impl GreyMipmap {
    /// Halves `picture` until its shorter side has at most `shortest_side` pixels.
    pub fn new(picture: &Picture, shortest_side: usize) -> Self {
        let mut levels = Vec::new();
        let mut next = Some(MipLevel::finest(picture.clone()));
        while let Some(level) = next {
            levels.push(GreyLevel {
                image: GreyImage::of(&level.picture),
                extent: level.extent.as_vec2().to_array(),
            });
            let shorter = level.picture.width().min(level.picture.height());
            next = level.coarser().filter(|_| shorter > shortest_side);
        }
        Self { levels }
    }

    /// The level with this number, the coarsest one beyond the last.
    pub fn level(&self, level: usize) -> &GreyLevel {
        &self.levels[level.min(self.levels.len() - 1)]
    }
}

impl GreyLevel {
    /// Texels in the whole picture's width and height.
    pub fn extent(&self) -> [f32; 2] {
        self.extent
    }

    /// Bilinear grey value in 0..=255 at texture position (u, v); edges are repeated.
    pub fn sample(&self, [u, v]: [f32; 2]) -> f32 {
        let (image, [columns, rows]) = (&self.image, self.extent);
        let x = (u * columns - 0.5).clamp(0.0, (image.width - 1) as f32);
        let y = (v * rows - 0.5).clamp(0.0, (image.height - 1) as f32);
        let (column, row) = (x as usize, y as usize);
        let (a, b) = (x - column as f32, y - row as f32);
        let right = (column + 1).min(image.width - 1);
        let below = (row + 1).min(image.height - 1) * image.width;
        let row = row * image.width;
        let value = |i: usize| image.values[i];
        let top = value(row + column) * (1.0 - a) + value(row + right) * a;
        let bottom = value(below + column) * (1.0 - a) + value(below + right) * a;
        top * (1.0 - b) + bottom * b
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_edge_stays_where_it_is_on_every_level_also_of_an_odd_size() {
        // Black up to u = 0.8. A level of 46.4 texels that is taken for one of 46 has its edge 0.3 texels off.
        let picture = Picture::from_fn(1485, 1050, |x, _| [if x < 1188 { 0 } else { 255 }; 3]);
        for level in &GreyMipmap::new(&picture, 8).levels[..6] {
            let mut u = 0.0;
            while level.sample([u, 0.5]) < 127.5 {
                u += 1e-4;
            }
            let off = (u - 0.8) * level.extent[0];
            // An edge within a texel makes it grey: interpolation finds the edge to a quarter of a texel.
            assert!(off.abs() < 0.26, "{off} texels of {}", level.extent[0]);
        }
    }

    #[test]
    fn the_levels_end_at_the_shortest_side_or_at_a_single_pixel() {
        let picture = Picture::from_fn(40, 9, |_, _| [7; 3]);
        let sides = |shortest| {
            let levels = GreyMipmap::new(&picture, shortest).levels;
            levels
                .iter()
                .map(|l| (l.image.width, l.image.height))
                .collect::<Vec<_>>()
        };
        assert_eq!(sides(9), [(40, 9)]);
        assert_eq!(sides(8), [(40, 9), (20, 4)]);
        assert_eq!(sides(0), [(40, 9), (20, 4), (10, 2), (5, 1), (2, 1), (1, 1)]);
    }
}
