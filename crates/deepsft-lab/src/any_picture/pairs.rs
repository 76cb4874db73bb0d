//! Pairs: a window of a frame, and a view of its print that is turned and scaled about as the window shows it.

use super::prints::{Frame, Shown};
use deepsft_geometry::glam::{DMat2, DVec2, DVec3};
use deepsft_geometry::{ImageSize, MipLevel, Picture, Template};
use deepsft_synth::random::between;
use rand::{Rng, RngExt};
use std::f64::consts::PI;

/// Width and height of a window, and of a view, pixels.
pub const WINDOW: [usize; 2] = [288, 160];
pub const VIEW: [usize; 2] = [240, 240];

/// Pixels along a cell's side.
pub const CELL: usize = 8;

/// How far the view's turn is off, radians, and its scale, octaves: the network must bear half of what lies between the
/// views of a picture.
const TURN: f64 = 0.5;
const OCTAVES: f64 = 0.75;

/// Scales of views, mm per pixel.
const SCALES: [f64; 2] = [1.0, 3.0];

/// Fewest pixels of the print that tell how it lies.
const FEWEST: usize = 200;

/// A window and a view, and which cells show the same.
pub struct Pair {
    /// [3, height, width], 0 to 1.
    pub window: Vec<f32>,
    pub view: Vec<f32>,
    /// Of each cell of the window: where in the view it lies, in cells from the middle of the first; `None` beside the print.
    pub place: Vec<Option<DVec2>>,
    /// Of each cell of the view: whether it shows the print.
    pub is_print: Vec<bool>,
}

/// A picture on its sheet, at all sizes.
struct Sheet {
    levels: Vec<MipLevel>,
    size_mm: DVec2,
    mean: [f32; 3],
}

impl Pair {
    /// Of frame `frame` of `shown`; half of them are mirrored.
    pub fn new<R: Rng>(shown: &Shown, frame: usize, dice: &mut R) -> Self {
        let (frame, size_mm) = (&shown.frames[frame], shown.template.size_mm());
        let corner = best_corner(frame, dice);
        let mirrored = dice.random_bool(0.5);
        let place_of = |x: usize, y: usize| -> Option<DVec2> {
            let x = if mirrored { WINDOW[0] / 2 - 1 - x } else { x };
            let pixel = (corner[1] / 2 + y) * frame.columns + corner[0] / 2 + x;
            let [u, v] = frame.registration[pixel]?.map(f64::from);
            Some(DVec2::new(if mirrored { 1.0 - u } else { u }, v) * size_mm)
        };
        let to_view = ViewFrame::near(&place_of, size_mm, dice);
        let sheet = Sheet::of(&shown.template, mirrored);
        let fill = match dice.random_bool(0.6) {
            true => sheet.mean,
            false => std::array::from_fn(|_| between([0.0, 255.0], dice) as f32),
        };
        let window = |x: usize, y: usize| {
            let x = if mirrored { WINDOW[0] - 1 - x } else { x };
            frame.image.pixel(corner[0] + x, corner[1] + y).map(f32::from)
        };
        let view = |x: usize, y: usize| {
            let place = to_view.place(DVec2::new(x as f64 + 0.5, y as f64 + 0.5));
            sheet.color(place, to_view.mm_per_pixel).unwrap_or(fill)
        };
        let cells =
            |[width, height]: [usize; 2]| (0..height / CELL).flat_map(move |y| (0..width / CELL).map(move |x| [x, y]));
        Self {
            window: channels(WINDOW, window, dice),
            view: channels(VIEW, view, dice),
            place: cells(WINDOW)
                .map(|[x, y]| {
                    let place = place_of(CELL / 2 * x + CELL / 4, CELL / 2 * y + CELL / 4)?;
                    Some(to_view.pixel(place) / CELL as f64 - 0.5)
                })
                .collect(),
            is_print: cells(VIEW)
                .map(|cell| {
                    let middle = cell.map(|k| (CELL * k + CELL / 2) as f64);
                    let place = to_view.place(DVec2::from(middle));
                    place.cmpgt(DVec2::splat(-2.0)).all() && place.cmplt(size_mm + 2.0).all()
                })
                .collect(),
        }
    }
}

/// The corner of the window, at even pixels: that of three that shows most of the print.
fn best_corner<R: Rng>(frame: &Frame, dice: &mut R) -> [usize; 2] {
    let ImageSize { width, height } = frame.image.size();
    let mut best = (0, [0; 2]);
    for _ in 0..3 {
        let corner =
            [(width, WINDOW[0]), (height, WINDOW[1])].map(|(all, part)| 2 * dice.random_range(0..=(all - part) / 2));
        let rows = (corner[1] / 2..(corner[1] + WINDOW[1]) / 2).map(|y| y * frame.columns + corner[0] / 2);
        let shown = rows.map(|first| {
            let row = &frame.registration[first..first + WINDOW[0] / 2];
            row.iter().filter(|place| place.is_some()).count()
        });
        let shown = 1 + shown.sum::<usize>();
        if shown > best.0 {
            best = (shown, corner);
        }
    }
    best.1
}

/// How a view shows the print.
struct ViewFrame {
    /// From mm on the print to pixels.
    turn: DMat2,
    middle_mm: DVec2,
    mm_per_pixel: f64,
}

impl ViewFrame {
    /// About as the window shows it: `place_of` says where its pixels (every second of every second row) lie.
    fn near<R: Rng>(place_of: &impl Fn(usize, usize) -> Option<DVec2>, size_mm: DVec2, dice: &mut R) -> Self {
        let pixels = (0..WINDOW[1] / 2).flat_map(|y| (0..WINDOW[0] / 2).map(move |x| (x, y)));
        let seen: Vec<(DVec2, DVec2)> = pixels
            .filter_map(|(x, y)| Some((DVec2::new(2.0 * x as f64, 2.0 * y as f64), place_of(x, y)?)))
            .collect();
        let (mut angle, mut scale) = (between([-PI, PI], dice), between([0.7, 2.2], dice));
        let mut middle_mm = size_mm / 2.0;
        if let Some((mm_per_pixel, middle)) = affine(&seen) {
            angle =
                (mm_per_pixel.x_axis.y - mm_per_pixel.y_axis.x).atan2(mm_per_pixel.x_axis.x + mm_per_pixel.y_axis.y);
            scale = mm_per_pixel.determinant().abs().sqrt().clamp(0.3, 4.0);
            middle_mm = middle;
        }
        let mm_per_pixel = (scale * between([-OCTAVES, OCTAVES], dice).exp2()).clamp(SCALES[0], SCALES[1]);
        let turn = DMat2::from_angle(between([-TURN, TURN], dice) - angle) * (1.0 / mm_per_pixel);
        // As much of the print as fits.
        let reach = (size_mm / 2.0 - 0.42 * VIEW[0] as f64 * mm_per_pixel).max(DVec2::ZERO);
        let jitter = DVec2::new(between([-14.0, 14.0], dice), between([-14.0, 14.0], dice));
        Self {
            turn,
            middle_mm: middle_mm.clamp(size_mm / 2.0 - reach, size_mm / 2.0 + reach) + jitter,
            mm_per_pixel,
        }
    }

    fn centre() -> DVec2 {
        DVec2::new(VIEW[0] as f64, VIEW[1] as f64) / 2.0
    }

    /// Where in the view a place on the print lies, pixels.
    fn pixel(&self, place: DVec2) -> DVec2 {
        self.turn * (place - self.middle_mm) + Self::centre()
    }

    /// The place on the print, mm, that a pixel shows.
    fn place(&self, pixel: DVec2) -> DVec2 {
        self.turn.inverse() * (pixel - Self::centre()) + self.middle_mm
    }
}

/// The affine map from pixels to mm that fits best, its linear part, and the mean place; `None` where too little is seen.
fn affine(seen: &[(DVec2, DVec2)]) -> Option<(DMat2, DVec2)> {
    if seen.len() < FEWEST {
        return None;
    }
    let count = seen.len() as f64;
    let sum = seen.iter().fold(DVec2::ZERO, |sum, (pixel, _)| sum + *pixel);
    let middle = seen.iter().fold(DVec2::ZERO, |sum, (_, place)| sum + *place) / count;
    let (mut xx, mut xp) = (DMat2::ZERO, DMat2::ZERO);
    for (pixel, place) in seen {
        let (d, p) = (*pixel - sum / count, *place - middle);
        xx += DMat2::from_cols(d * d.x, d * d.y);
        xp += DMat2::from_cols(p * d.x, p * d.y);
    }
    (xx.determinant() > 1e-6).then(|| (xp * xx.inverse(), middle))
}

impl Sheet {
    fn of(template: &Template, mirrored: bool) -> Self {
        let texture = template.texture();
        let ImageSize { width, height } = texture.size();
        let picture = match mirrored {
            true => Picture::from_fn(width, height, |x, y| texture.pixel(width - 1 - x, y)),
            false => texture.clone(),
        };
        let mut levels = vec![MipLevel::finest(picture)];
        while let Some(coarser) = levels.last().filter(|_| levels.len() < 4).and_then(MipLevel::coarser) {
            levels.push(coarser);
        }
        let sum = texture.rgb().chunks_exact(3).fold(DVec3::ZERO, |sum, rgb| {
            sum + DVec3::new(f64::from(rgb[0]), f64::from(rgb[1]), f64::from(rgb[2]))
        });
        Self {
            mean: (sum / (width * height) as f64).as_vec3().to_array(),
            levels,
            size_mm: template.size_mm(),
        }
    }

    /// What is printed at `place`, for a view of `mm_per_pixel`; `None` beside the print.
    fn color(&self, place: DVec2, mm_per_pixel: f64) -> Option<[f32; 3]> {
        if place.cmplt(DVec2::ZERO).any() || place.cmpgt(self.size_mm).any() {
            return None;
        }
        let texels_per_pixel = self.levels[0].extent.x / self.size_mm.x * mm_per_pixel;
        let level = texels_per_pixel.max(1.0).log2().round() as usize;
        Some(self.levels[level.min(self.levels.len() - 1)].sample(place / self.size_mm))
    }
}

/// Planes of a picture in other light: contrast, brightness, tint, grey, as chance has it.
fn channels<R: Rng>([width, height]: [usize; 2], color: impl Fn(usize, usize) -> [f32; 3], dice: &mut R) -> Vec<f32> {
    let (mut contrast, mut brightness, mut tint) = (1.0, 0.0, [1.0; 3]);
    if dice.random_bool(0.6) {
        (contrast, brightness) = (between([0.7, 1.25], dice) as f32, between([-0.12, 0.12], dice) as f32);
    }
    if dice.random_bool(0.4) {
        tint = std::array::from_fn(|_| between([0.85, 1.15], dice) as f32);
    }
    let grey = dice.random_bool(0.15);
    let mut values = vec![0.0; 3 * width * height];
    for pixel in 0..width * height {
        let mut rgb =
            color(pixel % width, pixel / width).map(|value| (value / 255.0 - 0.5) * contrast + 0.5 + brightness);
        (0..3).for_each(|c| rgb[c] *= tint[c]);
        if grey {
            rgb = [rgb.iter().sum::<f32>() / 3.0; 3];
        }
        (0..3).for_each(|c| values[c * width * height + pixel] = rgb[c].clamp(0.0, 1.0));
    }
    values
}
