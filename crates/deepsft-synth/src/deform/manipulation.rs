//! How a simulated sheet is manipulated: where anchors hold it, how they move, which forces and wind act on it.
//!
//! The paper (section 5.1) anchors its thin shells at randomly located points and applies tensile and compressive
//! forces in random directions; numbers are in its supplementary material, which we do not have. Ours are our choice.

use crate::deform::cloth::{Cloth, FREE_FALL};
use crate::random::unit_direction;
use crate::random::{between, chance, sign};
use deepsft_geometry::glam::{DQuat, DVec2, DVec3};
use rand::{Rng, RngExt};

/// Radius of what a hand holds, fractions of the sheet's diagonal: 11 to 29 mm of an A4 sheet.
const GRIP_RADIUS: [f64; 2] = [0.03, 0.08];
/// Fraction of a side that is held when a whole edge is.
const HELD_EDGE: [f64; 2] = [0.3, 1.0];
/// Least distance between two anchors, fractions of the diagonal.
const MIN_BETWEEN: f64 = 0.25;
/// Draws of an anchor before a sheet has one less.
const ANCHOR_TRIES: usize = 20;
/// Nearest that two anchors are brought, fraction of their distance on the sheet.
const NEAREST: f64 = 0.35;
/// Rounds of bringing anchors within reach of each other before their motion is halved.
const REACH_ROUNDS: usize = 40;
/// Rounds of halving before the anchors stay where they are.
const HALVINGS: usize = 6;
/// Radius (one standard deviation) of the part that a point force pulls at, fraction of the diagonal.
const FORCE_RADIUS: f64 = 0.12;
/// Length of a simulation, in units of the time (d / g)^(1/2) of a sheet of diagonal d: 0.6 to 1 s for A4, in which
/// the hands arrive and what swings comes nearly to rest.
const DURATION: [f64; 2] = [3.0, 5.0];
/// Fraction of the time in which hands move and forces rise.
const ARRIVAL: f64 = 0.6;
/// Fraction of the velocity that is left after one unit of time.
const VELOCITY_KEPT: f64 = 0.12;
/// Sweeps that take the strain out of a sheet that was let go, and their time, steps of the simulation: short enough
/// that bends stay.
const SETTLING_SWEEPS: usize = 120;
const SETTLING_STEP: f64 = 0.5;
/// Steps between two looks at how the sheet lies in the wind.
const WIND_EVERY: usize = 8;

/// Bending length (Peirce 1930), fraction of the diagonal, uniform in its logarithm: how far a strip reaches out before it
/// bends under its own weight. 44 to 180 mm of A4: writing paper to thin card.
const BENDING_LENGTH: [f64; 2] = [0.12, 0.5];
/// Most parts that are held at once: corners, points of the border, points inside, edges.
const MAX_ANCHORS: usize = 4;
/// Farthest way that is drawn for an anchor, fraction of the diagonal. Where anchors end no two points that are held are
/// farther apart than on the flat sheet. On the way there, and where a sheet is handled more gently than drawn, they can
/// be, because points that turn go along arcs: each by a tenth of its distance from the centre of its part at most.
const ANCHOR_SHIFT: f64 = 0.4;
/// Largest turn of an anchor, radians.
const ANCHOR_TURN_RAD: f64 = 0.9;
/// Weight of the sheet in any direction, in units of its weight on earth.
const GRAVITY: [f64; 2] = [0.0, 1.0];
/// Most point forces, and the size of each, in units of the sheet's weight.
const MAX_FORCES: usize = 3;
const FORCE: [f64; 2] = [0.1, 1.2];
/// Probability of wind, and its force on a sheet that faces it, in units of the sheet's weight.
const WIND_PROBABILITY: f64 = 0.3;
const WIND: [f64; 2] = [0.3, 1.5];
/// Steps of the simulation; fewer let the sheet stretch more before its strain is taken out.
const STEPS: usize = 240;

/// A part of the sheet that is held, and its motion: a turn about its centre and a way.
#[derive(Clone, Debug)]
struct Anchor {
    centre: DVec2,
    particles: Vec<usize>,
    way: DVec3,
    turn: DQuat,
}

impl Anchor {
    fn weaken(&mut self, factor: f64) {
        self.way *= factor;
        self.turn = DQuat::IDENTITY.slerp(self.turn, factor);
    }

    /// Where a point of the held part is at `fraction` of the motion.
    fn position(&self, rest: DVec2, fraction: f64) -> DVec3 {
        let turn = DQuat::IDENTITY.slerp(self.turn, fraction);
        self.centre.extend(0.0) + self.way * fraction + turn * (rest - self.centre).extend(0.0)
    }
}

#[derive(Clone, Debug)]
pub(crate) struct Manipulation {
    cloth: Cloth,
    anchors: Vec<Anchor>,
    /// Steady accelerations of the particles, mm/s^2: gravity and point forces.
    pull: Vec<DVec3>,
    /// Acceleration of a sheet that faces the wind, along it, mm/s^2.
    wind: DVec3,
    duration_s: f64,
}

impl Manipulation {
    pub(crate) fn sample<R: Rng + ?Sized>(size_mm: DVec2, rng: &mut R) -> Self {
        let diagonal = size_mm.length();
        let stiffness = between(BENDING_LENGTH.map(f64::ln), rng).exp();
        let mut cloth = Cloth::new(size_mm, stiffness * diagonal);
        let anchors = sample_anchors(&cloth, size_mm, rng);
        for &particle in anchors.iter().flat_map(|anchor| &anchor.particles) {
            cloth.hold(particle);
        }
        let gravity = unit_direction(rng) * between(GRAVITY, rng) * FREE_FALL;
        let mut pull = vec![gravity; cloth.rest().len()];
        for _ in 0..rng.random_range(0..=MAX_FORCES) {
            let at = (DVec2::new(between([0.0, 1.0], rng), between([0.0, 1.0], rng)) - 0.5) * size_mm;
            let force = unit_direction(rng) * between(FORCE, rng) * FREE_FALL * size_mm.element_product();
            let weight = |p: &DVec2| (-0.5 * p.distance_squared(at) / (FORCE_RADIUS * diagonal).powi(2)).exp();
            let weights: Vec<f64> = cloth.rest().iter().map(weight).collect();
            let pulls = weights.iter().zip(cloth.areas()).map(|(weight, area)| weight * area);
            let pulled: f64 = pulls.sum();
            for (pull, weight) in pull.iter_mut().zip(weights) {
                *pull += force * (weight / pulled);
            }
        }
        let blows = chance(WIND_PROBABILITY, rng);
        let wind = unit_direction(rng) * between(WIND, rng) * FREE_FALL;
        Self {
            cloth,
            anchors,
            pull,
            wind: if blows { wind } else { DVec3::ZERO },
            duration_s: between(DURATION, rng) * (diagonal / FREE_FALL).sqrt(),
        }
    }

    /// Shortens all ways and turns and weakens all forces by `factor`.
    pub(crate) fn weaken(&mut self, factor: f64) {
        self.anchors.iter_mut().for_each(|anchor| anchor.weaken(factor));
        self.pull.iter_mut().for_each(|pull| *pull *= factor);
        self.wind *= factor;
    }

    /// The sheet after the manipulation: it begins flat, is let go at the end, and is free of strain.
    pub(crate) fn simulate(&self) -> Cloth {
        let mut cloth = self.manipulated();
        cloth.settle(SETTLING_SWEEPS, SETTLING_STEP * self.step_s());
        cloth
    }

    fn step_s(&self) -> f64 {
        self.duration_s / STEPS as f64
    }

    /// The sheet as it is held at the end.
    fn manipulated(&self) -> Cloth {
        let mut cloth = self.cloth.clone();
        let unit_s = (cloth.diagonal() / FREE_FALL).sqrt();
        let kept = VELOCITY_KEPT.powf(self.step_s() / unit_s);
        let mut accelerations = self.pull.clone();
        for step in 0..STEPS {
            let time = (step + 1) as f64 / STEPS as f64;
            let t = (time / ARRIVAL).min(1.0);
            let fraction = t * t * (3.0 - 2.0 * t);
            for anchor in &self.anchors {
                for &particle in &anchor.particles {
                    let place = anchor.position(cloth.rest()[particle], fraction);
                    cloth.place(particle, place);
                }
            }
            if step % WIND_EVERY == 0 {
                self.accelerate(&cloth, fraction, &mut accelerations);
            }
            cloth.step(self.step_s(), &accelerations, kept);
        }
        cloth
    }

    /// The accelerations at `fraction` of full strength.
    fn accelerate(&self, cloth: &Cloth, fraction: f64, accelerations: &mut [DVec3]) {
        for (acceleration, pull) in accelerations.iter_mut().zip(&self.pull) {
            *acceleration = *pull * fraction;
        }
        if self.wind != DVec3::ZERO {
            // Pressure acts along the normal, whichever side faces the wind.
            for (acceleration, normal) in accelerations.iter_mut().zip(cloth.normals()) {
                *acceleration += normal * normal.dot(self.wind) * fraction;
            }
        }
    }
}

/// Anchors apart from each other, with motions that the sheet can follow.
fn sample_anchors<R: Rng + ?Sized>(cloth: &Cloth, size_mm: DVec2, rng: &mut R) -> Vec<Anchor> {
    let diagonal = size_mm.length();
    let mut anchors: Vec<Anchor> = Vec::new();
    for _ in 0..rng.random_range(1..=MAX_ANCHORS) {
        for _ in 0..ANCHOR_TRIES {
            let (centre, particles) = sample_held_part(cloth, size_mm, rng);
            let way = unit_direction(rng) * between([0.0, ANCHOR_SHIFT], rng) * diagonal;
            let turn = DQuat::from_axis_angle(unit_direction(rng), between([0.0, ANCHOR_TURN_RAD], rng));
            let apart = |a: usize, b: usize| cloth.rest()[a].distance(cloth.rest()[b]) > MIN_BETWEEN * diagonal;
            let mut held = anchors.iter().flat_map(|other| &other.particles);
            if held.all(|&a| particles.iter().all(|&b| apart(a, b))) {
                anchors.push(Anchor {
                    centre,
                    particles,
                    way,
                    turn,
                });
                break;
            }
        }
    }
    for _ in 0..HALVINGS {
        if bring_within_reach(&mut anchors, cloth.rest()) {
            return anchors;
        }
        anchors.iter_mut().for_each(|anchor| anchor.weaken(0.5));
    }
    for anchor in &mut anchors {
        (anchor.way, anchor.turn) = (DVec3::ZERO, DQuat::IDENTITY);
    }
    anchors
}

/// Centre and particles of a part that is held: a corner, a place of the border, an edge, or any place.
fn sample_held_part<R: Rng + ?Sized>(cloth: &Cloth, size_mm: DVec2, rng: &mut R) -> (DVec2, Vec<usize>) {
    let half = size_mm / 2.0;
    let radius = between(GRIP_RADIUS, rng) * size_mm.length();
    let kind = between([0.0, 1.0], rng);
    let along = between([-1.0, 1.0], rng);
    let on_side = |along: f64, rng: &mut R| {
        let side = sign(rng);
        if chance(0.5, rng) {
            DVec2::new(along, side)
        } else {
            DVec2::new(side, along)
        }
    };
    let centre = match kind {
        k if k < 0.35 => DVec2::new(sign(rng), sign(rng)),
        k if k < 0.7 => on_side(along, rng),
        k if k < 0.82 => on_side(0.0, rng),
        _ => DVec2::new(along, between([-1.0, 1.0], rng)),
    } * half;
    let reach = if (0.7..0.82).contains(&kind) {
        // As far along the side as it is held, and a finger's width into the sheet.
        let held = between(HELD_EDGE, rng) * half + 1e-9;
        if centre.x == 0.0 {
            DVec2::new(held.x, 1e-9)
        } else {
            DVec2::new(1e-9, held.y)
        }
    } else {
        DVec2::splat(radius)
    };
    let distance = |k: &usize| ((cloth.rest()[*k] - centre) / reach).length();
    let all = 0..cloth.rest().len();
    let mut particles: Vec<usize> = all.clone().filter(|k| distance(k) <= 1.0).collect();
    if particles.is_empty() {
        particles.extend(all.min_by(|a, b| distance(a).total_cmp(&distance(b))));
    }
    (centre, particles)
}

/// Shifts the anchors' ends, as they are drawn, until no two held particles are farther apart than on the flat sheet,
/// and the anchors not much nearer; whether that came about. A map that shortens all distances of some points extends
/// to one that shortens all distances of the whole sheet (Kirszbraun), so nothing is torn: what is too long can bend
/// away.
fn bring_within_reach(anchors: &mut [Anchor], rest: &[DVec2]) -> bool {
    for _ in 0..REACH_ROUNDS {
        let mut within = true;
        for a in 0..anchors.len() {
            for b in a + 1..anchors.len() {
                let shift = correction(&anchors[a], &anchors[b], rest);
                if shift != DVec3::ZERO {
                    within = false;
                    anchors[a].way += shift / 2.0;
                    anchors[b].way -= shift / 2.0;
                }
            }
        }
        if within {
            return true;
        }
    }
    false
}

/// How `b` has to come nearer to `a` (away if negative): the worst of their pairs of particles, with a little more.
fn correction(a: &Anchor, b: &Anchor, rest: &[DVec2]) -> DVec3 {
    let (mut worst, mut shift) = (0.0, DVec3::ZERO);
    for &i in &a.particles {
        for &j in &b.particles {
            let away = b.position(rest[j], 1.0) - a.position(rest[i], 1.0);
            let (length, allowed) = (away.length(), rest[i].distance(rest[j]));
            let excess = if length > allowed {
                length - 0.995 * allowed
            } else {
                (length - 1.01 * NEAREST * allowed).min(0.0) * f64::from(u8::from(length < NEAREST * allowed))
            };
            if excess.abs() > worst {
                worst = excess.abs();
                shift = away.normalize_or(DVec3::Z) * excess;
            }
        }
    }
    shift
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::SeedableRng;
    use rand_pcg::Pcg64Mcg;

    const A4: DVec2 = DVec2::new(297.0, 210.0);

    #[test]
    fn anchors_end_no_farther_apart_than_the_sheet_is_long_and_are_little_farther_on_the_way() {
        let (mut several, mut moved) = (0, 0);
        for seed in 0..300 {
            let manipulation = Manipulation::sample(A4, &mut Pcg64Mcg::seed_from_u64(seed));
            let anchors = &manipulation.anchors;
            let rest = manipulation.cloth.rest();
            assert!((1..=4).contains(&anchors.len()), "seed {seed}");
            several += usize::from(anchors.len() > 1);
            moved += usize::from(anchors.iter().any(|anchor| anchor.way.length() > 30.0));
            for (k, a) in anchors.iter().enumerate() {
                for b in &anchors[..k] {
                    for (&i, &j) in a.particles.iter().flat_map(|i| b.particles.iter().map(move |j| (i, j))) {
                        let long = rest[i].distance(rest[j]);
                        let at = |fraction| a.position(rest[i], fraction).distance(b.position(rest[j], fraction));
                        assert!(at(1.0) <= long + 1e-9, "seed {seed}");
                        // Along straight ways distances would be convex in the fraction, never above those of both ends. An
                        // arc of 0.9 rad is 1 - cos 0.45 of its radius above its chord, less at a smaller turn.
                        let radii = rest[i].distance(a.centre) + rest[j].distance(b.centre);
                        let arcs = (1.0 - 0.45_f64.cos()) * radii;
                        for fraction in [0.25, 0.5, 0.7] {
                            assert!(at(fraction) <= long + arcs + 1e-9, "seed {seed}");
                        }
                    }
                }
            }
        }
        assert!(
            several > 150 && moved > 200,
            "{several} with several anchors, {moved} moved"
        );
    }

    #[test]
    fn held_particles_end_where_the_hands_are() {
        let manipulation = Manipulation::sample(A4, &mut Pcg64Mcg::seed_from_u64(4));
        let cloth = manipulation.manipulated();
        let cells = cloth.rest().len();
        for anchor in &manipulation.anchors {
            for &particle in &anchor.particles {
                let rest = cloth.rest()[particle];
                let seen = cloth.surface(rest / A4 + 0.5);
                assert!(
                    seen.distance(anchor.position(rest, 1.0)) < 1e-6,
                    "particle {particle} of {cells}"
                );
            }
        }
    }

    #[test]
    fn without_motion_and_forces_the_sheet_stays_flat() {
        let mut manipulation = Manipulation::sample(A4, &mut Pcg64Mcg::seed_from_u64(2));
        manipulation.weaken(0.0);
        let cloth = manipulation.simulate();
        for uv in [DVec2::ZERO, DVec2::splat(0.5), DVec2::ONE] {
            assert!(cloth.surface(uv).distance(((uv - 0.5) * A4).extend(0.0)) < 1e-6);
        }
    }
}
