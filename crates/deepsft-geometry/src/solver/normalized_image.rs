//! Grey values freed from light and gain.

use crate::Picture;
use glam::DVec2;

/// Grey levels added to the local deviation, so that noise on an even surface is not blown up to texture.
const FLOOR_LEVELS: f32 = 4.0;

/// Gaussian windows are cut off at this many standard deviations.
const WINDOW_SIGMAS: f32 = 3.0;

/// Share of a blurred neighbourhood that must be seen for a value to exist.
const LEAST_SUPPORT: f32 = 0.02;

/// A grey image, row-major, 0..=255.
#[derive(Clone, Debug)]
pub(crate) struct GreyImage {
    pub width: usize,
    pub height: usize,
    pub values: Vec<f32>,
}

impl GreyImage {
    /// Rec. 601 luma of the stored (gamma) values.
    pub fn of(picture: &Picture) -> Self {
        let luma = |c: &[u8]| 0.299 * f32::from(c[0]) + 0.587 * f32::from(c[1]) + 0.114 * f32::from(c[2]);
        Self {
            width: picture.width(),
            height: picture.height(),
            values: picture.rgb().chunks_exact(3).map(luma).collect(),
        }
    }
}

/// A picture as grey values minus their local mean, divided by their local deviation: what stays the same when
/// light and exposure change.
#[derive(Clone, Debug)]
pub struct NormalizedImage {
    width: usize,
    height: usize,
    values: Vec<f32>,
}

impl NormalizedImage {
    /// Blurs the grey picture with a Gaussian of `blur_px` (0 for none; large first, small last when a fit
    /// goes from coarse to fine), then subtracts the mean and divides by the deviation plus 4 grey
    /// levels in a Gaussian window of `window_px` (8 suits prints seen on a 480 x 270 image).
    pub fn new(picture: &Picture, blur_px: f32, window_px: f32) -> Self {
        let grey = GreyImage::of(picture);
        let everywhere = vec![1.0; grey.values.len()];
        Self::masked(&grey, &everywhere, blur_px, window_px)
    }

    /// The same where `mask` is 1 (0 or 1 a pixel, row-major): all averages run over those pixels alone, so that
    /// nothing leaks in from what lies beside or before the object. 0 where nothing is seen nearby.
    pub(crate) fn masked(grey: &GreyImage, mask: &[f32], blur_px: f32, window_px: f32) -> Self {
        let (width, height) = (grey.width, grey.height);
        let mean_of = |values: &[f32], support: &[f32], deviation: f32| -> Vec<f32> {
            let masked: Vec<f32> = values.iter().zip(mask).map(|(v, m)| v * m).collect();
            let sums = gaussian(&masked, width, height, deviation);
            let mean = |(sum, &n): (f32, &f32)| if n > LEAST_SUPPORT { sum / n } else { 0.0 };
            sums.into_iter().zip(support).map(mean).collect()
        };
        let near = gaussian(mask, width, height, blur_px);
        let wide = gaussian(mask, width, height, window_px);
        let smooth = mean_of(&grey.values, &near, blur_px);
        let mean = mean_of(&smooth, &wide, window_px);
        let squares: Vec<f32> = smooth.iter().zip(&mean).map(|(v, m)| (v - m) * (v - m)).collect();
        let variance = mean_of(&squares, &wide, window_px);
        let contrast = (smooth.iter().zip(&mean).zip(&variance).zip(&near)).map(|(((v, m), s), &n)| {
            if n > LEAST_SUPPORT {
                (v - m) / (s.max(0.0).sqrt() + FLOOR_LEVELS)
            } else {
                0.0
            }
        });
        Self {
            width,
            height,
            values: contrast.collect(),
        }
    }

    /// Value of the pixel with row-major index `index`.
    pub(crate) fn pixel(&self, index: usize) -> f64 {
        f64::from(self.values[index])
    }

    /// Columns.
    pub fn width(&self) -> usize {
        self.width
    }

    /// Rows.
    pub fn height(&self) -> usize {
        self.height
    }

    /// Bilinear value and its gradient (per pixel) at an image position, pixel centres at half integers;
    /// `None` outside the outermost pixel centres.
    pub fn sample(&self, at: DVec2) -> Option<(f64, DVec2)> {
        let p = at - 0.5;
        let last = DVec2::new((self.width - 1) as f64, (self.height - 1) as f64);
        if !(p.x >= 0.0 && p.y >= 0.0 && p.x < last.x && p.y < last.y) {
            return None;
        }
        let (x, y) = (p.x as usize, p.y as usize);
        let (fx, fy) = (p.x - x as f64, p.y - y as f64);
        let value = |dx: usize, dy: usize| f64::from(self.values[(y + dy) * self.width + x + dx]);
        let (a, b, c, d) = (value(0, 0), value(1, 0), value(0, 1), value(1, 1));
        let gradient = DVec2::new((b - a) * (1.0 - fy) + (d - c) * fy, (c - a) * (1.0 - fx) + (d - b) * fx);
        Some((a + gradient.x * fx + (c - a) * fy, gradient))
    }
}

/// Separable Gaussian blur, nothing beyond the edge; the input when `deviation` is not positive.
fn gaussian(values: &[f32], width: usize, height: usize, deviation: f32) -> Vec<f32> {
    if deviation <= 0.0 || deviation.is_nan() {
        return values.to_vec();
    }
    let radius = (WINDOW_SIGMAS * deviation).ceil() as usize;
    let kernel: Vec<f32> = (0..=radius)
        .map(|k| (-0.5 * (k as f32 / deviation).powi(2)).exp())
        .collect();
    let sum = kernel[0] + 2.0 * kernel[1..].iter().sum::<f32>();
    let kernel: Vec<f32> = kernel.iter().map(|k| k / sum).collect();
    let mut across = vec![0.0_f32; values.len()];
    for (row, out) in values.chunks_exact(width).zip(across.chunks_exact_mut(width)) {
        for (k, &weight) in kernel.iter().enumerate() {
            if k >= width {
                break;
            }
            for (o, v) in out[k..].iter_mut().zip(row) {
                *o += weight * v;
            }
            if k > 0 {
                for (o, v) in out.iter_mut().zip(&row[k..]) {
                    *o += weight * v;
                }
            }
        }
    }
    let mut down = vec![0.0_f32; values.len()];
    for (k, &weight) in kernel.iter().enumerate() {
        if k >= height {
            break;
        }
        let shift = k * width;
        for (o, v) in down[shift..].iter_mut().zip(&across) {
            *o += weight * v;
        }
        if k > 0 {
            for (o, v) in down.iter_mut().zip(&across[shift..]) {
                *o += weight * v;
            }
        }
    }
    down
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_darker_picture_with_less_contrast_has_nearly_the_same_normalised_values() {
        let pattern = |x: usize, y: usize| 40 + (x * 37 + y * 61) % 160;
        let bright = Picture::from_fn(60, 50, |x, y| [pattern(x, y) as u8; 3]);
        let dark = Picture::from_fn(60, 50, |x, y| [(10 + pattern(x, y) / 2) as u8; 3]);
        let [bright, dark] = [bright, dark].map(|p| NormalizedImage::new(&p, 1.0, 8.0));
        let (mut apart, mut size) = (0.0_f32, 0.0_f32);
        for (a, b) in bright.values.iter().zip(&dark.values) {
            apart += (a - b).powi(2);
            size += a * a;
        }
        // The 4 grey levels and rounding to bytes: a fifth of a deviation of some 10 grey levels.
        assert!(size > 100.0 && apart < 0.1 * size, "{apart} {size}");
    }

    #[test]
    fn what_lies_outside_the_mask_does_not_matter() {
        let pattern = |x: usize, y: usize| 40 + (x * 37 + y * 61) % 160;
        let picture = Picture::from_fn(64, 48, |x, y| [pattern(x, y) as u8; 3]);
        let painted = Picture::from_fn(64, 48, |x, y| [if x < 40 { pattern(x, y) as u8 } else { 255 }; 3]);
        let mask: Vec<f32> = (0..64 * 48).map(|i| f32::from(u8::from(i % 64 < 40))).collect();
        let [one, other] =
            [picture, painted].map(|p| NormalizedImage::masked(&GreyImage::of(&p), &mask, 2.0, 8.0).values);
        assert_eq!(one, other);
        assert!(one.iter().any(|v| v.abs() > 0.5));
    }

    #[test]
    fn an_even_picture_is_zero_and_the_gradient_is_that_of_the_value() {
        let even = NormalizedImage::new(&Picture::from_fn(20, 10, |_, _| [99; 3]), 2.0, 4.0);
        assert!(even.values.iter().all(|v| v.abs() < 1e-3));
        let image = NormalizedImage::new(&Picture::from_fn(20, 10, |x, y| [(x * x + 7 * y) as u8; 3]), 0.0, 4.0);
        let at = DVec2::new(7.3, 4.9);
        let (_, gradient) = image.sample(at).unwrap();
        for axis in [DVec2::X, DVec2::Y] {
            let moved = |by: f64| image.sample(at + by * axis).unwrap().0;
            // Bilinear: exact within a pixel but for rounding.
            assert!(((moved(1e-3) - moved(-1e-3)) / 2e-3 - gradient.dot(axis)).abs() < 1e-9);
        }
        assert_eq!(image.sample(DVec2::new(0.4, 5.0)), None);
        assert_eq!(image.sample(DVec2::NAN), None);
    }
}
