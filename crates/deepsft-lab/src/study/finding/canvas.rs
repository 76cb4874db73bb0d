//! Anti-aliased drawing in mm of a sheet, with opaque inks.

use deepsft_geometry::Picture;
use std::f32::consts::TAU;
use tiny_skia::{FillRule, LineCap, LineJoin, Mask, Paint, Path, PathBuilder, Pixmap, Stroke, Transform};

/// A point of the sheet: mm from its top-left corner, x right, y down.
pub type Point = (f32, f32);

/// An sRGB ink.
pub type Ink = [u8; 3];

/// An outline or a line. Degenerate ones are empty and draw nothing.
pub struct Shape(Option<Path>);

impl Shape {
    pub fn polygon(points: &[Point]) -> Self {
        Self::through(points, true)
    }

    pub fn line(points: &[Point]) -> Self {
        Self::through(points, false)
    }

    fn through(points: &[Point], closed: bool) -> Self {
        let mut path = PathBuilder::new();
        for (i, &(x, y)) in points.iter().enumerate() {
            if i == 0 { path.move_to(x, y) } else { path.line_to(x, y) }
        }
        if closed {
            path.close();
        }
        Self(path.finish())
    }

    /// The closed Catmull-Rom curve through the points.
    pub fn blob(points: &[Point]) -> Self {
        let n = points.len();
        Self::catmull_rom(points, n, |i, offset| (i + n + offset - 1) % n)
    }

    /// The open Catmull-Rom curve through the points.
    pub fn curve(points: &[Point]) -> Self {
        let last = points.len().saturating_sub(1);
        Self::catmull_rom(points, last, |i, offset| (i + offset).saturating_sub(1).min(last))
    }

    /// Segments from each point to the next; `index(i, k)` is the k-th of the four points that shape segment i.
    fn catmull_rom(points: &[Point], segments: usize, index: impl Fn(usize, usize) -> usize) -> Self {
        let mut path = PathBuilder::new();
        for i in 0..segments {
            let [a, b, c, d] = [0, 1, 2, 3].map(|k| points[index(i, k)]);
            if i == 0 {
                path.move_to(b.0, b.1);
            }
            path.cubic_to(
                b.0 + (c.0 - a.0) / 6.0,
                b.1 + (c.1 - a.1) / 6.0,
                c.0 - (d.0 - b.0) / 6.0,
                c.1 - (d.1 - b.1) / 6.0,
                c.0,
                c.1,
            );
        }
        if segments == points.len() {
            path.close();
        }
        Self(path.finish())
    }

    pub fn disc(centre: Point, radius: f32) -> Self {
        Self(PathBuilder::from_circle(centre.0, centre.1, radius))
    }

    pub fn ellipse(centre: Point, radius_x: f32, radius_y: f32) -> Self {
        let at = |i: u8| {
            let (sin, cos) = (f32::from(i) / 16.0 * TAU).sin_cos();
            (centre.0 + radius_x * cos, centre.1 + radius_y * sin)
        };
        Self::blob(&(0..16).map(at).collect::<Vec<_>>())
    }

    pub fn rectangle(x: f32, y: f32, width: f32, height: f32) -> Self {
        Self::polygon(&[(x, y), (x + width, y), (x + width, y + height), (x, y + height)])
    }
}

/// `offset` turned by `angle` from x towards y, from `origin`.
pub fn turned(origin: Point, angle: f32, offset: Point) -> Point {
    let (s, c) = angle.sin_cos();
    (
        origin.0 + c * offset.0 - s * offset.1,
        origin.1 + s * offset.0 + c * offset.1,
    )
}

/// The sheet being drawn.
pub struct Canvas {
    pixmap: Pixmap,
    pixels_from_mm: Transform,
    clip: Option<Mask>,
}

impl Canvas {
    /// White paper; `None` when the size does not fit into memory.
    pub fn new(width: u32, height: u32, pixels_per_mm: f32) -> Option<Self> {
        let mut pixmap = Pixmap::new(width, height)?;
        pixmap.fill(tiny_skia::Color::WHITE);
        Some(Self {
            pixmap,
            pixels_from_mm: Transform::from_scale(pixels_per_mm, pixels_per_mm),
            clip: None,
        })
    }

    pub fn fill(&mut self, shape: &Shape, ink: Ink) {
        if let Some(path) = &shape.0 {
            let (pixels, clip) = (self.pixels_from_mm, self.clip.as_ref());
            self.pixmap
                .fill_path(path, &paint(ink), FillRule::Winding, pixels, clip);
        }
    }

    /// Draws the outline `width` mm wide, with round ends and corners.
    pub fn stroke(&mut self, shape: &Shape, ink: Ink, width: f32) {
        if let Some(path) = &shape.0 {
            let stroke = Stroke {
                width,
                line_cap: LineCap::Round,
                line_join: LineJoin::Round,
                ..Stroke::default()
            };
            let (pixels, clip) = (self.pixels_from_mm, self.clip.as_ref());
            self.pixmap.stroke_path(path, &paint(ink), &stroke, pixels, clip);
        }
    }

    /// Draws with everything outside `shape` protected.
    pub fn clipped(&mut self, shape: &Shape, draw: impl FnOnce(&mut Self)) {
        let mask = Mask::new(self.pixmap.width(), self.pixmap.height());
        let (Some(path), Some(mut mask)) = (&shape.0, mask) else {
            return;
        };
        mask.fill_path(path, FillRule::Winding, true, self.pixels_from_mm);
        self.clip = Some(mask);
        draw(self);
        self.clip = None;
    }

    /// The drawing without its alpha channel (paper is opaque).
    pub fn into_picture(self) -> Picture {
        let width = self.pixmap.width() as usize;
        let pixels = self.pixmap.pixels();
        Picture::from_fn(width, self.pixmap.height() as usize, |x, y| {
            let pixel = pixels[y * width + x];
            [pixel.red(), pixel.green(), pixel.blue()]
        })
    }
}

fn paint([r, g, b]: Ink) -> Paint<'static> {
    let mut paint = Paint::default();
    paint.set_color_rgba8(r, g, b, 255);
    paint.anti_alias = true;
    paint
}
