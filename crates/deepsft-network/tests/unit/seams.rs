//! Up-sampling of a registration that jumps at seams.

use burn::tensor::{Device, Tensor};
use deepsft::NetworkConfig;
use deepsft_geometry::training_camera;
use deepsft_network::{CompactNetwork, Network};

#[test]
fn charts_are_not_mixed_and_one_chart_is_as_smooth_as_without_seams() {
    // u = 0.1, 0.14, 0.8, 0.84 along x: a seam between the second and the third cell; v and d rise evenly.
    let device = Device::flex();
    let config = NetworkConfig::compact([200.0, 100.0], &training_camera()).with_seams();
    let Network::Compact(network) = Network::new(&config, &device) else {
        panic!("not a compact network")
    };
    let u = [0.1, 0.14, 0.8, 0.84];
    let mut values = vec![0.0_f32; 3 * 2 * 4];
    for row in 0..2 {
        for column in 0..4 {
            values[row * 4 + column] = u[column];
            values[8 + row * 4 + column] = 0.02 * column as f32;
            values[16 + row * 4 + column] = 0.3 * column as f32;
        }
    }
    let cells: Tensor<4> = Tensor::<1>::from_floats(values.as_slice(), &device).reshape([1, 3, 2, 4]);
    let read = |tensor: Tensor<4>| tensor.into_data().try_to_vec::<f32>().unwrap();
    let across = read(network.upsample(cells.clone()));
    let smooth = read(CompactNetwork::at_pixels(cells));
    let at = |values: &[f32], channel: usize, x: usize| values[(channel * 16 + 5) * 32 + x];
    for x in 0..32 {
        // The seam's pixels lie between the centres of the cells: 12 and 20.
        let expected = match x {
            12..16 => 0.14,
            16..20 => 0.8,
            _ => at(&smooth, 0, x),
        };
        let u = at(&across, 0, x);
        assert!((u - expected).abs() < 1e-6, "u at {x}: {u}");
        assert_eq!(at(&across, 2, x), at(&smooth, 2, x), "d at {x}");
    }
    // 0.1 at 4, 0.14 at 12, linear between.
    assert!((at(&across, 0, 8) - (0.1 + 0.04 * 4.5 / 8.0)).abs() < 1e-6);
}
