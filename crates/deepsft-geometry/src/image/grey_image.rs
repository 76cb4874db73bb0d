//! Grey images.

use super::image_size::ImageSize;
use super::picture::Picture;

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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn halving_takes_the_mean_of_four_and_leaves_out_an_odd_last_row_and_column() {
        let values = (1..16).map(|k| (k * k) as f32).collect();
        let size = (5, 3).into();
        let half = GreyImage { size, values }.halved_into(vec![7.0; 3]);
        assert_eq!(half.size, (2, 1).into());
        assert_eq!(
            half.values,
            [(1 + 4 + 36 + 49) as f32 / 4.0, (9 + 16 + 64 + 81) as f32 / 4.0]
        );
    }
}
