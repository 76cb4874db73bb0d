//! Colours for numbers.

use crate::output::color_map::ColorMap;

#[test]
fn the_ends_and_the_middle_are_those_of_matplotlib() {
    assert_eq!(ColorMap::Viridis.color(0.0), [0x44, 0x01, 0x54]);
    assert_eq!(ColorMap::Viridis.color(0.5), [0x21, 0x91, 0x8c]);
    assert_eq!(ColorMap::Viridis.color(7.0), [0xfd, 0xe7, 0x25]);
    assert_eq!(ColorMap::Inferno.color(1.0), [0xfc, 0xff, 0xa4]);
    assert_eq!(ColorMap::Inferno.color(f64::NAN), ColorMap::Inferno.color(0.0));
}

#[test]
fn brightness_rises_with_the_value() {
    for map in [ColorMap::Viridis, ColorMap::Inferno] {
        let brightness = |i: u32| {
            let [r, g, b] = map.color(f64::from(i) / 50.0).map(f64::from);
            0.2126 * r + 0.7152 * g + 0.0722 * b
        };
        assert!((0..50).all(|i| brightness(i + 1) > brightness(i)), "{map:?}");
    }
}
