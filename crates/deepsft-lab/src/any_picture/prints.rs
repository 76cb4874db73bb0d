//! Prints to learn from, and the frames that show them.

use crate::reading;
use anyhow::{Context, Result};
use deepsft_geometry::{ImageSize, Picture, Template};
use deepsft_synth::painting::artwork;
use deepsft_synth::random::{Stream, between, generator};
use deepsft_synth::{SynthConfig, Synthesizer};
use rand::{Rng, RngExt};
use std::path::PathBuf;
use std::sync::mpsc::{Receiver, sync_channel};
use std::thread;

/// Longer side of a print: pixels and mm.
const LONG_SIDE: usize = 560;
const LONG_SIDE_MM: f64 = 297.0;

/// Frames of each print.
pub const FRAMES: usize = 8;

/// Prints that are rendered ahead.
const AHEAD: usize = 4;

/// Photographs behind the sheets of one print.
const BACKGROUNDS: usize = 3;

/// A print and frames of it.
pub struct Shown {
    pub template: Template,
    pub frames: Vec<Frame>,
}

/// A frame with the registration of every second pixel of every second row, as texture positions.
pub struct Frame {
    pub image: Picture,
    pub columns: usize,
    pub registration: Vec<Option<[f32; 2]>>,
}

/// Prints painted and rendered by a thread of its own, in an order that the seed alone decides.
pub struct PrintSource {
    prints: Receiver<Result<Shown>>,
}

impl PrintSource {
    /// From print number `first` on.
    pub fn start(seed: u64, first: u64, photographs: Vec<PathBuf>) -> Self {
        let (sender, prints) = sync_channel(AHEAD);
        thread::spawn(move || {
            for number in first.. {
                // The training has ended, or this error ends it.
                if sender.send(Shown::new(seed, number, FRAMES, &photographs)).is_err() {
                    break;
                }
            }
        });
        Self { prints }
    }

    /// The next print.
    pub fn next(&self) -> Result<Shown> {
        self.prints.recv().context("the thread that renders prints has ended")?
    }
}

impl Shown {
    /// Print `number` in so many frames.
    pub fn new(seed: u64, number: u64, frames: usize, photographs: &[PathBuf]) -> Result<Self> {
        let mut dice = generator(seed, number, Stream::Pool);
        let picture = picture(number, photographs, &mut dice)?;
        let (width, height) = (picture.width() as f64, picture.height() as f64);
        let scale = LONG_SIDE_MM / width.max(height);
        let template = Template::thin_shell(picture, width * scale, height * scale)?;
        let config = SynthConfig {
            empty_probability: 0.08,
            photograph_probability: if photographs.is_empty() { 0.0 } else { 0.4 },
            ..SynthConfig::default()
        };
        let mut synthesizer = Synthesizer::new(&template, config)?;
        if !photographs.is_empty() {
            let backgrounds = (0..BACKGROUNDS).map(|_| photographs[dice.random_range(0..photographs.len())].clone());
            synthesizer = synthesizer.with_photographs(backgrounds.collect())?;
        }
        let frame = |index: usize| {
            let sample = synthesizer.sample(seed.wrapping_mul(7919).wrapping_add(number), index as u64);
            let ImageSize { width, height } = sample.image.size();
            let registration = (0..height / 2).flat_map(|y| (0..width / 2).map(move |x| 2 * y * width + 2 * x));
            Frame {
                columns: width / 2,
                registration: registration
                    .map(|pixel| sample.truth.inside(pixel).then(|| sample.truth.registration()[pixel]))
                    .collect(),
                image: sample.image,
            }
        };
        let frames = (0..frames).map(frame).collect();
        synthesizer.check_photographs()?;
        Ok(Self { template, frames })
    }
}

/// What is printed: a photograph, something painted, the painted in rows, or a photograph with something painted below.
fn picture<R: Rng>(number: u64, photographs: &[PathBuf], dice: &mut R) -> Result<Picture> {
    let painted = artwork(number as usize, dice).1;
    let chosen: f64 = dice.random();
    if chosen < 0.05 {
        return Ok(in_rows(&painted, dice));
    }
    if chosen < 0.45 || photographs.is_empty() {
        return Ok(painted);
    }
    let photograph = reading::picture(&photographs[dice.random_range(0..photographs.len())])?;
    let cut = part_of(&photograph, dice);
    if chosen < 0.87 {
        return Ok(cut);
    }
    let ImageSize { width, height } = painted.size();
    let below = (height as f64 * between([0.25, 0.75], dice)) as usize;
    Ok(Picture::from_fn(width, height, |x, y| {
        if y < below {
            cut.pixel(x * cut.width() / width, y * cut.height() / height)
        } else {
            painted.pixel(x, y)
        }
    }))
}

/// The picture small, in rows, within a border.
fn in_rows<R: Rng>(picture: &Picture, dice: &mut R) -> Picture {
    let ImageSize { width, height } = picture.size();
    let (times, border) = (dice.random_range(2..6), dice.random_range(0..30));
    Picture::from_fn(width, height, |x, y| {
        let is_border = x < border || y < border || x + border >= width || y + border >= height;
        match is_border {
            true => [230, 220, 200],
            false => picture.pixel((x * times) % width, (y * times) % height),
        }
    })
}

/// A part of a photograph in other colours, mirrored or with a white border, as chance has it.
fn part_of<R: Rng>(photograph: &Picture, dice: &mut R) -> Picture {
    let short = (LONG_SIDE as f64 * between([0.6, 1.0], dice)) as usize;
    let (width, height) = match dice.random_bool(0.45) {
        true => (short, LONG_SIDE),
        false => (LONG_SIDE, short),
    };
    let fit = (photograph.width() as f64 / width as f64).min(photograph.height() as f64 / height as f64);
    let scale = fit * between([0.4, 1.0], dice);
    let room = |all: usize, part: usize| all as f64 - scale * part as f64;
    let left = room(photograph.width(), width) * dice.random::<f64>();
    let top = room(photograph.height(), height) * dice.random::<f64>();
    let [mirrored, upside_down, negative, grey] = [0.5, 0.3, 0.2, 0.2].map(|share| dice.random_bool(share));
    let orders = [[0, 1, 2], [0, 1, 2], [0, 1, 2], [1, 2, 0], [2, 1, 0], [1, 0, 2]];
    let order = orders[dice.random_range(0..orders.len())];
    let border = if dice.random_bool(0.3) {
        dice.random_range(10..40)
    } else {
        0
    };
    let per_side = (scale.ceil() as usize).clamp(1, 4);
    Picture::from_fn(width, height, |x, y| {
        if x < border || y < border || x + border >= width || y + border >= height {
            return [240; 3];
        }
        let x = if mirrored { width - 1 - x } else { x };
        let y = if upside_down { height - 1 - y } else { y };
        let mut sum = [0.0_f32; 3];
        for k in 0..per_side * per_side {
            let within = |k: usize| (k as f64 + 0.5) / per_side as f64;
            let at = |whole: usize, k: usize| scale * (whole as f64 + within(k));
            let color = photograph.sample(left + at(x, k % per_side), top + at(y, k / per_side));
            (0..3).for_each(|c| sum[c] += color[order[c]]);
        }
        let mut color = sum.map(|value| value / (per_side * per_side) as f32);
        if grey {
            color = [color.iter().sum::<f32>() / 3.0; 3];
        }
        color.map(|value| if negative { 255.0 - value } else { value } as u8)
    })
}
