//! The random choices of what paints prints.

use deepsft_geometry::glam::Vec3;
use deepsft_synth::random::between;
use rand::RngExt;

/// What paints prints.
pub type Dice = rand_pcg::Pcg64Mcg;

pub fn uniform(dice: &mut Dice, low: f32, high: f32) -> f32 {
    between([f64::from(low), f64::from(high)], dice) as f32
}

/// A uniform vector of a box, from its ends along each axis.
pub fn uniform_in(dice: &mut Dice, ends: [[f32; 2]; 3]) -> Vec3 {
    Vec3::from(ends.map(|[low, high]| uniform(dice, low, high)))
}

/// Width and height of a print, pixels: three in five are upright.
pub fn print_size(long_side: f32, dice: &mut Dice) -> (usize, usize) {
    let (long, short) = (long_side as usize, (long_side * uniform(dice, 0.6, 1.0)) as usize);
    if dice.random_bool(0.4) {
        (long, short)
    } else {
        (short, long)
    }
}
