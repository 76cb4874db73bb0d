//! The town on its terraces, with a church and a clock tower, and the lighthouse on its rock.

use super::canvas::{Canvas, Dice, Ink, Shape};
use super::inks::*;
use super::ornament::{any, arc, dots, facets, hatch, leaf, scallops, zigzag};

pub(super) fn draw(canvas: &mut Canvas) {
    town(canvas);
    lighthouse(canvas);
}

/// Four terraces of houses, back to front; no two houses share width, height, roof, inks and windows.
fn town(canvas: &mut Canvas) {
    let hill = Shape::ground(
        &[
            (180.0, 160.0),
            (196.0, 142.0),
            (210.0, 122.0),
            (232.0, 108.0),
            (256.0, 104.0),
            (278.0, 98.0),
            (300.0, 102.0),
        ],
        162.0,
    );
    let dice = &mut Dice::new(50);
    canvas.fill_with(&hill, FOREST, |canvas| {
        scallops(canvas, &hill, dice, 0.1, 4.4, &[LEAF, TEAL, LIME, FOREST, INK])
    });
    canvas.stroke(&hill, INK, 0.8);
    landmarks(canvas);
    for (row, (from, to, base, tilt)) in [
        (228.0, 297.0, 118.0, -3.0),
        (214.0, 297.0, 132.0, -2.0),
        (206.0, 297.0, 146.0, 1.5),
        (200.0, 297.0, 158.0, 0.0),
    ]
    .into_iter()
    .enumerate()
    {
        let mut x = from;
        while x < to {
            let width = dice.between(5.5, 13.5);
            let foot = base + tilt * (x - from) / (to - from) + dice.jitter(1.4);
            let height = dice.between(9.0, 19.0) + if row == 0 { 5.0 } else { 0.0 };
            house(canvas, dice, x, foot, width, height);
            x += width + if dice.chance(0.2) { dice.between(0.5, 3.0) } else { 0.0 };
        }
    }
}

/// What stands out of the roofs: a church with an onion dome and a clock tower.
fn landmarks(canvas: &mut Canvas) {
    let dice = &mut Dice::new(51);
    let nave = Shape::rectangle(243.0, 96.0, 13.0, 24.0);
    canvas.fill_with(&nave, SAND, |canvas| {
        zigzag(canvas, &nave, dice, 0.0, 3.0, &[RED, BROWN, CREAM])
    });
    canvas.stroke(&nave, INK, 0.6);
    let dome = Shape::blob(&[
        (242.6, 96.5),
        (240.8, 90.5),
        (245.0, 85.0),
        (249.5, 76.0),
        (254.0, 85.0),
        (258.2, 90.5),
        (256.4, 96.5),
    ]);
    canvas.fill_with(&dome, GOLD, |canvas| {
        hatch(canvas, &dome, dice, 2.2, 2.8, &[RED, CREAM, WINE])
    });
    canvas.stroke(&dome, INK, 0.7);
    canvas.stroke(&Shape::line(&[(249.5, 76.0), (249.5, 71.0)]), GOLD, 0.8);
    canvas.stroke(&Shape::line(&[(247.7, 73.0), (251.3, 73.0)]), GOLD, 0.8);
    let tower = Shape::rectangle(274.0, 78.0, 9.5, 34.0);
    canvas.fill_with(&tower, CORAL, |canvas| {
        hatch(canvas, &tower, dice, 0.0, 2.0, &[WINE, CREAM, RED])
    });
    canvas.stroke(&tower, INK, 0.6);
    let spire = Shape::polygon(&[(272.8, 78.3), (278.3, 62.5), (284.7, 78.3)]);
    canvas.fill_with(&spire, NAVY, |canvas| {
        facets(canvas, &spire, dice, 3.0, &[SKY, GOLD, BLUE])
    });
    canvas.stroke(&spire, CREAM, 0.6);
    canvas.fill(&Shape::disc((278.7, 84.5), 3.7), CREAM);
    canvas.stroke(&Shape::disc((278.7, 84.5), 3.7), INK, 0.6);
    canvas.stroke(&Shape::line(&[(280.2, 82.6), (278.7, 84.5), (277.2, 83.2)]), INK, 0.6);
}

fn house(canvas: &mut Canvas, dice: &mut Dice, x: f32, foot: f32, width: f32, height: f32) {
    const PAINTS: [(Ink, Ink, Ink); 11] = [
        (CREAM, RED, NAVY),
        (CORAL, WINE, CREAM),
        (GOLD, BROWN, INK),
        (SKY, NAVY, CREAM),
        (PINK, MAGENTA, WINE),
        (NAVY, ORANGE, GOLD),
        (MINT, TEAL, FOREST),
        (RED, INK, SAND),
        (SAND, SEA, BLUE),
        (WINE, CORAL, GOLD),
        (ICE, PLUM, BLUE),
    ];
    let (wall_ink, roof_ink, window_ink) = PAINTS[dice.below(11)];
    let top = foot - height;
    let peak = dice.between(2.5, 6.5);
    let roof = match dice.below(6) {
        0 => Shape::polygon(&[
            (x - 0.6, top + 0.2),
            (x + width * dice.between(0.35, 0.65), top - peak),
            (x + width + 0.6, top + 0.2),
        ]),
        1 => Shape::polygon(&[
            (x - 0.6, top + 0.2),
            (x + 0.2 * width, top - peak),
            (x + 0.85 * width, top - peak),
            (x + width + 0.6, top + 0.2),
        ]),
        2 => Shape::ring_sector(
            (x + 0.5 * width, top + 0.2),
            (0.0, 0.5 * width),
            (std::f32::consts::PI, std::f32::consts::TAU),
        ),
        3 => Shape::polygon(&[
            (x, top + 0.2),
            (x, top - peak),
            (x + width, top - 0.3 * peak),
            (x + width, top + 0.2),
        ]),
        4 => Shape::polygon(&[
            (x, top + 0.2),
            (x + 0.5 * width, top - 1.9 * peak),
            (x + width, top + 0.2),
        ]),
        _ => Shape::rectangle(x - 0.4, top - 1.4, width + 0.8, 1.8),
    };
    if dice.chance(0.5) {
        let chimney = Shape::rectangle(x + width * dice.between(0.6, 0.8), top - peak - 1.5, 1.5, peak + 2.0);
        canvas.fill(&chimney, roof_ink);
        canvas.stroke(&chimney, INK, 0.4);
    }
    let wall = Shape::rectangle(x, top, width, height + 3.0);
    canvas.fill_with(&wall, wall_ink, |canvas| match dice.below(4) {
        0 => hatch(canvas, &wall, dice, 0.0, 1.5, &[roof_ink, window_ink]),
        1 => dots(canvas, &wall, dice, 2.4, &[roof_ink]),
        2 => {
            let half = Shape::rectangle(x + width * dice.between(0.45, 0.7), top, width, height + 3.0);
            canvas.fill(&half, roof_ink);
        }
        _ => {}
    });
    let columns = (width / dice.between(2.3, 3.8)).floor().max(1.0) as usize;
    let rows = (height / dice.between(3.2, 5.0)).floor().max(1.0) as usize;
    for row in 0..rows {
        for column in 0..columns {
            if dice.chance(0.15) {
                continue;
            }
            let centre = (
                x + width * (column as f32 + 0.5) / columns as f32,
                top + height * (row as f32 + 0.5) / rows as f32,
            );
            let (w, h) = (dice.between(0.8, 1.7), dice.between(1.2, 2.6));
            let frame = Shape::rectangle(centre.0 - 0.5 * w, centre.1 - 0.5 * h, w, h);
            match dice.below(4) {
                0 => canvas.fill(&Shape::disc(centre, 0.55 * w), window_ink),
                1 => {
                    canvas.fill(&frame, GOLD);
                    canvas.stroke(&frame, window_ink, 0.45);
                }
                2 => canvas.fill(
                    &leaf((centre.0, centre.1 + 0.6 * h), (centre.0, centre.1 - 0.8 * h), 0.55 * w),
                    window_ink,
                ),
                _ => canvas.fill(&frame, window_ink),
            }
        }
    }
    canvas.stroke(&wall, INK, 0.55);
    canvas.fill_with(&roof, roof_ink, |canvas| {
        any(canvas, &roof, dice, 0.75, &[wall_ink, window_ink])
    });
    canvas.stroke(&roof, INK, 0.55);
}

fn lighthouse(canvas: &mut Canvas) {
    let dice = &mut Dice::new(60);
    let rock = Shape::polygon(&[
        (172.0, 162.0),
        (176.0, 153.0),
        (182.0, 155.0),
        (186.0, 149.0),
        (194.0, 150.0),
        (199.0, 156.0),
        (206.0, 162.0),
    ]);
    canvas.fill_with(&rock, INK, |canvas| {
        facets(canvas, &rock, dice, 4.5, &[BROWN, PLUM, INK, VIOLET, NAVY])
    });
    canvas.stroke(&rock, INK, 0.7);
    let tower = Shape::polygon(&[(183.6, 152.0), (185.8, 115.0), (192.6, 115.0), (195.4, 152.0)]);
    canvas.fill_with(&tower, CREAM, |canvas| {
        let mut y = 116.0;
        while y < 152.0 {
            let (height, slant) = (dice.between(2.2, 5.4), dice.jitter(2.4));
            canvas.fill(
                &Shape::polygon(&[
                    (180.0, y + slant),
                    (198.0, y - slant),
                    (198.0, y - slant + height),
                    (180.0, y + slant + height),
                ]),
                dice.pick(&[RED, NAVY, RED, ORANGE]),
            );
            y += height + dice.between(1.8, 4.6);
        }
    });
    canvas.stroke(&tower, INK, 0.8);
    canvas.fill(&Shape::rectangle(184.4, 113.4, 9.6, 1.8), INK);
    canvas.fill(&Shape::rectangle(186.4, 108.4, 5.6, 5.0), GOLD);
    canvas.stroke(&Shape::rectangle(186.4, 108.4, 5.6, 5.0), INK, 0.7);
    canvas.fill(&Shape::polygon(&[(185.4, 108.6), (189.2, 104.0), (193.0, 108.6)]), RED);
    canvas.stroke(&arc((189.2, 105.5), 5.2, 3.6, 5.8), CREAM, 0.7);
}
