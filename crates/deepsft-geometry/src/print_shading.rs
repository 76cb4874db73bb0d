//! The light on a print laid flat, divided out.

use crate::flat_print::FlatPrint;
use crate::image::{ImageSize, MipLevel, Picture};
use glam::DVec2;

/// Cells of the light's grid across the print: of 1.2 mm on an upright A4 page, about as sharp as shadows are.
const COLUMNS: usize = 170;

/// Difference from the print under its light, a fraction of that light, at which a pixel counts half: what is written on the print says
/// nothing of the light.
const WRITTEN: f32 = 0.05;

/// Rounds of reweighted least squares.
const ROUNDS: usize = 3;

/// Weight of the mean light in a cell, as a fraction of what a cell of the mean print has: where a cell is black, or is not shown.
const PRIOR: f32 = 0.002;

impl FlatPrint {
    /// The same print without shading: shadows, uneven light and its colour are divided out, and what is written on the print stays.
    ///
    /// `texture` is the template's. The light is the factor, smooth over a hundredth of the width, that makes it most like what is seen, for
    /// each channel by itself (least squares, reweighted so that ink which the texture lacks does not count). Where the image shows nothing the
    /// picture stays as it is.
    #[must_use]
    pub fn without_shading(&self, texture: &Picture) -> Self {
        let size = self.picture.size();
        let halvings = (texture.width() / size.width).max(1).ilog2();
        let level = MipLevel::halved(texture.clone(), halvings);
        let drawn = |x: usize, y: usize| level.sample(DVec2::new(x as f64 + 0.5, y as f64 + 0.5) / size.as_dvec2());
        let seen = |x: usize, y: usize| self.picture.pixel(x, y).map(f32::from);
        let is_shown = |x: usize, y: usize| self.confidence.get(y * size.width + x).is_some_and(|c| *c > 0.0);

        let light_with = |weight: &dyn Fn(usize, usize) -> f32| {
            let mut sums = LightSums::new(size);
            for (x, y) in (0..size.area()).map(|place| (place % size.width, place / size.width)) {
                if is_shown(x, y) {
                    sums.add((x, y), weight(x, y), seen(x, y), drawn(x, y));
                }
            }
            sums.light()
        };
        let mut light = light_with(&|_, _| 1.0);
        for _ in 1..ROUNDS {
            light = light_with(&|x, y| robust_weight(light.at(x, y), seen(x, y), drawn(x, y)));
        }
        let even = |x: usize, y: usize| {
            let (light, seen) = (light.at(x, y), seen(x, y));
            // `as` saturates.
            [0, 1, 2].map(|k| (seen[k] / light[k]).round() as u8)
        };
        let color = |x: usize, y: usize| match is_shown(x, y) {
            true => even(x, y),
            false => self.picture.pixel(x, y),
        };
        Self {
            picture: Picture::from_fn(size.width, size.height, color),
            confidence: self.confidence.clone(),
        }
    }
}

/// How much a pixel says of the light.
fn robust_weight(light: [f32; 3], seen: [f32; 3], drawn: [f32; 3]) -> f32 {
    let off: f32 = (0..3).map(|k| seen[k] - light[k] * drawn[k]).sum();
    let whole: f32 = 255.0 * light.iter().sum::<f32>();
    1.0 / (1.0 + (off / (WRITTEN * whole.max(1.0))).powi(2))
}

/// Sums of least squares in each cell: seen times drawn, and drawn squared.
struct LightSums {
    size: ImageSize,
    cells: ImageSize,
    sums: Vec<[[f32; 3]; 2]>,
}

impl LightSums {
    fn new(size: ImageSize) -> Self {
        let columns = COLUMNS.min(size.width);
        let cells = ImageSize::from((columns, (columns * size.height / size.width).max(1)));
        let sums = vec![[[0.0; 3]; 2]; cells.area()];
        Self { size, cells, sums }
    }

    fn add(&mut self, (x, y): (usize, usize), weight: f32, seen: [f32; 3], drawn: [f32; 3]) {
        let (column, row) = (
            x * self.cells.width / self.size.width,
            y * self.cells.height / self.size.height,
        );
        let sums = &mut self.sums[row * self.cells.width + column];
        for k in 0..3 {
            sums[0][k] += weight * seen[k] * drawn[k];
            sums[1][k] += weight * drawn[k] * drawn[k];
        }
    }

    /// The light of each cell, from it and its neighbours.
    fn light(mut self) -> Light {
        let mut whole = [[0.0; 3]; 2];
        for sums in &self.sums {
            add(&mut whole, sums, 1.0);
        }
        let (width, height) = (self.cells.width, self.cells.height);
        for (step, stride, count) in [(1, width, height), (width, 1, width)].repeat(2) {
            let along = self.sums.len() / count;
            for line in 0..count {
                let place = |k: usize| line * stride + k * step;
                let mut before = self.sums[place(0)];
                for k in 0..along {
                    let here = self.sums[place(k)];
                    let after = self.sums[place((k + 1).min(along - 1))];
                    let mut blurred = [[0.0; 3]; 2];
                    for (sums, share) in [(&before, 0.25), (&here, 0.5), (&after, 0.25)] {
                        add(&mut blurred, sums, share);
                    }
                    self.sums[place(k)] = blurred;
                    before = here;
                }
            }
        }
        let prior = PRIOR / self.sums.len() as f32;
        let light = self.sums.into_iter().map(|mut sums| {
            add(&mut sums, &whole, prior);
            let [product, square] = sums;
            [0, 1, 2].map(|k| product[k] / square[k].max(f32::MIN_POSITIVE))
        });
        Light {
            size: self.size,
            cells: self.cells,
            light: light.collect(),
        }
    }
}

fn add(to: &mut [[f32; 3]; 2], sums: &[[f32; 3]; 2], share: f32) {
    for (to, sums) in to.iter_mut().flatten().zip(sums.iter().flatten()) {
        *to += share * sums;
    }
}

/// The light on a print: a factor for each channel, in cells.
struct Light {
    size: ImageSize,
    cells: ImageSize,
    light: Vec<[f32; 3]>,
}

impl Light {
    /// Between the centres of cells, bilinear.
    fn at(&self, x: usize, y: usize) -> [f32; 3] {
        let between = |at: usize, size: usize, cells: usize| {
            let at = ((at as f32 + 0.5) * cells as f32 / size as f32 - 0.5).clamp(0.0, (cells - 1) as f32);
            let low = (at as usize).min(cells.saturating_sub(2));
            (low, (low + 1).min(cells - 1), at - low as f32)
        };
        let (left, right, across) = between(x, self.size.width, self.cells.width);
        let (top, bottom, down) = between(y, self.size.height, self.cells.height);
        let cell = |column: usize, row: usize| self.light[row * self.cells.width + column];
        let corners = [
            cell(left, top),
            cell(right, top),
            cell(left, bottom),
            cell(right, bottom),
        ];
        let mix = |a: f32, b: f32, part: f32| a + part * (b - a);
        [0, 1, 2].map(|k| {
            let [a, b, c, d] = corners.map(|corner| corner[k]);
            mix(mix(a, b, across), mix(c, d, across), down)
        })
    }
}
