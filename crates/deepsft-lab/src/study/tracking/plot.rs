//! The error of a track over time as a picture.

use deepsft_cli::output::canvas::{CHARACTER, Canvas, text_width};
use deepsft_geometry::Picture;

const PAPER: [u8; 3] = [252, 251, 247];
const INK: [u8; 3] = [40, 40, 46];
const GRID: [u8; 3] = [222, 220, 212];
const LIMIT: [u8; 3] = [60, 140, 80];
const LINE: [u8; 3] = [196, 61, 44];
const EVENT: [u8; 3] = [236, 232, 214];
const MISSED: [u8; 3] = [214, 60, 160];
const AWAY: [u8; 3] = [170, 170, 176];
const HARDLY: [u8; 3] = [206, 206, 212];
const ANSWER: [u8; 3] = [50, 90, 170];

/// Size of the picture.
pub const WIDTH: usize = 480;
pub const HEIGHT: usize = 270;

/// Left, right, top and bottom margins, pixels.
const MARGINS: [usize; 4] = [36, 8, 10, 26];

/// Ends of the logarithmic scale, pixels of error; what lies outside is drawn at the end.
const SCALE: [f64; 2] = [0.1, 100.0];

/// The error that counts as tracked.
const TRACKED: f64 = 2.0;

/// Height of the strip of marks, pixels.
const STRIP: usize = 6;

/// A frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Point {
    /// Registration RMSE, pixels.
    pub error: Option<f64>,
    pub mark: Mark,
    /// Whether an answer of the network arrived.
    pub answer: bool,
}

/// The strip above the curve.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Mark {
    /// Nothing.
    Found,
    /// In view and not found: magenta.
    Missed,
    /// Too little of it in view to ask for it: light grey.
    HardlyThere,
    /// Nothing of it in view: grey.
    Away,
}

/// The error over the frames on a logarithmic scale from 0.1 to 100 pixels, a line at 2 pixels, the frames of the event
/// shaded, and below it a tick for each answer of the network.
pub fn track_plot(points: &[Point], event_frames: [usize; 2]) -> Picture {
    let [left, right, top, bottom] = MARGINS;
    let (width, height) = (WIDTH - left - right, HEIGHT - top - bottom - STRIP - 2);
    let above = top + STRIP + 2;
    let mut canvas = Canvas::new(WIDTH, HEIGHT, PAPER);
    let x_of = |frame: f64| left as f64 + frame / points.len().max(2) as f64 * width as f64;
    let y_of = |error: f64| {
        let [low, high] = SCALE;
        let share = (error.clamp(low, high) / low).ln() / (high / low).ln();
        above as f64 + (1.0 - share) * height as f64
    };
    let fill = |canvas: &mut Canvas, frames: [usize; 2], rows: std::ops::Range<usize>, color: [u8; 3]| {
        for y in rows {
            canvas.line(
                (x_of(frames[0] as f64), y as f64),
                (x_of(frames[1] as f64) - 1.0, y as f64),
                color,
            );
        }
    };
    if event_frames[1] > event_frames[0] {
        fill(&mut canvas, event_frames, above..above + height, EVENT);
    }
    for error in [0.1, 0.3, 1.0, 3.0, 10.0, 30.0, 100.0] {
        let y = y_of(error);
        canvas.line((left as f64, y), ((left + width) as f64, y), GRID);
        let label = format!("{error}");
        let at = left.saturating_sub(4 + text_width(&label, 1));
        canvas.write(&label, at, (y as usize).saturating_sub(CHARACTER / 2), 1, INK);
    }
    canvas.line(
        (left as f64, y_of(TRACKED)),
        ((left + width) as f64, y_of(TRACKED)),
        LIMIT,
    );
    for frame in (0..points.len()).step_by(10) {
        let label = frame.to_string();
        let x = x_of(frame as f64 + 0.5) as usize;
        canvas.write(
            &label,
            x.saturating_sub(text_width(&label, 1) / 2),
            HEIGHT - CHARACTER - 4,
            1,
            INK,
        );
    }
    let place = |frame: usize, error: f64| (x_of(frame as f64 + 0.5), y_of(error));
    for (frame, point) in points.iter().enumerate() {
        let color = match point.mark {
            Mark::Found => None,
            Mark::Missed => Some(MISSED),
            Mark::HardlyThere => Some(HARDLY),
            Mark::Away => Some(AWAY),
        };
        if let Some(color) = color {
            fill(&mut canvas, [frame, frame + 1], top..top + STRIP, color);
        }
        if point.answer {
            let x = x_of(frame as f64 + 0.5);
            let foot = (above + height) as f64;
            canvas.line((x, foot + 2.0), (x, foot + 8.0), ANSWER);
        }
        let Some(error) = point.error else { continue };
        let (x, y) = place(frame, error);
        for dot in 0..9 {
            let offset = |k: usize| k as f64 - 1.0;
            let at = (x + offset(dot % 3), y + offset(dot / 3));
            canvas.line(at, at, LINE);
        }
        if let Some(before) = frame.checked_sub(1).and_then(|before| points[before].error) {
            canvas.line(place(frame - 1, before), (x, y), LINE);
        }
    }
    canvas.into_picture()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn count(picture: &Picture, color: [u8; 3]) -> usize {
        picture.rgb().chunks_exact(3).filter(|pixel| **pixel == color).count()
    }

    #[test]
    fn a_growing_error_rises_and_a_missed_frame_is_marked() {
        let point = |error: Option<f64>| Point {
            error,
            mark: if error.is_some() { Mark::Found } else { Mark::Missed },
            answer: false,
        };
        let mut points: Vec<Point> = (0..20).map(|k| point(Some(0.2 * 1.3_f64.powi(k)))).collect();
        points.push(point(None));
        let plot = track_plot(&points, [5, 10]);
        let row_of = |x: usize| (0..HEIGHT).find(|&y| plot.pixel(x, y) == LINE).unwrap();
        assert!(row_of(60) > row_of(200) && row_of(200) > row_of(400));
        assert!(count(&plot, EVENT) > 1000 && count(&plot, MISSED) > 60);
        let calm = track_plot(&points[..20], [0, 0]);
        assert_eq!((count(&calm, EVENT), count(&calm, MISSED)), (0, 0));
    }

    #[test]
    fn the_limit_is_where_two_pixels_are() {
        let two = track_plot(
            &[Point {
                error: Some(TRACKED),
                mark: Mark::Found,
                answer: true,
            }; 30],
            [0, 0],
        );
        // The dots of the frames lie on the line of the limit and cover it.
        let limit = (0..HEIGHT)
            .find(|&y| two.pixel(WIDTH - MARGINS[1], y) == LIMIT)
            .unwrap();
        assert_eq!(two.pixel(WIDTH / 2, limit), LINE);
        assert!(count(&two, ANSWER) >= 30 * 6);
        assert_eq!(track_plot(&[], [0, 0]).width(), WIDTH);
    }
}
