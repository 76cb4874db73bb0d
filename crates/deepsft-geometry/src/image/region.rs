//! Rectangles of images.

use super::grey_image::GreyImage;
use super::image_size::ImageSize;
use std::ops::Range;

/// Most that a pixel of a black bar has.
const BLACK: f32 = 4.0;

/// Least fraction of a column beside a bar that is lit: a bar is as long as the image, which a lit sheet before a black wall is not.
const BESIDE_BAR: f64 = 0.9;

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

    /// What `image` shows: without the black bars that a narrower image leaves in a canonical one, and without the outermost pixels, part
    /// of which may lie beyond the image.
    pub(crate) fn shown(image: &GreyImage) -> Self {
        let ImageSize { width, height } = image.size;
        let is_lit = |column: usize, row: usize| image.values[row * width + column] > BLACK;
        let inside = |side: usize, across: usize, is_lit: &dyn Fn(usize, usize) -> bool| {
            let lit = |place: usize| (0..across).filter(|k| is_lit(place, *k)).count() as f64 / across as f64;
            // The outermost that is lit may be so in part.
            let is_end =
                |outermost: usize, next: usize| outermost == 0 || outermost + 1 == side || lit(next) >= BESIDE_BAR;
            let first = (0..side).find(|place| lit(*place) > 0.0);
            let last = (0..side).rfind(|place| lit(*place) > 0.0);
            let first = first.filter(|first| is_end(*first, (first + 1).min(side - 1)));
            let last = last.filter(|last| is_end(*last, last.saturating_sub(1)));
            first.unwrap_or(0) + 1..last.unwrap_or(side.saturating_sub(1))
        };
        Self::new(
            inside(width, height, &is_lit),
            inside(height, width, &|row, column| is_lit(column, row)),
        )
    }

    /// The rectangle with `margin` more on all sides, as far as `whole` has them.
    pub(crate) fn grown(&self, margin: usize, whole: &Self) -> Self {
        let grown = |own: Range<usize>, whole: Range<usize>| {
            let start = own
                .start
                .saturating_sub(margin)
                .clamp(whole.start, whole.end.max(whole.start));
            start..(own.end + margin).min(whole.end).max(start)
        };
        Self::new(grown(self.columns(), whole.columns()), grown(self.rows(), whole.rows()))
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bars_beside_an_image_are_not_shown_but_a_black_wall_is() {
        let shown = |is_lit: &dyn Fn(usize, usize) -> bool| {
            let size = (40, 30).into();
            let whole = Region::whole(size).pixels();
            let values = whole.map(|(x, y)| if is_lit(x, y) { 90.0 } else { 0.0 }).collect();
            Region::shown(&GreyImage { size, values })
        };
        assert_eq!(shown(&|x, _| (4..33).contains(&x)), Region::new(5..32, 1..29));
        assert_eq!(shown(&|_, y| y < 25), Region::new(1..39, 1..24));
        let inside = Region::new(1..39, 1..29);
        assert_eq!(shown(&|x, y| (4..33).contains(&x) && (2..25).contains(&y)), inside);
        assert_eq!(shown(&|_, _| false), inside);
    }
}
