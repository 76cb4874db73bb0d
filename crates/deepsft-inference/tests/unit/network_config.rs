//! Descriptions of networks.

use deepsft_geometry::training_camera;
use deepsft_inference::{Architecture, CompactConfig, NetworkConfig, PaperConfig, R50FConfig};

/// As it stands in a `model.json`.
const COMPACT: &str = r#"{"architecture": "compact",
    "channels": [32, 48, 96, 160], "blocks_at_32": 2, "bins": [32, 24, 24],
    "refinement_channels": 32, "mask_channels": 24, "template_size_mm": [297.0, 210.0],
    "focal": 380.0, "principal_point": [240.0, 135.0],
    "depth_range": {"near_mm": 150.0, "far_mm": 1200.0}}"#;

#[test]
fn a_description_is_read_with_its_layers_beside_the_other_fields() {
    let read: NetworkConfig = serde_json::from_str(COMPACT).unwrap();
    assert_eq!(read, NetworkConfig::compact([297.0, 210.0], &training_camera()));
}

#[test]
fn every_architecture_comes_back_from_its_description() {
    let camera = training_camera();
    for architecture in [
        Architecture::Compact(CompactConfig::default()),
        Architecture::Paper(PaperConfig::default()),
        Architecture::R50F(R50FConfig::default()),
    ] {
        let config = NetworkConfig::new(architecture, [297.0, 210.0], &camera);
        let json = serde_json::to_value(&config).unwrap();
        assert_eq!(json["architecture"], config.architecture.name());
        assert_eq!(serde_json::from_value::<NetworkConfig>(json).unwrap(), config);
    }
}

#[test]
fn an_unknown_or_missing_architecture_and_a_missing_field_are_named() {
    let refusal = |from: &str, to: &str| {
        assert!(COMPACT.contains(from));
        let json = COMPACT.replacen(from, to, 1);
        serde_json::from_str::<NetworkConfig>(&json).unwrap_err().to_string()
    };
    let unknown = refusal("compact", "vgg");
    assert!(unknown.contains("vgg") && unknown.contains("r50f"), "{unknown}");
    let nameless = refusal(r#""architecture": "compact","#, "");
    assert!(nameless.contains("architecture"), "{nameless}");
    let missing = refusal(r#""blocks_at_32": 2,"#, "");
    assert!(missing.contains("blocks_at_32"), "{missing}");
    let other = refusal("compact", "paper");
    assert!(other.contains("width_divisor"), "{other}");
}
