//! Depth in millimetres and as the network has it.

use deepsft_inference::DepthRange;

#[test]
fn both_measures_of_depth_come_back_and_end_at_the_ends_of_the_range() {
    let range = DepthRange::default();
    for z in [150.0, 333.0, 1200.0] {
        assert!((range.depth_mm(range.normalise(z)) - z).abs() < 1e-9);
        assert!((range.depth_mm_linear(range.normalise_linear(z)) - z).abs() < 1e-9);
    }
    assert_eq!(
        (range.normalise_linear(150.0), range.normalise_linear(1200.0)),
        (0.0, 1.0)
    );
}
