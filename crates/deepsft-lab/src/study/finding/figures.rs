//! Pictures of the prints, and of the frames that our finders failed on.

use super::judging::FrameResult;
use super::prints::{Kind, Print};
use deepsft_cli::output::canvas::Canvas;
use deepsft_cli::output::lettering::{Align, Lettering};
use deepsft_geometry::Picture;

/// Size of a print on its sheet, and prints in a row.
const PRINT_SIDE: usize = 150;
const PRINT_COLUMNS: usize = 10;

/// Size of a failed frame, of the print beside it and of the line below, pixels; failures in a row, and how many there are.
const FRAME_SIDE: usize = 320;
const BESIDE: usize = 100;
const LINE: usize = 18;
const COLUMNS: usize = 4;
const MOST: usize = 60;

/// One sheet of each kind of print, with the name of its file.
pub fn print_sheets(prints: &[Print]) -> Vec<(String, Picture)> {
    let sheet = |kind: Kind| {
        let of: Vec<&Picture> = (prints.iter().filter(|print| print.kind == kind))
            .map(|print| print.template.texture())
            .collect();
        let rows = of.len().div_ceil(PRINT_COLUMNS);
        let mut sheet = Canvas::new(PRINT_COLUMNS * PRINT_SIDE, rows * PRINT_SIDE, [120; 3]);
        for (number, picture) in of.iter().enumerate() {
            let (left, top) = (number % PRINT_COLUMNS * PRINT_SIDE, number / PRINT_COLUMNS * PRINT_SIDE);
            sheet.draw(&shrunk(picture, PRINT_SIDE - 4), left + 2, top + 2);
        }
        let name = format!("prints-{}.png", kind.name().replace(", ", "-").replace(' ', "-"));
        (!of.is_empty()).then(|| (name, sheet.into_picture()))
    };
    Kind::ALL.into_iter().filter_map(sheet).collect()
}

/// Frames that our finders failed on: with the print and not within 2 px, or without it and found.
#[derive(Default)]
pub struct Failures(Vec<(usize, String, Picture)>);

impl Failures {
    /// Keeps the frame if it is one.
    pub fn note(&mut self, result: &FrameResult, image: &Picture) {
        let Some(best) = result.best_of_ours() else { return };
        let failed = match result.shown {
            true => !best.is_fitted(),
            false => best.is_found(),
        };
        if failed {
            let what = match (result.shown, best.started) {
                (true, true) => "off",
                (true, false) => "not started",
                (false, _) => "another print",
            };
            let error = best.fitted_px.map_or(String::new(), |px| format!(", {px:.1} px"));
            let line = format!(
                "{} {}.{}: {what}{error}, {:.2}",
                result.subject, result.print, result.index, best.correlation
            );
            self.0.push((result.print, line, shrunk(image, FRAME_SIDE)));
        }
    }

    /// Up to 60 of them, spread over all, each with its print.
    pub fn sheet(&self, prints: &[Print]) -> Picture {
        let count = self.0.len().min(MOST);
        let (width, height) = (FRAME_SIDE + BESIDE + 8, FRAME_SIDE * 9 / 16 + LINE + 4);
        let mut sheet = Canvas::new(COLUMNS * width, count.div_ceil(COLUMNS).max(1) * height, [255; 3]);
        for k in 0..count {
            let (print, line, frame) = &self.0[k * self.0.len() / count];
            let (left, top) = (k % COLUMNS * width, k / COLUMNS * height);
            sheet.draw(frame, left, top);
            sheet.draw(
                &shrunk(prints[*print].template.texture(), BESIDE),
                left + FRAME_SIDE + 4,
                top,
            );
            let middle = (top + height - LINE / 2 - 2) as f64;
            sheet.write(
                line,
                (left as f64 + 2.0, middle),
                Align::Left,
                Lettering::regular(13.0, [0; 3]),
            );
        }
        sheet.into_picture()
    }
}

/// A picture with `side` pixels along its longer side, by averaging.
fn shrunk(picture: &Picture, side: usize) -> Picture {
    let factor = picture.width().max(picture.height()) as f64 / side as f64;
    let [width, height] = [picture.width(), picture.height()].map(|s| ((s as f64 / factor) as usize).max(1));
    let points = (factor.ceil() as usize).max(1);
    Picture::from_fn(width, height, |x, y| {
        let mut sum = [0.0; 3];
        for k in 0..points * points {
            let within = |k: usize| (k as f64 + 0.5) / points as f64;
            let at = [(x, k % points), (y, k / points)].map(|(at, k)| (at as f64 + within(k)) * factor);
            sum.iter_mut()
                .zip(picture.sample(at[0], at[1]))
                .for_each(|(s, c)| *s += c);
        }
        sum.map(|s| (s / (points * points) as f32) as u8)
    })
}
