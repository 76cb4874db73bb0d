//! The noise of the simulated depth camera.

use crate::random::{Stream, generator};
use crate::recording::depth_camera::{self, SeenDepth, deviation_mm};

const WIDTH: usize = 200;

fn wall(depth_mm: f64, angle_deg: f64) -> Vec<SeenDepth> {
    let cosine = f64::to_radians(angle_deg).cos();
    vec![SeenDepth { depth_mm, cosine }; WIDTH * WIDTH]
}

fn measure(seen: &[SeenDepth]) -> Vec<u16> {
    depth_camera::measure(seen, WIDTH, &mut generator(1, 2, Stream::DepthNoise))
}

#[test]
fn a_wall_is_measured_with_the_deviation_of_the_fit() {
    // At 1 m, frontal: 1.5 - 0.5 + 0.3 = 1.3 mm. At 2 m and 60 degrees: 1.5 - 1 + 1.2 + 0.1 * 2.828 * (60 / 30)^2 =
    // 2.831 mm. Rounding to 1 mm adds a variance of 1/12 mm^2.
    for (depth, angle, expected) in [(1000.0, 0.0, 1.3), (2000.0, 60.0, 2.831_37)] {
        assert!((deviation_mm(depth, f64::to_radians(angle).cos()) - expected).abs() < 1e-4);
        let measured: Vec<f64> = measure(&wall(depth, angle))
            .into_iter()
            .filter(|&units| units > 0)
            .map(f64::from)
            .collect();
        let count = measured.len() as f64;
        assert!((count / 40_000.0 - 0.998).abs() < 1e-3, "dropouts: {count}");
        let mean = measured.iter().sum::<f64>() / count;
        let deviation = (measured.iter().map(|d| (d - mean).powi(2)).sum::<f64>() / count).sqrt();
        assert!((mean - depth).abs() < 0.06, "{mean}");
        assert!((deviation / (expected * expected + 1.0 / 12.0).sqrt() - 1.0).abs() < 0.02);
    }
}

#[test]
fn at_an_edge_some_pixels_are_lost_and_some_fly_between_the_surfaces() {
    let mut seen = wall(1500.0, 0.0);
    for row in 0..WIDTH {
        seen[row * WIDTH..row * WIDTH + 100].fill(SeenDepth {
            depth_mm: 700.0,
            cosine: 1.0,
        });
    }
    let measured = measure(&seen);
    let column = |x: usize| (0..WIDTH).map(move |row| row * WIDTH + x).map(|i| measured[i]);
    let holes = column(99).chain(column(100)).filter(|&d| d == 0).count() as f64 / 400.0;
    let flying = column(99)
        .chain(column(100))
        .filter(|d| (720..1480).contains(d))
        .count() as f64
        / 400.0;
    // 400 pixels: deviations of 0.025 and 0.023. Flying ones within 20 mm of a surface are not told apart.
    assert!((holes - 0.45).abs() < 0.08, "{holes}");
    assert!((flying - 0.29).abs() < 0.08, "{flying}");
    assert!(column(90).all(|d| d == 0 || d.abs_diff(700) < 10));
}

#[test]
fn grazing_and_too_near_surfaces_measure_nothing() {
    assert!(measure(&wall(1000.0, 81.0)).iter().all(|&d| d == 0));
    assert!(measure(&wall(450.0, 0.0)).iter().all(|&d| d == 0));
    assert!(measure(&wall(f64::INFINITY, 0.0)).iter().all(|&d| d == 0));
}
