//! The grade of a print: how well it will be found, before anybody prints it.
//!
//! Bounds come from 732 synthetic frames of 183 prints (four frames each, any way up, bent, tilted, half of them partly hidden): 75
//! painted prints and photographs, and 108 that were spoilt on purpose. "Found" below is a start within 8 pixels. Of the frames of
//! prints graded good 95 % were found, of fair ones 89 %, of poor ones 53 %, of hopeless ones 10 %: chosen and measured on the same
//! prints.

use crate::descriptor::distances;
use crate::matching::ELSEWHERE_PX;
use crate::target::PictureTarget;
use deepsft_geometry::glam::Vec2;
use deepsft_geometry::{GeometryError, Template};
use std::f32::consts::{PI, TAU};

/// Descriptors that differ in no more bits are of one look: the noise of a camera changes more.
const TWINS: u16 = 12;

/// Largest angle between a corner and its twin after half a turn, beside that half turn, radians.
const TURN: f32 = 0.4;

/// Cells along the longer side of the print, and the corners without a twin that make one of them tell.
const CELLS: usize = 12;
const TELLING: usize = 3;

/// Least share of telling cells, from grade to grade. Found: 17 % of the frames below the first, 38 % below 0.08, 60 % below the
/// second, 87 % below the third, 95 % above.
const COVERED: [f64; 3] = [0.03, 0.2, 0.4];

/// Share of corners with a twin, from grade to grade. Found: 85 % of the frames from 0.5 to 0.7, half of those from 0.7 to 0.8, 25 %
/// to 0.9, 8 % above. Painted prints without a pattern reach 0.7.
const REPEATED: [f64; 2] = [0.65, 0.75];

/// The same after half a turn. Playing cards have 0.7 or more, other prints less than 0.2. Half of their frames are found, most
/// others upside down, and the fit agrees with both.
const HALF_TURN: f64 = 0.4;

/// Grey levels between the darkest and the brightest hundredth of the print, from grade to grade. Found: none of 12 frames at 15 levels, 4 at 20, 6 at 25,
/// 8 at 30, 10 at 40.
const CONTRAST: [u8; 2] = [20, 35];

/// How wide the strip at a side is that is judged for itself, as a fraction of the print, and the least share of its fair part of
/// the corners: with less it is lost when the rest is covered.
const STRIP: f32 = 0.4;
const MIN_PART: f64 = 0.12;

/// Levels of a [`PictureGrade`], the worst first.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
#[non_exhaustive]
pub enum GradeLevel {
    /// Do not expect it to be found.
    Hopeless,
    /// Found now and then, or mistaken.
    Poor,
    /// Found in most views, lost in hard ones.
    Fair,
    /// As good as prints get.
    Good,
}

impl GradeLevel {
    /// The level of a share by the least share of each level but the worst.
    pub(crate) fn of(share: f64, [poor, fair, good]: [f64; 3]) -> Self {
        match share {
            share if share < poor => Self::Hopeless,
            share if share < fair => Self::Poor,
            share if share < good => Self::Fair,
            _ => Self::Good,
        }
    }

    /// Returns its name: `hopeless`, `poor`, `fair` or `good`.
    pub fn name(self) -> &'static str {
        match self {
            Self::Hopeless => "hopeless",
            Self::Poor => "poor",
            Self::Fair => "fair",
            Self::Good => "good",
        }
    }
}

/// How well features will find a print.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct PictureGrade {
    /// The verdict.
    pub level: GradeLevel,
    /// Corners at all sizes; at most about 4000 are kept.
    pub corners: usize,
    /// Fraction of the print's area that has corners like no other.
    pub covered: f64,
    /// Fraction of the corners that have a twin elsewhere on the print.
    pub repeated: f64,
    /// Fraction of the corners that find their twin when the print is turned by half a turn. Mirror symmetry does no harm
    /// (98 % found): a mirrored corner is another corner.
    pub half_turn: f64,
    /// Grey levels between the print's darkest and brightest hundredth.
    pub contrast: u8,
    /// What is wrong, in sentences for people, the worst first. Empty when nothing is.
    pub advice: Vec<String>,
}

impl PictureGrade {
    /// Grades the print on `template`, a sheet. Takes up to 50 ms, after as much for its features.
    ///
    /// # Errors
    /// As [`FeatureFinder::new`](crate::FeatureFinder::new).
    pub fn of(template: Template) -> Result<Self, GeometryError> {
        Ok(Self::of_target(&PictureTarget::new(template)?))
    }

    pub(crate) fn of_target(target: &PictureTarget) -> Self {
        let [has_twin, has_opposite] = twins(target);
        let corners = target.places.len();
        let share = |some: &[bool]| some.iter().filter(|&&is| is).count() as f64 / corners.max(1) as f64;
        let mut grade = Self {
            level: GradeLevel::Good,
            corners,
            covered: covered(target, &has_twin),
            repeated: share(&has_twin),
            half_turn: share(&has_opposite),
            contrast: target.contrast,
            advice: Vec::new(),
        };
        grade.judge();
        if grade.level > GradeLevel::Hopeless {
            grade.judge_sides(target, &has_twin);
        }
        grade
    }

    fn judge(&mut self) {
        use GradeLevel::{Good, Hopeless, Poor};
        let [faint, dull] = CONTRAST;
        if self.contrast < dull {
            let level = if self.contrast < faint { Hopeless } else { Poor };
            let sentence = "The picture has hardly any contrast: use stronger light and dark.";
            self.lower(level, sentence);
        }
        if self.half_turn > HALF_TURN {
            let sentence = "The picture looks the same upside down: add something to one end that the other lacks.";
            self.lower(Poor, sentence);
        }
        let [some, most] = REPEATED;
        // Half a turn makes twins too; it has its own sentence.
        let repeated = self.repeated - self.half_turn;
        if repeated > some {
            let level = if repeated > most { Hopeless } else { Poor };
            let sentence =
                "The same motif is repeated over the picture: one place is taken for another. Make places differ.";
            self.lower(level, sentence);
        }
        let level = GradeLevel::of(self.covered, COVERED);
        if level < Good && self.advice.is_empty() {
            let sentence = match level {
                Hopeless => "There is next to nothing in the picture to hold on to: it needs edges and corners.",
                _ => "Large parts of the picture have nothing to hold on to: fill them with detail.",
            };
            self.advice.push(sentence.to_owned());
        }
        self.level = self.level.min(level);
    }

    fn lower(&mut self, level: GradeLevel, sentence: &str) {
        self.level = self.level.min(level);
        self.advice.push(sentence.to_owned());
    }

    /// A sentence for each side that has less than its part of the corners.
    fn judge_sides(&mut self, target: &PictureTarget, has_twin: &[bool]) {
        let size = target.template.size_mm().as_vec2();
        type Inside = fn(Vec2) -> bool;
        let sides: [(&str, &str, Inside); 4] = [
            ("on the left", "the right", |at| at.x < STRIP),
            ("on the right", "the left", |at| at.x > 1.0 - STRIP),
            ("at the top", "the bottom", |at| at.y < STRIP),
            ("at the bottom", "the top", |at| at.y > 1.0 - STRIP),
        ];
        let places = || target.places.iter().map(|place| *place / size).zip(has_twin);
        let all: Vec<Vec2> = places().map(|(at, _)| at).collect();
        let unlike: Vec<Vec2> = places().filter(|(_, has_twin)| !**has_twin).map(|(at, _)| at).collect();
        for (side, opposite, inside) in sides {
            // How many of its fair part of the corners lie there.
            let part = |corners: &[Vec2]| {
                let there = corners.iter().filter(|&&at| inside(at)).count();
                there as f64 / (f64::from(STRIP) * corners.len().max(1) as f64)
            };
            let what = if part(&all) < MIN_PART {
                "is mostly one colour"
            } else if part(&unlike) < MIN_PART {
                "mostly repeats itself"
            } else {
                continue;
            };
            let sentence = format!("The picture {what} {side}: it will be lost when {opposite} is covered.");
            self.lower(GradeLevel::Fair, &sentence);
        }
    }
}

/// Which corners of a print look like one elsewhere on it, and which like the one where half a turn of the print takes them.
fn twins(target: &PictureTarget) -> [Vec<bool>; 2] {
    let (features, places) = (&target.features, &target.places);
    let size = target.template.size_mm().as_vec2();
    let elsewhere_mm = ELSEWHERE_PX * target.mm_per_pixel;
    let (mut of_one, mut any, mut opposite) = (Vec::new(), Vec::new(), Vec::new());
    for (i, descriptor) in features.descriptors.iter().enumerate() {
        distances(descriptor, &features.descriptors, &mut of_one);
        let mut alike = of_one.iter().zip(places).filter(|(distance, _)| **distance <= TWINS);
        any.push(alike.any(|(_, place)| place.distance(places[i]) > elsewhere_mm));
        let turned = |j: usize| {
            let angle = features.all[j].angle - features.all[i].angle;
            (angle.rem_euclid(TAU) - PI).abs() < TURN && of_one[j] <= TWINS
        };
        opposite.push(target.near(size - places[i], elsewhere_mm).any(turned));
    }
    [any, opposite]
}

fn covered(target: &PictureTarget, has_twin: &[bool]) -> f64 {
    let size = target.template.size_mm().as_vec2();
    let cell = size.max_element() / CELLS as f32;
    let [columns, rows] = [size.x, size.y].map(|side| ((side / cell).ceil() as usize).max(1));
    let mut counts = vec![0; columns * rows];
    for (place, _) in target.places.iter().zip(has_twin).filter(|(_, has_twin)| !**has_twin) {
        let (x, y) = ((place.x / cell) as usize, (place.y / cell) as usize);
        counts[y.min(rows - 1) * columns + x.min(columns - 1)] += 1;
    }
    counts.iter().filter(|&&count| count >= TELLING).count() as f64 / counts.len() as f64
}
