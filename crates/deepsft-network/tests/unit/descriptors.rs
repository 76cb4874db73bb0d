//! The network that describes any picture, on burn and without.

use deepsft_geometry::Picture;
use deepsft_inference::{DESCRIPTOR_LENGTH, DescriptorExecutor, DescriptorSimilarities, DeviceKind};
use deepsft_network::{DescriptorNetwork, images_to_tensor, start_device};

/// Waves and edges.
fn picture() -> Picture {
    Picture::from_fn(600, 430, |x, y| {
        let wave = ((x * x + 3 * y * y) as f64 / 9000.0).sin();
        [(128.0 + 120.0 * wave) as u8, (x / 23 * 40) as u8, (y / 17 * 60) as u8]
    })
}

#[test]
fn descriptors_are_unit_vectors() {
    let (device, _) = pollster::block_on(start_device(DeviceKind::Cpu)).unwrap();
    let network = DescriptorNetwork::new(&device);
    let picture = picture();
    let image = images_to_tensor(&[&picture], &device);
    let descriptors = network.forward(image.clone());
    assert_eq!(descriptors.dims(), [1, DESCRIPTOR_LENGTH, 432 / 8, 608 / 8]);
    let lengths = descriptors.clone().square().sum_dim(1);
    assert!((lengths - 1.0).abs().max().into_scalar::<f32>() < 1e-4);
}

#[test]
fn the_executor_describes_as_burn_does() {
    let (device, _) = pollster::block_on(start_device(DeviceKind::Cpu)).unwrap();
    let network = DescriptorNetwork::new(&device);
    let picture = picture();
    let burn = network.forward(images_to_tensor(&[&picture], &device));
    let [_, d, rows, columns] = burn.dims();
    let burn = burn.reshape([d, rows * columns]).swap_dims(0, 1);
    let burn = burn.into_data().try_to_vec::<f32>().unwrap();
    let mut executor = DescriptorExecutor::new((600, 430), &network.folded_weights(), 2).unwrap();
    assert_eq!((executor.cells(), d), ((columns, rows), DESCRIPTOR_LENGTH));
    let ours = executor.describe(&picture).unwrap();
    assert_eq!(ours.len(), burn.len());
    let off = ours.iter().zip(&burn).map(|(a, b)| (a - b).abs()).fold(0.0, f32::max);
    assert!(off < 1e-4, "{off}");
    assert!(executor.describe(&Picture::from_fn(16, 16, |_, _| [0; 3])).is_err());
    // Seven with the first hundred of them, as their sums say.
    let others = ours[..100 * d].to_vec();
    for threads in [1, 2] {
        let mut similarities = DescriptorSimilarities::new(others.clone(), 9, threads).unwrap();
        let products: Vec<Vec<f32>> = similarities.of(&ours[50 * d..57 * d]).map(<[f32]>::to_vec).collect();
        assert_eq!(products.len(), 7);
        for (k, products) in products.iter().enumerate() {
            assert_eq!(products.len(), 100);
            for (other, product) in products.iter().enumerate() {
                let pairs = ours[(50 + k) * d..][..d].iter().zip(&others[other * d..][..d]);
                let expected: f32 = pairs.map(|(a, b)| a * b).sum();
                assert!((product - expected).abs() < 1e-5, "{product} {expected}");
            }
        }
    }
}
