//! Images from which light and gain have dropped out.

use crate::Picture;
use glam::DVec2;

/// Standard deviation of the window in which mean and contrast are taken, pixels.
const WINDOW: f64 = 8.0;

/// Grey levels added to the local deviation: flat areas stay flat.
const LEAST_DEVIATION: f32 = 4.0;

/// Share of a blurred neighbourhood that must be seen for a value to exist.
const LEAST_SUPPORT: f32 = 0.02;

/// A grey image, row-major, 0..=255.
#[derive(Clone, Debug)]
pub(crate) struct Grey {
    pub width: usize,
    pub height: usize,
    pub values: Vec<f32>,
}

impl Grey {
    /// The luma of a picture.
    pub fn of(picture: &Picture) -> Self {
        let values = picture.rgb().chunks_exact(3).map(luma).collect();
        Self {
            width: picture.width(),
            height: picture.height(),
            values,
        }
    }
}

/// Rec. 601 luma of an RGB triple.
fn luma(rgb: &[u8]) -> f32 {
    0.299 * f32::from(rgb[0]) + 0.587 * f32::from(rgb[1]) + 0.114 * f32::from(rgb[2])
}

/// An image blurred, less its local mean, divided by its local deviation: what is left is the print.
/// All averages run over the pixels of a mask alone, so that nothing leaks in from outside it.
#[derive(Clone, Debug)]
pub(crate) struct LocalContrast {
    width: usize,
    height: usize,
    values: Vec<f32>,
}

impl LocalContrast {
    /// `grey` seen where `mask` (0 or 1 a pixel) is 1, blurred by `blur` pixels.
    pub fn new(grey: &Grey, mask: &[f32], blur: f64) -> Self {
        let (width, height) = (grey.width, grey.height);
        let masked = |values: &[f32]| -> Vec<f32> { values.iter().zip(mask).map(|(v, m)| v * m).collect() };
        let over = |sum: Vec<f32>, support: &[f32]| -> Vec<f32> {
            sum.iter()
                .zip(support)
                .map(|(s, &n)| if n > LEAST_SUPPORT { s / n } else { 0.0 })
                .collect()
        };
        let support = gaussian_blur(mask, width, height, blur);
        let smooth = over(gaussian_blur(&masked(&grey.values), width, height, blur), &support);
        let wide = gaussian_blur(mask, width, height, WINDOW);
        let mean = over(gaussian_blur(&masked(&smooth), width, height, WINDOW), &wide);
        let squares: Vec<f32> = smooth.iter().map(|v| v * v).collect();
        let square = over(gaussian_blur(&masked(&squares), width, height, WINDOW), &wide);
        let values = (smooth.iter().zip(&mean).zip(&square).zip(&support))
            .map(|(((v, m), s), &n)| {
                if n > LEAST_SUPPORT {
                    (v - m) / ((s - m * m).max(0.0).sqrt() + LEAST_DEVIATION)
                } else {
                    0.0
                }
            })
            .collect();
        Self { width, height, values }
    }

    /// Value of a pixel.
    pub fn pixel(&self, index: usize) -> f64 {
        f64::from(self.values[index])
    }

    /// Bilinear value and gradient a pixel at an image position, pixel centres at half integers; `None` outside.
    pub fn sample(&self, at: DVec2) -> Option<(f64, DVec2)> {
        let (x, y) = (at.x - 0.5, at.y - 0.5);
        // Not "less than": what is no number is outside.
        if !(x >= 0.0 && y >= 0.0 && x < (self.width - 1) as f64 && y < (self.height - 1) as f64) {
            return None;
        }
        let (column, row) = (x as usize, y as usize);
        let (a, b) = (x - column as f64, y - row as f64);
        let i = row * self.width + column;
        let [v00, v10, v01, v11] = [i, i + 1, i + self.width, i + self.width + 1].map(|k| self.pixel(k));
        let (top, bottom) = (v00 + a * (v10 - v00), v01 + a * (v11 - v01));
        let dx = (1.0 - b) * (v10 - v00) + b * (v11 - v01);
        Some((top + b * (bottom - top), DVec2::new(dx, bottom - top)))
    }
}

/// Gaussian blur of standard deviation `deviation`, pixels; nothing beyond the edge.
fn gaussian_blur(values: &[f32], width: usize, height: usize, deviation: f64) -> Vec<f32> {
    let radius = (3.0 * deviation).ceil() as usize;
    let kernel: Vec<f32> = (0..=radius)
        .map(|k| (-0.5 * (k as f64 / deviation).powi(2)).exp() as f32)
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

    fn texture(gain: f32, offset: f32) -> Grey {
        let values = (0..64 * 48)
            .map(|i| {
                let (x, y) = ((i % 64) as f32, (i / 64) as f32);
                gain * (100.0 + 40.0 * (0.7 * x).sin() * (0.5 * y + 0.1 * x).cos()) + offset
            })
            .collect();
        Grey {
            width: 64,
            height: 48,
            values,
        }
    }

    #[test]
    fn gain_and_offset_drop_out() {
        let mask = vec![1.0; 64 * 48];
        let one = LocalContrast::new(&texture(1.0, 0.0), &mask, 1.0);
        let other = LocalContrast::new(&texture(2.0, -60.0), &mask, 1.0);
        for i in 0..64 * 48 {
            // The 4 grey levels added to a deviation of some 15 leave a tenth.
            assert!((one.pixel(i) - other.pixel(i)).abs() < 0.25);
        }
    }

    #[test]
    fn what_lies_outside_the_mask_does_not_matter() {
        let mask: Vec<f32> = (0..64 * 48).map(|i| f32::from(u8::from(i % 64 < 40))).collect();
        let mut painted = texture(1.0, 0.0);
        for (v, m) in painted.values.iter_mut().zip(&mask) {
            *v += 1000.0 * (1.0 - m);
        }
        let one = LocalContrast::new(&texture(1.0, 0.0), &mask, 2.0);
        let other = LocalContrast::new(&painted, &mask, 2.0);
        assert_eq!(one.values, other.values);
    }

    #[test]
    fn the_gradient_is_the_values_derivative() {
        let image = LocalContrast::new(&texture(1.0, 0.0), &vec![1.0; 64 * 48], 1.0);
        let at = DVec2::new(20.3, 17.8);
        let (_, gradient) = image.sample(at).unwrap();
        let value = |p: DVec2| image.sample(p).unwrap().0;
        let h = 1e-4;
        for axis in [DVec2::X, DVec2::Y] {
            let numeric = (value(at + h * axis) - value(at - h * axis)) / (2.0 * h);
            assert!((gradient.dot(axis) - numeric).abs() < 1e-6);
        }
        assert!(image.sample(DVec2::new(0.4, 3.0)).is_none() && image.sample(DVec2::NAN).is_none());
    }
}
