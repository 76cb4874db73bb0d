//! Random occluders of a scene.

use crate::random::{draw_or, uniform, unit_vector};
use crate::render::{Figure, ValueNoise, any_color};
use crate::scene::background::color_jitter;
use crate::scene::occluder::anchored::{Anchor, Occluder, OccluderKind};
use crate::scene::occluder::body::{Part, Surface};
use crate::scene::occluder::hand::{sample_hand, skin_color};
use deepsft_geometry::glam::{Vec2, Vec3};
use rand::{Rng, RngExt};
use std::f32::consts::TAU;

/// Most discs, alone or among hands and things, and their radii in pixels; the paper's own have half the size.
const MAX_DISCS: usize = 4;
const DISC_RADIUS_PX: [f64; 2] = [1.0, 10.0];
const PAPER_DISC_RADIUS_PX: [f64; 2] = [0.5, 5.0];

/// Draws the occluders of a scene, which has any with the given probability.
pub(crate) fn sample_occluders<R: Rng + ?Sized>(probability: f64, kind: OccluderKind, rng: &mut R) -> Vec<Occluder> {
    if !rng.random_bool(probability) {
        return Vec::new();
    }
    if kind == OccluderKind::Discs {
        return (0..rng.random_range(0..=MAX_DISCS))
            .map(|_| {
                let color = any_color(rng);
                let radius_px = uniform(rng, PAPER_DISC_RADIUS_PX);
                let anchor = Anchor::Image(Vec2::new(rng.random(), rng.random()));
                disc(color, radius_px, anchor, rng)
            })
            .collect();
    }
    let mut occluders = Vec::new();
    let skin = skin_color(rng);
    let sleeve = any_color(rng);
    if rng.random_bool(0.75) {
        // One or two hands of the same person, at random places of the outline; two hold opposite sides.
        let place: f32 = rng.random();
        occluders.push(hand(place, skin, sleeve, rng));
        if rng.random_bool(0.5) {
            let other = place + 0.5 + uniform(rng, [-0.12, 0.12]);
            occluders.push(hand(other.fract(), skin, sleeve, rng));
        }
    }
    if rng.random_bool(0.3) {
        for _ in 0..rng.random_range(1..4) {
            occluders.push(thing(rng));
        }
    }
    if rng.random_bool(0.35) || occluders.is_empty() {
        for _ in 0..rng.random_range(1..=MAX_DISCS) {
            occluders.push(disc_on_sheet(rng));
        }
    }
    occluders
}

/// A hand at `place` of the outline.
fn hand<R: Rng + ?Sized>(place: f32, skin: Vec3, sleeve: Vec3, rng: &mut R) -> Occluder {
    let (behind, front) = sample_hand(skin, sleeve, rng);
    let turn = uniform(rng, [-0.7, 0.7]);
    body(Anchor::Outline { fraction: place, turn }, behind, front, rng)
}

/// Something with a size in mm that throws a shadow.
fn body<R: Rng + ?Sized>(anchor: Anchor, behind: Vec<Part>, front: Vec<Part>, rng: &mut R) -> Occluder {
    Occluder {
        anchor,
        behind,
        front,
        noise: ValueNoise::new(rng),
        shadow: shadow(rng),
        in_pixels: false,
    }
}

/// A shadow's displacement and softness in mm and its strength, often none.
fn shadow<R: Rng + ?Sized>(rng: &mut R) -> (Vec2, f32, f32) {
    let strength = draw_or(rng, 0.7, 0.0, |rng| uniform(rng, [0.15, 0.65]));
    let shift = unit_vector(rng) * uniform(rng, [2.0, 18.0]);
    (shift, uniform(rng, [2.0, 14.0]), strength)
}

/// A flat or rounded thing before the sheet.
fn thing<R: Rng + ?Sized>(rng: &mut R) -> Occluder {
    let size = uniform(rng, [8.0, 55.0]);
    let (a, b) = (any_color(rng), any_color(rng));
    let half = Vec2::new(size * uniform(rng, [1.0, 3.0]), size) * 0.6;
    let (figure, surface) = match rng.random_range(0..4) {
        0 => (Figure::Ellipse(Vec2::ZERO, Vec2::X, half), Surface::Cloth(a)),
        1 => (Figure::Rectangle(Vec2::ZERO, Vec2::X, half), Surface::Flat(a, b)),
        2 => {
            // A pen or stick.
            let ends = [Vec2::ZERO, Vec2::new(uniform(rng, [60.0, 160.0]), 0.0)];
            let radii = [uniform(rng, [2.5, 6.0]), uniform(rng, [2.0, 6.0])];
            (Figure::Capsule(ends, radii), Surface::Cloth(a))
        }
        _ => {
            let corners = rng.random_range(3..7);
            let direction = |k: usize| Vec2::from_angle(k as f32 * TAU / corners as f32);
            let outline = (0..corners).map(|k| direction(k) * (size * uniform(rng, [0.5, 1.3])));
            (Figure::Polygon(outline.collect()), Surface::Flat(a, b))
        }
    };
    let anchor = Anchor::Inside {
        fraction: rng.random(),
        direction: unit_vector(rng),
    };
    body(anchor, Vec::new(), vec![Part::new(figure, surface)], rng)
}

/// A disc that matches no background: its colour is jittered as theirs is.
fn disc_on_sheet<R: Rng + ?Sized>(rng: &mut R) -> Occluder {
    let (matrix, offset) = color_jitter(rng);
    let color = (matrix * any_color(rng) + offset).max(Vec3::ZERO);
    let radius_px = uniform(rng, DISC_RADIUS_PX);
    let anchor = Anchor::Inside {
        fraction: rng.random(),
        direction: Vec2::X,
    };
    disc(color, radius_px, anchor, rng)
}

/// A disc of one colour.
fn disc<R: Rng + ?Sized>(color: Vec3, radius_px: f32, anchor: Anchor, rng: &mut R) -> Occluder {
    Occluder {
        anchor,
        behind: Vec::new(),
        front: vec![Part::new(
            Figure::disc(Vec2::ZERO, radius_px),
            Surface::Flat(color, color),
        )],
        noise: ValueNoise::new(rng),
        shadow: (Vec2::ZERO, 1.0, 0.0),
        in_pixels: true,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::random::{Stream, generator};
    use crate::render::{Frame, Lighting};
    use crate::scene::occluder::anchored::SheetInImage;
    use crate::scene::occluder::body::covered_by;
    use deepsft_geometry::{Maps, training_camera};

    #[test]
    fn the_papers_discs_lie_anywhere_in_the_image_in_one_colour_and_have_the_papers_sizes() {
        let camera = training_camera();
        let sheet = SheetInImage {
            outline: &[],
            vertices_camera: &[],
            camera: &camera,
        };
        let (mut counts, mut reach) = ([0; 5], Vec2::ZERO);
        for index in 0..500 {
            let discs = sample_occluders(1.0, OccluderKind::Discs, &mut generator(2, index, Stream::Scene));
            counts[discs.len()] += 1;
            for disc in discs {
                let placed = disc.place(&sheet).unwrap();
                let (low, high) = placed.front[0].figure.bounds();
                let size = high - low;
                assert!(
                    (size.x - size.y).abs() < 1e-3 && (0.999..10.001).contains(&size.x),
                    "{size}"
                );
                reach = reach.max(low);
                let mut frame = Frame::filled(480, 270, Vec3::ZERO);
                let mut truth = Maps::empty((480, 270));
                placed.paint_front(&mut frame, &mut truth, &Lighting::frontal(), &camera);
                // Pixels that are covered whole: their centre is half a diagonal or more inside.
                let figure = &placed.front[0].figure;
                let covered = covered_by(&placed.front, &frame);
                let mut whole = covered
                    .into_iter()
                    .filter(|&p| figure.distance(frame.centre(p)) < -0.71);
                let first = whole.next().map(|pixel| frame.color(pixel));
                assert!(whole.all(|pixel| first.is_some_and(|first| frame.color(pixel).distance(first) < 1e-6)));
            }
        }
        // Each number of discs is a fifth of 500: 100 +- 9; five standard deviations.
        assert!(counts.iter().all(|count| (55..145).contains(count)), "{counts:?}");
        assert!(reach.x > 460.0 && reach.y > 255.0, "{reach}");
    }
}
