//! Random shapes of a mesh.

use super::capsule::capsule;
use super::edge_length_change;
use crate::deform::ControlPointDeformation;
use crate::edge_lengths::EdgeLengthChange;
use rand::SeedableRng;
use rand_pcg::Pcg64Mcg;

/// Below the strength of the last try, 0.6^5 = 0.078.
const WEAKEST: f64 = 0.07;

#[test]
fn a_shape_says_whether_it_was_weakened_or_given_up() {
    let tube = capsule(240.0, 20.0, 41, 16);
    let deformation = ControlPointDeformation::new(&tube).unwrap();
    let shape = |p95| {
        let most = EdgeLengthChange { median: 1.0, p95 };
        deformation.deform(most, &mut Pcg64Mcg::seed_from_u64(3))
    };
    let drawn = shape(1.0);
    assert_eq!(drawn.1, 1.0);
    // A bound a little below what was drawn: one step weaker, or a few.
    let weaker = shape(0.9 * edge_length_change(&tube, &drawn.0).p95);
    assert!((0.0..1.0).contains(&weaker.1) && weaker.1 >= WEAKEST);
    assert_ne!(weaker.0, tube.vertices());
    let given_up = shape(0.0);
    assert_eq!((given_up.1, given_up.0.as_slice()), (0.0, tube.vertices()));
}
