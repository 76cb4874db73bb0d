//! Grey values freed from light and gain.

use crate::Picture;
use glam::DVec2;

/// Grey levels added to the local deviation, so that noise on an even surface is not blown up to texture.
const FLOOR_LEVELS: f32 = 4.0;

/// Gaussian windows are cut off at this many standard deviations.
const WINDOW_SIGMAS: f32 = 3.0;

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
    /// Edges are repeated.
    pub fn new(picture: &Picture, blur_px: f32, window_px: f32) -> Self {
        let (width, height) = (picture.width(), picture.height());
        // Rec. 601 luma on the stored (gamma) values.
        let luma = |c: &[u8]| 0.299 * f32::from(c[0]) + 0.587 * f32::from(c[1]) + 0.114 * f32::from(c[2]);
        let grey: Vec<f32> = picture.rgb().chunks_exact(3).map(luma).collect();
        let grey = gaussian(&grey, width, height, blur_px);
        let mean = gaussian(&grey, width, height, window_px);
        let squares: Vec<f32> = grey.iter().zip(&mean).map(|(g, m)| (g - m) * (g - m)).collect();
        let variance = gaussian(&squares, width, height, window_px);
        let values = grey.iter().zip(mean.iter().zip(&variance));
        Self {
            width,
            height,
            values: values
                .map(|(g, (m, v))| (g - m) / (v.max(0.0).sqrt() + FLOOR_LEVELS))
                .collect(),
        }
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

/// Separable Gaussian blur, edges repeated; the input when `sigma` is not positive.
fn gaussian(values: &[f32], width: usize, height: usize, sigma: f32) -> Vec<f32> {
    if sigma <= 0.0 || sigma.is_nan() {
        return values.to_vec();
    }
    let radius = (WINDOW_SIGMAS * sigma).ceil() as usize;
    let mut kernel: Vec<f32> = (0..=radius)
        .map(|k| (-0.5 * (k as f32 / sigma).powi(2)).exp())
        .collect();
    let sum: f32 = kernel[0] + 2.0 * kernel[1..].iter().sum::<f32>();
    kernel.iter_mut().for_each(|k| *k /= sum);
    let mut rows = vec![0.0; values.len()];
    for (from, to) in values.chunks_exact(width).zip(rows.chunks_exact_mut(width)) {
        for (x, to) in to.iter_mut().enumerate() {
            let pair = |k: usize| from[x.saturating_sub(k)] + from[(x + k).min(width - 1)];
            *to = kernel[0] * from[x] + (1..=radius).map(|k| kernel[k] * pair(k)).sum::<f32>();
        }
    }
    let mut blurred = vec![0.0; values.len()];
    for (y, to) in blurred.chunks_exact_mut(width).enumerate() {
        for k in 0..=radius {
            let (above, below) = (y.saturating_sub(k) * width, (y + k).min(height - 1) * width);
            let weight = if k == 0 { 0.5 * kernel[0] } else { kernel[k] };
            for (x, to) in to.iter_mut().enumerate() {
                *to += weight * (rows[above + x] + rows[below + x]);
            }
        }
    }
    blurred
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
