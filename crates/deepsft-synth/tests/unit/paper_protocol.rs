//! The ranges of the paper's section 5.1.

use crate::random::{Stream, generator};
use crate::scene::pose::sample_pose;
use crate::{PhotographUse, SynthConfig, Synthesizer};
use deepsft_formats::encode_png;
use deepsft_geometry::glam::{DMat3, DVec3};
use deepsft_geometry::{Picture, Template, training_camera};
use std::fs;

fn a4() -> Template {
    let texture = Picture::from_fn(60, 42, |x, y| [4 * x as u8, 6 * y as u8, 90]);
    Template::thin_shell(texture, 297.0, 210.0).unwrap()
}

#[test]
fn poses_fill_the_papers_ranges_and_keep_them() {
    let (template, config) = (a4(), SynthConfig::paper());
    let (mut low, mut high) = (DVec3::INFINITY, DVec3::NEG_INFINITY);
    let (mut least, mut most) = (DVec3::INFINITY, DVec3::NEG_INFINITY);
    for index in 0..2000 {
        let mut rng = generator(1, index, Stream::Shape);
        let pose = sample_pose(&training_camera(), template.mesh().vertices(), &config.pose, &mut rng);
        (low, high) = (low.min(pose.translation), high.max(pose.translation));
        // R = Rx(a) Ry(b) Rz(c): its third column is (sin b, -sin a cos b, cos a cos b), its first row
        // (cos b cos c, -cos b sin c, sin b).
        let matrix: DMat3 = pose.matrix3;
        let b = matrix.z_axis.x.asin();
        let a = (-matrix.z_axis.y).atan2(matrix.z_axis.z);
        let c = (-matrix.y_axis.x).atan2(matrix.x_axis.x);
        let angles = DVec3::new(a, b, c).map(f64::to_degrees);
        (least, most) = (least.min(angles), most.max(angles));
    }
    let within = |value: DVec3, bound: DVec3, slack: f64| (value - bound).abs().max_element() < slack;
    // The ends of 2000 draws are within 1 % of the ranges' ends but where drawing again cuts corners off.
    assert!(within(low, DVec3::new(-150.0, -150.0, 400.0), 10.0), "{low}");
    assert!(within(high, DVec3::new(150.0, 150.0, 900.0), 10.0), "{high}");
    assert!(low.cmpge(DVec3::new(-150.0, -150.0, 400.0) - 1e-9).all());
    assert!(high.cmple(DVec3::new(150.0, 150.0, 900.0) + 1e-9).all());
    assert!(
        within(least, DVec3::splat(-45.0), 2.0) && least.min_element() > -45.0 - 1e-9,
        "{least}"
    );
    assert!(
        within(most, DVec3::splat(45.0), 2.0) && most.max_element() < 45.0 + 1e-9,
        "{most}"
    );
}

#[test]
fn every_frame_shows_the_sheet_under_a_light_near_the_axis() {
    let synthesizer = Synthesizer::new(&a4(), SynthConfig::paper()).unwrap();
    for index in 0..30 {
        let sample = synthesizer.sample(3, index);
        assert!(sample.has_template, "{index}");
        let angle = sample.towards_light.angle_between(DVec3::NEG_Z).to_degrees();
        // Single precision: the light is a unit vector to 1e-7, an angle to 3e-4 rad at worst near 0.
        assert!(angle <= 10.0 + 0.02, "{angle}");
    }
}

#[test]
fn a_small_part_of_the_image_is_all_that_discs_hide() {
    // At most 4 discs of 10 px in diameter: 314 px^2 and their pixelated outlines.
    let with = Synthesizer::new(&a4(), SynthConfig::paper()).unwrap();
    let mut hidden = 0;
    for index in 0..40 {
        let sample = with.sample(4, index);
        let whole = with.render_clean(sample.vertices_camera.clone()).unwrap().truth;
        let covered = whole.area() - sample.truth.area();
        assert!(covered < 400, "{covered}");
        hidden += usize::from(covered > 0);
    }
    // Two discs on average; the sheet covers about a quarter of the image.
    assert!((5..38).contains(&hidden), "{hidden} of 40");
}

#[test]
fn a_photograph_stands_behind_the_sheet_as_it_is() {
    let photograph = Picture::from_fn(480, 270, |x, y| [(x / 2) as u8, (y * 2 / 3 + 20) as u8, 77]);
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("room.png");
    fs::write(&file, encode_png(&photograph).unwrap()).unwrap();
    let mut config = SynthConfig::paper();
    config.effects.gain = [1.0, 1.0];
    let behind = |photographs: PhotographUse| {
        let config = SynthConfig {
            photographs,
            ..config.clone()
        };
        let synthesizer = Synthesizer::new(&a4(), config).unwrap();
        let sample = synthesizer.with_photographs(vec![file.clone()]).unwrap().sample(6, 0);
        let outside: Vec<usize> = (0..480 * 270).filter(|&pixel| !sample.truth.inside(pixel)).collect();
        let same = outside.iter().filter(|&&pixel| {
            let seen = &sample.image.rgb()[3 * pixel..3 * pixel + 3];
            let there = &photograph.rgb()[3 * pixel..3 * pixel + 3];
            // Through linear light and back.
            seen.iter().zip(there).all(|(a, b)| a.abs_diff(*b) <= 1)
        });
        same.count() as f64 / outside.len() as f64
    };
    // The others are discs (at most 314 pixels), edges and what is seen of the sheet's back.
    let fraction = behind(PhotographUse::Plain);
    assert!(fraction > 0.98, "{fraction}");
    assert!(behind(PhotographUse::Varied) < 0.5);
}

#[test]
fn gain_is_the_only_thing_the_camera_does() {
    let config = SynthConfig::paper();
    let mut plain = config.clone();
    plain.effects.gain = [1.0, 1.0];
    let (with, without) = (Synthesizer::new(&a4(), config), Synthesizer::new(&a4(), plain));
    let (with, without) = (with.unwrap().sample(5, 2).image, without.unwrap().sample(5, 2).image);
    // The ratio of linear light is the same in all pixels that are neither clipped nor too dark to tell.
    // All bytes that are compared are above the curve's linear part (IEC 61966-2-1).
    let light = |byte: u8| ((f32::from(byte) / 255.0 + 0.055) / 1.055).powf(2.4);
    let ratios: Vec<f32> = with
        .rgb()
        .iter()
        .zip(without.rgb())
        .filter(|(a, b)| **a < 250 && **b < 250 && **b > 120)
        .map(|(&a, &b)| light(a) / light(b))
        .collect();
    let mean = ratios.iter().sum::<f32>() / ratios.len() as f32;
    assert!((0.9..=1.1).contains(&mean) && (mean - 1.0).abs() > 0.002, "{mean}");
    // Half a byte of 120 either side is 0.9 % of the light each.
    assert!(ratios.iter().all(|ratio| (ratio / mean - 1.0).abs() < 0.025));
}
