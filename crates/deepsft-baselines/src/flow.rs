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

use std::iter::successors;

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
    pub width: usize,
    pub height: usize,
    pub values: Vec<f32>,
}

impl Grey {
    /// An image whose pixel (column, row) is `value(column, row)`.
    pub fn from_fn(width: usize, height: usize, value: impl Fn(usize, usize) -> f32) -> Self {
        let values = (0..width * height).map(|k| value(k % width, k / width)).collect();
        Self { width, height, values }
    }

    /// The pixel, coordinates clamped into the image.
    fn pixel(&self, x: isize, y: isize) -> f32 {
        let clamped = |at: isize, size: usize| at.clamp(0, size as isize - 1) as usize;
        self.values[clamped(y, self.height) * self.width + clamped(x, self.width)]
    }

    /// Bilinear value between pixels, (0, 0) being the first pixel's centre; edges repeated.
    pub fn sample(&self, x: f32, y: f32) -> f32 {
        let clamped = |at: f32, size: usize| at.clamp(0.0, size as f32 - 1.0);
        let (x, y) = (clamped(x, self.width), clamped(y, self.height));
        let (i, j) = (x as isize, y as isize);
        let (a, b) = (x - i as f32, y - j as f32);
        let row = |j: isize| self.pixel(i, j) * (1.0 - a) + self.pixel(i + 1, j) * a;
        row(j) * (1.0 - b) + row(j + 1) * b
    }

    /// What `of` makes of each pixel between its two neighbours along a `way`.
    fn along(&self, [i, j]: [isize; 2], of: impl Fn([f32; 3]) -> f32) -> Self {
        Self::from_fn(self.width, self.height, |x, y| {
            of([-1, 0, 1].map(|k| self.pixel(x as isize + k * i, y as isize + k * j)))
        })
    }

    /// The mean of each pixel and its neighbours by the binomial weights 1 2 1 along both sides.
    fn blurred(&self) -> Self {
        let mean = |[before, here, after]: [f32; 3]| (before + 2.0 * here + after) / 4.0;
        self.along([1, 0], mean).along([0, 1], mean)
    }

    fn resized(&self, width: usize, height: usize) -> Self {
        let scale = [self.width as f32 / width as f32, self.height as f32 / height as f32];
        let at = |k: usize, axis: usize| (k as f32 + 0.5) * scale[axis] - 0.5;
        Self::from_fn(width, height, |x, y| self.sample(at(x, 0), at(y, 1)))
    }

    /// Half the difference of the neighbours along x and along y.
    fn gradient(&self) -> [Self; 2] {
        [[1, 0], [0, 1]].map(|way| self.along(way, |[before, _, after]| (after - before) / 2.0))
    }
}

/// Pixels to the right, and down, by which the second image shows what a pixel of the first shows.
pub type Flow = [Grey; 2];

/// The flow from `first` to `second`, images of one size; `known` is 1 where the second image shows something, and 0 where not.
pub fn flow(first: &Grey, second: &Grey, known: &Grey) -> Flow {
    let coarser = |level: &[Grey; 3]| {
        let [width, height] = [level[0].width, level[0].height].map(|side| (side as f64 * PYRAMID).round() as usize);
        let resized = || level.each_ref().map(|image| image.blurred().resized(width, height));
        (width.min(height) >= COARSEST).then(resized)
    };
    let finest = [first.blurred(), second.blurred(), known.clone()];
    let levels: Vec<_> = successors(Some(finest), coarser).collect();
    let mut flow = [(); 2].map(|()| Grey::from_fn(first.width, first.height, |_, _| 0.0));
    for [first, second, known] in levels.iter().rev() {
        flow = of_level(&flow, first);
        for _ in 0..WARPS {
            flow = improved(&flow, first, second, known);
        }
    }
    flow
}

/// The linearised data term of a pixel: derivatives of the warped image and differences to the first, of grey and of both gradients.
struct Data {
    /// d/dx, d/dy and the difference of grey, of the gradient along x and of that along y.
    rows: [[f32; 3]; 3],
    /// 0 where the second image shows nothing.
    weight: f32,
}

impl Data {
    /// The normal equations [[a, b], [b, c]] (du, dv) = (d, e) at an increment, psi' included.
    fn equations(&self, du: f32, dv: f32) -> [f32; 5] {
        let rows = || self.rows.into_iter().zip([1.0, GRADIENTS, GRADIENTS]);
        let squares = rows().map(|([x, y, t], weight)| weight * (t + x * du + y * dv).powi(2));
        let psi = self.weight / (squares.sum::<f32>() + DATA_E * DATA_E).sqrt();
        let mut sums = [0.0; 5];
        for ([x, y, t], weight) in rows() {
            for (sum, product) in sums.iter_mut().zip([x * x, x * y, y * y, -x * t, -y * t]) {
                *sum += psi * weight * product;
            }
        }
        sums
    }
}

/// A flow on another level, of the size of `image`.
fn of_level([u, v]: &Flow, image: &Grey) -> Flow {
    let scaled = |part: &Grey, ratio: f32| {
        let mut scaled = part.resized(image.width, image.height);
        scaled.values.iter_mut().for_each(|value| *value *= ratio);
        scaled
    };
    [
        scaled(u, image.width as f32 / u.width as f32),
        scaled(v, image.height as f32 / v.height as f32),
    ]
}

/// A flow with its increment.
fn sum(flow: &Flow, increment: &[Vec<f32>; 2]) -> Flow {
    let mut sum = flow.clone();
    for (part, increment) in sum.iter_mut().zip(increment) {
        for (value, more) in part.values.iter_mut().zip(increment) {
            *value += more;
        }
    }
    sum
}

/// One warp: the flow with the increment that the images, linearised here, ask for.
fn improved(flow: &Flow, first: &Grey, second: &Grey, known: &Grey) -> Flow {
    let data = data(flow, first, second, known);
    let mut increment = [(); 2].map(|()| vec![0.0; data.len()]);
    for _ in 0..INNER {
        let of = |k: usize| data[k].equations(increment[0][k], increment[1][k]);
        let equations: Vec<_> = (0..data.len()).map(of).collect();
        let smoothness = smoothness(&sum(flow, &increment));
        for _ in 0..SWEEPS {
            sweep(flow, &equations, &smoothness, &mut increment);
        }
    }
    sum(flow, &increment)
}

fn data([u, v]: &Flow, first: &Grey, second: &Grey, known: &Grey) -> Vec<Data> {
    let (width, height) = (first.width, first.height);
    let at = |x: usize, y: usize| {
        let k = y * width + x;
        (x as f32 + u.values[k], y as f32 + v.values[k])
    };
    let warped = |image: &Grey| Grey::from_fn(width, height, |x, y| image.sample(at(x, y).0, at(x, y).1));
    let (warped, seen) = (warped(second), warped(known));
    let [x, y] = warped.gradient();
    let ([xx, xy], [_, yy]) = (x.gradient(), y.gradient());
    let [fx, fy] = first.gradient();
    let of = |k: usize| {
        let (to_x, to_y) = at(k % width, k / width);
        let is_inside = to_x >= 0.0 && to_y >= 0.0 && to_x <= width as f32 - 1.0 && to_y <= height as f32 - 1.0;
        let difference = |warped: &Grey, first: &Grey| warped.values[k] - first.values[k];
        Data {
            rows: [
                [x.values[k], y.values[k], difference(&warped, first)],
                [xx.values[k], xy.values[k], difference(&x, &fx)],
                [xy.values[k], yy.values[k], difference(&y, &fy)],
            ],
            weight: if is_inside && seen.values[k] > 0.99 { 1.0 } else { 0.0 },
        }
    };
    (0..width * height).map(of).collect()
}

/// a psi' of the smoothness of a flow at each pixel.
fn smoothness(flow: &Flow) -> Vec<f32> {
    let gradients = flow.each_ref().map(Grey::gradient);
    let of = |k: usize| {
        let square: f32 = gradients.as_flattened().iter().map(|part| part.values[k].powi(2)).sum();
        SMOOTHNESS / (square + SMOOTH_E * SMOOTH_E).sqrt()
    };
    (0..flow[0].values.len()).map(of).collect()
}

/// One sweep of over-relaxation over all pixels.
fn sweep([u, v]: &Flow, equations: &[[f32; 5]], smoothness: &[f32], [du, dv]: &mut [Vec<f32>; 2]) {
    let (width, height) = (u.width, u.height);
    for (k, &[a, b, c, d, e]) in equations.iter().enumerate() {
        let (x, y) = (k % width, k / width);
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
            pull_u += weight * (u.values[n] + du[n] - u.values[k]);
            pull_v += weight * (v.values[n] + dv[n] - v.values[k]);
        }
        du[k] += OVER_RELAXATION * ((d - b * dv[k] + pull_u) / (a + total) - du[k]);
        dv[k] += OVER_RELAXATION * ((e - b * du[k] + pull_v) / (c + total) - dv[k]);
    }
}

#[cfg(test)]
pub mod tests {
    use super::*;

    /// A pattern with detail at several sizes, grey levels.
    pub fn pattern(x: f32, y: f32) -> f32 {
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
        let at = |(x, y): (f32, f32)| pattern(x, y);
        let first = Grey::from_fn(width, height, |x, y| at(moved(x as f32, y as f32)));
        let known = Grey::from_fn(width, height, |_, _| 1.0);
        let found = flow(&first, &second, &known);
        let (mut sum, mut count) = (0.0, 0.0);
        for (x, y) in (20..100).flat_map(|y| (25..125).map(move |x| (x, y))) {
            let (tx, ty) = moved(x as f32, y as f32);
            let (u, v) = (found[0].values[y * width + x], found[1].values[y * width + x]);
            sum += (x as f32 + u - tx).hypot(y as f32 + v - ty);
            count += 1.0;
        }
        assert!(sum / count < 0.1, "{} px", sum / count);
    }
}
