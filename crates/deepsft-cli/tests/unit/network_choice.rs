//! Networks by their names.

use crate::network_choice::NetworkChoice;
use clap::ValueEnum;
use deepsft::{Architecture, PaperConfig};
use deepsft_geometry::training_camera;

#[test]
fn every_network_has_a_config_that_can_be_made_and_only_some_can_be_narrow() {
    let config = |choice: NetworkChoice, divisor| choice.config(divisor, [297.0, 210.0], &training_camera());
    for (choice, name) in [
        (NetworkChoice::Compact, "compact"),
        (NetworkChoice::Paper, "paper"),
        (NetworkChoice::R50f, "r50f"),
    ] {
        let whole = config(choice, 1).unwrap();
        assert_eq!((whole.architecture.name(), whole.check()), (name, Ok(())));
        assert_eq!(choice.to_possible_value().unwrap().get_name(), name);
    }
    let narrow = config(NetworkChoice::Paper, 8).unwrap();
    assert_eq!(narrow.architecture, Architecture::Paper(PaperConfig::narrow(8)));
    assert!(config(NetworkChoice::Compact, 8).is_err());
}
