//! Random shapes of a mesh.

use super::capsule::capsule;
use super::edge_length_change;
use crate::deform::ControlPointDeformation;
use crate::deform::EdgeLengthChange;
use deepsft_geometry::glam::DVec3;
use rand::SeedableRng;
use rand_pcg::Pcg64Mcg;

#[test]
fn a_shape_that_stretches_too_much_is_weakened_or_given_up() {
    let tube = capsule(240.0, 20.0, 41, 16);
    let deformation = ControlPointDeformation::new(&tube).unwrap();
    let shape = |p95| {
        let most = EdgeLengthChange { median: 1.0, p95 };
        deformation.deform(most, &mut Pcg64Mcg::seed_from_u64(3))
    };
    let change = |vertices: &[DVec3]| edge_length_change(&tube, vertices).p95;
    let drawn = shape(1.0);
    assert!(change(&drawn) > 0.0);
    // A bound a little below what was drawn: one step weaker, or a few.
    let weaker = shape(0.9 * change(&drawn));
    assert!(
        (1e-6..0.9 * change(&drawn)).contains(&change(&weaker)),
        "{}",
        change(&weaker)
    );
    assert_eq!(shape(0.0), tube.vertices());
}
