//! Devices by name.

use burn::tensor::Tensor;
use deepsft_inference::DeviceKind;
use deepsft_network::start_device;
use pollster::block_on;

#[test]
fn the_cpu_starts_and_adds() {
    let (device, description) = block_on(start_device(DeviceKind::Cpu)).unwrap();
    assert_eq!((description.kind, description.software), (DeviceKind::Cpu, false));
    let sum = Tensor::<1>::from_floats([1.0, 2.0, 4.0], &device)
        .sum()
        .into_scalar::<f32>();
    assert_eq!(sum, 7.0);
}

#[test]
#[cfg(not(any(feature = "webgpu", feature = "vulkan", feature = "cuda")))]
fn a_gpu_that_the_build_lacks_is_refused_with_the_features_name() {
    for kind in [DeviceKind::WebGpu, DeviceKind::Vulkan, DeviceKind::Cuda] {
        let error = block_on(start_device(kind)).unwrap_err().to_string();
        assert!(error.contains(&format!("feature `{kind}`")), "{error}");
    }
}

#[test]
fn devices_are_named_as_people_type_them() {
    for name in ["cpu", "webgpu", "vulkan", "cuda"] {
        assert_eq!(name.parse::<DeviceKind>().unwrap().to_string(), name);
    }
    let error = "tpu".parse::<DeviceKind>().unwrap_err().to_string();
    assert!(error.contains("tpu") && error.contains("vulkan"), "{error}");
}
