//! What a bundle tells people, and its curve as a table.

use deepsft::{Accuracy, DeviceKind, FoundRule, ModelBundle, ModelCard, NetworkConfig, Provenance, R50FConfig};
use deepsft_geometry::{Picture, Template, training_camera};
use deepsft_network::{Network, start_device};
use deepsft_train::{CurvePoint, TrainingCourse, curve_csv, model_card};
use std::path::Path;

/// The card of a model of `template` that was trained along `curve`.
fn card(template: Template, curve: &[CurvePoint]) -> String {
    let (device, description) = pollster::block_on(start_device(DeviceKind::Cpu)).unwrap();
    let size_mm = template.size_mm().to_array();
    let network = NetworkConfig::new(
        deepsft::Architecture::R50F(R50FConfig::narrow(64)),
        size_mm,
        &training_camera(),
    );
    let card = ModelCard {
        name: "test".to_owned(),
        licence: Some("MIT OR Apache-2.0".to_owned()),
        found: FoundRule::default(),
        provenance: Provenance::default(),
        accuracy: Accuracy::default(),
    };
    let course = TrainingCourse {
        device: &description,
        training_images: None,
        curve,
        tuning: None,
        measured_images: Default::default(),
    };
    let bundle = ModelBundle::new(
        Network::new(&network, &device).folded(),
        template,
        training_camera(),
        card,
    );
    model_card(&bundle, &course)
}

fn texture() -> Picture {
    Picture::from_fn(4, 3, |_, _| [9; 3])
}

fn sheet() -> Template {
    Template::thin_shell(texture(), 200.0, 150.5).unwrap()
}

#[test]
fn the_curve_has_a_line_per_point_and_leaves_unknown_figures_empty() {
    let point = CurvePoint {
        samples: 64,
        seconds: 1.5,
        loss: 0.25,
        learning_rate: 0.001,
        depth_rmse_mm: Some(12.5),
        mask_iou: Some(0.0),
        ..CurvePoint::default()
    };
    let first = CurvePoint {
        loss: f64::NAN,
        ..point
    };
    let csv = curve_csv(&[point, first]);
    let lines: Vec<&str> = csv.lines().collect();
    assert_eq!(lines.len(), 3);
    assert_eq!(lines[1], "64,1.5,0.25,0.001,,12.5,0,");
    assert_eq!(lines[2], "64,1.5,,0.001,,12.5,0,");
    assert_eq!(lines[0].matches(',').count(), lines[1].matches(',').count());
    let card = card(sheet(), &[first, point]);
    assert!(card.contains("\n| 64 | 0.00 | - | - | 12.50 | 0.00 |\n"), "{card}");
}

#[test]
fn a_card_does_not_call_a_mesh_a_sheet() {
    let of_sheet = card(sheet(), &[]);
    assert!(
        of_sheet.contains("Finds one thin sheet of 200 x 150.5 mm (`template/texture.png`) in an image"),
        "{of_sheet}"
    );
    let folder = concat!(env!("CARGO_MANIFEST_DIR"), "/../../models/soft-toy/template");
    let toy = deepsft_formats::read_template(Path::new(folder)).unwrap();
    let of_toy = card(toy, &[]);
    assert!(
        !of_toy.contains("sheet") && of_toy.contains("200 x 302 x 103"),
        "{of_toy}"
    );
}
