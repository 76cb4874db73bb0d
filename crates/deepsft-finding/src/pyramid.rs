//! A grey picture at many sizes.

use deepsft_geometry::glam::Vec2;
use deepsft_geometry::{Picture, luma};

/// How much smaller each level is than the one before.
pub(crate) const STEP: f32 = 1.25;

/// The blur's window: binomial weights, a deviation of 1.2 pixels.
const BLUR: [u16; 7] = [1, 6, 15, 20, 15, 6, 1];

/// One level of a pyramid.
#[derive(Clone, Debug, Default)]
pub(crate) struct Level {
    pub width: usize,
    pub height: usize,
    /// Pixels of the whole picture per pixel of this level.
    pub scale: f32,
    /// Grey values, row-major.
    pub values: Vec<u8>,
    /// The same, blurred.
    pub smooth: Vec<u8>,
}

impl Level {
    /// Position in the whole picture, pixels, of the centre of pixel (`x`, `y`).
    pub fn position(&self, x: u16, y: u16) -> Vec2 {
        (Vec2::new(f32::from(x), f32::from(y)) + 0.5) * self.scale
    }
}

/// The picture's levels, the whole one first, down to `shortest_side` pixels or `most` levels.
pub(crate) fn pyramid(picture: &Picture, shortest_side: usize, most: usize) -> Vec<Level> {
    let values = picture
        .rgb()
        .as_chunks()
        .0
        .iter()
        .map(|&c| (luma(c) + 0.5) as u8)
        .collect();
    let mut levels = vec![Level {
        width: picture.width(),
        height: picture.height(),
        scale: 1.0,
        values,
        smooth: Vec::new(),
    }];
    while levels.len() < most {
        let last = &levels[levels.len() - 1];
        let side = |length: usize| (length as f32 / STEP).round() as usize;
        let (width, height) = (side(last.width), side(last.height));
        if width.min(height) < shortest_side.max(8) {
            break;
        }
        let next = smaller(last, width, height);
        levels.push(next);
    }
    for level in &mut levels {
        level.smooth = blurred(&level.values, level.width, level.height);
    }
    levels
}

/// `level` resampled by bilinear interpolation to `width` x `height`.
fn smaller(level: &Level, width: usize, height: usize) -> Level {
    let place = |i: usize, to: usize, from: usize| {
        let at = ((i as f32 + 0.5) * from as f32 / to as f32 - 0.5).clamp(0.0, (from - 1) as f32);
        let first = at as usize;
        (first, (first + 1).min(from - 1), at - first as f32)
    };
    let columns: Vec<_> = (0..width).map(|x| place(x, width, level.width)).collect();
    let mut values = Vec::with_capacity(width * height);
    for y in 0..height {
        let (above, below, b) = place(y, height, level.height);
        let above = &level.values[above * level.width..][..level.width];
        let below = &level.values[below * level.width..][..level.width];
        for &(left, right, a) in &columns {
            let mix = |row: &[u8]| f32::from(row[left]) * (1.0 - a) + f32::from(row[right]) * a;
            values.push((mix(above) * (1.0 - b) + mix(below) * b + 0.5) as u8);
        }
    }
    Level {
        width,
        height,
        scale: level.scale * level.width as f32 / width as f32,
        values,
        smooth: Vec::new(),
    }
}

/// The picture with its longest side at most `longest` pixels.
pub(crate) fn resized(picture: &Picture, longest: usize) -> Picture {
    let mut picture = picture.clone();
    while picture.width().max(picture.height()) >= 2 * longest {
        picture = picture.halved();
    }
    let side = picture.width().max(picture.height());
    if side <= longest {
        return picture;
    }
    let to = |length: usize| ((length * longest) as f64 / side as f64).round().max(1.0) as usize;
    let (width, height) = (to(picture.width()), to(picture.height()));
    let (across, down) = (
        picture.width() as f64 / width as f64,
        picture.height() as f64 / height as f64,
    );
    // Four samples per pixel: the picture shrinks by less than two.
    Picture::from_fn(width, height, |x, y| {
        let mut sum = [0.0_f32; 3];
        for (i, j) in [(0.25, 0.25), (0.75, 0.25), (0.25, 0.75), (0.75, 0.75)] {
            let color = picture.sample((x as f64 + i) * across, (y as f64 + j) * down);
            sum.iter_mut().zip(color).for_each(|(s, c)| *s += c / 4.0);
        }
        sum.map(|s| (s + 0.5) as u8)
    })
}

/// Separable binomial blur, edges repeated.
fn blurred(values: &[u8], width: usize, height: usize) -> Vec<u8> {
    let radius = BLUR.len() / 2;
    let mut across = vec![0_u16; values.len()];
    let mut padded = vec![0_u16; width + 2 * radius];
    for (row, out) in values.chunks_exact(width).zip(across.chunks_exact_mut(width)) {
        padded[..radius].fill(u16::from(row[0]));
        padded[radius + width..].fill(u16::from(row[width - 1]));
        for (p, &v) in padded[radius..].iter_mut().zip(row) {
            *p = u16::from(v);
        }
        for (x, out) in out.iter_mut().enumerate() {
            let window = &padded[x..x + BLUR.len()];
            *out = window.iter().zip(BLUR).map(|(v, w)| v * w).sum();
        }
    }
    let mut smooth = vec![0_u8; values.len()];
    let mut sums = vec![0_u32; width];
    for y in 0..height {
        sums.fill(0);
        for (k, &weight) in BLUR.iter().enumerate() {
            let row = (y + k).saturating_sub(radius).min(height - 1);
            for (sum, &v) in sums.iter_mut().zip(&across[row * width..][..width]) {
                *sum += u32::from(weight) * u32::from(v);
            }
        }
        for (out, &sum) in smooth[y * width..][..width].iter_mut().zip(&sums) {
            *out = ((sum + 2048) >> 12) as u8;
        }
    }
    smooth
}
