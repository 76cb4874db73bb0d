//! Image pyramids: a grey picture at many sizes.

use deepsft_geometry::glam::Vec2;
use deepsft_geometry::{ImageSize, Picture, luma};
use std::borrow::Cow;

/// Shortest side of a level, pixels: a smaller one has hardly any place for a descriptor.
const SHORTEST_SIDE: usize = 48;

/// How much smaller each level is than the one before.
const STEP: f32 = 1.25;

/// The blur's window: binomial weights, a deviation of 1.2 pixels.
const BLUR: [u16; 7] = [1, 6, 15, 20, 15, 6, 1];

#[derive(Debug)]
pub(crate) struct PyramidLevel {
    pub width: usize,
    pub height: usize,
    /// Pixels of the whole picture per pixel of this level.
    pub scale: f32,
    /// Grey values, row-major.
    pub values: Vec<u8>,
    /// The same, blurred.
    pub smooth: Vec<u8>,
}

/// The levels of `picture`, the largest first, down to [`SHORTEST_SIDE`] or `most` levels. A picture whose longer side has fewer than
/// `longest_side` pixels is first enlarged to these, as Lowe (2004) does: a corner needs 31 pixels around it.
pub(crate) fn pyramid_levels(picture: &Picture, longest_side: usize, most: usize) -> Vec<PyramidLevel> {
    let grey = picture.rgb().as_chunks().0.iter().map(|&c| (luma(c) + 0.5) as u8);
    let whole = PyramidLevel::new(picture.size(), 1.0, grey.collect());
    let longest = whole.width.max(whole.height);
    let larger = |side: usize| (side * longest_side + longest / 2) / longest;
    let first = match longest < longest_side {
        true => whole.resized(ImageSize {
            width: larger(whole.width),
            height: larger(whole.height),
        }),
        false => whole,
    };
    let mut levels = vec![first];
    while let Some(level) = levels.last().filter(|_| levels.len() < most) {
        let side = |length: usize| (length as f32 / STEP).round() as usize;
        let (width, height) = (side(level.width), side(level.height));
        if width.min(height) < SHORTEST_SIDE {
            break;
        }
        levels.push(level.resized(ImageSize { width, height }));
    }
    levels
}

impl PyramidLevel {
    fn new(ImageSize { width, height }: ImageSize, scale: f32, values: Vec<u8>) -> Self {
        let smooth = blurred(&values, width);
        Self {
            width,
            height,
            scale,
            values,
            smooth,
        }
    }

    /// Position in the whole picture, pixels, of the centre of pixel (`x`, `y`).
    pub fn position(&self, x: u16, y: u16) -> Vec2 {
        (Vec2::new(f32::from(x), f32::from(y)) + 0.5) * self.scale
    }

    /// The same in fewer or more pixels, by bilinear interpolation.
    fn resized(&self, size: ImageSize) -> Self {
        let ImageSize { width, height } = size;
        // The two pixels that a new one lies between, and the weight of the second in 256ths.
        let place = |i: usize, to: usize, from: usize| {
            let at = ((i as f32 + 0.5) * from as f32 / to as f32 - 0.5).clamp(0.0, (from - 1) as f32);
            let first = at as usize;
            let weight = ((at - first as f32) * 256.0 + 0.5) as u32;
            (first, (first + 1).min(from - 1), weight)
        };
        let columns: Vec<(usize, usize, u32)> = (0..width).map(|x| place(x, width, self.width)).collect();
        let mut sums = vec![0_u16; self.width];
        let mut values = Vec::with_capacity(width * height);
        for y in 0..height {
            let (above, below, b) = place(y, height, self.height);
            let row = |y: usize| &self.values[y * self.width..][..self.width];
            for ((sum, &above), &below) in sums.iter_mut().zip(row(above)).zip(row(below)) {
                // At most 255 x 256: it fits.
                *sum = u16::from(above) * (256 - b as u16) + u16::from(below) * b as u16;
            }
            let mix = |&(left, right, a): &(usize, usize, u32)| {
                let sum = u32::from(sums[left]) * (256 - a) + u32::from(sums[right]) * a;
                ((sum + (1 << 15)) >> 16) as u8
            };
            values.extend(columns.iter().map(mix));
        }
        let scale = self.scale * self.width as f32 / width as f32;
        Self::new(size, scale, values)
    }
}

/// Separable binomial blur of rows of `width` values, edges repeated.
fn blurred(values: &[u8], width: usize) -> Vec<u8> {
    let (height, radius) = (values.len() / width, BLUR.len() / 2);
    let mut across = vec![0; values.len()];
    let mut padded = vec![0; width + 2 * radius];
    for (row, out) in values.chunks_exact(width).zip(across.chunks_exact_mut(width)) {
        padded[..radius].fill(u16::from(row[0]));
        padded[radius + width..].fill(u16::from(row[width - 1]));
        for (p, &v) in padded[radius..].iter_mut().zip(row) {
            *p = u16::from(v);
        }
        weighted(out, |k| &padded[k..]);
        // Ten bits, so that the sum of the rows still fits.
        out.iter_mut().for_each(|sum| *sum = (*sum + 8) >> 4);
    }
    let mut smooth = vec![0; values.len()];
    let sums = &mut padded[..width];
    for (y, out) in smooth.chunks_exact_mut(width).enumerate() {
        weighted(sums, |k| {
            let row = (y + k).saturating_sub(radius).min(height - 1);
            &across[row * width..]
        });
        for (out, &sum) in out.iter_mut().zip(sums.iter()) {
            *out = ((sum + 128) >> 8) as u8;
        }
    }
    smooth
}

fn weighted<'a>(out: &mut [u16], row: impl Fn(usize) -> &'a [u16]) {
    let rows: [&[u16]; BLUR.len()] = std::array::from_fn(|k| &row(k)[..out.len()]);
    for (x, sum) in out.iter_mut().enumerate() {
        *sum = (0..BLUR.len()).map(|k| BLUR[k] * rows[k][x]).sum();
    }
}

/// The picture with its longest side at most `longest` pixels.
pub(crate) fn resized(picture: &Picture, longest: usize) -> Cow<'_, Picture> {
    let factor = picture.width().max(picture.height()) / longest;
    let picture = match factor {
        0 | 1 => Cow::Borrowed(picture),
        _ => Cow::Owned(averaged(picture, factor)),
    };
    let side = picture.width().max(picture.height());
    if side <= longest {
        return picture;
    }
    let to = |length: usize| ((length * longest) as f64 / side as f64).round().max(1.0) as usize;
    let (width, height) = (to(picture.width()), to(picture.height()));
    let across = picture.width() as f64 / width as f64;
    let down = picture.height() as f64 / height as f64;
    // Four samples per pixel: the picture shrinks by less than two.
    Cow::Owned(Picture::from_fn(width, height, |x, y| {
        let mut sum = [0.0_f32; 3];
        for (i, j) in [(0.25, 0.25), (0.75, 0.25), (0.25, 0.75), (0.75, 0.75)] {
            let color = picture.sample((x as f64 + i) * across, (y as f64 + j) * down);
            sum.iter_mut().zip(color).for_each(|(s, c)| *s += c / 4.0);
        }
        sum.map(|s| (s + 0.5) as u8)
    }))
}

/// The picture `factor` times smaller, each pixel the mean of those it covers. It reads every pixel once, in
/// order: a picture of 100 megapixels costs little beyond its own memory. A side shorter than `factor` becomes one pixel.
fn averaged(picture: &Picture, factor: usize) -> Picture {
    let [across, down] = [picture.width(), picture.height()].map(|side| factor.min(side));
    let (width, height) = (picture.width() / across, picture.height() / down);
    let count = (across * down) as u32;
    let mut means = Vec::with_capacity(width * height);
    let mut sums = vec![[0_u32; 3]; width];
    for rows in picture.rgb().chunks_exact(3 * picture.width() * down) {
        sums.fill([0; 3]);
        for row in rows.chunks_exact(3 * picture.width()) {
            for (sum, covered) in sums.iter_mut().zip(row.chunks_exact(3 * across)) {
                for color in covered.as_chunks::<3>().0 {
                    sum.iter_mut().zip(color).for_each(|(s, &c)| *s += u32::from(c));
                }
            }
        }
        means.extend(sums.iter().map(|sum| sum.map(|s| ((s + count / 2) / count) as u8)));
    }
    Picture::from_fn(width, height, |x, y| means[y * width + x])
}
