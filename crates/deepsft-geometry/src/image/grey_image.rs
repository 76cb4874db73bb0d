//! Grey images, and rectangles of images.

use super::image_size::ImageSize;
use super::picture::Picture;
use glam::DVec2;
use std::ops::Range;

/// A grey image, row-major, 0..=255.
#[derive(Clone, PartialEq)]
pub(crate) struct GreyImage {
    pub size: ImageSize,
    pub values: Vec<f32>,
}

impl std::fmt::Debug for GreyImage {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "GreyImage({})", self.size)
    }
}

impl GreyImage {
    /// The [`luma`] of each pixel.
    pub(crate) fn of(picture: &Picture) -> Self {
        Self::of_into(picture, Vec::new())
    }

    /// As [`GreyImage::of`], in memory that is there already; what was in it is gone.
    pub(crate) fn of_into(picture: &Picture, mut values: Vec<f32>) -> Self {
        values.clear();
        values.extend(picture.rgb().as_chunks().0.iter().map(|&c| luma(c)));
        let size = picture.size();
        Self { size, values }
    }

    /// The value at an image position, bilinear, pixel centres at half integers. `None` outside the outermost pixel centres.
    pub(crate) fn sample(&self, at: DVec2) -> Option<f64> {
        let p = at - 0.5;
        let last = self.size.as_dvec2() - 1.0;
        if !(p.cmpge(DVec2::ZERO).all() && p.cmplt(last).all()) {
            return None;
        }
        let (floor, [fx, fy]) = (p.floor(), p.fract().to_array());
        let above = &self.values[floor.y as usize * self.size.width + floor.x as usize..];
        let below = &above[self.size.width..];
        let [a, b, c, d] = [above[0], above[1], below[0], below[1]].map(f64::from);
        Some((a * (1.0 - fx) + b * fx) * (1.0 - fy) + (c * (1.0 - fx) + d * fx) * fy)
    }

    /// The image at half the size (rounded down), each pixel the mean of the four that it covers; in memory that is there already.
    pub(crate) fn halved_into(&self, mut values: Vec<f32>) -> Self {
        let (width, size) = (self.size.width, self.size.halved());
        values.clear();
        values.reserve_exact(size.area());
        for rows in self.values.chunks_exact(2 * width.max(1)) {
            let (above, below) = rows.split_at(width);
            let pairs = above.as_chunks::<2>().0.iter().zip(below.as_chunks::<2>().0);
            values.extend(pairs.map(|([a, b], [c, d])| 0.25 * ((a + b) + (c + d))));
        }
        Self { size, values }
    }
}

/// Rec. 601 luma of a stored (gamma) colour, 0..=255.
pub fn luma([r, g, b]: [u8; 3]) -> f32 {
    0.299 * f32::from(r) + 0.587 * f32::from(g) + 0.114 * f32::from(b)
}

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
            let start = own.start.saturating_sub(margin);
            let start = start.clamp(whole.start, whole.end.max(whole.start));
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
        let (rows, columns) = (self.rows(), self.columns());
        rows.flat_map(move |row| columns.clone().map(move |column| (column, row)))
    }

    /// Where the pixel of the image with this column and row is stored, if it lies in the rectangle.
    pub fn index(&self, column: usize, row: usize) -> Option<usize> {
        let (x, y) = (column.wrapping_sub(self.left), row.wrapping_sub(self.top));
        (x < self.width && y < self.height).then(|| y * self.width + x)
    }

    pub(crate) fn of<'a>(&self, image: &'a GreyImage) -> impl Iterator<Item = f32> + 'a {
        let columns = self.columns();
        let rows = image.values.chunks_exact(image.size.width.max(1)).skip(self.top);
        let rows = rows.take(self.height);
        rows.flat_map(move |row| row[columns.clone()].iter().copied())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn halving_takes_the_mean_of_four_and_leaves_out_an_odd_last_row_and_column() {
        let values = (1..16).map(|k| (k * k) as f32).collect();
        let size = (5, 3).into();
        let half = GreyImage { size, values }.halved_into(vec![7.0; 3]);
        assert_eq!(half.size, (2, 1).into());
        let means = [(1 + 4 + 36 + 49) as f32 / 4.0, (9 + 16 + 64 + 81) as f32 / 4.0];
        assert_eq!(half.values, means);
    }

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
