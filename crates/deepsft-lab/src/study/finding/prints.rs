//! The prints of the study: photograph-like, graphic, text or line art, and repetitive ones, all made by code.

use super::line_art::line_art;
use super::photograph::photograph_like;
use super::repetitive::repetitive;
use anyhow::Result;
use clap::ValueEnum;
use deepsft_geometry::{Picture, Template};
use deepsft_synth::painting::artwork;
use deepsft_synth::random::{Stream, generator, mix};
use rayon::prelude::*;
use serde::Serialize;
use std::fmt;

/// Longer side of every print, mm.
const LONG_SIDE_MM: f64 = 297.0;

/// The kinds of prints, in the order of the table.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, ValueEnum)]
#[serde(rename_all = "kebab-case")]
pub enum Kind {
    /// Landscapes, cities, still lifes, leaves, pebbles.
    PhotographLike,
    /// Collages, mosaics, geometric posters, rings, triangles, flat landscapes.
    Graphic,
    /// Pages of text, scribbles, maps, engravings, plans, plants.
    LineArt,
    /// Checks, dots and rows of one motif.
    Repetitive,
    /// The template of a model.
    #[value(skip)]
    OfModel,
}

impl Kind {
    pub fn name(self) -> &'static str {
        match self {
            Self::PhotographLike => "photograph-like",
            Self::Graphic => "graphic",
            Self::LineArt => "text, line art",
            Self::Repetitive => "repetitive",
            Self::OfModel => "the model's",
        }
    }

    /// Print `number` of this kind.
    fn painted(self, number: usize, seed: u64) -> (&'static str, Picture) {
        let mut dice = generator(mix(seed ^ self as u64), number as u64, Stream::Pool);
        let of = |numbers: &[usize]| numbers[number % numbers.len()];
        match self {
            Self::PhotographLike | Self::OfModel => photograph_like(number, &mut dice),
            Self::Graphic => artwork(of(&[0, 1, 2, 4, 6, 8]), &mut dice),
            // Every third: the text and scribbles that also stand around in synthetic scenes.
            Self::LineArt if number.is_multiple_of(3) => artwork(of(&[5, 7]), &mut dice),
            Self::LineArt => line_art(number - number / 3 - 1, &mut dice),
            Self::Repetitive => repetitive(number, &mut dice),
        }
    }
}

impl fmt::Display for Kind {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(
            self.to_possible_value()
                .as_ref()
                .map_or("model", |value| value.get_name()),
        )
    }
}

pub struct Print {
    pub kind: Kind,
    /// What it shows.
    pub subject: &'static str,
    pub template: Template,
}

impl Print {
    fn new(kind: Kind, subject: &'static str, picture: Picture) -> Result<Self> {
        let (width, height) = (picture.width() as f64, picture.height() as f64);
        let scale = LONG_SIDE_MM / width.max(height);
        Ok(Self {
            kind,
            subject,
            template: Template::thin_shell(picture, width * scale, height * scale)?,
        })
    }
}

pub fn prints(counts: &[(Kind, usize)], seed: u64) -> Result<Vec<Print>> {
    let wanted: Vec<(Kind, usize)> = (counts.iter())
        .flat_map(|&(kind, count)| (0..count).map(move |number| (kind, number)))
        .collect();
    let painted = wanted.into_par_iter().map(|(kind, number)| {
        let (subject, picture) = kind.painted(number, seed);
        Print::new(kind, subject, picture)
    });
    painted.collect()
}

/// The print of a model and another one to stand in its place.
pub fn prints_of_model(template: &Template, seed: u64) -> Result<Vec<Print>> {
    let mut prints = prints(&[(Kind::Graphic, 1)], seed)?;
    let of_model = Print {
        kind: Kind::OfModel,
        subject: "a model's template",
        template: template.clone(),
    };
    prints.insert(0, of_model);
    Ok(prints)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_subject_has_contrast_and_depends_on_the_seed_alone() {
        for (kind, subjects) in [
            (Kind::PhotographLike, 5),
            (Kind::Graphic, 6),
            (Kind::LineArt, 15),
            (Kind::Repetitive, 5),
        ] {
            let paint = |count: usize, seed: u64| prints(&[(kind, count)], seed).unwrap();
            let pixels = |print: &Print| print.template.texture().rgb().to_vec();
            let painted = paint(subjects, 3);
            let first = pixels(&painted[0]);
            assert!(
                first == pixels(&paint(1, 3)[0]) && first != pixels(&paint(1, 4)[0]),
                "{kind}"
            );
            for print in &painted {
                let values = pixels(print);
                let mean = |of: &dyn Fn(f64) -> f64| {
                    values.iter().map(|&v| of(f64::from(v))).sum::<f64>() / values.len() as f64
                };
                let middle = mean(&|v| v);
                let deviation = mean(&|v| (v - middle).powi(2)).sqrt();
                assert!(deviation > 10.0, "{}: {deviation}", print.subject);
                let longer = print.template.size_mm().max_element();
                assert!((longer - LONG_SIDE_MM).abs() < 1e-9);
            }
        }
    }
}
