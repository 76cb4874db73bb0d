//! Grey images.

use super::image_size::ImageSize;
use super::picture::Picture;
use glam::DVec2;

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
}
