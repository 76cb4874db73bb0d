//! Anti-aliased drawing in millimetres of the sheet: shapes, inks, clipping, and the dice every part of
//! the artwork throws for itself.

use deepsft_geometry::Picture;
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg32;
use tiny_skia::{FillRule, LineCap, LineJoin, Mask, Paint, Path, PathBuilder, Pixmap, Stroke, Transform};

/// A point of the sheet: mm from its top-left corner, x right, y down.
pub(crate) type Point = (f32, f32);

/// An opaque sRGB printing ink.
pub(crate) type Ink = [u8; 3];

/// Random choices of one element of the artwork. Each element has its own seed, so that changing one
/// leaves all others as they were.
pub(crate) struct Dice(Pcg32);

impl Dice {
    pub(crate) fn new(seed: u64) -> Self {
        Self(Pcg32::seed_from_u64(0xdee9_5f70_0000_0000 ^ seed))
    }

    /// Uniform in `low..high`.
    pub(crate) fn between(&mut self, low: f32, high: f32) -> f32 {
        low + (high - low) * self.0.random::<f32>()
    }

    /// Uniform in `-spread..spread`.
    pub(crate) fn jitter(&mut self, spread: f32) -> f32 {
        self.between(-spread, spread)
    }

    pub(crate) fn chance(&mut self, probability: f32) -> bool {
        self.0.random::<f32>() < probability
    }

    /// A whole number in `0..count` (0 for a `count` of 0).
    pub(crate) fn below(&mut self, count: usize) -> usize {
        ((self.0.random::<f32>() * count as f32) as usize).min(count.saturating_sub(1))
    }

    /// Two different ones of three inks.
    pub(crate) fn pair(&mut self, inks: &[Ink; 3]) -> [Ink; 2] {
        let first = self.below(3);
        [inks[first], inks[(first + 1 + self.below(2)) % 3]]
    }

    /// One of the inks; white when there is none.
    pub(crate) fn pick(&mut self, inks: &[Ink]) -> Ink {
        inks.get(self.below(inks.len())).copied().unwrap_or([255; 3])
    }
}

/// A filled outline or a line. Degenerate shapes are empty and draw nothing.
#[derive(Clone)]
pub(crate) struct Shape(Option<Path>);

impl Shape {
    pub(crate) fn polygon(points: &[Point]) -> Self {
        Self::through(points, true)
    }

    pub(crate) fn line(points: &[Point]) -> Self {
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
    pub(crate) fn blob(points: &[Point]) -> Self {
        let n = points.len();
        if n < 3 {
            return Self(None);
        }
        let mut path = PathBuilder::new();
        path.move_to(points[0].0, points[0].1);
        for i in 0..n {
            let [a, b, c, d] = [
                points[(i + n - 1) % n],
                points[i],
                points[(i + 1) % n],
                points[(i + 2) % n],
            ];
            catmull_rom(&mut path, a, b, c, d);
        }
        path.close();
        Self(path.finish())
    }

    /// The open Catmull-Rom curve through the points.
    pub(crate) fn curve(points: &[Point]) -> Self {
        let n = points.len();
        if n < 2 {
            return Self(None);
        }
        let mut path = PathBuilder::new();
        path.move_to(points[0].0, points[0].1);
        for i in 0..n - 1 {
            let [a, b, c, d] = [
                points[i.saturating_sub(1)],
                points[i],
                points[i + 1],
                points[(i + 2).min(n - 1)],
            ];
            catmull_rom(&mut path, a, b, c, d);
        }
        Self(path.finish())
    }

    pub(crate) fn disc(centre: Point, radius: f32) -> Self {
        Self(PathBuilder::from_circle(centre.0, centre.1, radius))
    }

    /// An ellipse with its first axis turned by `angle` from x towards y.
    pub(crate) fn ellipse(centre: Point, radius_x: f32, radius_y: f32, angle: f32) -> Self {
        Self::blob(
            &(0..16)
                .map(|i| turned(centre, angle, unit(i as f32 / 16.0, radius_x, radius_y)))
                .collect::<Vec<_>>(),
        )
    }

    /// The part of a ring between two radii and two angles.
    pub(crate) fn ring_sector(centre: Point, radii: (f32, f32), angles: (f32, f32)) -> Self {
        let steps = (((angles.1 - angles.0).abs() * radii.1 / 0.5).ceil() as usize).clamp(4, 200);
        let at = |i: usize, radius: f32| {
            let angle = angles.0 + (angles.1 - angles.0) * i as f32 / steps as f32;
            (centre.0 + radius * angle.cos(), centre.1 + radius * angle.sin())
        };
        let outer = (0..=steps).map(|i| at(i, radii.1));
        let inner = (0..=steps).rev().map(|i| at(i, radii.0));
        Self::polygon(&outer.chain(inner).collect::<Vec<_>>())
    }

    pub(crate) fn rectangle(x: f32, y: f32, width: f32, height: f32) -> Self {
        Self::polygon(&[(x, y), (x + width, y), (x + width, y + height), (x, y + height)])
    }

    /// Everything below a curve that is given from left to right, down to `bottom`.
    pub(crate) fn ground(skyline: &[Point], bottom: f32) -> Self {
        let (Some(first), Some(last)) = (skyline.first(), skyline.last()) else {
            return Self(None);
        };
        let mut path = PathBuilder::new();
        path.move_to(first.0, first.1);
        let n = skyline.len();
        for i in 0..n - 1 {
            let [a, b, c, d] = [
                skyline[i.saturating_sub(1)],
                skyline[i],
                skyline[i + 1],
                skyline[(i + 2).min(n - 1)],
            ];
            catmull_rom(&mut path, a, b, c, d);
        }
        path.line_to(last.0, bottom);
        path.line_to(first.0, bottom);
        path.close();
        Self(path.finish())
    }

    /// Left, top, right and bottom; all zero when empty.
    pub(crate) fn bounds(&self) -> (f32, f32, f32, f32) {
        self.0.as_ref().map_or((0.0, 0.0, 0.0, 0.0), |path| {
            let b = path.bounds();
            (b.left(), b.top(), b.right(), b.bottom())
        })
    }
}

fn catmull_rom(path: &mut PathBuilder, a: Point, b: Point, c: Point, d: Point) {
    path.cubic_to(
        b.0 + (c.0 - a.0) / 6.0,
        b.1 + (c.1 - a.1) / 6.0,
        c.0 - (d.0 - b.0) / 6.0,
        c.1 - (d.1 - b.1) / 6.0,
        c.0,
        c.1,
    );
}

/// The point of an axis-aligned ellipse about the origin at a fraction of a whole turn.
pub(crate) fn unit(turn: f32, radius_x: f32, radius_y: f32) -> Point {
    let angle = turn * std::f32::consts::TAU;
    (radius_x * angle.cos(), radius_y * angle.sin())
}

/// `offset` turned by `angle` from x towards y, from `origin`.
pub(crate) fn turned(origin: Point, angle: f32, offset: Point) -> Point {
    let (s, c) = angle.sin_cos();
    (
        origin.0 + c * offset.0 - s * offset.1,
        origin.1 + s * offset.0 + c * offset.1,
    )
}

/// The sheet being drawn.
pub(crate) struct Canvas {
    pixmap: Pixmap,
    pixels_from_mm: Transform,
    clips: Vec<Mask>,
}

impl Canvas {
    /// White paper; `None` when the size does not fit into memory.
    pub(crate) fn new(width: u32, height: u32, pixels_per_mm: f32) -> Option<Self> {
        let mut pixmap = Pixmap::new(width, height)?;
        pixmap.fill(tiny_skia::Color::WHITE);
        Some(Self {
            pixmap,
            pixels_from_mm: Transform::from_scale(pixels_per_mm, pixels_per_mm),
            clips: Vec::new(),
        })
    }

    pub(crate) fn fill(&mut self, shape: &Shape, ink: Ink) {
        self.tint(shape, ink, 1.0);
    }

    /// Fills with a transparent ink; `opacity` from 0 to 1.
    pub(crate) fn tint(&mut self, shape: &Shape, ink: Ink, opacity: f32) {
        if let Some(path) = &shape.0 {
            let paint = paint(ink, opacity);
            self.pixmap
                .fill_path(path, &paint, FillRule::Winding, self.pixels_from_mm, self.clips.last());
        }
    }

    /// Draws the outline `width` mm wide, with round ends and corners.
    pub(crate) fn stroke(&mut self, shape: &Shape, ink: Ink, width: f32) {
        if let Some(path) = &shape.0 {
            let stroke = Stroke {
                width,
                line_cap: LineCap::Round,
                line_join: LineJoin::Round,
                ..Stroke::default()
            };
            self.pixmap
                .stroke_path(path, &paint(ink, 1.0), &stroke, self.pixels_from_mm, self.clips.last());
        }
    }

    /// Draws with everything outside `shape` (and outside the enclosing clips) protected.
    pub(crate) fn clipped(&mut self, shape: &Shape, draw: impl FnOnce(&mut Self)) {
        let Some(path) = &shape.0 else { return };
        let mask = match self.clips.last() {
            Some(outer) => {
                let mut mask = outer.clone();
                mask.intersect_path(path, FillRule::Winding, true, self.pixels_from_mm);
                mask
            }
            None => {
                let Some(mut mask) = Mask::new(self.pixmap.width(), self.pixmap.height()) else {
                    return;
                };
                mask.fill_path(path, FillRule::Winding, true, self.pixels_from_mm);
                mask
            }
        };
        self.clips.push(mask);
        draw(self);
        self.clips.pop();
    }

    /// Fills the shape, then draws its ornament clipped to it.
    pub(crate) fn fill_with(&mut self, shape: &Shape, ink: Ink, ornament: impl FnOnce(&mut Self)) {
        self.fill(shape, ink);
        self.clipped(shape, ornament);
    }

    /// The drawing without its alpha channel (paper is opaque).
    pub(crate) fn into_picture(self) -> Picture {
        let width = self.pixmap.width() as usize;
        let pixels = self.pixmap.pixels();
        Picture::from_fn(width, self.pixmap.height() as usize, |x, y| {
            let pixel = pixels[y * width + x];
            [pixel.red(), pixel.green(), pixel.blue()]
        })
    }
}

fn paint([r, g, b]: Ink, opacity: f32) -> Paint<'static> {
    let mut paint = Paint::default();
    paint.set_color_rgba8(r, g, b, (255.0 * opacity).round() as u8);
    paint.anti_alias = true;
    paint
}
