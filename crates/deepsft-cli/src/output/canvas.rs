//! A picture to compose on: other pictures, rectangles, lines, dots and text.
//!
//! Coordinates are pixels from the top left corner of the canvas; the centre of the first pixel is at (0.5, 0.5). What lies
//! outside is cut off.

use super::lettering::{Align, Lettering};
use deepsft_geometry::Picture;
use tiny_skia::{FillRule, LineCap, LineJoin, Paint, PathBuilder, PixmapMut, Rect, Stroke, Transform};

/// An RGB picture in the making.
pub struct Canvas {
    width: usize,
    height: usize,
    /// Opaque RGBA, row-major.
    pixels: Vec<u8>,
}

impl Canvas {
    /// A canvas of one colour.
    pub fn new(width: usize, height: usize, [r, g, b]: [u8; 3]) -> Self {
        Self {
            width,
            height,
            pixels: [r, g, b, 255].repeat(width * height),
        }
    }

    /// A canvas that shows `picture`.
    pub fn of(picture: &Picture) -> Self {
        let pixels = picture.rgb().chunks_exact(3).flat_map(|c| [c[0], c[1], c[2], 255]);
        Self {
            width: picture.width(),
            height: picture.height(),
            pixels: pixels.collect(),
        }
    }

    /// Puts `picture` with its top left corner at (`left`, `top`).
    pub fn draw(&mut self, picture: &Picture, left: usize, top: usize) {
        for y in 0..picture.height().min(self.height.saturating_sub(top)) {
            for x in 0..picture.width().min(self.width.saturating_sub(left)) {
                let at = 4 * ((top + y) * self.width + left + x);
                self.pixels[at..at + 3].copy_from_slice(&picture.pixel(x, y));
            }
        }
    }

    /// Fills a rectangle. Borders between pixels are sharp, others are blended.
    pub fn fill(&mut self, left: f64, top: f64, width: f64, height: f64, color: [u8; 3]) {
        let Some(rectangle) = Rect::from_xywh(left as f32, top as f32, width as f32, height as f32) else {
            return;
        };
        if let Some(mut pixels) = self.pixels() {
            pixels.fill_rect(rectangle, &paint(color), Transform::identity(), None);
        }
    }

    /// Draws a line through `points`, `width` pixels wide.
    pub fn line(&mut self, points: &[(f64, f64)], width: f64, color: [u8; 3]) {
        let mut path = PathBuilder::new();
        for (i, &(x, y)) in points.iter().enumerate() {
            match i {
                0 => path.move_to(x as f32, y as f32),
                _ => path.line_to(x as f32, y as f32),
            }
        }
        let stroke = Stroke {
            width: width as f32,
            line_cap: LineCap::Butt,
            line_join: LineJoin::Round,
            ..Stroke::default()
        };
        if let (Some(path), Some(mut pixels)) = (path.finish(), self.pixels()) {
            pixels.stroke_path(&path, &paint(color), &stroke, Transform::identity(), None);
        }
    }

    /// Draws a round dot.
    pub fn dot(&mut self, (x, y): (f64, f64), radius: f64, color: [u8; 3]) {
        let circle = PathBuilder::from_circle(x as f32, y as f32, radius as f32);
        if let (Some(circle), Some(mut pixels)) = (circle, self.pixels()) {
            pixels.fill_path(&circle, &paint(color), FillRule::Winding, Transform::identity(), None);
        }
    }

    /// Writes `text`; the middle of its capitals is at the height of `middle`, and its point of `align` at `x`.
    pub fn write(&mut self, text: &str, (x, middle): (f64, f64), align: Align, lettering: Lettering) {
        let (width, height) = (self.width as i64, self.height as i64);
        let pixels = &mut self.pixels;
        lettering.rasterise(text, x, middle, align, |column, row, covered| {
            if (0..width).contains(&column) && (0..height).contains(&row) {
                let at = 4 * (row * width + column) as usize;
                for (under, ink) in pixels[at..at + 3].iter_mut().zip(lettering.color) {
                    let (under_value, ink) = (f32::from(*under), f32::from(ink));
                    *under = (under_value + covered.min(1.0) * (ink - under_value)).round() as u8;
                }
            }
        });
    }

    /// The finished picture.
    pub fn into_picture(self) -> Picture {
        Picture::from_fn(self.width, self.height, |x, y| {
            let at = 4 * (y * self.width + x);
            [self.pixels[at], self.pixels[at + 1], self.pixels[at + 2]]
        })
    }

    /// `None` when there is no pixel.
    fn pixels(&mut self) -> Option<PixmapMut<'_>> {
        PixmapMut::from_bytes(&mut self.pixels, self.width as u32, self.height as u32)
    }
}

fn paint([r, g, b]: [u8; 3]) -> Paint<'static> {
    let mut paint = Paint::default();
    paint.set_color_rgba8(r, g, b, 255);
    paint
}
