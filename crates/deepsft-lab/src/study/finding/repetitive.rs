//! Prints that look the same in many places: checks, dots and rows of one motif.

use super::dice::{Dice, print_size, uniform};
use deepsft_geometry::Picture;
use deepsft_geometry::glam::Vec2;
use rand::RngExt;

/// Longer side, pixels.
const LONG_SIDE: f32 = 720.0;

/// A repetitive print and its kind. `number` chooses the kind, the dice everything else.
pub fn repetitive(number: usize, dice: &mut Dice) -> (&'static str, Picture) {
    let (width, height) = print_size(LONG_SIDE, dice);
    let size = Vec2::new(width as f32, height as f32);
    let color = |dice: &mut Dice| -> [u8; 3] { std::array::from_fn(|_| dice.random_range(0..=255)) };
    let (paper, ink): ([u8; 3], [u8; 3]) = ([245; 3], color(dice).map(|c| c / 2));
    let cell = uniform(dice, 40.0, 90.0);
    let margin = uniform(dice, 0.0, 0.5) * cell;
    // What stands in each cell, and how it differs.
    let [discs, marks]: [Vec<(Vec2, f32, [u8; 3])>; 2] = std::array::from_fn(|_| {
        let count = dice.random_range(5..10);
        (0..count)
            .map(|_| {
                let at = Vec2::new(uniform(dice, 0.2, 0.8), uniform(dice, 0.2, 0.8));
                (at, uniform(dice, 0.04, 0.2), color(dice))
            })
            .collect()
    });
    let salt: u64 = dice.random();
    let changed = |cell: Vec2, share: f32| {
        let mixed = deepsft_synth::random::mix((cell.x as u64) << 20 ^ cell.y as u64 ^ salt);
        ((mixed >> 40) as f32 / (1_u64 << 24) as f32) < share
    };
    let ink_where = |is_ink: bool| if is_ink { ink } else { paper };
    let check = |cell: Vec2| ink_where((cell.x + cell.y) as i64 % 2 == 0);
    let motif = |within: Vec2, discs: &[(Vec2, f32, [u8; 3])]| {
        let mut over = discs.iter().rev();
        over.find(|(at, radius, _)| within.distance(*at) < *radius)
            .map_or(paper, |disc| disc.2)
    };
    let paint = |cell: Vec2, within: Vec2| match number % 5 {
        0 => check(cell),
        1 if changed(cell, 0.12) => discs[0].2,
        1 => check(cell),
        2 => ink_where(within.distance(Vec2::splat(0.5)) < 0.3),
        3 => motif(within, &discs),
        _ => {
            let mark = marks
                .iter()
                .enumerate()
                .find(|(k, _)| changed(cell * 3.0 + *k as f32, 0.15));
            let own = mark.filter(|(_, (at, radius, _))| within.distance(*at) < *radius);
            own.map_or_else(|| motif(within, &discs), |(_, mark)| mark.2)
        }
    };
    let names = [
        "checks",
        "checks with odd ones",
        "dots",
        "rows of one motif",
        "rows with differences",
    ];
    let picture = Picture::from_fn(width, height, |x, y| {
        let p = Vec2::new(x as f32 + 0.5, y as f32 + 0.5);
        if p.min(size - p).min_element() < margin {
            return paper;
        }
        let at = (p - margin) / cell;
        paint(at.floor(), at - at.floor())
    });
    (names[number % names.len()], picture)
}
