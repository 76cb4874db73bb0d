//! sRGB and linear light, and random colours.

use deepsft_geometry::glam::Vec3;
use rand::{Rng, RngExt};
use std::sync::LazyLock;

/// Linear light (0 to 1) of each sRGB byte (IEC 61966-2-1).
static LINEAR: LazyLock<[f32; 256]> =
    LazyLock::new(|| std::array::from_fn(|byte| linear_from_srgb(byte as f32 / 255.0)));

/// Entries of [`SRGB`] less one. The table is indexed by the square root of the light, so its steps are even
/// to the eye: half a step is below half a byte everywhere.
const SRGB_STEPS: f32 = 4095.0;

static SRGB: LazyLock<Vec<u8>> = LazyLock::new(|| {
    (0..=SRGB_STEPS as usize)
        .map(|i| (255.0 * srgb_from_linear((i as f32 / SRGB_STEPS).powi(2))).round() as u8)
        .collect()
});

/// Linear light of an sRGB value, both 0 to 1.
pub(crate) fn linear_from_srgb(value: f32) -> f32 {
    if value <= 0.040_45 {
        value / 12.92
    } else {
        ((value + 0.055) / 1.055).powf(2.4)
    }
}

/// sRGB value of linear light, both 0 to 1.
pub(crate) fn srgb_from_linear(light: f32) -> f32 {
    if light <= 0.003_130_8 {
        12.92 * light
    } else {
        1.055 * light.powf(1.0 / 2.4) - 0.055
    }
}

/// Linear light (0 to 1) of an sRGB colour in bytes.
pub(crate) fn linear_from_srgb8(color: [u8; 3]) -> Vec3 {
    let table = &*LINEAR;
    Vec3::from_array(color.map(|byte| table[usize::from(byte)]))
}

/// sRGB bytes of linear light, clipped to 0 to 1.
pub fn srgb8_from_linear(light: Vec3) -> [u8; 3] {
    let table = &*SRGB;
    let byte = |x: f32| table[(x.clamp(0.0, 1.0).sqrt() * SRGB_STEPS + 0.5) as i32 as usize];
    [byte(light.x), byte(light.y), byte(light.z)]
}

/// A uniform colour of the cube, squared towards darker light as most things are.
pub fn any_color<R: Rng + ?Sized>(rng: &mut R) -> Vec3 {
    let color = Vec3::from_array(rng.random());
    color * color
}

/// A colour of the given `saturation` (0 grey, 1 pure) and `value` at a random hue, in linear light.
pub(crate) fn vivid_color<R: Rng + ?Sized>(rng: &mut R, saturation: f32, value: f32) -> Vec3 {
    let hue = rng.random_range(0.0..3.0_f32);
    let wave = |k: f32| (1.5 - (hue - k).abs().min(3.0 - (hue - k).abs()) * 1.5).clamp(0.0, 1.0);
    let pure = Vec3::new(wave(0.0), wave(1.0), wave(2.0));
    Vec3::ONE.lerp(pure, saturation) * value
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_byte_survives_the_way_to_light_and_back() {
        for byte in 0..=255 {
            assert_eq!(srgb8_from_linear(linear_from_srgb8([byte; 3])), [byte; 3]);
        }
    }

    #[test]
    fn mid_grey_is_a_fifth_of_the_light() {
        // IEC 61966-2-1: byte 119 reflects 18.4 %.
        assert!((linear_from_srgb8([119; 3]).x - 0.184).abs() < 0.001);
    }
}
