//! The paper's loss of step 1 by hand.

use crate::loss::supervised_maps_loss;
use burn::tensor::{Device, Tensor};
use deepsft_network::NetworkMaps;

#[test]
fn the_terms_by_hand() {
    let map = |values: &[f32], channels: usize| -> Tensor<4> {
        Tensor::<1>::from_floats(values, &Device::flex()).reshape([1, channels, 1, 2])
    };
    // The object in the first pixel, nothing in the second.
    let (depth, registration) = (map(&[0.0, -1.0], 1), map(&[0.0, -1.0, 0.25, -1.0], 2));
    let right = NetworkMaps {
        main_depth: depth.clone(),
        main_registration: registration.clone(),
        depth: depth.clone(),
        registration: registration.clone(),
        mask_logits: map(&[0.0, 0.0], 1),
    };
    let main_depth = map(&[0.5, -1.0], 1);
    let main_registration = map(&[0.25, 0.0, 0.75, -1.0], 2);
    let wrong_depth = map(&[0.25, -1.0], 1);
    let wrong_registration = map(&[0.0, -1.0, 0.5, -1.0], 2);
    let all_wrong = NetworkMaps {
        main_depth: main_depth.clone(),
        main_registration: main_registration.clone(),
        depth: wrong_depth.clone(),
        registration: wrong_registration.clone(),
        ..right.clone()
    };
    // Two pixels; registration errors (0, 0.25) and (0.25, 0.5; 1, 0).
    for (maps, expected) in [
        (
            NetworkMaps {
                depth: wrong_depth,
                ..right.clone()
            },
            0.0625 / 2.0,
        ),
        (
            NetworkMaps {
                main_depth,
                ..right.clone()
            },
            0.25 / 2.0,
        ),
        (
            NetworkMaps {
                registration: wrong_registration,
                ..right.clone()
            },
            0.5 * 0.0625 / 2.0,
        ),
        (
            NetworkMaps {
                main_registration,
                ..right.clone()
            },
            0.5 * (0.0625 + 0.25 + 1.0) / 2.0,
        ),
        (all_wrong, 0.03125 + 0.125 + 0.015625 + 0.328125),
        (right, 0.0),
    ] {
        let loss = supervised_maps_loss(&maps, &depth, &registration);
        assert_eq!(loss.into_scalar::<f32>(), expected);
    }
}
