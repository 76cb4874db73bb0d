//! Leaves and a flower in front of everything.

use super::canvas::{Canvas, Dice, Ink, Point, Shape, turned};
use super::inks::*;
use super::ornament::{branches, dots, hatch, leaf};

pub(super) fn draw(canvas: &mut Canvas) {
    let dice = &mut Dice::new(70);
    let fronds: [(Point, Point, f32, Ink, Ink); 10] = [
        ((6.0, 176.0), (38.0, 146.0), 6.0, FOREST, LIME),
        ((4.0, 168.0), (22.0, 134.0), 5.5, LEAF, CREAM),
        ((4.0, 186.0), (44.0, 166.0), 6.5, TEAL, MINT),
        ((2.0, 160.0), (11.0, 138.0), 4.0, WINE, CORAL),
        ((4.0, 196.0), (40.0, 186.0), 6.0, LIME, FOREST),
        ((6.0, 206.0), (34.0, 198.0), 5.0, NAVY, SKY),
        ((294.0, 206.0), (262.0, 196.0), 5.5, FOREST, MINT),
        ((296.0, 196.0), (270.0, 180.0), 5.0, WINE, GOLD),
        ((296.0, 184.0), (278.0, 163.0), 4.6, LEAF, SAND),
        ((296.0, 172.0), (287.0, 150.0), 3.8, INK, SEA),
    ];
    for (stem, tip, half_width, ink, vein) in fronds {
        let blade = leaf(stem, tip, half_width);
        let (dx, dy) = (tip.0 - stem.0, tip.1 - stem.1);
        let (length, angle) = (dx.hypot(dy), dy.atan2(dx));
        canvas.fill_with(&blade, ink, |canvas| {
            let mut along = 2.0;
            while along < length {
                let lean = dice.between(3.0, 7.0);
                for side in [-1.0, 1.0] {
                    let rib = [
                        (along, 0.0),
                        (along + 0.5 * lean, side * 0.5 * half_width),
                        (along + lean, side * half_width),
                    ]
                    .map(|p| turned(stem, angle, p));
                    canvas.stroke(&Shape::curve(&rib), vein, dice.between(0.3, 0.9));
                }
                along += dice.between(1.4, 3.6);
            }
            canvas.stroke(&Shape::line(&[stem, tip]), vein, 0.9);
        });
        canvas.stroke(&blade, INK, 0.6);
    }
    let heart = (21.0, 161.0);
    for i in 0..7 {
        let angle = 0.35 + i as f32 * 0.8976 + dice.jitter(0.12);
        let petal = leaf(
            turned(heart, angle, (1.0, 0.0)),
            turned(heart, angle, (dice.between(10.0, 13.5), 0.0)),
            dice.between(3.4, 4.6),
        );
        canvas.fill_with(&petal, [PINK, RED, CREAM][i % 3], |canvas| {
            hatch(canvas, &petal, dice, angle, 1.9, &[MAGENTA, WINE, CORAL])
        });
        canvas.stroke(&petal, WINE, 0.6);
    }
    canvas.fill(&Shape::disc(heart, 3.4), GOLD);
    dots(canvas, &Shape::disc(heart, 2.0), dice, 1.5, &[BROWN, ORANGE, CREAM]);
    branches(
        canvas,
        dice,
        (290.5, 206.0),
        -1.9,
        7.0,
        2.4,
        &[MAGENTA, CREAM, GOLD, PINK],
    );
}
