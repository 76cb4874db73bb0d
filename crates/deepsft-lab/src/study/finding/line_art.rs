//! Line art: contour maps, hatched engravings, floor plans, diagrams, and plants drawn with a pen.

use super::canvas::{Canvas, Ink, Point, Shape, turned};
use super::dice::{Dice, print_size, uniform};
use deepsft_geometry::Picture;
use deepsft_geometry::glam::Vec2;
use deepsft_synth::painting::ValueNoise;
use rand::RngExt;

/// Longer side of the paper in mm, and its resolution.
const LONG_SIDE_MM: f32 = 297.0;
const PIXELS_PER_MM: f32 = 3.0;

type Painter = fn(&mut Sheet, &mut Dice);

/// A drawing and what it shows. `number` chooses the kind, the dice everything else.
pub fn line_art(number: usize, dice: &mut Dice) -> (&'static str, Picture) {
    let painters: [(&'static str, Painter); 5] = [
        ("contour map", contour_map),
        ("engraving", engraving),
        ("floor plan", floor_plan),
        ("diagram", diagram),
        ("plant", plants),
    ];
    let (width, height) = print_size(LONG_SIDE_MM * PIXELS_PER_MM, dice);
    let (name, paint) = painters[number % painters.len()];
    (name, Sheet::drawn(width, height, dice, paint))
}

/// Paper and pen, in mm.
struct Sheet {
    canvas: Canvas,
    width: f32,
    height: f32,
    pen: f32,
    ink: Ink,
}

impl Sheet {
    fn drawn(width: usize, height: usize, dice: &mut Dice, paint: Painter) -> Picture {
        let Some(canvas) = Canvas::new(width as u32, height as u32, PIXELS_PER_MM) else {
            return Picture::from_fn(width, height, |_, _| [255; 3]);
        };
        let mut sheet = Self {
            canvas,
            width: width as f32 / PIXELS_PER_MM,
            height: height as f32 / PIXELS_PER_MM,
            pen: uniform(dice, 0.35, 1.2),
            ink: std::array::from_fn(|_| dice.random_range(0..70)),
        };
        if dice.random_bool(0.4) {
            let paper: [u8; 3] = std::array::from_fn(|_| dice.random_range(215..=255));
            sheet
                .canvas
                .fill(&Shape::rectangle(0.0, 0.0, sheet.width, sheet.height), paper);
        }
        paint(&mut sheet, dice);
        sheet.canvas.into_picture()
    }

    fn line(&mut self, points: &[Point], width: f32) {
        self.canvas.stroke(&Shape::line(points), self.ink, self.pen * width);
    }

    fn curve(&mut self, points: &[Point], width: f32) {
        self.canvas.stroke(&Shape::curve(points), self.ink, self.pen * width);
    }

    fn place(&self, margin: f32, dice: &mut Dice) -> Point {
        [self.width, self.height]
            .map(|side| uniform(dice, margin, side - margin))
            .into()
    }

    /// A word of letter-like strokes; its end.
    fn word(&mut self, (mut x, y): Point, size: f32, letters: usize, dice: &mut Dice) -> f32 {
        for _ in 0..letters {
            let width = size * uniform(dice, 0.4, 0.8);
            for _ in 0..dice.random_range(2..4) {
                let mut halves = |side: f32| side * dice.random_range(0..3) as f32 / 2.0;
                let mut end = || (x + halves(width), y + halves(size));
                let ends = [end(), end()];
                self.canvas.stroke(&Shape::line(&ends), self.ink, size * 0.13);
            }
            x += width + size * 0.3;
        }
        x
    }
}

/// Contour lines of hills, roads between places, names.
fn contour_map(sheet: &mut Sheet, dice: &mut Dice) {
    let (noise, scale) = (ValueNoise::new(dice), uniform(dice, 0.008, 0.025));
    let interval = uniform(dice, 0.05, 0.15);
    let level = |x: f32, y: f32| noise.fractal(Vec2::new(x, y) * scale, 5) / interval;
    let cell = 2.0;
    for row in 0..(sheet.height / cell) as usize {
        for column in 0..(sheet.width / cell) as usize {
            let (x, y) = (column as f32 * cell, row as f32 * cell);
            let corners = [(x, y), (x + cell, y), (x + cell, y + cell), (x, y + cell)];
            let values = corners.map(|(x, y)| level(x, y));
            let (low, high) = values
                .iter()
                .fold((f32::MAX, f32::MIN), |(l, h), &v| (l.min(v), h.max(v)));
            for k in low.ceil() as i32..=high.floor() as i32 {
                let mut ends = Vec::new();
                for i in 0..4 {
                    let (a, b) = (values[i] - k as f32, values[(i + 1) % 4] - k as f32);
                    if (a < 0.0) != (b < 0.0) {
                        let (p, q, t) = (corners[i], corners[(i + 1) % 4], a / (a - b));
                        ends.push((p.0 + (q.0 - p.0) * t, p.1 + (q.1 - p.1) * t));
                    }
                }
                let width = if k % 5 == 0 { 0.9 } else { 0.4 };
                ends.chunks_exact(2).for_each(|pair| sheet.line(pair, width));
            }
        }
    }
    let towns: Vec<Point> = (0..dice.random_range(4..12)).map(|_| sheet.place(12.0, dice)).collect();
    for pair in towns.windows(2) {
        let bend = |a: f32, b: f32, dice: &mut Dice| (a + b) / 2.0 + uniform(dice, -20.0, 20.0);
        let middle = (bend(pair[0].0, pair[1].0, dice), bend(pair[0].1, pair[1].1, dice));
        sheet.curve(&[pair[0], middle, pair[1]], 2.0);
    }
    for town in towns {
        sheet.canvas.fill(&Shape::disc(town, 2.0), sheet.ink);
        let (size, letters) = (uniform(dice, 3.0, 7.0), dice.random_range(4..10));
        sheet.word((town.0 + 3.0, town.1 + 1.0), size, letters, dice);
    }
}

/// Overlapping bodies, each hatched in one or two directions.
fn engraving(sheet: &mut Sheet, dice: &mut Dice) {
    for _ in 0..dice.random_range(12..45) {
        let (centre, size) = (sheet.place(0.0, dice), uniform(dice, 8.0, 55.0));
        let points: Vec<Point> = (0..dice.random_range(5..11))
            .map(|k| turned(centre, k as f32 * 0.65, (size * uniform(dice, 0.5, 1.0), 0.0)))
            .collect();
        let shape = Shape::blob(&points);
        let hatches = dice.random_range(1..3);
        let ink = sheet.ink;
        sheet.canvas.fill(&shape, [250; 3]);
        for _ in 0..hatches {
            let (angle, step) = (uniform(dice, 0.0, 3.1), uniform(dice, 1.2, 5.0));
            let (wave, width) = (uniform(dice, 0.0, 2.0), sheet.pen * uniform(dice, 0.3, 1.0));
            sheet.canvas.clipped(&shape, |canvas| {
                let mut offset = -size;
                while offset < size {
                    let at = |k: i32| (k as f32 / 6.0 * size, offset + wave * (k as f32 * 1.1).sin());
                    let line: Vec<Point> = (-6..=6).map(|k| turned(centre, angle, at(k))).collect();
                    canvas.stroke(&Shape::curve(&line), ink, width);
                    offset += step * (1.0 + 0.6 * (offset / size));
                }
            });
        }
        sheet.canvas.stroke(&shape, ink, sheet.pen);
    }
}

/// Rooms with doors, stairs and their sizes.
fn floor_plan(sheet: &mut Sheet, dice: &mut Dice) {
    let mut rooms = vec![(10.0, 10.0, sheet.width - 20.0, sheet.height - 20.0)];
    let smallest = uniform(dice, 18.0, 40.0);
    while let Some((x, y, w, h)) = rooms.pop() {
        let (wide, part) = (w > h, uniform(dice, 0.3, 0.7));
        if w.max(h) > 2.2 * smallest && (w.max(h) > 90.0 || dice.random_bool(0.85)) {
            if wide {
                rooms.extend([(x, y, w * part, h), (x + w * part, y, w * (1.0 - part), h)]);
            } else {
                rooms.extend([(x, y, w, h * part), (x, y + h * part, w, h * (1.0 - part))]);
            }
            continue;
        }
        sheet.line(&[(x, y), (x + w, y), (x + w, y + h), (x, y + h), (x, y)], 2.5);
        let door = uniform(dice, 0.1, 0.6) * w;
        let leaf = (w * 0.3).min(12.0);
        let swing: Vec<Point> = (0..7)
            .map(|k| turned((x + door, y), k as f32 * 0.26, (leaf, 0.0)))
            .collect();
        sheet.curve(&swing, 0.5);
        sheet.line(&[(x + door, y), (x + door, y + leaf)], 0.8);
        match dice.random_range(0..4) {
            0 => {
                let steps = dice.random_range(5..12);
                for k in 0..steps {
                    let at = y + h * (0.3 + 0.6 * k as f32 / steps as f32);
                    sheet.line(&[(x + w * 0.55, at), (x + w * 0.9, at)], 0.6);
                }
            }
            1 => {
                let (a, b) = (w * uniform(dice, 0.2, 0.4), h * uniform(dice, 0.15, 0.3));
                let corner = (x + w * 0.5, y + h * 0.55);
                let table = Shape::rectangle(corner.0, corner.1, a, b);
                sheet.canvas.stroke(&table, sheet.ink, sheet.pen * 0.6);
                for k in 0..4 {
                    let chair = (corner.0 + a * (k as f32 + 0.5) / 4.0, corner.1 - 3.0);
                    sheet
                        .canvas
                        .stroke(&Shape::disc(chair, 1.8), sheet.ink, sheet.pen * 0.5);
                }
            }
            _ => {}
        }
        let letters = dice.random_range(3..8);
        sheet.word((x + 4.0, y + h - 8.0), uniform(dice, 2.5, 4.5), letters, dice);
    }
}

/// Boxes of several shapes with words in them, joined by arrows.
fn diagram(sheet: &mut Sheet, dice: &mut Dice) {
    let (columns, rows) = (dice.random_range(3..6), dice.random_range(3..7));
    let cell = (sheet.width / columns as f32, sheet.height / rows as f32);
    let mut boxes = Vec::new();
    for k in 0..columns * rows {
        if dice.random_bool(0.8) {
            let shift = |dice: &mut Dice| uniform(dice, 0.4, 0.6);
            let column = (k % columns) as f32 + shift(dice);
            boxes.push((column * cell.0, ((k / columns) as f32 + shift(dice)) * cell.1));
        }
    }
    for _ in 0..boxes.len() * 3 / 2 {
        let [from, to] = [0; 2].map(|_| boxes[dice.random_range(0..boxes.len())]);
        if dice.random_bool(0.5) {
            sheet.line(&[from, (to.0, from.1), to], 0.7);
        } else {
            sheet.line(&[from, to], 0.7);
        }
        let middle = ((from.0 + to.0) / 2.0, (from.1 + to.1) / 2.0);
        sheet.word(middle, 3.0, dice.random_range(1..4), dice);
    }
    for at in boxes {
        let (w, h) = (cell.0 * uniform(dice, 0.35, 0.8), cell.1 * uniform(dice, 0.25, 0.6));
        let shape = match dice.random_range(0..4) {
            0 => Shape::ellipse(at, w / 2.0, h / 2.0),
            1 => Shape::polygon(&[
                (at.0 - w / 2.0, at.1),
                (at.0, at.1 - h / 2.0),
                (at.0 + w / 2.0, at.1),
                (at.0, at.1 + h / 2.0),
            ]),
            _ => Shape::rectangle(at.0 - w / 2.0, at.1 - h / 2.0, w, h),
        };
        sheet.canvas.fill(&shape, [252; 3]);
        sheet.canvas.stroke(&shape, sheet.ink, sheet.pen);
        let size = uniform(dice, 2.5, 5.0);
        for line in 0..dice.random_range(1..4) {
            let letters = dice.random_range(3..8);
            let left = at.0 - w * 0.3;
            sheet.word((left, at.1 + (line as f32 - 1.0) * size * 1.6), size, letters, dice);
        }
    }
}

/// Branches with leaves in outline.
fn plants(sheet: &mut Sheet, dice: &mut Dice) {
    for _ in 0..dice.random_range(2..6) {
        let root = (uniform(dice, 0.1, 0.9) * sheet.width, sheet.height - 8.0);
        let length = sheet.height * uniform(dice, 0.1, 0.22);
        branch(sheet, root, -1.57 + uniform(dice, -0.3, 0.3), length, 5, dice);
    }
}

fn branch(sheet: &mut Sheet, from: Point, angle: f32, length: f32, depth: u32, dice: &mut Dice) {
    let middle = turned(from, angle, (length / 2.0, uniform(dice, -0.15, 0.15) * length));
    let end = turned(from, angle, (length, 0.0));
    sheet.curve(&[from, middle, end], 0.35 * depth as f32);
    for _ in 0..2 {
        let side = if dice.random_bool(0.5) { 1.0 } else { -1.0 };
        let turn = side * uniform(dice, 0.5, 1.3);
        leaf(sheet, middle, angle + turn, uniform(dice, 6.0, 18.0), dice);
    }
    if depth == 0 {
        return;
    }
    for _ in 0..dice.random_range(1..4) {
        let turn = uniform(dice, -0.9, 0.9);
        let shorter = length * uniform(dice, 0.6, 0.9);
        branch(sheet, end, angle + turn, shorter, depth - 1, dice);
    }
}

fn leaf(sheet: &mut Sheet, from: Point, angle: f32, length: f32, dice: &mut Dice) {
    let wide = length * uniform(dice, 0.15, 0.35);
    let at = |along: f32, across: f32| turned(from, angle, (length * along, across));
    let outline = Shape::blob(&[at(0.0, 0.0), at(0.4, wide), at(1.0, 0.0), at(0.4, -wide)]);
    sheet.canvas.fill(&outline, [250; 3]);
    sheet.canvas.stroke(&outline, sheet.ink, sheet.pen * 0.6);
    sheet.line(&[from, at(0.9, 0.0)], 0.4);
    for k in 1..4 {
        let along = k as f32 * 0.22;
        sheet.line(&[at(along, 0.0), at(along + 0.12, wide * 0.7)], 0.3);
        sheet.line(&[at(along, 0.0), at(along + 0.12, -wide * 0.7)], 0.3);
    }
}
