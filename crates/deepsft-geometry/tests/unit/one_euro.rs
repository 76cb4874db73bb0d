//! The One-Euro filter.

use deepsft_geometry::glam::DVec3;
use deepsft_geometry::tracking::{OneEuro, OneEuroOptions};

const FRAME_S: f64 = 1.0 / 30.0;

/// Root mean square of what `signal` (mm at frame k) leaves after the filter beside `truth`, after a second.
fn error(signal: impl Fn(usize) -> f64, truth: impl Fn(usize) -> f64) -> f64 {
    let mut filter = OneEuro::new(OneEuroOptions::default());
    let mut squares = 0.0;
    for k in 0..120 {
        let mut vertices = [DVec3::new(0.0, signal(k), 500.0)];
        filter.smooth(k as f64 * FRAME_S, &mut vertices);
        if k >= 30 {
            squares += (vertices[0].y - truth(k)).powi(2);
        }
    }
    (squares / 90.0_f64).sqrt()
}

/// Alternating noise with some irregularity, about 1 mm.
fn noise(k: usize) -> f64 {
    if (k * 7 + k * k).is_multiple_of(3) { 1.0 } else { -0.7 }
}

#[test]
fn noise_of_a_vertex_at_rest_is_halved_and_motion_hardly_lags() {
    let still = error(noise, |_| 0.0);
    assert!(still < 0.55 * error_of_noise(), "{still}");
    // 300 mm/s: a lag of 5 ms.
    let moving = |k: usize| 10.0 * k as f64;
    let lag_mm = error(moving, moving);
    assert!(lag_mm < 2.0, "{lag_mm}");
}

fn error_of_noise() -> f64 {
    ((30..120).map(|k| noise(k).powi(2)).sum::<f64>() / 90.0).sqrt()
}

#[test]
fn a_reset_a_step_back_in_time_and_another_mesh_start_afresh() {
    let mut filter = OneEuro::new(OneEuroOptions::default());
    filter.smooth(1.0, &mut [DVec3::ZERO]);
    for (time_s, reset) in [(1.1, true), (1.0, false)] {
        if reset {
            filter.reset();
        }
        let mut vertices = [DVec3::X];
        filter.smooth(time_s, &mut vertices);
        assert_eq!(vertices, [DVec3::X]);
    }
    let mut two = [DVec3::Y; 2];
    filter.smooth(2.0, &mut two);
    assert_eq!(two, [DVec3::Y; 2]);
}
