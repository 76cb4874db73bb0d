//! A picture at halving sizes.

use super::grey_image::GreyImage;
use super::image_size::ImageSize;
use super::picture::Picture;
use glam::DVec2;
use std::iter::successors;

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
            extent: picture.size().as_dvec2(),
            picture,
        }
    }

    /// The level after as many halvings, the coarsest one beyond the last.
    pub(crate) fn halved(picture: Picture, times: u32) -> Self {
        let finest = Self::finest(picture);
        (0..times).fold(finest, |level, _| level.coarser().unwrap_or(level))
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
        for level in successors(Some(MipLevel::finest(picture.clone())), MipLevel::coarser) {
            levels.push(GreyLevel {
                image: GreyImage::of(&level.picture),
                extent: level.extent.as_vec2().to_array(),
            });
            if level.picture.width().min(level.picture.height()) <= shortest_side {
                break;
            }
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
        let ImageSize { width, height } = image.size;
        let x = (u * columns - 0.5).clamp(0.0, (width - 1) as f32);
        let y = (v * rows - 0.5).clamp(0.0, (height - 1) as f32);
        let (column, row) = (x as usize, y as usize);
        let (a, b) = (x - column as f32, y - row as f32);
        let right = (column + 1).min(width - 1);
        let below = (row + 1).min(height - 1) * width;
        let row = row * width;
        let value = |i: usize| image.values[i];
        let top = value(row + column) * (1.0 - a) + value(row + right) * a;
        let bottom = value(below + column) * (1.0 - a) + value(below + right) * a;
        top * (1.0 - b) + bottom * b
    }
}
