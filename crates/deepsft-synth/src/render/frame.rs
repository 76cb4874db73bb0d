//! The picture while it is formed: linear light, f32.

use crate::render::color::srgb8_from_linear;
use crate::render::figure::Figure;
use deepsft_geometry::Picture;
use deepsft_geometry::glam::{Vec2, Vec3};
use std::ops::Range;

/// An image in linear light (0 black, 1 white before exposure), row-major, three values per pixel.
#[derive(Clone, Debug)]
pub(crate) struct Frame {
    pub(crate) width: usize,
    pub(crate) height: usize,
    pub(crate) rgb: Vec<f32>,
}

impl Frame {
    pub(crate) fn filled(width: usize, height: usize, color: Vec3) -> Self {
        Self {
            width,
            height,
            rgb: color.to_array().repeat(width * height),
        }
    }

    pub(crate) fn color(&self, pixel: usize) -> Vec3 {
        Vec3::from_slice(&self.rgb[3 * pixel..3 * pixel + 3])
    }

    pub(crate) fn set(&mut self, pixel: usize, color: Vec3) {
        color.write_to_slice(&mut self.rgb[3 * pixel..3 * pixel + 3]);
    }

    /// Blends `color` over row-major pixel `pixel`.
    pub(crate) fn blend(&mut self, pixel: usize, color: Vec3, alpha: f32) {
        self.set(pixel, self.color(pixel).lerp(color, alpha));
    }

    /// Replaces every pixel by `color(position of its centre, its colour)`.
    pub(crate) fn map(&mut self, mut color: impl FnMut(Vec2, Vec3) -> Vec3) {
        for pixel in 0..self.width * self.height {
            self.set(pixel, color(self.centre(pixel), self.color(pixel)));
        }
    }

    /// Adds the light of a frame of the same size.
    pub(crate) fn add(&mut self, other: &Self) {
        for (sum, value) in self.rgb.iter_mut().zip(&other.rgb) {
            *sum += value;
        }
    }

    /// Dims or brightens the light.
    pub(crate) fn scale(&mut self, factor: f32) {
        self.rgb.iter_mut().for_each(|value| *value *= factor);
    }

    /// Image position of the centre of row-major pixel `pixel`.
    pub(crate) fn centre(&self, pixel: usize) -> Vec2 {
        Vec2::new((pixel % self.width) as f32 + 0.5, (pixel / self.width) as f32 + 0.5)
    }

    /// Columns and rows of the pixels that a rectangle touches.
    pub(crate) fn window(&self, (low, high): (Vec2, Vec2)) -> (Range<usize>, Range<usize>) {
        let range = |low: f32, high: f32, side: usize| {
            let end = (high.ceil().max(0.0) as usize).min(side);
            (low.floor().max(0.0) as usize).min(end)..end
        };
        (range(low.x, high.x, self.width), range(low.y, high.y, self.height))
    }

    /// Paints a shape, its outline blended over one pixel; `color(p, alpha)` is asked for colour and opacity at
    /// each covered pixel's centre.
    pub(crate) fn paint(&mut self, shape: &Figure, mut color: impl FnMut(Vec2) -> (Vec3, f32)) {
        let (low, high) = shape.bounds();
        let (columns, rows) = self.window((low - 1.0, high + 1.0));
        for row in rows {
            for column in columns.clone() {
                let p = Vec2::new(column as f32 + 0.5, row as f32 + 0.5);
                let coverage = 0.5 - shape.distance(p);
                if coverage > 0.0 {
                    let (color, alpha) = color(p);
                    self.blend(row * self.width + column, color, alpha * coverage.min(1.0));
                }
            }
        }
    }

    /// Paints a shape in one opaque colour.
    pub(crate) fn fill(&mut self, shape: &Figure, color: Vec3) {
        self.paint(shape, |_| (color, 1.0));
    }

    /// The frame as an sRGB picture, clipped.
    pub(crate) fn to_picture(&self) -> Picture {
        let mut pixels = self.rgb.chunks_exact(3);
        Picture::from_fn(self.width, self.height, |_, _| {
            pixels.next().map_or([0; 3], |c| srgb8_from_linear(Vec3::from_slice(c)))
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_painted_disc_has_the_area_of_a_disc() {
        let mut frame = Frame::filled(40, 30, Vec3::ZERO);
        frame.fill(&Figure::disc(Vec2::new(20.3, 14.8), 9.0), Vec3::ONE);
        let area: f32 = frame.rgb.iter().sum::<f32>() / 3.0;
        // pi 81 = 254.5; coverage by distance is exact for straight edges, good to a few per mille here.
        assert!((area - 254.5).abs() < 2.0, "{area}");
    }

    #[test]
    fn a_shape_partly_outside_is_clipped() {
        let mut frame = Frame::filled(8, 8, Vec3::ZERO);
        frame.fill(&Figure::upright(Vec2::new(-5.0, -5.0), Vec2::new(3.0, 100.0)), Vec3::X);
        assert_eq!(frame.color(8 * 7 + 2), Vec3::X);
        assert_eq!(frame.color(8 * 7 + 3), Vec3::ZERO);
    }
}
