//! Hands that hold a sheet or point at it, made of rounded parts.

use crate::random::uniform;
use crate::render::Figure;
use crate::scene::occluder::body::{Part, Surface};
use deepsft_geometry::glam::{Vec2, Vec3};
use rand::{Rng, RngExt};

/// Reflectance of skin from light to dark, linear light.
const SKIN: [Vec3; 7] = [
    Vec3::new(0.78, 0.53, 0.42),
    Vec3::new(0.68, 0.42, 0.31),
    Vec3::new(0.56, 0.32, 0.22),
    Vec3::new(0.42, 0.22, 0.135),
    Vec3::new(0.27, 0.13, 0.075),
    Vec3::new(0.15, 0.07, 0.04),
    Vec3::new(0.07, 0.034, 0.022),
];

/// Reflectance of a nail.
const NAIL: Vec3 = Vec3::new(0.85, 0.6, 0.55);

/// Lengths of the fingers from the knuckles, mm, index first, and of one that is bent.
const FINGERS: [f32; 4] = [62.0, 74.0, 70.0, 54.0];
const BENT_FINGER: f32 = 18.0;

/// The colour of a person's skin.
pub(crate) fn skin_color<R: Rng + ?Sized>(rng: &mut R) -> Vec3 {
    let place = rng.random_range(0.0..(SKIN.len() - 1) as f32);
    let tone = SKIN[place as usize].lerp(SKIN[place as usize + 1], place.fract());
    tone * Vec3::from([[0.9, 1.1], [0.92, 1.08], [0.85, 1.15]].map(|range| uniform(rng, range)))
}

/// The parts of a hand at the edge of a sheet, behind the sheet and before it: the edge is at x = 0, the sheet beyond it
/// towards x, in mm.
type Hand = (Vec<Part>, Vec<Part>);

/// A person's measures for one hand.
struct Build {
    skin: Vec3,
    /// The colour of the sleeve, none on a bare arm.
    sleeve: Option<Vec3>,
    /// Size against the middle adult hand.
    size: f32,
    /// 1 or -1: right or left.
    side: f32,
    nails: bool,
}

impl Build {
    /// A point of the middle hand.
    fn at(&self, x: f32, y: f32) -> Vec2 {
        Vec2::new(x, y * self.side) * self.size
    }

    fn palm(&self, centre: Vec2, radii: Vec2) -> Part {
        let figure = Figure::Ellipse(centre, Vec2::X, radii * self.size);
        Part::new(figure, Surface::Skin(self.skin))
    }

    /// The wrist and the arm behind it, bare or in a sleeve.
    fn arm(&self, wrist: Vec2) -> [Part; 2] {
        let elbow = wrist - self.at(260.0, 40.0);
        let (start, radii, surface) = match self.sleeve {
            None => (wrist, [26.0, 38.0], Surface::Skin(self.skin)),
            Some(cloth) => (wrist - self.at(25.0, 0.0), [36.0, 52.0], Surface::Cloth(cloth)),
        };
        let wrist = Figure::Capsule([wrist, wrist - self.at(30.0, 0.0)], [27.0 * self.size; 2]);
        let arm = Figure::Capsule([start, elbow], radii.map(|radius| radius * self.size));
        [Part::new(wrist, Surface::Skin(self.skin)), Part::new(arm, surface)]
    }

    /// A finger from its root to its tip with its radius in the middle hand: two slightly bent segments, and a nail
    /// when the back of the hand is seen.
    fn finger(&self, root: Vec2, tip: Vec2, radius: f32, parts: &mut Vec<Part>) {
        let radius = radius * self.size;
        let middle = root.lerp(tip, 0.5) + (tip - root).perp().normalize_or_zero() * radius * 0.15;
        for (ends, widths) in [([root, middle], [1.12, 1.02]), ([middle, tip], [1.02, 0.86])] {
            let figure = Figure::Capsule(ends, widths.map(|width| width * radius));
            parts.push(Part::new(figure, Surface::Skin(self.skin)));
        }
        if self.nails {
            let axis = (tip - middle).normalize_or(Vec2::X);
            let figure = Figure::Ellipse(tip + axis * radius * 0.12, axis, Vec2::new(0.68, 0.55) * radius);
            parts.push(Part::new(figure, Surface::Nail(self.skin.lerp(NAIL, 0.45))));
        }
    }
}

/// Draws a hand: most hold the sheet with the thumb in front, the others lie on it or point at it.
pub(crate) fn sample_hand<R: Rng + ?Sized>(skin: Vec3, sleeve: Vec3, rng: &mut R) -> Hand {
    let build = Build {
        skin,
        size: uniform(rng, [0.85, 1.15]),
        sleeve: rng.random_bool(0.6).then_some(sleeve),
        side: if rng.random_bool(0.5) { 1.0 } else { -1.0 },
        nails: rng.random_bool(0.6),
    };
    if rng.random_bool(0.65) {
        holding(&build, rng)
    } else {
        lying(&build, rng)
    }
}

/// The hand behind, the thumb over the edge, seldom a second finger in front.
fn holding<R: Rng + ?Sized>(build: &Build, rng: &mut R) -> Hand {
    let reach = uniform(rng, [8.0, 42.0]);
    let mut behind = build.arm(build.at(-75.0, 10.0)).to_vec();
    behind.push(build.palm(build.at(-35.0, 8.0), Vec2::new(44.0, 38.0)));
    let mut front = Vec::new();
    let lean = uniform(rng, [-14.0, 14.0]);
    build.finger(build.at(-34.0, lean - 8.0), build.at(reach, 0.0), 10.0, &mut front);
    if rng.random_bool(0.2) {
        build.finger(build.at(-40.0, 18.0), build.at(reach * 0.7, 24.0), 8.5, &mut front);
    }
    (behind, front)
}

/// Some fingers on the sheet, the others bent, the palm outside or partly over the edge.
fn lying<R: Rng + ?Sized>(build: &Build, rng: &mut R) -> Hand {
    let stretched = rng.random_range(1..5);
    let knuckles = uniform(rng, [10.0, 70.0]) - 75.0;
    let mut front = build.arm(build.at(knuckles - 85.0, 5.0)).to_vec();
    front.push(build.palm(build.at(knuckles - 40.0, 0.0), Vec2::new(50.0, 42.0)));
    let spread = uniform(rng, [0.9, 1.5]);
    for (number, length) in FINGERS.into_iter().enumerate() {
        let y = (number as f32 - 1.5) * 19.0;
        let length = if number < stretched { length } else { BENT_FINGER };
        let tip = build.at(knuckles + length, y * spread);
        build.finger(build.at(knuckles, y), tip, 8.6, &mut front);
    }
    if rng.random_bool(0.5) {
        let (root, tip) = (build.at(knuckles - 45.0, -34.0), build.at(knuckles + 5.0, -62.0));
        build.finger(root, tip, 10.0, &mut front);
    }
    (Vec::new(), front)
}
