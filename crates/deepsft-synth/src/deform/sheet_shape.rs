//! Random shapes of paper: which bends, folds, curls and waves a deformation is made of.

use crate::deform::bend::{Bend, Rulings, corners};
use crate::deform::config::{DeformationConfig, DeformationFamily};
use crate::random::{between, chance, sign};
use deepsft_geometry::glam::{DVec2, DVec3};
use rand::{Rng, RngExt};
use std::f64::consts::{PI, TAU};

/// Steps of the curvature of a bend over the whole sheet.
const WHOLE_SHEET_STEPS: usize = 24;
/// Steps of the curvature of a bend over a strip.
const STRIP_STEPS: usize = 8;
/// Strips drawn at random before a bend that should not cross the others is given up.
const PLACEMENT_TRIES: usize = 20;
/// Distance of a cone's apex from the ruling's middle, sheet diagonals: far enough to lie off the
/// sheet (half a diagonal), near enough to differ from a cylinder.
const APEX_DISTANCE: [f64; 2] = [0.75, 2.5];
/// Wavelength of waves, sheet diagonals.
const WAVELENGTH: [f64; 2] = [0.45, 2.0];

/// Steepest slope of each wave (0.1 is 3 mm on a wave of 200 mm).
const WAVE_SLOPE: [f64; 2] = [0.02, 0.1];
/// Angle through which a bend over the whole sheet turns, from edge to edge (the integral of |curvature|), radians; more
/// shows the sheet from behind.
const BEND_RAD: [f64; 2] = [0.2, 2.2];
/// Angle of a fold, radians, its width, mm, and most folds in a sheet. The mesh softens sharper folds; a width below its
/// cells no longer matters.
const FOLD_RAD: [f64; 2] = [0.2, 1.3];
const FOLD_WIDTH_MM: [f64; 2] = [3.0, 10.0];
const MAX_FOLDS: usize = 4;

/// A deformation before relaxation: waves, then bends.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Shape {
    half: DVec2,
    waves: Vec<Wave>,
    bends: Vec<Bend>,
}

/// Height amplitude cos(wave_vector . p + phase), mm.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Wave {
    amplitude_mm: f64,
    wave_vector: DVec2,
    phase: f64,
}

impl Shape {
    /// A random shape of a family, of a sheet of the given size.
    pub(crate) fn sample<R: Rng + ?Sized>(
        family: DeformationFamily,
        size_mm: DVec2,
        config: &DeformationConfig,
        rng: &mut R,
    ) -> Self {
        let mut shape = Self {
            half: size_mm / 2.0,
            waves: Vec::new(),
            bends: Vec::new(),
        };
        match family {
            DeformationFamily::Wavy => shape.add_waves(rng.random_range(1..=3), rng),
            DeformationFamily::Cylinder => shape.add_whole_sheet_bend(1.0, rng),
            DeformationFamily::Bends => shape.add_strip_bends(rng.random_range(2..=4), config, rng),
            DeformationFamily::Folds => shape.add_folds(rng),
            DeformationFamily::CornerCurls => shape.add_corner_curls(rng.random_range(1..=4), config, rng),
            DeformationFamily::Mixed => {
                shape.add_waves(rng.random_range(0..=2), rng);
                match rng.random_range(0..3) {
                    0 => shape.add_folds(rng),
                    1 => shape.add_corner_curls(rng.random_range(1..=2), config, rng),
                    _ => shape.add_strip_bends(rng.random_range(1..=2), config, rng),
                }
                // Crossing bends stretch the sheet in proportion to the product of their angles.
                shape.add_whole_sheet_bend(0.5, rng);
                if chance(0.3, rng) {
                    shape.add_whole_sheet_bend(0.25, rng);
                }
            }
            // Cloth is simulated, not composed.
            DeformationFamily::Cloth => {}
        }
        shape.order_bends();
        shape.limit_turn(config.max_turn_rad);
        shape
    }

    fn diagonal(&self) -> f64 {
        2.0 * self.half.length()
    }

    fn add_waves<R: Rng + ?Sized>(&mut self, count: usize, rng: &mut R) {
        for _ in 0..count {
            let frequency = TAU / (between(WAVELENGTH, rng) * self.diagonal());
            self.waves.push(Wave {
                amplitude_mm: between(WAVE_SLOPE, rng) / frequency,
                wave_vector: DVec2::from_angle(between([0.0, PI], rng)) * frequency,
                phase: between([0.0, TAU], rng),
            });
        }
    }

    /// A generalised cylinder or cone whose curvature over all rulings of the sheet is a constant plus
    /// three cosines.
    fn add_whole_sheet_bend<R: Rng + ?Sized>(&mut self, strength: f64, rng: &mut R) {
        let rulings = self.sample_rulings(DVec2::from_angle(between([0.0, TAU], rng)), 0.0, rng);
        let [low, high] = self.extent(&rulings);
        let mut angles = [0.0; WHOLE_SHEET_STEPS];
        let mean = between([-1.0, 1.0], rng);
        let waves =
            [0.5, 1.0, 1.5].map(|turns| (turns * TAU, between([-0.8, 0.8], rng) / turns, between([0.0, TAU], rng)));
        for (i, angle) in angles.iter_mut().enumerate() {
            let at = (i as f64 + 0.5) / WHOLE_SHEET_STEPS as f64;
            let cosine = |(turns, height, phase): &(f64, f64, f64)| height * (turns * at + phase).cos();
            *angle = mean + waves.iter().map(cosine).sum::<f64>();
        }
        let total: f64 = angles.iter().map(|angle| angle.abs()).sum();
        let factor = strength * between(BEND_RAD, rng) / total.max(f64::MIN_POSITIVE);
        let angles = angles.map(|angle| angle * factor);
        self.bends.push(Bend::new(rulings, low, high - low, &angles));
    }

    /// Smooth bends over strips that do not cross any bend so far.
    fn add_strip_bends<R: Rng + ?Sized>(&mut self, count: usize, config: &DeformationConfig, rng: &mut R) {
        for _ in 0..count {
            self.place(rng, |shape, rng| {
                let across = DVec2::from_angle(between([0.0, TAU], rng));
                let reach = shape.reach(across);
                let start = between([0.0, 0.75], rng) * reach;
                let width = between([0.15, 0.8], rng) * reach;
                let rulings = shape.sample_rulings(across, start, rng);
                shape.strip_bend(rulings, width, sign(rng) * between(config.strip_bend_rad, rng))
            });
        }
    }

    /// Narrow folds, half the time all in nearly the same direction as in a folded letter.
    fn add_folds<R: Rng + ?Sized>(&mut self, rng: &mut R) {
        let along_letter = chance(0.5, rng).then(|| between([0.0, PI], rng));
        for _ in 0..rng.random_range(1..=MAX_FOLDS) {
            self.place(rng, |shape, rng| {
                let direction = match along_letter {
                    Some(direction) if chance(0.5, rng) => direction + between([-0.1, 0.1], rng),
                    Some(direction) => direction + PI + between([-0.1, 0.1], rng),
                    None => between([0.0, TAU], rng),
                };
                let across = DVec2::from_angle(direction);
                let origin = across * between([0.0, 0.85], rng) * shape.reach(across);
                let angle = sign(rng) * between(FOLD_RAD, rng);
                let width = between(FOLD_WIDTH_MM, rng);
                Bend::new(Rulings::Parallel { origin, across }, 0.0, width, &[angle])
            });
        }
    }

    /// Bends whose strip begins on a line that cuts off a corner.
    fn add_corner_curls<R: Rng + ?Sized>(&mut self, count: usize, config: &DeformationConfig, rng: &mut R) {
        for _ in 0..count {
            self.place(rng, |shape, rng| {
                let corner = shape.half * DVec2::new(sign(rng), sign(rng));
                let bisector = DVec2::new(corner.x.signum(), corner.y.signum()).to_angle();
                let across = DVec2::from_angle(bisector + between([-0.5, 0.5], rng));
                let depth = between([0.25, 0.9], rng) * shape.half.min_element();
                let start = across.dot(corner) - depth;
                let rulings = shape.sample_rulings(across, start, rng);
                let width = between([0.3, 1.0], rng) * depth;
                shape.strip_bend(rulings, width, sign(rng) * between(config.strip_bend_rad, rng))
            });
        }
    }

    /// Adds a bend if one of the first draws does not cross the others.
    fn place<R: Rng + ?Sized>(&mut self, rng: &mut R, mut draw: impl FnMut(&Self, &mut R) -> Bend) {
        for _ in 0..PLACEMENT_TRIES {
            let bend = draw(self, rng);
            if self.bends.iter().all(|other| other.apart(&bend, self.half)) {
                self.bends.push(bend);
                return;
            }
        }
    }

    /// Distance in mm of the farthest corner from the centre along a unit vector.
    fn reach(&self, across: DVec2) -> f64 {
        across.abs().dot(self.half)
    }

    /// Rulings with coordinate 0 at distance `start_mm` from the sheet's centre along `across`, the
    /// coordinate growing away from the centre: parallel or, as often, through an apex off the sheet.
    fn sample_rulings<R: Rng + ?Sized>(&self, across: DVec2, start_mm: f64, rng: &mut R) -> Rulings {
        let origin = across * start_mm;
        if chance(0.5, rng) {
            return Rulings::Parallel { origin, across };
        }
        let ray = across.perp() * sign(rng);
        let apex = origin - ray * between(APEX_DISTANCE, rng) * self.diagonal();
        Rulings::Conical {
            apex,
            ray,
            turn: ray.perp().dot(across).signum(),
        }
    }

    /// A bend of `angle` radians over the first `width_mm` of the rulings, its curvature rising and
    /// falling smoothly as sin^2.
    fn strip_bend(&self, rulings: Rulings, width_mm: f64, angle: f64) -> Bend {
        let width = match rulings {
            Rulings::Parallel { .. } => width_mm,
            Rulings::Conical { apex, ray, .. } => width_mm / -ray.dot(apex),
        };
        // The mean of sin^2 over equal steps is 1/2.
        let angles: [f64; STRIP_STEPS] = std::array::from_fn(|i| {
            let rise = (PI * (i as f64 + 0.5) / STRIP_STEPS as f64).sin();
            2.0 * angle * rise * rise / STRIP_STEPS as f64
        });
        Bend::new(rulings, 0.0, width, &angles)
    }

    /// Least and greatest ruling coordinate of the sheet.
    fn extent(&self, rulings: &Rulings) -> [f64; 2] {
        let coordinates = corners(self.half).map(|corner| rulings.coordinate(corner));
        [
            coordinates.iter().copied().fold(f64::INFINITY, f64::min),
            coordinates.iter().copied().fold(f64::NEG_INFINITY, f64::max),
        ]
    }

    /// Outermost bends first, so that each finds the part it rolls still flat: of two nested bends
    /// the outer one moves less of the sheet.
    fn order_bends(&mut self) {
        const SIDE: i32 = 24;
        let half = self.half;
        let fraction = move |i: i32| 2.0 * f64::from(i) / f64::from(SIDE) - 1.0;
        self.bends.sort_by_cached_key(|bend| {
            (0..=SIDE)
                .flat_map(|j| (0..=SIDE).map(move |i| DVec2::new(fraction(i), fraction(j)) * half))
                .filter(|point| bend.moves(*point))
                .count()
        });
    }

    /// Weakens all bends alike until no corner is turned by more than `most` against the centre.
    fn limit_turn(&mut self, most: f64) {
        let turn = |corner: DVec2| self.bends.iter().map(|bend| bend.turned(corner)).sum::<f64>();
        let turned = corners(self.half).map(turn).into_iter().fold(0.0, f64::max);
        if turned > most {
            self.bends.iter_mut().for_each(|bend| bend.scale(most / turned));
        }
    }

    pub(crate) fn scale(&mut self, factor: f64) {
        self.bends.iter_mut().for_each(|bend| bend.scale(factor));
        self.waves.iter_mut().for_each(|wave| wave.amplitude_mm *= factor);
    }

    /// Bends the vertices, which are to lie at `rest` before.
    pub(crate) fn apply(&self, rest: &[DVec3], vertices: &mut [DVec3]) {
        for (vertex, point) in vertices.iter_mut().zip(rest) {
            vertex.z += self.waves.iter().map(|wave| wave.height(point.truncate())).sum::<f64>();
        }
        for bend in &self.bends {
            bend.apply(rest, vertices);
        }
    }
}

impl Wave {
    fn height(&self, point: DVec2) -> f64 {
        self.amplitude_mm * (self.wave_vector.dot(point) + self.phase).cos()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::SeedableRng;
    use rand_pcg::Pcg64Mcg;

    fn sample(config: &DeformationConfig, seed: u64) -> Shape {
        let mut rng = Pcg64Mcg::seed_from_u64(seed);
        let family = config.draw_family(&mut rng);
        Shape::sample(family, DVec2::new(297.0, 210.0), config, &mut rng)
    }

    #[test]
    fn corners_turn_by_no_more_than_the_limit() {
        let config = DeformationConfig {
            max_turn_rad: 0.4,
            ..DeformationConfig::default()
        };
        let mut limited = 0;
        for seed in 0..200 {
            let shape = sample(&config, seed);
            let turn = |corner: DVec2| shape.bends.iter().map(|bend| bend.turned(corner)).sum::<f64>();
            let turned = corners(shape.half).map(turn).into_iter().fold(0.0, f64::max);
            assert!(turned < 0.4 + 1e-12, "seed {seed}: {turned} rad");
            limited += usize::from(turned > 0.4 - 1e-12);
        }
        assert!(limited > 50, "{limited}");
    }
}
