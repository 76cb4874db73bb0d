//! Prints like photographs, made by code: landscapes, cities, still lifes, leaves and pebbles, with texture at all sizes, soft
//! shadows, haze, limited depth of field and grain.

mod clutter;
mod exposure;
mod land;
mod still_life;

use super::dice::{Dice, print_size};
use deepsft_geometry::Picture;
use exposure::Exposure;

/// Longer side, pixels.
const LONG_SIDE: f32 = 840.0;

/// A painted photograph and what it shows. `number` chooses the subject, the dice everything else.
pub fn photograph_like(number: usize, dice: &mut Dice) -> (&'static str, Picture) {
    let (width, height) = print_size(LONG_SIDE, dice);
    let mut exposure = Exposure::black(width, height);
    type Subject = fn(&mut Exposure, &mut Dice);
    let subjects: [(&'static str, Subject); 5] = [
        ("land", land::landscape),
        ("still life", still_life::still_life),
        ("leaves", clutter::leaves),
        ("city", land::city),
        ("pebbles", clutter::pebbles),
    ];
    let (name, paint) = subjects[number % subjects.len()];
    paint(&mut exposure, dice);
    (name, exposure.developed(dice))
}
