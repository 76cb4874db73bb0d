//! The upper half: a sun with a face and its rays, clouds, a balloon, birds, around the night.

use super::canvas::{Canvas, Dice, Ink, Point, Shape, turned};
use super::inks::*;
use super::night;
use super::ornament::{any, arc, confetti, contours, dots, hatch, leaf, sign, star};
use std::f32::consts::{PI, TAU};

const SUN: Point = (82.0, 60.0);

pub(super) fn draw(canvas: &mut Canvas) {
    rays(canvas);
    night::draw(canvas);
    clouds(canvas);
    sun(canvas);
    balloon(canvas);
    birds(canvas);
}

/// Wedges of uneven width around the sun: warm and light on its left, cool and darker towards the night.
fn rays(canvas: &mut Canvas) {
    let dice = &mut Dice::new(1);
    const WARM: [(Ink, [Ink; 3]); 6] = [
        (SAND, [ORANGE, RED, CREAM]),
        (CORAL, [CREAM, WINE, GOLD]),
        (CREAM, [CORAL, GOLD, MAGENTA]),
        (ORANGE, [SAND, WINE, CREAM]),
        (PINK, [RED, CREAM, MAGENTA]),
        (RED, [GOLD, PINK, WINE]),
    ];
    const COOL: [(Ink, [Ink; 3]); 6] = [
        (SKY, [NAVY, ICE, CREAM]),
        (ICE, [BLUE, SEA, CORAL]),
        (SEA, [MINT, INK, CREAM]),
        (MINT, [TEAL, CREAM, BLUE]),
        (BLUE, [SKY, INK, PINK]),
        (VIOLET, [PINK, PLUM, ICE]),
    ];
    let mut angle = -2.75;
    let mut turn = 0;
    while angle < -2.75 + TAU - 0.08 {
        let next = (angle + dice.between(0.13, 0.34)).min(-2.75 + TAU);
        let middle: f32 = 0.5 * (angle + next);
        let (ink, ornaments) = if middle.cos() < 0.25 {
            WARM[turn % 6]
        } else {
            COOL[turn % 6]
        };
        let wedge = Shape::ring_sector(SUN, (0.0, 260.0), (angle, next));
        canvas.fill_with(&wedge, ink, |canvas| {
            // Each ray changes its ornament two to five times on the way out.
            let mut radius = 28.0;
            while radius < 240.0 {
                let outer = radius + dice.between(14.0, 38.0);
                let part = Shape::ring_sector(SUN, (radius, outer), (angle, next));
                let scale = dice.between(0.9, 1.9);
                let inks = dice.pair(&ornaments);
                canvas.clipped(&part, |canvas| any(canvas, &part, dice, scale, &inks));
                canvas.stroke(
                    &arc(SUN, outer, angle, next),
                    ornaments[dice.below(3)],
                    dice.between(0.4, 1.4),
                );
                radius = outer;
            }
        });
        canvas.stroke(&Shape::line(&[SUN, turned(SUN, angle, (260.0, 0.0))]), CREAM, 0.8);
        angle = next;
        turn += 1 + dice.below(3);
    }
}

/// The sun: two half faces between rings of uneven tiles.
fn sun(canvas: &mut Canvas) {
    let dice = &mut Dice::new(2);
    canvas.fill(&star(SUN, 38.0, 28.0, 19, 0.1), RED);
    canvas.fill(&star(SUN, 34.5, 27.0, 23, 0.33), GOLD);
    for (inner, outer, inks) in [(25.0, 29.5, [WINE, CREAM, ORANGE]), (20.5, 24.6, [GOLD, RED, INK])] {
        canvas.fill(&Shape::disc(SUN, outer + 0.5), CREAM);
        let mut angle = 0.0;
        while angle < TAU {
            let next = (angle + dice.between(0.08, 0.36)).min(TAU);
            let tile = Shape::ring_sector(SUN, (inner, outer), (angle, next));
            canvas.fill(&tile, dice.pick(&inks));
            let bead = turned(SUN, 0.5 * (angle + next), (0.5 * (inner + outer), 0.0));
            let kind = dice.below(10);
            sign(
                canvas,
                kind,
                bead,
                dice.between(0.8, 1.7),
                angle,
                dice.pick(&[CREAM, GOLD, NAVY]),
            );
            angle = next;
        }
    }
    let face = Shape::disc(SUN, 20.0);
    canvas.fill_with(&face, SAND, |canvas| {
        let shade = Shape::blob(&[
            (82.0, 38.0),
            (80.0, 52.0),
            (87.0, 62.0),
            (82.0, 68.0),
            (84.0, 82.0),
            (110.0, 82.0),
            (110.0, 38.0),
        ]);
        canvas.fill_with(&shade, ORANGE, |canvas| {
            hatch(canvas, &shade, dice, 0.9, 1.8, &[CORAL, GOLD, RED]);
        });
        dots(canvas, &Shape::disc((70.0, 67.0), 6.0), dice, 2.4, &[CORAL, PINK]);
        canvas.fill(&Shape::disc((70.0, 67.0), 3.6), CORAL);
        canvas.fill(&Shape::disc((93.5, 68.0), 3.2), RED);
        // Forehead, brows, eyes (the right one closed), nose, mouth.
        contours(
            canvas,
            &Shape::disc((74.0, 46.0), 5.0),
            dice,
            (74.0, 46.0),
            1.5,
            &[ORANGE, RED],
        );
        canvas.stroke(&arc((73.0, 59.5), 6.4, 3.7, 5.6), WINE, 1.5);
        canvas.fill(&leaf((67.0, 58.5), (79.0, 58.0), 3.1), CREAM);
        canvas.fill(&Shape::disc((73.4, 58.0), 2.3), BLUE);
        canvas.fill(&Shape::disc((73.8, 57.8), 1.1), INK);
        canvas.stroke(&arc((92.0, 55.5), 5.2, 0.5, 2.7), INK, 1.2);
        for angle in [0.7, 1.2, 1.75, 2.3] {
            let lash = [
                turned((92.0, 55.5), angle, (5.2, 0.0)),
                turned((92.0, 55.5), angle, (7.2, 0.0)),
            ];
            canvas.stroke(&Shape::line(&lash), INK, 0.6);
        }
        canvas.stroke(&arc((92.0, 52.0), 6.0, 3.9, 5.7), WINE, 1.5);
        canvas.stroke(
            &Shape::curve(&[(80.5, 54.0), (84.0, 62.0), (86.2, 65.6), (81.0, 66.6)]),
            WINE,
            1.1,
        );
        canvas.fill(&leaf((75.0, 72.0), (90.5, 71.0), 2.5), RED);
        canvas.stroke(
            &Shape::curve(&[(74.0, 71.4), (79.0, 72.4), (84.0, 71.4), (91.5, 70.2)]),
            WINE,
            0.7,
        );
    });
    canvas.stroke(&face, WINE, 0.9);
}

/// Discs over a flat base.
struct Cloud {
    /// x, y and radius of each.
    puffs: &'static [(f32, f32, f32)],
    base: f32,
    ink: Ink,
    ornaments: [Ink; 3],
    seed: u64,
}

fn clouds(canvas: &mut Canvas) {
    let clouds = [
        Cloud {
            puffs: &[
                (18.0, 30.0, 9.0),
                (30.0, 24.0, 11.0),
                (42.0, 31.0, 7.5),
                (10.0, 34.0, 5.5),
            ],
            base: 37.0,
            ink: CREAM,
            ornaments: [SKY, BLUE, CORAL],
            seed: 11,
        },
        Cloud {
            puffs: &[
                (128.0, 20.0, 6.5),
                (138.0, 16.0, 8.5),
                (148.0, 21.0, 5.5),
                (119.0, 23.0, 4.5),
            ],
            base: 25.5,
            ink: ICE,
            ornaments: [BLUE, VIOLET, CREAM],
            seed: 12,
        },
        Cloud {
            puffs: &[
                (170.0, 84.0, 5.5),
                (180.0, 78.0, 9.5),
                (193.0, 80.0, 7.5),
                (203.0, 85.0, 5.0),
            ],
            base: 88.0,
            ink: PINK,
            ornaments: [WINE, CREAM, RED],
            seed: 13,
        },
        Cloud {
            puffs: &[(10.0, 88.0, 6.0), (20.0, 83.0, 8.0), (31.0, 88.0, 5.5)],
            base: 92.0,
            ink: MINT,
            ornaments: [FOREST, SEA, CREAM],
            seed: 14,
        },
    ];
    for Cloud {
        puffs,
        base,
        ink,
        ornaments: inks,
        seed,
    } in clouds
    {
        let dice = &mut Dice::new(seed);
        let all = Shape::rectangle(0.0, 0.0, 297.0, base);
        canvas.clipped(&all, |canvas| {
            for &(x, y, radius) in puffs {
                canvas.fill(&Shape::disc((x, y), radius + 0.9), INK);
            }
            for &(x, y, radius) in puffs {
                let puff = Shape::disc((x, y), radius);
                canvas.fill_with(&puff, ink, |canvas| {
                    // A spiral in each puff.
                    let (start, sense) = (dice.between(0.0, TAU), if dice.chance(0.5) { 1.0 } else { -1.0 });
                    let turns = dice.between(2.0, 3.4);
                    let spiral: Vec<Point> = (0..60)
                        .map(|i| {
                            let t = i as f32 / 59.0;
                            turned(
                                (x, y),
                                start + sense * TAU * turns * t,
                                (radius * (0.1 + 0.78 * t), 0.0),
                            )
                        })
                        .collect();
                    canvas.stroke(&Shape::curve(&spiral), dice.pick(&inks[..2]), dice.between(0.7, 1.5));
                    for _ in 0..7 {
                        let bead = turned((x, y), dice.between(0.0, TAU), (radius * dice.between(0.1, 0.95), 0.0));
                        canvas.fill(&Shape::disc(bead, dice.between(0.3, 0.9)), dice.pick(&inks));
                    }
                });
            }
        });
        let (first, last) = (
            puffs[0].0 - puffs[0].2,
            puffs[puffs.len() - 1].0 + puffs[puffs.len() - 1].2,
        );
        canvas.stroke(&Shape::line(&[(first.min(last), base), (last, base)]), INK, 1.0);
    }
}

/// A balloon whose gores all differ.
fn balloon(canvas: &mut Canvas) {
    let dice = &mut Dice::new(7);
    let (centre, radius) = ((160.0, 46.0), 16.5);
    let envelope = Shape::blob(&[
        (160.0, 29.5),
        (171.0, 33.0),
        (176.5, 43.0),
        (174.0, 54.0),
        (166.0, 64.0),
        (163.0, 68.5),
        (157.0, 68.5),
        (154.0, 64.0),
        (146.0, 54.0),
        (143.5, 43.0),
        (149.0, 33.0),
    ]);
    canvas.fill_with(&envelope, CREAM, |canvas| {
        let gores: [(Ink, [Ink; 2]); 6] = [
            (WINE, [PINK, GOLD]),
            (GOLD, [RED, NAVY]),
            (TEAL, [MINT, CREAM]),
            (CREAM, [RED, BLUE]),
            (RED, [CREAM, INK]),
            (NAVY, [SKY, GOLD]),
        ];
        for (i, (ink, inks)) in gores.into_iter().enumerate() {
            let edge = |k: usize| -> Vec<Point> {
                let bulge = (k as f32 - 3.0) / 3.0;
                (0..=10)
                    .map(|j| {
                        let t = j as f32 / 10.0;
                        (
                            centre.0 + bulge * (radius + 1.0) * (PI * (0.06 + 0.86 * t)).sin(),
                            28.0 + 42.0 * t,
                        )
                    })
                    .collect()
            };
            let mut outline = edge(i);
            outline.extend(edge(i + 1).into_iter().rev());
            let gore = Shape::polygon(&outline);
            canvas.fill_with(&gore, ink, |canvas| {
                any(canvas, &gore, dice, 1.3 + 0.1 * i as f32, &inks)
            });
        }
        let belt = Shape::polygon(&[(140.0, 47.0), (180.0, 44.0), (180.0, 51.0), (140.0, 53.5)]);
        canvas.fill_with(&belt, INK, |canvas| {
            confetti(canvas, &belt, dice, 4.2, &[GOLD, CREAM, CORAL])
        });
    });
    canvas.stroke(&envelope, INK, 0.9);
    for x in [157.2, 159.4, 162.8] {
        canvas.stroke(&Shape::line(&[(x, 68.5), (0.5 * (x + 160.0), 74.0)]), INK, 0.4);
    }
    let basket = Shape::polygon(&[(156.6, 74.0), (163.6, 74.0), (162.6, 79.5), (157.6, 79.5)]);
    canvas.fill_with(&basket, BROWN, |canvas| {
        hatch(canvas, &basket, dice, 0.4, 1.2, &[SAND, GOLD])
    });
    canvas.stroke(&basket, INK, 0.6);
}

fn birds(canvas: &mut Canvas) {
    let flock: [(f32, f32, f32, f32, Ink); 9] = [
        (112.0, 11.5, 6.0, 0.2, INK),
        (124.0, 38.0, 4.5, -0.3, WINE),
        (132.0, 45.0, 7.5, 0.15, INK),
        (121.0, 51.0, 5.2, -0.1, NAVY),
        (52.0, 13.0, 6.6, -0.35, WINE),
        (64.0, 17.5, 4.4, 0.1, INK),
        (14.0, 60.0, 7.0, 0.3, NAVY),
        (27.0, 66.0, 5.0, -0.2, INK),
        (184.0, 60.0, 6.0, -0.45, CREAM),
    ];
    for (i, (x, y, size, angle, ink)) in flock.into_iter().enumerate() {
        let lift = 0.25 + 0.05 * i as f32;
        let wing = |side: f32, t: f32, drop: f32| turned((x, y), angle, (side * size * t, size * (drop - lift * t)));
        for (side, stretch) in [(-1.0, 1.0), (1.0, 0.72 + 0.05 * i as f32)] {
            let outline = [
                wing(0.0, 0.0, 0.16),
                wing(side, 0.45 * stretch, -0.16),
                wing(side, stretch, 0.1),
                wing(side, 0.5 * stretch, 0.1),
                wing(0.0, 0.0, 0.34),
            ];
            canvas.fill(&Shape::blob(&outline), ink);
        }
        canvas.fill(&leaf(wing(0.0, 0.0, -0.1), wing(0.0, 0.0, 0.75), 0.15 * size), ink);
    }
}
