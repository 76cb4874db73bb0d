//! How large an R50F a description may ask for.

use deepsft_geometry::training_camera;
use deepsft_inference::{Architecture, NetworkConfig, R50FConfig};

#[test]
fn no_description_asks_for_more_than_half_as_much_again_as_the_papers() {
    let checked = |width_divisor, neurons| {
        let shape = R50FConfig {
            width_divisor,
            neurons,
            ..R50FConfig::default()
        };
        NetworkConfig::new(Architecture::R50F(shape), [297.0, 210.0], &training_camera()).check()
    };
    for (divisor, neurons) in [(1, 200), (1, 300), (8, 1024)] {
        checked(divisor, neurons).unwrap();
    }
    for (divisor, neurons) in [(1, 301), (1, 1024), (2, 1024)] {
        let refusal = checked(divisor, neurons).unwrap_err().to_string();
        assert!(
            refusal.contains("neurons is") && refusal.contains("at most"),
            "{refusal}"
        );
    }
    // 9 x 15 x 2048 values and one to 301 neurons, those and one to 3 x 270 x 480 values.
    let values = 276_481 * 301 + 302 * 388_800;
    assert!(
        checked(1, 301)
            .unwrap_err()
            .to_string()
            .contains(&format!("{values} values"))
    );
    assert!(checked(1, usize::MAX).is_err() && checked(0, 200).is_err());
}
