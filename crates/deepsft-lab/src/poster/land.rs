//! The middle: mountains, hills with fields, a river, trees.

use super::canvas::{Canvas, Dice, Ink, Point, Shape, turned};
use super::inks::*;
use super::ornament::{any, contours, dots, facets, hatch, leaf, plots, zigzag};

pub(super) fn draw(canvas: &mut Canvas) {
    mountains(canvas);
    hills(canvas);
    river(canvas);
    trees(canvas);
}

struct Peak {
    left: f32,
    apex: Point,
    right: f32,
    fold: f32,
    lit: (Ink, [Ink; 2]),
    shaded: (Ink, [Ink; 2]),
}

fn mountains(canvas: &mut Canvas) {
    let base = 140.0;
    let peaks = [
        Peak {
            left: 126.0,
            apex: (158.0, 86.0),
            right: 200.0,
            fold: 168.0,
            lit: (VIOLET, [PINK, PLUM]),
            shaded: (PLUM, [MAGENTA, INK]),
        },
        Peak {
            left: -4.0,
            apex: (24.0, 94.0),
            right: 62.0,
            fold: 18.0,
            lit: (WINE, [CORAL, ORANGE]),
            shaded: (SAND, [BROWN, RED]),
        },
        Peak {
            left: 84.0,
            apex: (124.0, 72.0),
            right: 168.0,
            fold: 131.0,
            lit: (SKY, [BLUE, CREAM]),
            shaded: (NAVY, [SKY, VIOLET]),
        },
        Peak {
            left: 176.0,
            apex: (205.0, 92.0),
            right: 246.0,
            fold: 199.0,
            lit: (SEA, [MINT, FOREST]),
            shaded: (FOREST, [LIME, SEA]),
        },
        Peak {
            left: 30.0,
            apex: (56.0, 101.0),
            right: 96.0,
            fold: 66.0,
            lit: (GOLD, [BROWN, CREAM]),
            shaded: (BROWN, [ORANGE, SAND]),
        },
        Peak {
            left: 68.0,
            apex: (93.0, 98.0),
            right: 128.0,
            fold: 86.0,
            lit: (INK, [CORAL, VIOLET]),
            shaded: (CORAL, [WINE, CREAM]),
        },
        Peak {
            left: 140.0,
            apex: (178.0, 103.0),
            right: 204.0,
            fold: 183.0,
            lit: (PINK, [RED, WINE]),
            shaded: (RED, [SAND, WINE]),
        },
    ];
    for (i, peak) in peaks.iter().enumerate() {
        let dice = &mut Dice::new(20 + i as u64);
        let apex = peak.apex;
        let lit = Shape::polygon(&[apex, (peak.fold, base), (peak.left, base)]);
        let ridge = [
            apex,
            (apex.0 + dice.jitter(4.0), apex.1 + 11.0),
            (apex.0 + 0.3 * (peak.fold - apex.0) + dice.jitter(5.0), apex.1 + 22.0),
            (peak.fold + dice.jitter(4.0), base),
            (peak.right, base),
        ];
        let shaded = Shape::polygon(&ridge);
        let angle = (apex.1 - base).atan2(apex.0 - peak.left);
        canvas.fill_with(&lit, peak.lit.0, |canvas| {
            if i % 2 == 0 {
                hatch(canvas, &lit, dice, angle, 2.3 + 0.3 * i as f32, &peak.lit.1);
            } else {
                contours(
                    canvas,
                    &lit,
                    dice,
                    (apex.0 - 14.0, apex.1 + 30.0),
                    2.2 + 0.2 * i as f32,
                    &peak.lit.1,
                );
            }
        });
        canvas.fill_with(&shaded, peak.shaded.0, |canvas| {
            if i % 3 == 0 {
                zigzag(canvas, &shaded, dice, 0.8 + 0.2 * i as f32, 3.2, &peak.shaded.1);
            } else {
                facets(
                    canvas,
                    &shaded,
                    dice,
                    4.2 + 0.4 * i as f32,
                    &[peak.shaded.0, peak.shaded.1[0], peak.shaded.1[1]],
                );
            }
        });
        let depth = dice.between(9.0, 17.0);
        let slope = |x: f32, t: f32| (apex.0 + (x - apex.0) * t, apex.1 + (base - apex.1) * t);
        let t = depth / (base - apex.1);
        let mut snow = vec![apex, slope(peak.right, t)];
        for k in (0..7).rev() {
            let place = slope(peak.left + (peak.right - peak.left) * k as f32 / 6.5, t);
            snow.push((place.0, place.1 + dice.jitter(4.2)));
        }
        snow.push(slope(peak.left, t * 0.9));
        let snow = Shape::polygon(&snow);
        let cap = if i % 3 == 1 { SAND } else { CREAM };
        canvas.fill_with(&snow, cap, |canvas| dots(canvas, &snow, dice, 2.6, &[ICE, SKY, CORAL]));
        canvas.stroke(&Shape::line(&[(peak.left, base), apex, (peak.right, base)]), INK, 0.8);
        canvas.stroke(&Shape::line(&ridge[..4]), INK, 0.6);
    }
}

fn hills(canvas: &mut Canvas) {
    let ground = |points: &[Point]| Shape::ground(points, 160.0);
    let far = ground(&[
        (0.0, 118.0),
        (22.0, 112.0),
        (48.0, 121.0),
        (78.0, 128.0),
        (104.0, 122.0),
        (136.0, 124.0),
        (170.0, 131.0),
        (200.0, 126.0),
    ]);
    let dice = &mut Dice::new(40);
    canvas.fill_with(&far, LEAF, |canvas| {
        plots(
            canvas,
            &far,
            dice,
            -0.22,
            9.0,
            &[LIME, FOREST, GOLD, LEAF, CORAL, MINT, BROWN, CREAM],
        )
    });
    canvas.stroke(&far, INK, 0.8);
    let near = ground(&[
        (60.0, 160.0),
        (82.0, 140.0),
        (110.0, 133.0),
        (140.0, 138.0),
        (166.0, 146.0),
        (196.0, 160.0),
    ]);
    canvas.fill_with(&near, GOLD, |canvas| {
        plots(
            canvas,
            &near,
            dice,
            0.31,
            7.0,
            &[SAND, ORANGE, RED, LIME, TEAL, WINE, CREAM, SEA],
        )
    });
    canvas.stroke(&near, INK, 0.8);
    let left = ground(&[(0.0, 128.0), (20.0, 126.0), (44.0, 136.0), (64.0, 146.0), (86.0, 156.0)]);
    canvas.fill_with(&left, TEAL, |canvas| {
        contours(canvas, &left, dice, (14.0, 152.0), 3.0, &[MINT, FOREST, LIME, INK])
    });
    canvas.stroke(&left, INK, 0.8);
}

fn river(canvas: &mut Canvas) {
    let dice = &mut Dice::new(41);
    let water = Shape::blob(&[
        (112.0, 121.5),
        (116.0, 122.5),
        (109.0, 128.0),
        (94.0, 134.0),
        (96.0, 140.0),
        (110.0, 147.0),
        (116.0, 158.0),
        (92.0, 158.0),
        (90.0, 149.0),
        (79.0, 142.0),
        (80.0, 133.0),
        (97.0, 127.0),
    ]);
    canvas.fill_with(&water, ICE, |canvas| {
        hatch(canvas, &water, dice, 0.5, 2.3, &[BLUE, SKY, NAVY])
    });
    canvas.stroke(&water, INK, 0.7);
}

fn trees(canvas: &mut Canvas) {
    let dice = &mut Dice::new(42);
    let stand: [(f32, f32, f32, usize); 17] = [
        (16.0, 126.0, 17.0, 0),
        (25.0, 131.0, 11.0, 1),
        (33.0, 127.0, 20.0, 0),
        (44.0, 138.0, 13.0, 2),
        (55.0, 142.0, 16.0, 1),
        (52.0, 124.0, 9.0, 2),
        (68.0, 127.0, 12.0, 0),
        (73.0, 148.0, 11.0, 1),
        (124.0, 136.0, 14.0, 2),
        (131.0, 139.0, 9.0, 0),
        (141.0, 140.0, 17.0, 1),
        (150.0, 129.0, 10.0, 0),
        (154.0, 146.0, 12.0, 2),
        (163.0, 133.0, 14.0, 0),
        (168.0, 149.0, 15.0, 1),
        (120.0, 126.0, 8.0, 1),
        (38.0, 120.0, 8.0, 1),
    ];
    for (x, y, height, kind) in stand {
        canvas.stroke(
            &Shape::line(&[(x, y), (x + dice.jitter(0.5), y - 0.6 * height)]),
            BROWN,
            0.07 * height,
        );
        let (ink, inks): (Ink, [Ink; 2]) = [
            (FOREST, [LIME, SEA]),
            (WINE, [CORAL, GOLD]),
            (LEAF, [CREAM, FOREST]),
            (RED, [PINK, WINE]),
            (NAVY, [SKY, MINT]),
            (LIME, [FOREST, LEAF]),
            (ORANGE, [CREAM, WINE]),
        ][dice.below(7)];
        let crown = match kind {
            0 => leaf(
                (x, y - 0.1 * height),
                (x + dice.jitter(1.0), y - 1.1 * height),
                height * dice.between(0.17, 0.26),
            ),
            1 => {
                let points: Vec<Point> = (0..9)
                    .map(|i| {
                        turned(
                            (x, y - 0.72 * height),
                            i as f32 * 0.698,
                            (height * dice.between(0.28, 0.42), 0.0),
                        )
                    })
                    .collect();
                Shape::blob(&points)
            }
            _ => Shape::polygon(&[
                (x - 0.33 * height, y - 0.15 * height),
                (x - 0.16 * height, y - 0.48 * height),
                (x - 0.25 * height, y - 0.46 * height),
                (x, y - height),
                (x + 0.22 * height, y - 0.5 * height),
                (x + 0.14 * height, y - 0.5 * height),
                (x + 0.3 * height, y - 0.18 * height),
            ]),
        };
        canvas.fill_with(&crown, ink, |canvas| any(canvas, &crown, dice, 0.95, &inks));
        canvas.stroke(&crown, INK, 0.55);
    }
}
