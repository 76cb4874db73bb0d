//! Grey values freed from light and gain.

use super::grey_image::{GreyImage, Region};
use super::image_size::ImageSize;
use super::picture::Picture;
use glam::DVec2;

/// Grey levels added to the local deviation, so that noise on an even surface is not blown up to texture.
const FLOOR_LEVELS: f32 = 4.0;

/// Gaussian windows are cut off at this many standard deviations.
const WINDOW_SIGMAS: f32 = 3.0;

/// Taken off grey values before they are squared, so that rounding does not spoil the deviation.
const MIDDLE_LEVEL: f32 = 128.0;

/// How far a picture goes on beyond its edge, and how far before its last pixel centres it is sampled for that, pixels.
const CONTINUED_PX: f64 = 8.0;
const EDGE: f64 = 1e-6;

/// Fraction of a blurred neighbourhood that must be seen for a value to exist.
const MIN_SUPPORT: f32 = 0.02;

/// A picture after local contrast normalisation: grey values minus local mean, divided by local deviation. It stays
/// the same when light and exposure change.
#[derive(Clone, Debug)]
pub struct ContrastNormalizedImage {
    size: ImageSize,
    /// Centres of the first and the last pixel that show anything, less half a pixel.
    shown: [DVec2; 2],
    /// The part of the picture that has values; elsewhere they are 0.
    region: Region,
    pub(crate) values: Vec<f32>,
}

impl ContrastNormalizedImage {
    /// Normalises the local contrast of a picture that is blurred by a Gaussian of `blur_px` (0 for none). A fit from
    /// coarse to fine takes large blurs first. Mean and deviation (plus 4 grey levels) are those of a Gaussian window
    /// of `window_px`; 8 suits prints seen on a 480 x 270 image.
    pub fn new(picture: &Picture, blur_px: f32, window_px: f32) -> Self {
        let GreyImage { size, values } = GreyImage::of(picture);
        let everywhere = vec![1.0; values.len()];
        let normalizer = ContrastNormalizer::new(everywhere, Region::whole(size), size, blur_px, window_px);
        normalizer.normalize(values.into_iter())
    }

    /// Says that the picture shows nothing outside of `shown`: that lies beyond its edge.
    pub(crate) fn shown_in(self, shown: Region) -> Self {
        let first = DVec2::new(shown.left as f64, shown.top as f64);
        let last = first + DVec2::new(shown.width as f64, shown.height as f64) - 1.0;
        let shown = [first, last];
        Self { shown, ..self }
    }

    /// Columns and rows.
    pub fn size(&self) -> ImageSize {
        self.size
    }

    /// Samples value and gradient (per pixel) at an image position, bilinear, pixel centres at half integers. `None`
    /// outside the outermost pixel centres that show anything.
    #[inline]
    pub fn sample(&self, at: DVec2) -> Option<(f64, DVec2)> {
        let p = at - 0.5;
        let [first, last] = self.shown;
        if !(p.x >= first.x && p.y >= first.y && p.x < last.x && p.y < last.y) {
            return None;
        }
        let (x, y) = (p.x as usize, p.y as usize);
        let (fx, fy) = (p.x - x as f64, p.y - y as f64);
        let [a, b, c, d] = self.square(x, y).map(f64::from);
        let gradient = DVec2::new((b - a) * (1.0 - fy) + (d - c) * fy, (c - a) * (1.0 - fx) + (d - b) * fx);
        Some((a + gradient.x * fx + (c - a) * fy, gradient))
    }

    /// As [`Self::sample`]; up to 8 pixels beyond its edge the picture goes on as it ends. A point that may not leave the picture would hold
    /// the mesh there.
    #[inline]
    pub(crate) fn sample_continued(&self, at: DVec2) -> Option<(f64, DVec2)> {
        self.sample(at).or_else(|| {
            let [first, last] = self.shown.map(|end| end + 0.5);
            let inside = at.max(first).min(last - EDGE);
            let (value, gradient) = self.sample(inside).filter(|_| at.distance(inside) < CONTINUED_PX)?;
            Some((value, DVec2::select(at.cmpeq(inside), gradient, DVec2::ZERO)))
        })
    }

    /// Values of the pixel, its right neighbour, and the two below.
    #[inline]
    fn square(&self, x: usize, y: usize) -> [f32; 4] {
        let width = self.region.width;
        let (column, row) = (x.wrapping_sub(self.region.left), y.wrapping_sub(self.region.top));
        if column < width.saturating_sub(1) && row < self.region.height.saturating_sub(1) {
            let values = &self.values[row * width + column..];
            return [values[0], values[1], values[width], values[width + 1]];
        }
        [(x, y), (x + 1, y), (x, y + 1), (x + 1, y + 1)]
            .map(|(x, y)| self.region.index(x, y).map_or(0.0, |index| self.values[index]))
    }
}

/// Normalises pictures under one mask: all averages run over the mask's pixels alone, so that nothing leaks in from
/// what lies beside or before the object.
///
/// Mean and deviation change slowly, over the window's width: they are taken on cells of 4 x 4 pixels and
/// interpolated, which makes them cost less than the blur (a twentieth of what they cost pixel by pixel).
pub(crate) struct ContrastNormalizer {
    size: ImageSize,
    region: Region,
    mask: Vec<f32>,
    blur: Vec<f32>,
    /// 1 / the fraction of the blurred neighbourhood that is seen, 0 where that is next to nothing.
    per_support: Vec<f32>,
    window: Vec<f32>,
    /// Seen pixels around each cell.
    cell_support: Vec<f32>,
}

/// Pixels along each side of the cells in which mean and deviation are taken.
const CELL: usize = 4;

impl ContrastNormalizer {
    /// For a `mask` (0 or 1 for each pixel of `region`) of images of `size`; `blur_px` and `window_px` as in
    /// [`ContrastNormalizedImage::new`].
    pub(crate) fn new(mask: Vec<f32>, region: Region, size: ImageSize, blur_px: f32, window_px: f32) -> Self {
        let blur = half_gaussian(blur_px);
        let support = blurred(&mask, region.width, region.height, &blur);
        let per_support = |s: f32| if s > MIN_SUPPORT { s.recip() } else { 0.0 };
        let mut this = Self {
            size,
            region,
            mask,
            blur,
            per_support: support.into_iter().map(per_support).collect(),
            window: half_gaussian(window_px / CELL as f32),
            cell_support: Vec::new(),
        };
        this.cell_support = this.around_cells(|i| this.mask[i]);
        this
    }

    /// Pixels beside a mask up to which its picture is blurred.
    pub(crate) fn reach(blur_px: f32) -> usize {
        half_gaussian(blur_px).len() + 1
    }

    /// The normalised picture with these grey values in the part. 0 where nothing is seen nearby.
    pub(crate) fn normalize(&self, grey: impl Iterator<Item = f32>) -> ContrastNormalizedImage {
        let masked: Vec<f32> = grey.zip(&self.mask).map(|(v, m)| (v - MIDDLE_LEVEL) * m).collect();
        let mut values = blurred(&masked, self.region.width, self.region.height, &self.blur);
        values.iter_mut().zip(&self.per_support).for_each(|(v, s)| *v *= s);
        let sums = self.around_cells(|i| self.mask[i] * values[i]);
        let squares = self.around_cells(|i| self.mask[i] * values[i] * values[i]);
        let statistics = self.cell_support.iter().zip(sums.iter().zip(&squares));
        let mean_and_gain = |(&n, (sum, square)): (&f32, (&f32, &f32))| {
            if n <= MIN_SUPPORT {
                return (0.0, 0.0);
            }
            let mean = sum / n;
            let variance = square / n - mean * mean;
            (mean, (variance.max(0.0).sqrt() + FLOOR_LEVELS).recip())
        };
        let (means, gains): (Vec<f32>, Vec<f32>) = statistics.map(mean_and_gain).unzip();
        self.subtract_and_scale(&mut values, &means, &gains);
        ContrastNormalizedImage {
            size: self.size,
            shown: [DVec2::ZERO, self.size.as_dvec2() - 1.0],
            region: self.region,
            values,
        }
    }

    fn cells(&self) -> (usize, usize) {
        (self.region.width.div_ceil(CELL), self.region.height.div_ceil(CELL))
    }

    /// Sums of `value` over cells, a pixel's fraction of a whole cell, averaged over the window.
    fn around_cells(&self, value: impl Fn(usize) -> f32) -> Vec<f32> {
        let (columns, rows) = self.cells();
        let mut sums = vec![0.0_f32; columns * rows];
        for y in 0..self.region.height {
            let row = &mut sums[y / CELL * columns..][..columns];
            for x in 0..self.region.width {
                row[x / CELL] += value(y * self.region.width + x);
            }
        }
        let fraction = ((CELL * CELL) as f32).recip();
        sums.iter_mut().for_each(|s| *s *= fraction);
        blurred(&sums, columns, rows, &self.window)
    }

    /// (value - mean) gain at every pixel with something seen nearby, mean and gain bilinear between the cells' centres.
    fn subtract_and_scale(&self, values: &mut [f32], means: &[f32], gains: &[f32]) {
        let (columns, rows) = self.cells();
        let place = |pixel: usize, cells: usize| {
            let at = ((pixel as f32 + 0.5) / CELL as f32 - 0.5).clamp(0.0, (cells - 1) as f32);
            let first = at as usize;
            (first, (first + 1).min(cells - 1), at - first as f32)
        };
        let across: Vec<_> = (0..self.region.width).map(|x| place(x, columns)).collect();
        let (mut mean_row, mut gain_row) = (vec![0.0_f32; columns], vec![0.0_f32; columns]);
        for (y, row) in values.chunks_exact_mut(self.region.width.max(1)).enumerate() {
            let (above, below, b) = place(y, rows);
            let lerp = |cells: &[f32], out: &mut [f32]| {
                let [above, below] = [above, below].map(|row| &cells[row * columns..][..columns]);
                for ((o, a), c) in out.iter_mut().zip(above).zip(below) {
                    *o = a + b * (c - a);
                }
            };
            lerp(means, &mut mean_row);
            lerp(gains, &mut gain_row);
            let supports = &self.per_support[y * self.region.width..];
            for ((value, &(left, right, a)), &support) in row.iter_mut().zip(&across).zip(supports) {
                let mean = mean_row[left] + a * (mean_row[right] - mean_row[left]);
                let gain = gain_row[left] + a * (gain_row[right] - gain_row[left]);
                *value = if support > 0.0 { (*value - mean) * gain } else { 0.0 };
            }
        }
    }
}

/// The middle and one side of a Gaussian window that sums to 1; 1 alone when `deviation` is not positive.
fn half_gaussian(deviation: f32) -> Vec<f32> {
    if deviation <= 0.0 || deviation.is_nan() {
        return vec![1.0];
    }
    let radius = (WINDOW_SIGMAS * deviation).ceil() as usize;
    let gaussian = |k: usize| (-0.5 * (k as f32 / deviation).powi(2)).exp();
    let window: Vec<f32> = (0..=radius).map(gaussian).collect();
    let sum = window[0] + 2.0 * window[1..].iter().sum::<f32>();
    window.into_iter().map(|w| w / sum).collect()
}

/// Separable blur with a symmetric window (its middle and one side), nothing beyond the edge.
fn blurred(values: &[f32], width: usize, height: usize, window: &[f32]) -> Vec<f32> {
    let radius = window.len() - 1;
    if radius == 0 || width == 0 {
        return values.to_vec();
    }
    let mut across = vec![0.0_f32; values.len()];
    let mut padded = vec![0.0_f32; width + 2 * radius];
    for (row, out) in values.chunks_exact(width).zip(across.chunks_exact_mut(width)) {
        padded[radius..radius + width].copy_from_slice(row);
        out.iter_mut().zip(row).for_each(|(o, v)| *o = window[0] * v);
        for (k, &weight) in window.iter().enumerate().skip(1) {
            let (before, after) = (&padded[radius - k..][..width], &padded[radius + k..][..width]);
            add_pairs(out, before, after, weight);
        }
    }
    let mut down: Vec<f32> = across.iter().map(|v| window[0] * v).collect();
    let none = vec![0.0_f32; width];
    let row = |y: Option<usize>| {
        y.filter(|&y| y < height)
            .map_or(&none[..], |y| &across[y * width..][..width])
    };
    for (y, out) in down.chunks_exact_mut(width).enumerate() {
        for (k, &weight) in window.iter().enumerate().skip(1) {
            add_pairs(out, row(y.checked_sub(k)), row(Some(y + k)), weight);
        }
    }
    down
}

fn add_pairs(out: &mut [f32], before: &[f32], after: &[f32], weight: f32) {
    for ((o, a), b) in out.iter_mut().zip(before).zip(after) {
        *o += weight * (a + b);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_lies_outside_the_mask_does_not_matter() {
        let pattern = |x: usize, y: usize| 40 + (x * 37 + y * 61) % 160;
        let picture = Picture::from_fn(64, 48, |x, y| [pattern(x, y) as u8; 3]);
        let painted = Picture::from_fn(64, 48, |x, y| [if x < 40 { pattern(x, y) as u8 } else { 255 }; 3]);
        let mask: Vec<f32> = (0..64 * 48).map(|i| f32::from(u8::from(i % 64 < 40))).collect();
        let [one, other] = [picture, painted].map(|p| {
            ContrastNormalizer::new(mask.clone(), Region::whole(p.size()), p.size(), 2.0, 8.0)
                .normalize(GreyImage::of(&p).values.into_iter())
                .values
        });
        assert_eq!(one, other);
        assert!(one.iter().any(|v| v.abs() > 0.5));
    }

    #[test]
    fn an_even_picture_is_zero_and_the_gradient_is_that_of_the_value() {
        let even = ContrastNormalizedImage::new(&Picture::from_fn(20, 10, |_, _| [99; 3]), 2.0, 4.0);
        assert!(even.values.iter().all(|v| v.abs() < 1e-3));
        let image =
            ContrastNormalizedImage::new(&Picture::from_fn(20, 10, |x, y| [(x * x + 7 * y) as u8; 3]), 0.0, 4.0);
        let at = DVec2::new(7.3, 4.9);
        let (_, gradient) = image.sample(at).unwrap();
        for axis in [DVec2::X, DVec2::Y] {
            let moved = |by: f64| image.sample(at + by * axis).unwrap().0;
            // Bilinear: exact within a pixel but for rounding.
            assert!(((moved(1e-3) - moved(-1e-3)) / 2e-3 - gradient.dot(axis)).abs() < 1e-9);
        }
        assert_eq!(image.sample(DVec2::new(0.4, 5.0)), None);
        assert_eq!(image.sample(DVec2::NAN), None);
        let (value, gradient) = image.sample_continued(DVec2::new(25.0, 4.9)).unwrap();
        let (edge, slope) = image.sample(DVec2::new(19.499, 4.9)).unwrap();
        assert!((value - edge).abs() < 0.01 && gradient == DVec2::new(0.0, gradient.y));
        assert!((gradient.y - slope.y).abs() < 0.01 && slope.x.abs() > 0.1);
        assert_eq!(image.sample_continued(DVec2::new(28.0, 4.9)), None);
        let part = image.shown_in(Region::new(3..15, 2..9));
        assert!(part.sample(DVec2::new(3.4, 4.9)).is_none() && part.sample(at).is_some());
    }
}
