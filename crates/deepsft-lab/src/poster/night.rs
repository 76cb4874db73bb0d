//! The disc of night in the upper right: stars and a galaxy, the moon, a planet with a ring, a comet.

use super::canvas::{Canvas, Dice, Ink, Point, Shape, turned, unit};
use super::inks::*;
use super::ornament::{any, arc, confetti, contours, dots, hatch, star};
use std::f32::consts::TAU;

const NIGHT: Point = (262.0, 14.0);
const NIGHT_RADIUS: f32 = 74.0;

/// A disc of night that comes in from the upper right corner.
pub(super) fn draw(canvas: &mut Canvas) {
    let dice = &mut Dice::new(3);
    let bands: [(f32, Ink, [Ink; 2]); 5] = [
        (13.0, WINE, [CORAL, GOLD]),
        (9.0, MAGENTA, [PINK, PLUM]),
        (5.5, VIOLET, [ICE, INK]),
        (2.4, CREAM, [RED, BLUE]),
        (0.0, INK, [BLUE, NAVY]),
    ];
    for (margin, ink, inks) in bands {
        let mut angle = 1.0;
        canvas.fill(&Shape::disc(NIGHT, NIGHT_RADIUS + margin), ink);
        while angle < 3.4 && margin > 0.0 {
            let next = angle + dice.between(0.06, 0.34);
            let radii = (NIGHT_RADIUS + margin - 4.5, NIGHT_RADIUS + margin);
            let tile = Shape::ring_sector(NIGHT, radii, (angle, next));
            canvas.clipped(&tile, |canvas| any(canvas, &tile, dice, 0.9, &inks));
            angle = next;
        }
    }
    let sky = Shape::disc(NIGHT, NIGHT_RADIUS);
    canvas.clipped(&sky, |canvas| {
        let cloud = |points: &[Point]| Shape::blob(points);
        let haze = cloud(&[
            (186.0, 10.0),
            (214.0, 22.0),
            (236.0, 52.0),
            (262.0, 64.0),
            (294.0, 58.0),
            (294.0, 92.0),
            (250.0, 92.0),
            (216.0, 62.0),
            (192.0, 40.0),
        ]);
        canvas.fill_with(&haze, BLUE, |canvas| {
            contours(canvas, &haze, dice, (244.0, 70.0), 2.6, &[BLUE, SKY, VIOLET, BLUE, INK])
        });
        let glow = cloud(&[
            (196.0, 22.0),
            (216.0, 36.0),
            (240.0, 64.0),
            (268.0, 76.0),
            (290.0, 70.0),
            (276.0, 84.0),
            (246.0, 80.0),
            (222.0, 60.0),
        ]);
        canvas.fill_with(&glow, PLUM, |canvas| {
            dots(canvas, &glow, dice, 2.6, &[PINK, MAGENTA, CREAM, CORAL])
        });
        confetti(canvas, &sky, dice, 12.0, &[CREAM, GOLD, SKY, CORAL, MINT]);
        let specks = Shape::disc((252.0, 20.0), 46.0);
        dots(canvas, &specks, dice, 5.4, &[VIOLET, SKY, BLUE, ICE]);
        for _ in 0..34 {
            let place = (dice.between(192.0, 290.0), dice.between(7.0, 86.0));
            let (outer, points, turn) = (dice.between(1.2, 4.2), 4 + dice.below(5), dice.between(0.0, TAU));
            canvas.fill(
                &star(place, outer, outer * dice.between(0.25, 0.5), points, turn),
                dice.pick(&[CREAM, GOLD, ICE, CORAL, MINT]),
            );
        }
        let bear = [
            (206.0, 14.0),
            (216.0, 19.0),
            (222.0, 28.0),
            (233.0, 31.0),
            (236.0, 42.0),
            (248.0, 44.0),
            (251.0, 33.0),
        ];
        canvas.stroke(&Shape::line(&bear), SKY, 0.5);
        for place in bear {
            canvas.fill(
                &star(place, dice.between(1.8, 3.0), 0.9, 6, dice.between(0.0, 1.0)),
                CREAM,
            );
        }
    });
    moon(canvas);
    planet(canvas);
    comet(canvas);
}

fn moon(canvas: &mut Canvas) {
    let dice = &mut Dice::new(4);
    let (centre, radius) = ((268.0, 31.0), 15.5);
    canvas.fill(&Shape::disc(centre, radius + 1.2), CREAM);
    let dark = Shape::disc(centre, radius);
    canvas.fill_with(&dark, TEAL, |canvas| {
        hatch(canvas, &dark, dice, 2.2, 1.7, &[INK, MINT, NAVY, SEA])
    });
    // The lit part: the disc less a smaller disc on the right, drawn as an outline of two arcs.
    let mut outline: Vec<Point> = (0..=24)
        .map(|i| turned(centre, 0.9 + (TAU - 2.2) * i as f32 / 24.0, (radius, 0.0)))
        .collect();
    let inner = (centre.0 + 6.2, centre.1 - 1.4);
    let (from, to) = (outline[24], outline[0]);
    let (a, b) = (
        (from.1 - inner.1).atan2(from.0 - inner.0),
        (to.1 - inner.1).atan2(to.0 - inner.0),
    );
    outline.extend((1..24).map(|i| {
        let t = i as f32 / 24.0;
        let sweep = (b - a).rem_euclid(TAU) - TAU;
        let length =
            (from.0 - inner.0).hypot(from.1 - inner.1) * (1.0 - t) + (to.0 - inner.0).hypot(to.1 - inner.1) * t;
        turned(inner, a + sweep * t, (length, 0.0))
    }));
    let lit = Shape::polygon(&outline);
    canvas.fill_with(&lit, SAND, |canvas| {
        for _ in 0..22 {
            let crater = (dice.between(252.0, 272.0), dice.between(17.0, 46.0));
            let size = dice.between(0.5, 2.2);
            canvas.fill(&Shape::disc(crater, size), dice.pick(&[GOLD, CREAM, ORANGE]));
            canvas.stroke(&arc(crater, size, 2.0, 4.6), BROWN, 0.4);
        }
    });
}

fn planet(canvas: &mut Canvas) {
    let dice = &mut Dice::new(5);
    let (centre, tilt) = ((227.0, 13.5), -0.42);
    let ball = Shape::disc(centre, 5.2);
    canvas.stroke(&Shape::ellipse(centre, 10.5, 2.9, tilt), MINT, 1.3);
    canvas.fill_with(&ball, CORAL, |canvas| {
        hatch(canvas, &ball, dice, tilt, 1.9, &[CREAM, WINE, ORANGE])
    });
    let front: Vec<Point> = (0..=12)
        .map(|i| turned(centre, tilt, unit(0.02 + 0.46 * i as f32 / 12.0, 10.5, 2.9)))
        .collect();
    canvas.stroke(&Shape::curve(&front), MINT, 1.3);
    canvas.stroke(&Shape::curve(&front), TEAL, 0.35);
}

fn comet(canvas: &mut Canvas) {
    let dice = &mut Dice::new(6);
    for i in 0..9 {
        let reach = dice.between(12.0, 27.0);
        let bend = 0.28 * i as f32 - 1.1;
        let tail = [
            (203.0, 52.5),
            turned((203.0, 52.5), -0.62, (0.5 * reach, bend)),
            turned((203.0, 52.5), -0.72, (reach, 2.2 * bend)),
        ];
        canvas.stroke(
            &Shape::curve(&tail),
            dice.pick(&[CREAM, GOLD, SKY, PINK]),
            dice.between(0.3, 0.8),
        );
    }
    canvas.fill(&star((203.0, 52.5), 4.4, 2.2, 7, 0.3), GOLD);
    canvas.fill(&Shape::disc((203.0, 52.5), 1.7), RED);
}
