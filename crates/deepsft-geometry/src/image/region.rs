//! Rectangles of images.

use super::grey_image::GreyImage;
use super::image_size::ImageSize;
use std::ops::Range;

/// A rectangle of an image, pixels. What lies in it is stored row by row.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Region {
    pub(crate) left: usize,
    pub(crate) top: usize,
    pub(crate) width: usize,
    pub(crate) height: usize,
}

impl Region {
    pub(crate) fn new(columns: Range<usize>, rows: Range<usize>) -> Self {
        Self {
            left: columns.start,
            top: rows.start,
            width: columns.len(),
            height: rows.len(),
        }
    }

    /// The whole of an image of this size.
    pub(crate) fn whole(size: ImageSize) -> Self {
        Self::new(0..size.width, 0..size.height)
    }

    /// The rectangle with `margin` more on all sides, as far as an image of `size` has them.
    pub(crate) fn grown(&self, margin: usize, size: ImageSize) -> Self {
        let grown =
            |range: Range<usize>, side: usize| range.start.saturating_sub(margin)..(range.end + margin).min(side);
        Self::new(grown(self.columns(), size.width), grown(self.rows(), size.height))
    }

    pub(crate) fn columns(&self) -> Range<usize> {
        self.left..self.left + self.width
    }

    pub(crate) fn rows(&self) -> Range<usize> {
        self.top..self.top + self.height
    }

    pub(crate) fn area(&self) -> usize {
        self.width * self.height
    }

    /// Its pixels (column, row of the image) in the order in which they are stored.
    pub fn pixels(&self) -> impl Iterator<Item = (usize, usize)> + use<> {
        let columns = self.columns();
        self.rows()
            .flat_map(move |row| columns.clone().map(move |column| (column, row)))
    }

    /// Where the pixel of the image with this column and row is stored, if it lies in the rectangle.
    pub fn index(&self, column: usize, row: usize) -> Option<usize> {
        let (x, y) = (column.wrapping_sub(self.left), row.wrapping_sub(self.top));
        (x < self.width && y < self.height).then(|| y * self.width + x)
    }

    /// The values of the rectangle in an `image`.
    pub(crate) fn of<'a>(&self, image: &'a GreyImage) -> impl Iterator<Item = f32> + 'a {
        let columns = self.columns();
        let rows = image.values.chunks_exact(image.size.width.max(1));
        rows.skip(self.top)
            .take(self.height)
            .flat_map(move |row| row[columns.clone()].iter().copied())
    }
}
