//! The error of a track over time as a picture.

use deepsft_cli::output::canvas::Canvas;
use deepsft_cli::output::chart::{FAINT_INK, GRID, NUMBER_SIZE, PAPER};
use deepsft_cli::output::lettering::{Align, Lettering};
use deepsft_geometry::Picture;

const LIMIT: [u8; 3] = [60, 140, 80];
const LINE: [u8; 3] = [204, 62, 44];
const EVENT: [u8; 3] = [250, 240, 214];
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

/// Length of a dash of the line at `TRACKED`, and of the gap after it, pixels.
const DASH: f64 = 4.0;

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
    let height = HEIGHT - top - bottom - STRIP - 2;
    let above = top + STRIP + 2;
    let mut canvas = Canvas::new(WIDTH, HEIGHT, PAPER);
    let (left, right, foot) = (left as f64, (WIDTH - right) as f64, (above + height) as f64);
    let x_of = |frame: f64| left + frame / points.len().max(2) as f64 * (right - left);
    let y_of = |error: f64| {
        let [low, high] = SCALE;
        foot - (error.clamp(low, high) / low).ln() / (high / low).ln() * height as f64
    };
    let sharp = |at: f64| at.floor() + 0.5;
    let numbers = Lettering::regular(NUMBER_SIZE, FAINT_INK);
    let columns = |frames: [usize; 2]| {
        let [from, to] = frames.map(|frame| x_of(frame as f64));
        (from, to - from)
    };
    if event_frames[1] > event_frames[0] {
        let (from, width) = columns(event_frames);
        canvas.fill(from, above as f64, width, height as f64, EVENT);
    }
    for error in [0.1, 0.3, 1.0, 3.0, 10.0, 30.0, 100.0] {
        let y = sharp(y_of(error));
        canvas.line(&[(left, y), (right, y)], 1.0, GRID);
        canvas.write(&error.to_string(), (left - 6.0, y), Align::Right, numbers);
    }
    let limit = y_of(TRACKED);
    for dash in 0..((right - left) / (2.0 * DASH)).ceil() as usize {
        let from = left + 2.0 * DASH * dash as f64;
        canvas.line(&[(from, limit), (right.min(from + DASH), limit)], 1.5, LIMIT);
    }
    for frame in (0..points.len()).step_by(10) {
        let at = (x_of(frame as f64 + 0.5), HEIGHT as f64 - 9.0);
        canvas.write(&frame.to_string(), at, Align::Centre, numbers);
    }
    let mark = |mark: Mark| match mark {
        Mark::Found => None,
        Mark::Missed => Some(MISSED),
        Mark::HardlyThere => Some(HARDLY),
        Mark::Away => Some(AWAY),
    };
    for (frame, point) in points.iter().enumerate() {
        if let Some(color) = mark(point.mark) {
            let (from, width) = columns([frame, frame + 1]);
            canvas.fill(from, top as f64, width, STRIP as f64, color);
        }
        if point.answer {
            let x = sharp(x_of(frame as f64 + 0.5));
            canvas.line(&[(x, foot + 2.0), (x, foot + 8.0)], 2.0, ANSWER);
        }
    }
    let place = |(frame, point): (usize, &Point)| Some((x_of(frame as f64 + 0.5), y_of(point.error?)));
    let places: Vec<Option<(f64, f64)>> = points.iter().enumerate().map(place).collect();
    for run in places.split(Option::is_none) {
        let run: Vec<(f64, f64)> = run.iter().copied().flatten().collect();
        canvas.line(&run, 1.5, LINE);
        for &place in &run {
            canvas.dot(place, 2.0, LINE);
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
        // The curve is the only thing that is red and neither magenta nor beige.
        let red = |[r, g, b]: [u8; 3]| r > g.saturating_add(70) && r > b.saturating_add(70);
        let row_of = |x: usize| (0..HEIGHT).find(|&y| red(plot.pixel(x, y))).unwrap();
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
        // The dots of the frames lie on the dashed line of the limit, which shows on both sides of them.
        let rows_of = |ink: &dyn Fn([u8; 3]) -> bool| -> Vec<usize> {
            let rows = (0..HEIGHT).filter(|&y| (0..WIDTH).any(|x| ink(two.pixel(x, y))));
            rows.collect()
        };
        let green = rows_of(&|[r, g, b]| g > r.saturating_add(30) && g > b.saturating_add(20));
        let dots = rows_of(&|color| color == LINE);
        assert!(!green.is_empty() && !dots.is_empty());
        assert!(
            green
                .iter()
                .all(|y| (dots[0] - 2..=dots[dots.len() - 1] + 2).contains(y))
        );
        assert!(count(&two, ANSWER) >= 30 * 6);
        assert_eq!(track_plot(&[], [0, 0]).width(), WIDTH);
    }
}
