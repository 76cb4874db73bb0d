//! The lower third: bands of waves, boats, fish, a jellyfish, corals, and the wordmark.

use super::canvas::{Canvas, Dice, Ink, Point, Shape, turned, unit};
use super::inks::*;
use super::lettering::Lettering;
use super::ornament::{any, arc, branches, confetti, contours, dots, facets, hatch, leaf, scallops, star};
use std::f32::consts::TAU;

pub(super) fn draw(canvas: &mut Canvas) {
    waves(canvas);
    boats(canvas);
    corals(canvas);
    great_fish(canvas);
    shoal(canvas);
    jellyfish(canvas);
    wordmark(canvas);
}

fn waves(canvas: &mut Canvas) {
    let bands: [(f32, Ink, [Ink; 3]); 6] = [
        (154.0, SKY, [CREAM, BLUE, NAVY]),
        (161.0, NAVY, [SKY, MINT, SEA]),
        (169.0, SEA, [CREAM, TEAL, INK]),
        (178.0, BLUE, [ICE, INK, SKY]),
        (187.0, TEAL, [MINT, LIME, INK]),
        (197.0, INK, [VIOLET, SEA, CORAL]),
    ];
    for (i, (level, ink, inks)) in bands.into_iter().enumerate() {
        let dice = &mut Dice::new(80 + i as u64);
        let mut crest = Vec::new();
        let mut x = -4.0;
        let mut side = 1.0;
        while x < 306.0 {
            crest.push((x, level + side * dice.between(0.8, 3.2)));
            x += dice.between(5.0, 13.0);
            side = -side;
        }
        let band = Shape::ground(&crest, 210.0);
        canvas.fill_with(&band, ink, |canvas| {
            let mut left = -dice.between(0.0, 20.0);
            while left < 297.0 {
                let right = left + dice.between(14.0, 34.0);
                let lean = dice.jitter(5.0);
                let part = Shape::polygon(&[
                    (left, level - 4.0),
                    (right, level - 4.0),
                    (right + lean, level + 15.0),
                    (left + lean, level + 15.0),
                ]);
                let scale = dice.between(1.0, 1.8);
                let pair = dice.pair(&inks);
                canvas.clipped(&part, |canvas| any(canvas, &part, dice, scale, &pair));
                left = right;
            }
        });
        canvas.stroke(&band, if i % 2 == 0 { CREAM } else { ICE }, 1.0);
    }
}

fn boats(canvas: &mut Canvas) {
    let dice = &mut Dice::new(90);
    // A ketch, a cutter and a steamer.
    let sails: [(&[Point], Ink, [Ink; 2]); 5] = [
        (&[(146.0, 119.0), (147.0, 152.0), (126.0, 152.0)], CREAM, [RED, BLUE]),
        (&[(148.0, 122.0), (150.0, 152.0), (160.0, 152.0)], RED, [GOLD, WINE]),
        (&[(131.0, 132.0), (124.0, 151.0), (117.0, 152.0)], GOLD, [NAVY, ORANGE]),
        (&[(228.0, 147.0), (229.0, 166.0), (217.0, 166.0)], PINK, [MAGENTA, PLUM]),
        (&[(230.0, 149.0), (231.0, 166.0), (238.0, 165.0)], MINT, [FOREST, TEAL]),
    ];
    for (corners, ink, inks) in sails {
        let sail = Shape::polygon(corners);
        canvas.fill_with(&sail, ink, |canvas| any(canvas, &sail, dice, 1.3, &inks));
        canvas.stroke(&sail, INK, 0.6);
    }
    let hulls: [(&[Point], Ink, Ink); 3] = [
        (
            &[(114.0, 154.0), (163.0, 154.0), (156.0, 162.0), (122.0, 162.0)],
            WINE,
            SAND,
        ),
        (
            &[(214.0, 167.5), (241.0, 166.5), (236.0, 172.0), (219.0, 172.5)],
            ORANGE,
            NAVY,
        ),
        (
            &[(246.0, 163.0), (284.0, 161.0), (279.0, 172.0), (250.0, 172.0)],
            INK,
            CORAL,
        ),
    ];
    for (corners, ink, stripe) in hulls {
        let hull = Shape::polygon(corners);
        canvas.fill_with(&hull, ink, |canvas| {
            let (left, top, right, _) = hull.bounds();
            canvas.stroke(&Shape::line(&[(left, top + 2.0), (right, top + 1.6)]), stripe, 1.1);
            let mut x = left + 4.0;
            while x < right {
                canvas.fill(
                    &Shape::disc((x, top + 5.0), dice.between(0.6, 1.3)),
                    dice.pick(&[GOLD, CREAM, stripe]),
                );
                x += dice.between(2.4, 5.0);
            }
        });
        canvas.stroke(&hull, INK, 0.7);
    }
    for (x, y, width, height, ink, inks) in [
        (252.0, 156.0, 25.0, 6.2, CREAM, [RED, INK]),
        (257.0, 150.5, 13.0, 5.5, GOLD, [NAVY, BROWN]),
        (259.0, 141.0, 4.0, 9.5, RED, [CREAM, INK]),
        (266.0, 143.0, 3.4, 7.5, TEAL, [CREAM, GOLD]),
    ] {
        let part = Shape::rectangle(x, y, width, height);
        canvas.fill_with(&part, ink, |canvas| hatch(canvas, &part, dice, 1.5, 2.2, &inks));
        canvas.stroke(&part, INK, 0.6);
    }
}

/// The one big fish: sections of different scales from head to tail.
fn great_fish(canvas: &mut Canvas) {
    let dice = &mut Dice::new(100);
    let fins: [(&[Point], Ink, [Ink; 2]); 4] = [
        (
            &[
                (112.0, 181.0),
                (134.0, 166.0),
                (129.0, 182.0),
                (137.0, 198.0),
                (114.0, 187.0),
            ],
            GOLD,
            [RED, WINE],
        ),
        (
            &[(74.0, 168.0), (92.0, 158.0), (106.0, 166.0), (102.0, 174.0)],
            CORAL,
            [CREAM, WINE],
        ),
        (
            &[(80.0, 194.0), (90.0, 204.0), (100.0, 200.0), (98.0, 191.0)],
            MAGENTA,
            [PINK, GOLD],
        ),
        (
            &[(66.0, 192.0), (70.0, 201.0), (76.0, 201.0), (78.0, 193.0)],
            VIOLET,
            [ICE, INK],
        ),
    ];
    for (points, ink, inks) in fins {
        let fin = Shape::blob(points);
        canvas.fill_with(&fin, ink, |canvas| hatch(canvas, &fin, dice, slant(points), 1.8, &inks));
        canvas.stroke(&fin, INK, 0.8);
    }
    let body = Shape::blob(&[
        (44.0, 181.0),
        (50.0, 173.0),
        (64.0, 166.5),
        (82.0, 166.0),
        (100.0, 172.0),
        (116.0, 181.0),
        (119.0, 184.5),
        (114.0, 187.0),
        (98.0, 193.0),
        (80.0, 196.5),
        (62.0, 194.0),
        (49.0, 187.5),
    ]);
    canvas.fill_with(&body, ORANGE, |canvas| {
        let sections: [(f32, Ink, [Ink; 3]); 5] = [
            (62.0, RED, [CORAL, WINE, GOLD]),
            (76.0, CREAM, [NAVY, CORAL, SKY]),
            (86.0, GOLD, [RED, BROWN, CREAM]),
            (97.0, NAVY, [SKY, CORAL, MINT]),
            (107.0, PINK, [MAGENTA, WINE, CREAM]),
        ];
        for (i, (left, ink, inks)) in sections.into_iter().enumerate() {
            let section = Shape::blob(&[
                (left, 160.0),
                (left + 4.0, 180.0),
                (left, 200.0),
                (left + 24.0, 200.0),
                (left + 26.0, 180.0),
                (left + 24.0, 160.0),
            ]);
            canvas.fill_with(&section, ink, |canvas| match i {
                0 => scallops(canvas, &section, dice, 1.57, 4.6, &[RED, CREAM, WINE, GOLD, ORANGE]),
                1 => facets(canvas, &section, dice, 3.6, &inks),
                2 => hatch(canvas, &section, dice, 1.3, 2.6, &inks),
                3 => dots(canvas, &section, dice, 3.2, &inks),
                _ => contours(canvas, &section, dice, (120.0, 180.0), 2.2, &inks),
            });
            canvas.stroke(&section, INK, 0.7);
        }
        hatch(
            canvas,
            &Shape::rectangle(43.0, 183.0, 18.0, 12.0),
            dice,
            -0.5,
            2.4,
            &[GOLD, RED],
        );
        canvas.stroke(&arc((52.0, 180.0), 10.0, -0.9, 1.0), WINE, 1.2);
        canvas.stroke(&Shape::curve(&[(44.0, 184.5), (49.0, 184.8), (52.5, 187.4)]), WINE, 1.1);
        canvas.fill(&Shape::disc((53.5, 177.0), 4.2), CREAM);
        canvas.fill(&Shape::disc((53.0, 176.8), 2.8), TEAL);
        canvas.fill(&Shape::disc((52.6, 176.6), 1.5), INK);
        canvas.fill(&Shape::disc((51.9, 176.0), 0.5), CREAM);
    });
    canvas.stroke(&body, INK, 1.0);
    let fin = leaf((70.0, 183.0), (86.0, 189.5), 3.4);
    canvas.fill_with(&fin, LIME, |canvas| {
        hatch(canvas, &fin, dice, 0.5, 1.6, &[FOREST, TEAL])
    });
    canvas.stroke(&fin, INK, 0.7);
}

/// The direction from the first point to the one half-way round.
fn slant(points: &[Point]) -> f32 {
    let (a, b) = (points[0], points[points.len() / 2]);
    (b.1 - a.1).atan2(b.0 - a.0)
}

fn shoal(canvas: &mut Canvas) {
    let fish: [(f32, f32, f32, f32, Ink, [Ink; 2]); 9] = [
        (150.0, 172.0, 11.0, 0.2, GOLD, [RED, INK]),
        (168.0, 181.0, 8.5, 2.9, CORAL, [CREAM, WINE]),
        (152.0, 196.0, 10.0, -0.35, LIME, [FOREST, NAVY]),
        (186.0, 168.0, 7.0, 3.4, PINK, [MAGENTA, PLUM]),
        (200.0, 176.0, 9.0, 0.1, CREAM, [RED, BLUE]),
        (172.0, 197.0, 7.5, 2.6, RED, [GOLD, CREAM]),
        (104.0, 201.0, 6.0, 3.0, MINT, [TEAL, INK]),
        (52.0, 199.0, 7.0, 0.4, SAND, [BROWN, RED]),
        (140.0, 186.0, 6.5, 1.0, VIOLET, [ICE, GOLD]),
    ];
    for (i, (x, y, size, angle, ink, inks)) in fish.into_iter().enumerate() {
        let dice = &mut Dice::new(110 + i as u64);
        let at = |u: f32, v: f32| turned((x, y), angle, (size * u, size * v));
        let tall = dice.between(0.34, 0.56);
        let tail = Shape::polygon(&[
            at(-0.7, 0.0),
            at(-1.3, -0.9 * tall),
            at(-1.1, 0.0),
            at(-1.35, 1.1 * tall),
        ]);
        canvas.fill(&tail, inks[0]);
        canvas.stroke(&tail, INK, 0.5);
        canvas.fill(
            &Shape::polygon(&[at(-0.4, -0.7 * tall), at(0.05, -1.7 * tall), at(0.4, -0.7 * tall)]),
            inks[1],
        );
        let body = Shape::blob(&[
            at(1.0, 0.0),
            at(0.5, -tall),
            at(-0.3, -0.85 * tall),
            at(-0.85, 0.0),
            at(-0.3, 0.9 * tall),
            at(0.5, 0.95 * tall),
        ]);
        canvas.fill_with(&body, ink, |canvas| any(canvas, &body, dice, 1.1, &inks));
        canvas.stroke(&body, INK, 0.6);
        canvas.fill(&Shape::disc(at(0.62, -0.12), 0.13 * size), CREAM);
        canvas.fill(&Shape::disc(at(0.65, -0.12), 0.07 * size), INK);
    }
    for i in 0..60 {
        let dice = &mut Dice::new(130 + i);
        let centre = (dice.between(44.0, 288.0), dice.between(166.0, 203.0));
        let radius = dice.between(0.5, 1.7);
        canvas.stroke(&Shape::disc(centre, radius), dice.pick(&[CREAM, ICE, MINT]), 0.45);
    }
}

fn jellyfish(canvas: &mut Canvas) {
    let dice = &mut Dice::new(200);
    for i in 0..8 {
        let x = 180.5 + 2.4 * i as f32;
        let points: Vec<Point> = (0..6).map(|k| (x + dice.jitter(1.8), 187.0 + 3.6 * k as f32)).collect();
        canvas.stroke(
            &Shape::curve(&points),
            dice.pick(&[PINK, CREAM, VIOLET, CORAL]),
            dice.between(0.5, 1.2),
        );
    }
    let bell = Shape::blob(&[
        (177.5, 188.0),
        (178.0, 181.0),
        (183.0, 176.0),
        (190.0, 175.0),
        (197.0, 178.5),
        (200.0, 188.0),
        (194.0, 186.5),
        (189.0, 189.0),
        (183.0, 186.8),
    ]);
    canvas.fill_with(&bell, MAGENTA, |canvas| {
        contours(canvas, &bell, dice, (187.0, 190.0), 2.6, &[PINK, PLUM, CREAM]);
        confetti(canvas, &bell, dice, 4.6, &[GOLD, CREAM]);
    });
    canvas.stroke(&bell, INK, 0.8);
}

fn corals(canvas: &mut Canvas) {
    let dice = &mut Dice::new(210);
    for (x, angle, length, inks) in [
        (126.0, -1.5, 9.0, [CORAL, CREAM, GOLD]),
        (160.0, -1.75, 7.0, [GOLD, RED, CREAM]),
        (40.0, -1.35, 7.0, [PINK, CREAM, RED]),
        (212.0, -1.4, 5.5, [MINT, CREAM, CORAL]),
    ] {
        branches(canvas, dice, (x, 205.0), angle, length, 2.8, &inks);
    }
    canvas.fill(&star((139.0, 202.0), 5.0, 2.2, 5, 0.4), ORANGE);
    dots(canvas, &Shape::disc((139.0, 202.0), 1.5), dice, 1.4, &[CREAM]);
    let shell: Vec<Point> = (0..70)
        .map(|i| turned((166.0, 189.5), TAU * 2.6 * i as f32 / 69.0, (0.06 * i as f32, 0.0)))
        .collect();
    canvas.fill(&Shape::disc((166.0, 189.5), 4.2), SAND);
    canvas.stroke(&Shape::curve(&shell), BROWN, 0.8);
}

/// The name on a pennant, each letter in its own ink.
fn wordmark(canvas: &mut Canvas) {
    let dice = &mut Dice::new(220);
    let pennant = Shape::blob(&[
        (201.0, 184.5),
        (222.0, 180.5),
        (248.0, 178.0),
        (268.0, 176.5),
        (275.0, 178.5),
        (273.0, 195.5),
        (266.0, 198.5),
        (242.0, 200.5),
        (218.0, 203.0),
        (202.0, 203.4),
        (198.5, 194.0),
    ]);
    canvas.fill(&pennant, CREAM);
    canvas.clipped(&pennant, |canvas| {
        for i in 0..40 {
            let place = turned((236.5, 190.6), -0.055, unit(i as f32 / 40.0, 35.5, 10.6));
            canvas.fill(
                &Shape::disc(place, dice.between(0.4, 1.3)),
                dice.pick(&[CORAL, GOLD, SEA, PINK, SKY]),
            );
        }
    });
    canvas.stroke(&pennant, INK, 1.1);
    let letters = Lettering {
        origin: (206.5, 197.2),
        angle: -0.055,
        x_height: 6.8,
        weight: 2.3,
        spacing: 0.45,
    };
    letters.draw(canvas, "deepsft", &[NAVY, RED, TEAL, INK, MAGENTA, BLUE, WINE]);
    let hairline = Lettering { weight: 0.5, ..letters };
    hairline.draw(canvas, "deepsft", &[SKY, PINK, MINT, GOLD, PINK, ICE, CORAL]);
}
