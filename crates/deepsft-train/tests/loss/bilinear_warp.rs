//! The template seen through a registration.

use crate::loss::TexturePyramid;
use burn::tensor::{Device, Tensor};
use deepsft_geometry::Picture;

fn texture() -> Picture {
    Picture::from_fn(5, 4, |x, y| {
        [(40 * x) as u8, (60 * y) as u8, (x * x * 10 + 7 * y) as u8]
    })
}

fn warp(level: usize, uv: &[[f32; 2]]) -> Vec<f32> {
    let device = Device::flex();
    let values: Vec<f32> = [0, 1].iter().flat_map(|&k| uv.iter().map(move |c| c[k])).collect();
    let registration = Tensor::<1>::from_floats(values.as_slice(), &device).reshape([1, 2, 1, uv.len()]);
    TexturePyramid::new(&texture(), &device)
        .warp(level, registration)
        .into_data()
        .try_to_vec()
        .unwrap()
}

#[test]
fn the_warp_is_the_bilinear_sample_of_the_picture_inside_at_texels_and_beyond_the_edge() {
    let uv = [
        [0.5, 0.5],
        [0.3, 0.375],
        [0.13, 0.77],
        [-0.4, 0.2],
        [1.7, 1.2],
        [0.999, 0.001],
    ];
    let warped = warp(0, &uv);
    for (i, [u, v]) in uv.into_iter().enumerate() {
        let expected = texture().sample(f64::from(u) * 5.0, f64::from(v) * 4.0);
        for k in 0..3 {
            let actual = warped[k * uv.len() + i];
            assert!(
                (actual - expected[k]).abs() < 1e-3,
                "{u}, {v}: {actual} and {}",
                expected[k]
            );
        }
    }
}

#[test]
fn coarser_levels_lie_over_the_same_template() {
    // Level 1 is 2 x 2 texels; of the five columns the last is left out, so a texel is 2 / 5 of the width.
    let warped = warp(1, &[[0.2, 0.25], [0.6, 0.75]]);
    let level = texture().halved();
    for k in 0..3 {
        assert_eq!(warped[2 * k], f32::from(level.pixel(0, 0)[k]));
        assert_eq!(warped[2 * k + 1], f32::from(level.pixel(1, 1)[k]));
    }
    // Beyond the last level there is none.
    assert_eq!(warp(9, &[[0.9, 0.1]]), warp(2, &[[0.2, 0.8]]));
}
