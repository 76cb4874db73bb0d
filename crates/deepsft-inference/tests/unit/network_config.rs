//! Descriptions of networks.

use deepsft_geometry::training_camera;
use deepsft_inference::NetworkConfig;

/// As it stands in the `model.json` of bundles made before there were other architectures.
const WITHOUT_ARCHITECTURE: &str = r#"{
    "channels": [32, 48, 96, 160], "blocks_at_32": 2, "bins": [32, 24, 24],
    "refinement_channels": 32, "mask_channels": 24, "template_size_mm": [297.0, 210.0],
    "focal": 380.0, "principal_point": [240.0, 135.0],
    "depth_range": {"near_mm": 150.0, "far_mm": 1200.0}}"#;

#[test]
fn a_description_without_an_architecture_is_of_a_compact_network() {
    let read: NetworkConfig = serde_json::from_str(WITHOUT_ARCHITECTURE).unwrap();
    assert_eq!(read, NetworkConfig::compact([297.0, 210.0], &training_camera()));
}

#[test]
fn every_architecture_comes_back_from_its_description() {
    let camera = training_camera();
    for config in [
        NetworkConfig::compact([297.0, 210.0], &camera),
        NetworkConfig::paper([297.0, 210.0], &camera),
        NetworkConfig::r50f([297.0, 210.0], &camera),
    ] {
        let json = serde_json::to_value(&config).unwrap();
        assert_eq!(json["architecture"], config.architecture.name());
        assert_eq!(serde_json::from_value::<NetworkConfig>(json).unwrap(), config);
    }
}

#[test]
fn an_unknown_architecture_and_a_missing_field_are_named() {
    let refusal = |from: &str, to: &str| {
        assert!(WITHOUT_ARCHITECTURE.contains(from));
        let json = WITHOUT_ARCHITECTURE.replacen(from, to, 1);
        serde_json::from_str::<NetworkConfig>(&json).unwrap_err().to_string()
    };
    let unknown = refusal("{", r#"{"architecture": "vgg","#);
    assert!(unknown.contains("vgg") && unknown.contains("r50f"), "{unknown}");
    let missing = refusal(r#""blocks_at_32": 2,"#, "");
    assert!(missing.contains("blocks_at_32"), "{missing}");
    let other = refusal("{", r#"{"architecture": "paper","#);
    assert!(other.contains("width_divisor"), "{other}");
}
