//! Ornaments that fill a region: hatching, dots, confetti, contours, scallops, facets, plots, zigzags.
//!
//! None repeats itself: every stroke throws its own dice for place, width, length, turn and ink.

use super::canvas::{Canvas, Dice, Ink, Point, Shape, turned, unit};
use std::f32::consts::{PI, TAU};

/// Centre and half diagonal of what a shape covers.
fn extent(region: &Shape) -> (Point, f32) {
    let (left, top, right, bottom) = region.bounds();
    (
        ((left + right) / 2.0, (top + bottom) / 2.0),
        0.5 * (right - left).hypot(bottom - top),
    )
}

/// Broken, slightly wavy strokes along `angle`, about `spacing` mm apart.
pub(super) fn hatch(canvas: &mut Canvas, region: &Shape, dice: &mut Dice, angle: f32, spacing: f32, inks: &[Ink]) {
    let (centre, reach) = extent(region);
    let mut offset = -reach;
    while offset < reach {
        let (phase, period) = (dice.between(0.0, TAU), dice.between(9.0, 30.0));
        let sway = spacing * dice.between(0.1, 0.5);
        let mut start = -reach - dice.between(0.0, 10.0);
        while start < reach {
            let end = start + dice.between(4.0, 26.0);
            let points: Vec<Point> = (0..=8)
                .map(|i| {
                    let along = start + (end - start) * i as f32 / 8.0;
                    turned(
                        centre,
                        angle,
                        (along, offset + sway * (phase + TAU * along / period).sin()),
                    )
                })
                .collect();
            let width = spacing * dice.between(0.18, 0.52);
            canvas.stroke(&Shape::curve(&points), dice.pick(inks), width);
            start = end + width + dice.between(0.4, 2.6);
        }
        offset += spacing * dice.between(0.65, 1.5);
    }
}

/// Discs and rings of many sizes on a jittered lattice `spacing` mm apart.
pub(super) fn dots(canvas: &mut Canvas, region: &Shape, dice: &mut Dice, spacing: f32, inks: &[Ink]) {
    scatter(region, dice, spacing, |dice, centre| {
        let radius = spacing * dice.between(0.12, 0.46);
        let ink = dice.pick(inks);
        if dice.chance(0.3) {
            canvas.stroke(&Shape::disc(centre, radius), ink, (0.4 * radius).max(0.25));
        } else {
            canvas.fill(&Shape::disc(centre, radius), ink);
        }
    });
}

/// Calls `draw` at the points of a turned, jittered lattice that covers the region.
pub(super) fn scatter(region: &Shape, dice: &mut Dice, spacing: f32, mut draw: impl FnMut(&mut Dice, Point)) {
    let (left, top, right, bottom) = region.bounds();
    let (centre, reach) = extent(region);
    let angle = dice.between(0.0, PI);
    let steps = (reach / spacing).ceil() as i32;
    for row in -steps..=steps {
        for column in -steps..=steps {
            let lattice = (
                spacing * (column as f32 + 0.5 * (row & 1) as f32 + dice.jitter(0.32)),
                spacing * (row as f32 + dice.jitter(0.32)),
            );
            let point = turned(centre, angle, lattice);
            let inside = point.0 > left - spacing
                && point.0 < right + spacing
                && point.1 > top - spacing
                && point.1 < bottom + spacing;
            if inside {
                draw(dice, point);
            }
        }
    }
}

/// Small signs of ten kinds (stars, crosses, leaves, arcs, ...), each with its own turn and size.
pub(super) fn confetti(canvas: &mut Canvas, region: &Shape, dice: &mut Dice, spacing: f32, inks: &[Ink]) {
    scatter(region, dice, spacing, |dice, centre| {
        let kind = dice.below(10);
        let size = spacing * dice.between(0.24, 0.5);
        let (angle, ink) = (dice.between(0.0, TAU), dice.pick(inks));
        sign(canvas, kind, centre, size, angle, ink);
    });
}

/// One small sign of radius `size` mm.
pub(super) fn sign(canvas: &mut Canvas, kind: usize, centre: Point, size: f32, angle: f32, ink: Ink) {
    let at = |x: f32, y: f32| turned(centre, angle, (size * x, size * y));
    let thin = (0.3 * size).max(0.3);
    match kind {
        0 => canvas.fill(&star(centre, size, 0.42 * size, 5, angle), ink),
        1 => {
            canvas.stroke(&Shape::line(&[at(-0.9, 0.0), at(0.9, 0.0)]), ink, thin);
            canvas.stroke(&Shape::line(&[at(0.0, -0.9), at(0.0, 0.9)]), ink, thin);
        }
        2 => canvas.fill(&Shape::polygon(&[at(1.0, 0.0), at(-0.6, 0.8), at(-0.6, -0.8)]), ink),
        3 => canvas.fill(&leaf(at(-1.0, 0.0), at(1.0, 0.0), 0.5 * size), ink),
        4 => canvas.stroke(&arc(centre, 0.8 * size, angle, angle + 3.6), ink, thin),
        5 => canvas.fill(&Shape::ring_sector(centre, (0.0, size), (angle, angle + PI)), ink),
        6 => canvas.stroke(
            &Shape::line(&[at(-1.0, 0.4), at(-0.4, -0.5), at(0.2, 0.5), at(0.9, -0.5)]),
            ink,
            thin,
        ),
        7 => canvas.fill(&star(centre, size, 0.3 * size, 4, angle), ink),
        8 => canvas.stroke(&Shape::line(&[at(-1.0, 0.0), at(1.0, 0.0)]), ink, 1.3 * thin),
        _ => canvas.fill(&Shape::disc(centre, 0.6 * size), ink),
    }
}

/// A star polygon.
pub(super) fn star(centre: Point, outer: f32, inner: f32, points: usize, angle: f32) -> Shape {
    let corners: Vec<Point> = (0..2 * points)
        .map(|i| {
            let radius = if i % 2 == 0 { outer } else { inner };
            turned(centre, angle, unit(i as f32 / (2 * points) as f32, radius, radius))
        })
        .collect();
    Shape::polygon(&corners)
}

/// A circular arc, as a line.
pub(super) fn arc(centre: Point, radius: f32, from: f32, to: f32) -> Shape {
    let points: Vec<Point> = (0..=12)
        .map(|i| {
            let angle = from + (to - from) * i as f32 / 12.0;
            (centre.0 + radius * angle.cos(), centre.1 + radius * angle.sin())
        })
        .collect();
    Shape::curve(&points)
}

/// A pointed leaf from stem to tip.
pub(super) fn leaf(stem: Point, tip: Point, half_width: f32) -> Shape {
    let (dx, dy) = (tip.0 - stem.0, tip.1 - stem.1);
    let length = dx.hypot(dy);
    let angle = dy.atan2(dx);
    let side = |sign: f32| -> Vec<Point> {
        (0..=10)
            .map(|i| {
                let t = i as f32 / 10.0;
                turned(stem, angle, (t * length, sign * half_width * (PI * t.powf(0.8)).sin()))
            })
            .collect()
    };
    let mut outline = side(1.0);
    outline.extend(side(-1.0).into_iter().rev());
    Shape::polygon(&outline)
}

/// Wobbly closed curves around `centre`, as in the grain of wood or the heights of a map.
pub(super) fn contours(
    canvas: &mut Canvas,
    region: &Shape,
    dice: &mut Dice,
    centre: Point,
    spacing: f32,
    inks: &[Ink],
) {
    let (middle, reach) = extent(region);
    let farthest = reach + (centre.0 - middle.0).hypot(centre.1 - middle.1);
    let waves: [(f32, f32, f32); 4] = std::array::from_fn(|k| {
        (
            dice.between(0.02, 0.16) / (1.0 + 0.4 * k as f32),
            dice.between(0.0, TAU),
            (k + 2) as f32,
        )
    });
    let drift = dice.jitter(0.03);
    let mut radius = spacing * 0.6;
    while radius < 1.25 * farthest {
        let points: Vec<Point> = (0..48)
            .map(|i| {
                let angle = TAU * i as f32 / 48.0;
                let wobble: f32 = waves
                    .iter()
                    .map(|(a, phase, k)| a * (k * angle + phase + drift * radius).sin())
                    .sum();
                (
                    centre.0 + radius * (1.0 + wobble) * angle.cos(),
                    centre.1 + radius * (1.0 + wobble) * angle.sin(),
                )
            })
            .collect();
        canvas.stroke(
            &Shape::blob(&points),
            dice.pick(inks),
            spacing * dice.between(0.2, 0.55),
        );
        radius += spacing * dice.between(0.7, 1.4);
    }
}

/// Rows of fans as on fish or roofs, each fan with its own size and inks.
pub(super) fn scallops(canvas: &mut Canvas, region: &Shape, dice: &mut Dice, angle: f32, size: f32, inks: &[Ink]) {
    let (centre, reach) = extent(region);
    let rows = (reach / (0.55 * size)).ceil() as i32;
    for row in -rows..=rows {
        let mut along = -reach - dice.between(0.0, size);
        while along < reach {
            let radius = size * dice.between(0.42, 0.75);
            let place = turned(
                centre,
                angle,
                (along, 0.55 * size * row as f32 + dice.jitter(0.1 * size)),
            );
            canvas.fill(&Shape::disc(place, radius), dice.pick(inks));
            canvas.fill(&Shape::disc(place, radius * dice.between(0.35, 0.75)), dice.pick(inks));
            if dice.chance(0.5) {
                canvas.fill(&Shape::disc(place, radius * dice.between(0.12, 0.3)), dice.pick(inks));
            }
            along += size * dice.between(0.75, 1.15);
        }
    }
}

/// Triangles of a jittered lattice, each in an ink of its own, some missing.
pub(super) fn facets(canvas: &mut Canvas, region: &Shape, dice: &mut Dice, cell: f32, inks: &[Ink]) {
    let (left, top, right, bottom) = region.bounds();
    let columns = ((right - left) / cell).ceil() as usize + 2;
    let rows = ((bottom - top) / cell).ceil() as usize + 2;
    let lattice: Vec<Point> = (0..(columns + 1) * (rows + 1))
        .map(|i| {
            let (row, column) = (i / (columns + 1), i % (columns + 1));
            (
                left + cell * (column as f32 - 0.8 + dice.jitter(0.38)),
                top + cell * (row as f32 - 0.8 + dice.jitter(0.38)),
            )
        })
        .collect();
    for row in 0..rows {
        for column in 0..columns {
            let i = row * (columns + 1) + column;
            let corners = [
                lattice[i],
                lattice[i + 1],
                lattice[i + columns + 2],
                lattice[i + columns + 1],
            ];
            let triangles = if dice.chance(0.5) {
                [[0, 1, 2], [0, 2, 3]]
            } else {
                [[0, 1, 3], [1, 2, 3]]
            };
            for triangle in triangles {
                if dice.chance(0.75) {
                    // The thin outline closes the seam that anti-aliasing leaves between neighbours.
                    let (facet, ink) = (Shape::polygon(&triangle.map(|k| corners[k])), dice.pick(inks));
                    canvas.fill(&facet, ink);
                    canvas.stroke(&facet, ink, 0.2);
                }
            }
        }
    }
}

/// Fields seen from the air: an uneven subdivision into plots, each sown differently.
pub(super) fn plots(canvas: &mut Canvas, region: &Shape, dice: &mut Dice, angle: f32, size: f32, inks: &[Ink]) {
    let (centre, reach) = extent(region);
    let mut open = vec![(-reach, -reach, reach, reach)];
    while let Some((left, top, right, bottom)) = open.pop() {
        let (width, height) = (right - left, bottom - top);
        if width.max(height) > size * dice.between(1.1, 2.2) {
            let fraction = dice.between(0.3, 0.7);
            if width > height {
                let cut = left + fraction * width;
                open.extend([(left, top, cut, bottom), (cut, top, right, bottom)]);
            } else {
                let cut = top + fraction * height;
                open.extend([(left, top, right, cut), (left, cut, right, bottom)]);
            }
            continue;
        }
        let corners = [(left, top), (right, top), (right, bottom), (left, bottom)].map(|p| turned(centre, angle, p));
        let plot = Shape::polygon(&corners);
        let soil = dice.below(inks.len());
        canvas.fill(&plot, inks[soil]);
        let middle = turned(centre, angle, ((left + right) / 2.0, (top + bottom) / 2.0));
        let furrows = dice.below(3);
        let ink = inks[(soil + 1 + dice.below(inks.len() - 1)) % inks.len()];
        let span = dice.between(0.9, 1.7);
        let count = (height / span) as usize;
        for i in 0..count {
            let y = top + height * (i as f32 + 0.5) / count as f32;
            match furrows {
                0 => {
                    let ends = [(left + 0.4, y), (right - 0.4, y + dice.jitter(0.3))].map(|p| turned(centre, angle, p));
                    canvas.stroke(&Shape::line(&ends), ink, span * dice.between(0.25, 0.5));
                }
                1 => {
                    let mut x = left + 0.6;
                    while x < right - 0.3 {
                        canvas.fill(
                            &Shape::disc(turned(centre, angle, (x, y)), dice.between(0.22, 0.6)),
                            ink,
                        );
                        x += span * dice.between(0.9, 1.5);
                    }
                }
                2 if i % 2 == 0 => {
                    let radius = 0.5 * width.min(height) * (1.0 - i as f32 / count as f32);
                    canvas.stroke(&Shape::disc(middle, radius), ink, 0.45);
                }
                _ => {}
            }
        }
        canvas.stroke(&plot, dice.pick(inks), 0.35);
    }
}

/// Rows of zigzag with peaks of uneven height.
pub(super) fn zigzag(canvas: &mut Canvas, region: &Shape, dice: &mut Dice, angle: f32, spacing: f32, inks: &[Ink]) {
    let (centre, reach) = extent(region);
    let mut offset = -reach;
    while offset < reach {
        let mut points = Vec::new();
        let mut along = -reach;
        let mut side = 1.0;
        while along < reach {
            points.push(turned(
                centre,
                angle,
                (along, offset + side * spacing * dice.between(0.1, 0.55)),
            ));
            along += spacing * dice.between(0.4, 1.3);
            side = -side;
        }
        canvas.stroke(
            &Shape::line(&points),
            dice.pick(inks),
            spacing * dice.between(0.16, 0.4),
        );
        offset += spacing * dice.between(0.8, 1.5);
    }
}

/// Branches that fork until they are `shortest` mm long, with a bud at each end.
pub(super) fn branches(
    canvas: &mut Canvas,
    dice: &mut Dice,
    root: Point,
    angle: f32,
    length: f32,
    shortest: f32,
    inks: &[Ink],
) {
    let tip = turned(root, angle, (length, 0.0));
    let middle = turned(root, angle, (0.5 * length, length * dice.jitter(0.14)));
    canvas.stroke(&Shape::curve(&[root, middle, tip]), inks[0], (0.17 * length).max(0.5));
    if length < shortest {
        canvas.fill(&Shape::disc(tip, dice.between(0.6, 1.3)), dice.pick(&inks[1..]));
        return;
    }
    let forks = 2 + dice.below(2);
    for fork in 0..forks {
        let turn = (fork as f32 - 0.5 * (forks - 1) as f32) * dice.between(0.5, 0.9) + dice.jitter(0.15);
        let shorter = length * dice.between(0.6, 0.84);
        branches(canvas, dice, tip, angle + turn, shorter, shortest, inks);
    }
}

/// One of the ornaments above, chosen by the dice: how long runs of similar regions stay different.
pub(super) fn any(canvas: &mut Canvas, region: &Shape, dice: &mut Dice, scale: f32, inks: &[Ink]) {
    let angle = dice.between(0.0, PI);
    let (centre, reach) = extent(region);
    match dice.below(7) {
        0 => hatch(canvas, region, dice, angle, 1.1 * scale, inks),
        1 => dots(canvas, region, dice, 1.7 * scale, inks),
        2 => confetti(canvas, region, dice, 2.3 * scale, inks),
        3 => {
            let focus = (centre.0 + dice.jitter(reach), centre.1 + dice.jitter(reach));
            contours(canvas, region, dice, focus, 1.3 * scale, inks);
        }
        4 => zigzag(canvas, region, dice, angle, 1.7 * scale, inks),
        5 => facets(canvas, region, dice, 2.2 * scale, inks),
        _ => scallops(canvas, region, dice, angle, 2.6 * scale, inks),
    }
}
