//! Variational optical flow, coarse to fine: what [`crate::dof`] registers with.
//!
//! T. Brox, A. Bruhn, N. Papenberg, J. Weickert, *High Accuracy Optical Flow Estimation Based on a Theory for Warping*, ECCV 2004.
//!
//! # Equations
//!
//! The flow w = (u, v) from an image `first` to an image `second` minimises, with psi(s) = sqrt(s + e^2),
//!
//! ```text
//! integral psi(|second(x + w) - first(x)|^2 + g |grad second(x + w) - grad first(x)|^2) + a psi(|grad u|^2 + |grad v|^2)
//! ```
//!
//! Each level of a pyramid begins with the flow of the coarser one. There the second image is warped with the flow so far, both terms are
//! linearised, psi' is taken from the last increment, and the increment is solved for by successive over-relaxation.

/// Smoothness a and gradient constancy g, for grey values of 0 to 255: those of LDOF (Brox and Malik 2011).
const SMOOTHNESS: f32 = 30.0;
const GRADIENTS: f32 = 5.0;

/// e of the data, grey levels, and of the smoothness, pixels.
const DATA_E: f32 = 1.0;
const SMOOTH_E: f32 = 0.05;

/// Size of a level beside the finer one, and the shorter side of the coarsest, pixels.
const PYRAMID: f64 = 0.7;
const COARSEST: usize = 16;

const WARPS: usize = 3;
const INNER: usize = 3;
const SWEEPS: usize = 12;
const OVER_RELAXATION: f32 = 1.85;

/// A grey image or any number per pixel, row-major; values of an image are 0 to 255.
#[derive(Clone, Debug, PartialEq)]
pub struct Grey {
    /// Columns.
    pub width: usize,
    /// Rows.
    pub height: usize,
    /// One per pixel.
    pub values: Vec<f32>,
}

impl Grey {
    /// An image whose pixel (column, row) is `value(column, row)`.
    pub fn from_fn(width: usize, height: usize, value: impl Fn(usize, usize) -> f32) -> Self {
        let values = (0..width * height).map(|k| value(k % width, k / width)).collect();
        Self { width, height, values }
    }

    /// The pixel, coordinates clamped into the image.
    pub fn pixel(&self, x: isize, y: isize) -> f32 {
        let clamped = |at: isize, size: usize| at.clamp(0, size as isize - 1) as usize;
        self.values[clamped(y, self.height) * self.width + clamped(x, self.width)]
    }

    /// Bilinear value between pixels, (0, 0) being the first pixel's centre; edges repeated.
    pub fn sample(&self, x: f32, y: f32) -> f32 {
        let (x, y) = (
            x.clamp(0.0, self.width as f32 - 1.0),
            y.clamp(0.0, self.height as f32 - 1.0),
        );
        let (i, j) = (x as isize, y as isize);
        let (a, b) = (x - i as f32, y - j as f32);
        let row = |j: isize| self.pixel(i, j) * (1.0 - a) + self.pixel(i + 1, j) * a;
        row(j) * (1.0 - b) + row(j + 1) * b
    }

    /// The mean of each pixel and its neighbours by the binomial weights 1 2 1 along both sides.
    fn blurred(&self) -> Self {
        let across = Self::from_fn(self.width, self.height, |x, y| {
            let at = |i: isize| self.pixel(x as isize + i, y as isize);
            (at(-1) + 2.0 * at(0) + at(1)) / 4.0
        });
        Self::from_fn(self.width, self.height, |x, y| {
            let at = |j: isize| across.pixel(x as isize, y as isize + j);
            (at(-1) + 2.0 * at(0) + at(1)) / 4.0
        })
    }

    fn resized(&self, width: usize, height: usize) -> Self {
        let scale = [self.width as f32 / width as f32, self.height as f32 / height as f32];
        let at = |k: usize, axis: usize| (k as f32 + 0.5) * scale[axis] - 0.5;
        Self::from_fn(width, height, |x, y| self.sample(at(x, 0), at(y, 1)))
    }

    /// Half the difference of the neighbours along x and along y.
    fn gradient(&self) -> [Self; 2] {
        let along = |i: isize, j: isize| {
            Self::from_fn(self.width, self.height, |x, y| {
                let (x, y) = (x as isize, y as isize);
                (self.pixel(x + i, y + j) - self.pixel(x - i, y - j)) / 2.0
            })
        };
        [along(1, 0), along(0, 1)]
    }
}

/// Pixels to the right and down by which the second image shows what a pixel of the first shows.
#[derive(Clone, Debug)]
pub struct Flow {
    /// To the right.
    pub u: Grey,
    /// Down.
    pub v: Grey,
}

/// The flow from `first` to `second`, images of one size; `known` is 1 where the second image shows something, and 0 where not.
pub fn flow(first: &Grey, second: &Grey, known: &Grey) -> Flow {
    let mut levels = vec![[first.blurred(), second.blurred(), known.clone()]];
    loop {
        let [finer, ..] = &levels[levels.len() - 1];
        let [width, height] = [finer.width, finer.height].map(|side| (side as f64 * PYRAMID).round() as usize);
        if width.min(height) < COARSEST {
            break;
        }
        let coarser = levels[levels.len() - 1]
            .each_ref()
            .map(|image| image.blurred().resized(width, height));
        levels.push(coarser);
    }
    let zero = |image: &Grey| Grey::from_fn(image.width, image.height, |_, _| 0.0);
    let mut flow: Option<Flow> = None;
    for [first, second, known] in levels.iter().rev() {
        let mut here = flow.map_or_else(
            || Flow {
                u: zero(first),
                v: zero(first),
            },
            |coarser| coarser.finer(first),
        );
        for _ in 0..WARPS {
            here.improve(first, second, known);
        }
        flow = Some(here);
    }
    flow.unwrap_or_else(|| Flow {
        u: zero(first),
        v: zero(first),
    })
}

/// The linearised data term of a pixel: derivatives of the warped image and differences to the first, of grey and of both gradients.
#[derive(Clone, Copy, Default)]
struct Data {
    /// d/dx, d/dy and the difference of grey, of the gradient along x and of that along y.
    rows: [[f32; 3]; 3],
    /// 0 where the second image shows nothing.
    weight: f32,
}

impl Data {
    /// The normal equations [[a, b], [b, c]] (du, dv) = (d, e) at an increment, psi' included.
    fn equations(&self, du: f32, dv: f32) -> [f32; 5] {
        let residual = |[x, y, t]: [f32; 3]| t + x * du + y * dv;
        let weights = [1.0, GRADIENTS, GRADIENTS];
        let square: f32 = self
            .rows
            .iter()
            .zip(weights)
            .map(|(&row, weight)| weight * residual(row).powi(2))
            .sum();
        let psi = self.weight / (square + DATA_E * DATA_E).sqrt();
        let mut sums = [0.0; 5];
        for ([x, y, t], weight) in self.rows.into_iter().zip(weights) {
            for (sum, product) in sums.iter_mut().zip([x * x, x * y, y * y, -x * t, -y * t]) {
                *sum += psi * weight * product;
            }
        }
        sums
    }
}

impl Flow {
    /// The flow on a finer level, of the size of `image`.
    fn finer(&self, image: &Grey) -> Self {
        let scaled = |part: &Grey, ratio: f32| {
            let mut finer = part.resized(image.width, image.height);
            finer.values.iter_mut().for_each(|value| *value *= ratio);
            finer
        };
        Self {
            u: scaled(&self.u, image.width as f32 / self.u.width as f32),
            v: scaled(&self.v, image.height as f32 / self.v.height as f32),
        }
    }

    /// One warp: adds the increment that the images, linearised here, ask for.
    fn improve(&mut self, first: &Grey, second: &Grey, known: &Grey) {
        let data = self.data(first, second, known);
        let zero = || vec![0.0_f32; data.len()];
        let mut increment = [zero(), zero()];
        for _ in 0..INNER {
            let equations: Vec<[f32; 5]> = data
                .iter()
                .enumerate()
                .map(|(k, data)| data.equations(increment[0][k], increment[1][k]))
                .collect();
            let smoothness = self.smoothness(&increment);
            for _ in 0..SWEEPS {
                self.sweep(&equations, &smoothness, &mut increment);
            }
        }
        for (part, increment) in [&mut self.u, &mut self.v].into_iter().zip(increment) {
            part.values
                .iter_mut()
                .zip(increment)
                .for_each(|(value, more)| *value += more);
        }
    }

    fn data(&self, first: &Grey, second: &Grey, known: &Grey) -> Vec<Data> {
        let (width, height) = (first.width, first.height);
        let at = |x: usize, y: usize| {
            let k = y * width + x;
            (x as f32 + self.u.values[k], y as f32 + self.v.values[k])
        };
        let warped = |image: &Grey| Grey::from_fn(width, height, |x, y| image.sample(at(x, y).0, at(x, y).1));
        let (warped, seen) = (warped(second), warped(known));
        let [x, y] = warped.gradient();
        let ([xx, xy], [_, yy]) = (x.gradient(), y.gradient());
        let [fx, fy] = first.gradient();
        let of = |k: usize| {
            let inside = {
                let (x, y) = at(k % width, k / width);
                x >= 0.0 && y >= 0.0 && x <= width as f32 - 1.0 && y <= height as f32 - 1.0
            };
            let grey = warped.values[k] - first.values[k];
            let (along_x, along_y) = (x.values[k] - fx.values[k], y.values[k] - fy.values[k]);
            Data {
                rows: [
                    [x.values[k], y.values[k], grey],
                    [xx.values[k], xy.values[k], along_x],
                    [xy.values[k], yy.values[k], along_y],
                ],
                weight: if inside && seen.values[k] > 0.99 { 1.0 } else { 0.0 },
            }
        };
        (0..width * height).map(of).collect()
    }

    /// a psi' of the smoothness at each pixel, of the flow with its increment.
    fn smoothness(&self, increment: &[Vec<f32>; 2]) -> Vec<f32> {
        let (width, height) = (self.u.width, self.u.height);
        let whole = |part: &Grey, increment: &[f32]| Grey {
            width,
            height,
            values: part.values.iter().zip(increment).map(|(a, b)| a + b).collect(),
        };
        let gradients = [whole(&self.u, &increment[0]), whole(&self.v, &increment[1])].map(|part| part.gradient());
        let of = |k: usize| {
            let square: f32 = gradients.as_flattened().iter().map(|part| part.values[k].powi(2)).sum();
            SMOOTHNESS / (square + SMOOTH_E * SMOOTH_E).sqrt()
        };
        (0..width * height).map(of).collect()
    }

    /// One sweep of over-relaxation over all pixels.
    fn sweep(&self, equations: &[[f32; 5]], smoothness: &[f32], [du, dv]: &mut [Vec<f32>; 2]) {
        let (width, height) = (self.u.width, self.u.height);
        for k in 0..equations.len() {
            let (x, y) = (k % width, k / width);
            let [a, b, c, d, e] = equations[k];
            let neighbours = [
                (x > 0).then(|| k - 1),
                (x + 1 < width).then(|| k + 1),
                (y > 0).then(|| k - width),
                (y + 1 < height).then(|| k + width),
            ];
            let (mut total, mut pull_u, mut pull_v) = (0.0, 0.0, 0.0);
            for n in neighbours.into_iter().flatten() {
                let weight = f32::midpoint(smoothness[k], smoothness[n]);
                total += weight;
                pull_u += weight * (self.u.values[n] + du[n] - self.u.values[k]);
                pull_v += weight * (self.v.values[n] + dv[n] - self.v.values[k]);
            }
            du[k] += OVER_RELAXATION * ((d - b * dv[k] + pull_u) / (a + total) - du[k]);
            dv[k] += OVER_RELAXATION * ((e - b * du[k] + pull_v) / (c + total) - dv[k]);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A pattern with detail at several sizes.
    fn pattern(x: f32, y: f32) -> f32 {
        let wave = |a: f32, b: f32, phase: f32| (a * x + b * y + phase).sin();
        127.0
            + 35.0 * wave(0.11, 0.05, 0.3)
            + 30.0 * wave(-0.07, 0.16, 1.0)
            + 25.0 * wave(0.41, 0.33, 2.0)
            + 20.0 * wave(-0.5, 0.21, 0.0)
    }

    #[test]
    fn known_displacements_are_found_to_a_tenth_of_a_pixel() {
        let (width, height) = (160, 120);
        // A turn by 4 degrees about the middle, 5 % larger, and 9 pixels aside: up to 18 pixels.
        let moved = |x: f32, y: f32| {
            let (dx, dy) = (x - 80.0, y - 60.0);
            let (sin, cos) = 4.0_f32.to_radians().sin_cos();
            (
                80.0 + 9.0 + 1.05 * (cos * dx - sin * dy),
                60.0 - 4.0 + 1.05 * (sin * dx + cos * dy),
            )
        };
        let second = Grey::from_fn(width, height, |x, y| pattern(x as f32, y as f32));
        let first = Grey::from_fn(width, height, |x, y| {
            let (x, y) = moved(x as f32, y as f32);
            pattern(x, y)
        });
        let known = Grey::from_fn(width, height, |_, _| 1.0);
        let found = flow(&first, &second, &known);
        let (mut sum, mut count) = (0.0, 0.0);
        for (x, y) in (20..100).flat_map(|y| (25..125).map(move |x| (x, y))) {
            let (tx, ty) = moved(x as f32, y as f32);
            let (u, v) = (found.u.values[y * width + x], found.v.values[y * width + x]);
            sum += (x as f32 + u - tx).hypot(y as f32 + v - ty);
            count += 1.0;
        }
        assert!(sum / count < 0.1, "{} px", sum / count);
    }
}
