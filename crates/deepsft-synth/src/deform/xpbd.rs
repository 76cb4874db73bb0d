//! Constraints of extended position-based dynamics (Macklin, Müller and Chentanez 2016): each moves its particles by
//! equation (18) there, delta lambda = -C / (sum of w |grad C|^2 + compliance / dt^2), masses 1 / w.

use deepsft_geometry::glam::DVec3;

/// A distance that is kept.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Link {
    pub(crate) ends: [usize; 2],
    pub(crate) rest: f64,
    /// Inverse of its stiffness: mm per unit of force.
    pub(crate) compliance: f64,
}

/// A weighted sum of particles that is zero where the sheet is flat; the energy is its square.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Bend<const COUNT: usize> {
    pub(crate) particles: [usize; COUNT],
    pub(crate) weights: [f64; COUNT],
    pub(crate) compliance: f64,
}

impl Link {
    /// Moves both ends. `scale` is one over the square of the step, s^-2; multipliers begin at zero in every step, which
    /// has one sweep.
    #[inline]
    pub(crate) fn solve(&self, positions: &mut [DVec3], inverse_masses: &[f64], scale: f64) {
        let [a, b] = self.ends;
        let (w_a, w_b) = (inverse_masses[a], inverse_masses[b]);
        let edge = positions[b] - positions[a];
        let length = edge.length();
        let resistance = w_a + w_b + self.compliance * scale;
        // Two held particles have no say, nor have two in one place.
        if w_a + w_b == 0.0 || length == 0.0 {
            return;
        }
        let correction = edge * ((length - self.rest) / (length * resistance));
        positions[a] += correction * w_a;
        positions[b] -= correction * w_b;
    }
}

impl<const COUNT: usize> Bend<COUNT> {
    #[inline]
    fn combination(&self, positions: &[DVec3]) -> DVec3 {
        let terms = self.particles.iter().zip(self.weights);
        terms.map(|(&particle, weight)| positions[particle] * weight).sum()
    }

    /// Moves the particles: the three coordinates of the combination are constraints of the same gradient.
    #[inline]
    pub(crate) fn solve(&self, positions: &mut [DVec3], inverse_masses: &[f64], scale: f64) {
        let mobilities: [f64; COUNT] = std::array::from_fn(|k| inverse_masses[self.particles[k]] * self.weights[k]);
        let give: f64 = mobilities.iter().zip(self.weights).map(|(m, weight)| m * weight).sum();
        let multiplier = self.combination(positions) / (give + self.compliance * scale);
        for (particle, mobility) in self.particles.into_iter().zip(mobilities) {
            positions[particle] -= multiplier * mobility;
        }
    }

    #[cfg(test)]
    pub(crate) fn energy(&self, positions: &[DVec3]) -> f64 {
        self.combination(positions).length_squared() / (2.0 * self.compliance)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_stiff_link_moves_its_ends_together_by_their_mobilities_and_none_that_is_held() {
        let mut positions = [DVec3::ZERO, DVec3::X * 14.0];
        let link = Link {
            ends: [0, 1],
            rest: 10.0,
            compliance: 0.0,
        };
        link.solve(&mut positions, &[0.0, 0.0], 1e6);
        assert_eq!(positions, [DVec3::ZERO, DVec3::X * 14.0]);
        link.solve(&mut positions, &[3.0, 1.0], 1e6);
        assert!(positions[0].distance(DVec3::X * 3.0) < 1e-12 && positions[1].distance(DVec3::X * 13.0) < 1e-12);
    }

    #[test]
    fn compliance_is_what_implicit_integration_of_a_spring_makes_of_it() {
        // A unit mass on a spring of stiffness k: one implicit step from an extension x ends at x / (1 + k dt^2).
        let (stiffness, step, extension) = (250.0, 0.05, 2.0);
        let mut positions = [DVec3::ZERO, DVec3::Y * (1.0 + extension)];
        let link = Link {
            ends: [0, 1],
            rest: 1.0,
            compliance: 1.0 / stiffness,
        };
        link.solve(&mut positions, &[0.0, 1.0], 1.0 / (step * step));
        let expected = extension / (1.0 + stiffness * step * step);
        assert!((positions[1].y - 1.0 - expected).abs() < 1e-12, "{}", positions[1].y);
    }
}
