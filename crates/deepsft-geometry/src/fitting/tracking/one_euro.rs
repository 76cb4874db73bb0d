//! Smoothing that is strong when still and weak in motion.

use glam::DVec3;
use std::f64::consts::TAU;

/// Cut-off frequency of the speed itself, Hz, as in the paper.
const SPEED_CUTOFF_HZ: f64 = 1.0;

/// Cut-offs of the [`OneEuro`] filter.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct OneEuroOptions {
    /// Cut-off frequency of a vertex at rest, Hz: lower is steadier. Default 2: at 30 frames per second
    /// noise is halved.
    pub min_cutoff_hz: f64,
    /// How much the cut-off rises with a vertex's speed, Hz per mm/s: higher lags less. Default 0.1: a hand's 300 mm/s
    /// passes with a lag of 5 ms, which is 1.5 mm.
    pub speed_coefficient: f64,
}

impl Default for OneEuroOptions {
    fn default() -> Self {
        Self {
            min_cutoff_hz: 2.0,
            speed_coefficient: 0.1,
        }
    }
}

/// The One-Euro filter (Casiez, Roussel and Vogel 2012) for vertices: a low-pass whose cut-off rises with speed. All
/// three coordinates of a vertex share one cut-off, so the result does not depend on the axes.
///
/// ```
/// use deepsft_geometry::{glam::DVec3, tracking::{OneEuro, OneEuroOptions}};
/// let mut filter = OneEuro::new(OneEuroOptions::default());
/// let mut noisy = vec![DVec3::ZERO];
/// filter.smooth(0.0, &mut noisy);
/// let mut noisy = vec![DVec3::X];
/// filter.smooth(1.0 / 30.0, &mut noisy);
/// assert!(noisy[0].x > 0.0 && noisy[0].x < 1.0);
/// ```
#[derive(Clone, Debug)]
pub struct OneEuro {
    options: OneEuroOptions,
    last: Option<State>,
}

#[derive(Clone, Debug)]
struct State {
    time_s: f64,
    vertices: Vec<DVec3>,
    /// Smoothed, mm/s.
    velocities: Vec<DVec3>,
}

impl OneEuro {
    /// A filter that has seen nothing.
    pub fn new(options: OneEuroOptions) -> Self {
        Self { options, last: None }
    }

    /// Forgets what it has seen: the next frame passes unchanged. For a track that is lost or starts again.
    pub fn reset(&mut self) {
        self.last = None;
    }

    /// Smooths the `vertices` (mm) of the frame at `time_s` in place. The first frame, one that does not come after the last,
    /// and one with another number of vertices pass unchanged and start afresh.
    pub fn smooth(&mut self, time_s: f64, vertices: &mut [DVec3]) {
        let usable = |last: &State| last.vertices.len() == vertices.len() && time_s > last.time_s;
        let Some(last) = self.last.as_mut().filter(|last| usable(last)) else {
            self.last = Some(State {
                time_s,
                vertices: vertices.to_vec(),
                velocities: vec![DVec3::ZERO; vertices.len()],
            });
            return;
        };
        let step = time_s - last.time_s;
        last.time_s = time_s;
        let of_speed = fraction(SPEED_CUTOFF_HZ, step);
        for ((vertex, smooth), velocity) in vertices.iter_mut().zip(&mut last.vertices).zip(&mut last.velocities) {
            *velocity += of_speed * ((*vertex - *smooth) / step - *velocity);
            let cutoff = self.options.min_cutoff_hz + self.options.speed_coefficient * velocity.length();
            *smooth += fraction(cutoff, step) * (*vertex - *smooth);
            *vertex = *smooth;
        }
    }
}

/// Fraction of the new value in an exponential average with this cut-off.
fn fraction(cutoff_hz: f64, step_s: f64) -> f64 {
    let turned = TAU * cutoff_hz * step_s;
    turned / (turned + 1.0)
}
