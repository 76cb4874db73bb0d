//! The default configuration is what the shipped models were trained on: its samples must not change by accident.

#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic)]

use deepsft_geometry::glam::DVec3;
use deepsft_geometry::{Picture, Template};
use deepsft_synth::{SynthConfig, Synthesizer};

/// Vertex 100, pixels of the template and mean grey level of samples 0 to 3 of seed 11, printed by the version before
/// cloth was added, in which they were part of no test.
const BEFORE: [(DVec3, usize, f64); 4] = [
    (
        DVec3::new(-361.271_368_169, -140.308_173_990, 598.571_404_226),
        20_187,
        85.689_118,
    ),
    (
        DVec3::new(-404.669_393_290, -92.817_310_295, 771.870_657_898),
        12_812,
        159.322_559,
    ),
    (
        DVec3::new(-66.351_850_889, -50.518_257_397, 527.735_556_222),
        28_732,
        104.640_954,
    ),
    (
        DVec3::new(38.976_887_533, -151.458_978_710, 451.011_324_442),
        25_925,
        58.314_249,
    ),
];

#[test]
fn the_default_configuration_still_draws_what_it_drew() {
    let texture = Picture::from_fn(420, 297, |x, y| {
        let cell = (x / 20 * 7 + y / 20 * 13) % 11;
        [(x / 2) as u8, (255 - y / 2) as u8, (cell * 23) as u8]
    });
    let template = Template::thin_shell(texture, 297.0, 210.0).unwrap();
    // Poses were turned by at most 45 degrees then; everything else is as it was.
    let mut config = SynthConfig::default();
    config.pose.max_roll_deg = 45.0;
    let synthesizer = Synthesizer::new(&template, config).unwrap();
    for (index, (vertex, area, mean)) in (0..).zip(BEFORE) {
        let sample = synthesizer.sample(11, index);
        // Libraries of elementary functions differ in the last bits, which forty sweeps of relaxation spread.
        assert!(sample.vertices_camera[100].distance(vertex) < 1e-4, "sample {index}");
        assert!(sample.truth.area().abs_diff(area) <= 2, "sample {index}");
        let values = sample.image.rgb();
        let level = values.iter().map(|&value| f64::from(value)).sum::<f64>() / values.len() as f64;
        assert!((level - mean).abs() < 0.01, "sample {index}: {level}");
    }
}
