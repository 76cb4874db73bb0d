//! A geometric alphabet of strokes (bowls, stems and arches): only the letters that the poster uses.

use super::canvas::{Canvas, Ink, Point, Shape, turned, unit};

/// The strokes of one character and its advance, in units of the x height; baseline at y = 0, y down.
/// Characters that the poster does not use are blank.
pub(super) fn glyph(character: char) -> (Vec<Vec<Point>>, f32) {
    let bowl = || arc((0.5, -0.5), 0.5, 0.5, 0.0, 1.0);
    let stem = |x: f32, top: f32, bottom: f32| vec![(x, top), (x, bottom)];
    let strokes = match character {
        'a' => vec![bowl(), stem(1.0, -1.0, 0.0)],
        'c' => vec![arc((0.5, -0.5), 0.5, 0.5, 0.87, 0.13)],
        'd' => vec![bowl(), stem(1.0, -1.6, 0.0)],
        'e' => vec![[vec![(0.02, -0.5), (1.0, -0.5)], arc((0.5, -0.5), 0.5, 0.5, 1.0, 0.12)].concat()],
        'f' => vec![
            [arc((0.6, -1.25), 0.35, 0.35, 0.85, 0.5), vec![(0.25, 0.0)]].concat(),
            vec![(0.0, -0.95), (0.6, -0.95)],
        ],
        'i' => vec![stem(0.0, -1.0, 0.0), vec![(0.0, -1.45), (0.0, -1.42)]],
        'l' => vec![stem(0.0, -1.6, 0.0)],
        'm' => vec![
            stem(0.0, -1.0, 0.0),
            [
                vec![(0.0, -0.6)],
                arc((0.4, -0.6), 0.4, 0.4, 0.5, 1.0),
                vec![(0.8, 0.0)],
            ]
            .concat(),
            [
                vec![(0.8, -0.6)],
                arc((1.2, -0.6), 0.4, 0.4, 0.5, 1.0),
                vec![(1.6, 0.0)],
            ]
            .concat(),
        ],
        'n' => vec![
            stem(0.0, -1.0, 0.0),
            [
                vec![(0.0, -0.6)],
                arc((0.4, -0.6), 0.4, 0.4, 0.5, 1.0),
                vec![(0.8, 0.0)],
            ]
            .concat(),
        ],
        'p' => vec![bowl(), stem(0.0, -1.0, 0.6)],
        'r' => vec![
            stem(0.0, -1.0, 0.0),
            [vec![(0.0, -0.6)], arc((0.4, -0.6), 0.4, 0.4, 0.5, 0.8)].concat(),
        ],
        's' => vec![
            [
                arc((0.4, -0.75), 0.36, 0.25, 0.95, 0.25),
                arc((0.4, -0.25), 0.38, 0.25, 0.75, 1.45),
            ]
            .concat(),
        ],
        't' => vec![
            [vec![(0.25, -1.45), (0.25, -0.3)], arc((0.55, -0.3), 0.3, 0.3, 0.5, 0.2)].concat(),
            vec![(0.0, -0.95), (0.65, -0.95)],
        ],
        'A' => vec![
            vec![(0.0, 0.0), (0.6, -1.5), (1.2, 0.0)],
            vec![(0.22, -0.5), (0.98, -0.5)],
        ],
        '0' => vec![arc((0.42, -0.75), 0.42, 0.75, 0.0, 1.0)],
        '1' => vec![vec![(0.0, -1.15), (0.4, -1.5), (0.4, 0.0)]],
        '4' => vec![vec![(0.75, 0.0), (0.75, -1.5), (0.0, -0.45), (1.0, -0.45)]],
        '%' => vec![
            arc((0.25, -1.2), 0.25, 0.28, 0.0, 1.0),
            arc((1.05, -0.28), 0.25, 0.28, 0.0, 1.0),
            vec![(0.2, 0.0), (1.1, -1.5)],
        ],
        ':' => vec![vec![(0.0, -0.9), (0.0, -0.87)], vec![(0.0, -0.05), (0.0, -0.02)]],
        ',' => vec![vec![(0.08, -0.05), (0.0, 0.25)]],
        _ => Vec::new(),
    };
    let right = strokes.iter().flatten().map(|p| p.0).fold(0.0, f32::max);
    (strokes, if character == ' ' { 0.55 } else { right })
}

fn arc(centre: Point, radius_x: f32, radius_y: f32, from: f32, to: f32) -> Vec<Point> {
    const STEPS: usize = 20;
    (0..=STEPS)
        .map(|i| {
            let (x, y) = unit(from + (to - from) * i as f32 / STEPS as f32, radius_x, radius_y);
            (centre.0 + x, centre.1 + y)
        })
        .collect()
}

/// Text on a straight line.
pub(super) struct Lettering {
    /// Where the first letter's baseline begins.
    pub(super) origin: Point,
    /// From x towards y.
    pub(super) angle: f32,
    pub(super) x_height: f32,
    /// Stroke width in mm.
    pub(super) weight: f32,
    /// Between two letters, in x heights.
    pub(super) spacing: f32,
}

impl Lettering {
    /// Draws the text; `inks` are used in turn. Returns its width in mm.
    pub(super) fn draw(&self, canvas: &mut Canvas, text: &str, inks: &[Ink]) -> f32 {
        let mut along = 0.0;
        for (i, character) in text.chars().enumerate() {
            let (strokes, advance) = glyph(character);
            let ink = inks.get(i % inks.len().max(1)).copied().unwrap_or([0; 3]);
            for stroke in strokes {
                let points: Vec<Point> = stroke
                    .into_iter()
                    .map(|(x, y)| turned(self.origin, self.angle, (along + self.x_height * x, self.x_height * y)))
                    .collect();
                canvas.stroke(&Shape::line(&points), ink, self.weight);
            }
            along += self.x_height * (advance + self.spacing);
        }
        along
    }
}
