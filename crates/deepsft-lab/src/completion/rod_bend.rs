//! Smooth bends of long objects.

use deepsft_geometry::glam::{DMat3, DQuat, DVec3};

/// Steps in which a bent axis is integrated.
const AXIS_STEPS: usize = 400;

/// A smooth bend of an object that is long in x: its axis becomes a curve whose curvature and twist change linearly
/// along it, its cross-sections stay as they are (a rod without shear). A flat sheet bent in one direction without
/// twist keeps its lengths exactly.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RodBend {
    /// Turn about (x, y, z) along the whole object, radians: twist, and bends up and sideways.
    pub turn_rad: DVec3,
    /// How much more of it is at the far end than in the middle, relative: 0 is an arc of a circle.
    pub growth: f64,
}

impl RodBend {
    /// The bent positions of `rest`, the middle of the axis where it was.
    pub fn apply(&self, rest: &[DVec3]) -> Vec<DVec3> {
        let low = rest.iter().map(|p| p.x).fold(f64::INFINITY, f64::min);
        let length = rest.iter().map(|p| p.x).fold(f64::NEG_INFINITY, f64::max) - low;
        if length.is_nan() || length <= 0.0 {
            return rest.to_vec();
        }
        let step = length / AXIS_STEPS as f64;
        // Turn per length at a fraction of the way.
        let turn = |fraction: f64| self.turn_rad / length * (1.0 + self.growth * (2.0 * fraction - 1.0));
        let mut axis = vec![(DVec3::new(low, 0.0, 0.0), DQuat::IDENTITY)];
        for k in 0..AXIS_STEPS {
            let fraction = (k as f64 + 0.5) / AXIS_STEPS as f64;
            axis.push(advance(axis[k], turn(fraction), step));
        }
        let middle = axis[AXIS_STEPS / 2];
        let back = DMat3::from_quat(middle.1.inverse());
        rest.iter()
            .map(|p| {
                let k = (((p.x - low) / step) as usize).min(AXIS_STEPS - 1);
                let along = p.x - low - k as f64 * step;
                let fraction = (k as f64 + 0.5) / AXIS_STEPS as f64;
                let (centre, frame) = advance(axis[k], turn(fraction), along);
                let bent = centre + frame * DVec3::new(0.0, p.y, p.z);
                back * (bent - middle.0) + DVec3::new(low + 0.5 * length, 0.0, 0.0)
            })
            .collect()
    }
}

/// A point of the axis and its frame, a piece of constant `turn` further on (exact up to the cube of the piece).
fn advance((centre, frame): (DVec3, DQuat), turn: DVec3, length: f64) -> (DVec3, DQuat) {
    let half = frame * DQuat::from_scaled_axis(0.5 * length * turn);
    let whole = frame * DQuat::from_scaled_axis(length * turn);
    (centre + length * (half * DVec3::X), whole.normalize())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_bend_in_one_direction_keeps_a_sheets_lengths_and_turns_its_ends_by_its_angle() {
        let rest: Vec<DVec3> = (0..=60)
            .flat_map(|i| [-1.0, 1.0].map(|y| DVec3::new(5.0 * f64::from(i) - 150.0, 100.0 * y, 0.0)))
            .collect();
        let bend = RodBend {
            turn_rad: DVec3::new(0.0, 1.5, 0.0),
            growth: 0.0,
        };
        let bent = bend.apply(&rest);
        for pair in bent.chunks_exact(2) {
            assert!((pair[0].distance(pair[1]) - 200.0).abs() < 1e-9);
        }
        // A chord of 5 mm on a circle of radius 300 / 1.5 = 200 mm is 5 (1 - (5 / 200)^2 / 24) mm long; the axis is made of
        // straight pieces of 0.75 mm, longer than their chords by a fraction of (0.75 / 200)^2 / 24 = 6e-7.
        for (a, b) in bent.iter().zip(&bent[2..]) {
            assert!((a.distance(*b) - 5.0 * (1.0 - 0.025_f64.powi(2) / 24.0)).abs() < 1e-5);
        }
        let (first, last) = (bent[2] - bent[0], bent[120] - bent[118]);
        let expected = 1.5 - 5.0 / 200.0;
        assert!((first.angle_between(last) - expected).abs() < 1e-5);
        assert!(bent[60].distance(rest[60]) < 1e-9, "the middle stays");
    }
}
