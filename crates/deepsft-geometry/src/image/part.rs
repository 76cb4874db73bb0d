//! Rectangles of images.

use super::grey_image::GreyImage;
use super::image_size::ImageSize;
use std::ops::Range;

/// A rectangle of an image, pixels. What lies in it is stored row by row.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Part {
    pub left: usize,
    pub top: usize,
    pub width: usize,
    pub height: usize,
}

impl Part {
    /// The whole of an image of this size.
    pub fn whole(ImageSize { width, height }: ImageSize) -> Self {
        Self {
            left: 0,
            top: 0,
            width,
            height,
        }
    }

    /// These columns and rows, and `margin` more on all sides as far as an image of `size` has them.
    pub fn around(columns: &Range<usize>, rows: &Range<usize>, margin: usize, size: ImageSize) -> Self {
        let (left, top) = (columns.start.saturating_sub(margin), rows.start.saturating_sub(margin));
        Self {
            left,
            top,
            width: (columns.end + margin).min(size.width) - left,
            height: (rows.end + margin).min(size.height) - top,
        }
    }

    /// Number of pixels.
    pub fn area(&self) -> usize {
        self.width * self.height
    }

    /// Its pixels (column, row of the image) in the order in which they are stored.
    pub fn pixels(&self) -> impl Iterator<Item = (usize, usize)> + use<> {
        let Self { left, width, .. } = *self;
        (self.top..self.top + self.height).flat_map(move |row| (left..left + width).map(move |column| (column, row)))
    }

    /// Where the pixel of the image with this column and row is stored, if it lies in the rectangle.
    pub fn index(&self, column: usize, row: usize) -> Option<usize> {
        let (x, y) = (column.wrapping_sub(self.left), row.wrapping_sub(self.top));
        (x < self.width && y < self.height).then(|| y * self.width + x)
    }

    /// The values of the rectangle in an `image`.
    pub fn of<'a>(&self, image: &'a GreyImage) -> impl Iterator<Item = f32> + 'a {
        let Self {
            left, width: columns, ..
        } = *self;
        let rows = image.values.chunks_exact(image.size.width.max(1)).skip(self.top).take(self.height);
        rows.flat_map(move |row| row[left..left + columns].iter().copied())
    }
}
