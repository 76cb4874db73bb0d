//! An 8-bit RGB picture in memory, and quarter turns of pixels.

use super::image_size::ImageSize;
use crate::error::{GeometryError, Result};
use std::fmt;

/// An 8-bit sRGB picture, row-major, three bytes per pixel, first row on top.
#[derive(Clone, PartialEq, Eq)]
pub struct Picture {
    size: ImageSize,
    rgb: Vec<u8>,
}

impl fmt::Debug for Picture {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "Picture({})", self.size)
    }
}

impl Picture {
    /// Takes a buffer of `3 * width * height` bytes.
    ///
    /// # Errors
    /// [`GeometryError::PictureSize`] without pixels and when the buffer's length does not fit.
    pub fn new(width: usize, height: usize, rgb: Vec<u8>) -> Result<Self> {
        let size = ImageSize { width, height };
        let actual = rgb.len();
        // More pixels than any memory has do not wrap around to a small number.
        if size.area() == 0 || actual != size.area().saturating_mul(3) {
            return Err(GeometryError::PictureSize { size, actual });
        }
        Ok(Self { size, rgb })
    }

    /// A picture whose pixel (column `x`, row `y`) is `color(x, y)`. A zero side is taken as one.
    pub fn from_fn(width: usize, height: usize, mut color: impl FnMut(usize, usize) -> [u8; 3]) -> Self {
        let (width, height) = (width.max(1), height.max(1));
        let mut rgb = Vec::with_capacity(3 * width * height);
        for y in 0..height {
            for x in 0..width {
                rgb.extend_from_slice(&color(x, y));
            }
        }
        Self::from_rows(width, height, rgb)
    }

    /// A picture of rows that were just filled, three bytes per pixel.
    pub(crate) fn from_rows(width: usize, height: usize, rgb: Vec<u8>) -> Self {
        let size = ImageSize { width, height };
        debug_assert_eq!(rgb.len(), 3 * size.area());
        Self { size, rgb }
    }

    /// Columns.
    pub fn width(&self) -> usize {
        self.size.width
    }

    /// Rows.
    pub fn height(&self) -> usize {
        self.size.height
    }

    /// Columns and rows.
    pub fn size(&self) -> ImageSize {
        self.size
    }

    /// The bytes, row-major, three per pixel.
    pub fn rgb(&self) -> &[u8] {
        &self.rgb
    }

    /// The pixel at column `x`, row `y`, both clamped into the picture.
    pub fn pixel(&self, x: usize, y: usize) -> [u8; 3] {
        let ImageSize { width, height } = self.size;
        let i = 3 * (y.min(height - 1) * width + x.min(width - 1));
        [self.rgb[i], self.rgb[i + 1], self.rgb[i + 2]]
    }

    /// Bilinear value in 0..=255 at image position (`x`, `y`) in pixels, pixel centres at half
    /// integers, edges repeated.
    pub fn sample(&self, x: f64, y: f64) -> [f32; 3] {
        let fx = (x - 0.5).clamp(0.0, (self.width() - 1) as f64);
        let fy = (y - 0.5).clamp(0.0, (self.height() - 1) as f64);
        let (x0, y0) = (fx as usize, fy as usize);
        let (ax, ay) = ((fx - x0 as f64) as f32, (fy - y0 as f64) as f32);
        let (a, b) = (self.pixel(x0, y0), self.pixel(x0 + 1, y0));
        let (c, d) = (self.pixel(x0, y0 + 1), self.pixel(x0 + 1, y0 + 1));
        std::array::from_fn(|k| {
            let top = f32::from(a[k]) * (1.0 - ax) + f32::from(b[k]) * ax;
            let bottom = f32::from(c[k]) * (1.0 - ax) + f32::from(d[k]) * ax;
            top * (1.0 - ay) + bottom * ay
        })
    }

    /// The picture turned by a quarter clockwise: its left column becomes the first row, read upwards.
    #[must_use]
    pub fn turned_clockwise(&self) -> Self {
        let ImageSize { width, height } = self.size;
        let rgb = turned_clockwise(self.rgb.as_chunks::<3>().0, width).into_flattened();
        Self::from_rows(height, width, rgb)
    }

    /// Halves the picture (rounded down, at least one pixel): each pixel is the mean of four. It is the next level of
    /// a mipmap.
    pub fn halved(&self) -> Self {
        Self::from_fn(self.width() / 2, self.height() / 2, |x, y| {
            let p = [(0, 0), (1, 0), (0, 1), (1, 1)].map(|(i, j)| self.pixel(2 * x + i, 2 * y + j));
            std::array::from_fn(|k| {
                let sum: u16 = p.iter().map(|c| u16::from(c[k])).sum();
                ((sum + 2) / 4) as u8
            })
        })
    }
}

/// Pixels in rows of `width`, turned by a quarter clockwise: the first row becomes the last column.
pub fn turned_clockwise<T: Copy>(pixels: &[T], width: usize) -> Vec<T> {
    let column = |x: usize| pixels[x..].iter().step_by(width).rev();
    (0..width.min(pixels.len())).flat_map(column).copied().collect()
}

/// Pixels in rows of `width`, turned by a quarter anticlockwise: the first row becomes the first column, read upwards.
pub fn turned_anticlockwise<T: Copy>(pixels: &[T], width: usize) -> Vec<T> {
    let column = |x: usize| pixels[x..].iter().step_by(width);
    (0..width.min(pixels.len())).rev().flat_map(column).copied().collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_quarter_turn_moves_the_corners_and_the_opposite_one_undoes_it() {
        let pixels = [1, 2, 3, 4, 5, 6];
        assert_eq!(turned_clockwise(&pixels, 3), [4, 1, 5, 2, 6, 3]);
        assert_eq!(turned_anticlockwise(&pixels, 3), [3, 6, 2, 5, 1, 4]);
        assert_eq!(turned_anticlockwise(&turned_clockwise(&pixels, 3), 2), pixels);
        assert_eq!(turned_clockwise::<u8>(&[], 3), []);
    }
}
