//! Which deformations of a sheet are drawn, and how strong they are.

use crate::deform::relaxation::EdgeLengthChange;
use crate::random::between;
use rand::Rng;
use serde::Serialize;

/// The kinds of shapes that are drawn.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum DeformationFamily {
    /// Nearly flat with slight waves.
    Wavy,
    /// One generalised cylinder or cone over the whole sheet, of random smooth curvature.
    Cylinder,
    /// Two to four smooth bends over strips in different directions that do not cross.
    Bends,
    /// One or more narrow folds that do not cross.
    Folds,
    /// One to four corners curled.
    CornerCurls,
    /// Several of these at once, crossing, with waves.
    Mixed,
    /// A simulated sheet, held and moved at random places, pulled and blown at.
    Cloth,
}

impl DeformationFamily {
    /// All families, in the order of [`DeformationConfig::family_weights`].
    pub(crate) const ALL: &[Self] = &[
        Self::Wavy,
        Self::Cylinder,
        Self::Bends,
        Self::Folds,
        Self::CornerCurls,
        Self::Mixed,
        Self::Cloth,
    ];
}

/// What deformations are drawn. Ranges are `[least, most]` and drawn uniformly; sheets may be
/// of any size.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct DeformationConfig {
    /// How often each family is drawn, relative to each other: wavy, cylinder, bends, folds, corner curls, mixed, cloth.
    /// Default 1, 3, 2, 2, 2, 3, and 0 for cloth, which the shipped models have not seen.
    pub family_weights: [f64; 7],
    /// Angle in radians of a bend over a strip or of a corner curl. Default 0.2 to 1.6.
    pub strip_bend_rad: [f64; 2],
    /// Most radians by which a corner is turned against the sheet's centre. Default 2.5; above pi
    /// sheets roll up and cut through themselves.
    pub max_turn_rad: f64,
    /// Sweeps of the relaxation. Default 40; fewer leave edges longer or shorter around folds and
    /// where bends cross.
    pub relaxation_sweeps: usize,
    /// Bounds on the relative change of edge lengths. Default median 1 %, 95th percentile 3 %; a
    /// deformation beyond them is drawn weaker. Of a template that is no sheet those of a stuffed toy, 2 % and 10 %; with 0 it is not bent.
    pub max_edge_change: EdgeLengthChange,
}

impl Default for DeformationConfig {
    fn default() -> Self {
        Self {
            family_weights: [1.0, 3.0, 2.0, 2.0, 2.0, 3.0, 0.0],
            strip_bend_rad: [0.2, 1.6],
            max_turn_rad: 2.5,
            relaxation_sweeps: 40,
            max_edge_change: EdgeLengthChange {
                median: 0.01,
                p95: 0.03,
            },
        }
    }
}

impl DeformationConfig {
    /// A family, drawn by its weight.
    pub(crate) fn draw_family<R: Rng + ?Sized>(&self, rng: &mut R) -> DeformationFamily {
        let weights = &self.family_weights;
        let mut left = between([0.0, weights.iter().sum()], rng);
        for (family, weight) in DeformationFamily::ALL.iter().copied().zip(weights) {
            left -= weight;
            if left < 0.0 {
                return family;
            }
        }
        DeformationFamily::Cylinder
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::SeedableRng;
    use rand_pcg::Pcg64Mcg;

    #[test]
    fn families_are_drawn_as_often_as_their_weights_say() {
        let mut rng = Pcg64Mcg::seed_from_u64(1);
        let config = DeformationConfig {
            family_weights: [1.0, 0.0, 2.0, 0.0, 0.0, 0.0, 1.0],
            ..DeformationConfig::default()
        };
        let mut counts = [0; 7];
        for _ in 0..4000 {
            let family = config.draw_family(&mut rng);
            counts[DeformationFamily::ALL.iter().position(|f| *f == family).unwrap()] += 1;
        }
        assert_eq!([counts[1], counts[3], counts[4], counts[5]], [0; 4]);
        // Five standard deviations of a binomial count of 4000 are at most 158.
        for (count, expected) in [(counts[0], 1000), (counts[2], 2000), (counts[6], 1000)] {
            assert!(i32::abs(count - expected) < 158, "{counts:?}");
        }
    }
}
