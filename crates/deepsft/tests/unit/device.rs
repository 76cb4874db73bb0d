//! Devices that networks run on.

use deepsft::{Device, DeviceKind, start_device};
use pollster::block_on;

#[test]
fn the_processor_starts() {
    let (device, description) = block_on(start_device(DeviceKind::Cpu)).unwrap();
    assert!(matches!(device, Device::Cpu));
    assert_eq!((description.kind, description.software), (DeviceKind::Cpu, false));
}

#[test]
fn devices_for_training_are_refused_and_say_what_to_use() {
    for kind in [DeviceKind::Vulkan, DeviceKind::Cuda] {
        let error = block_on(start_device(kind)).unwrap_err().to_string();
        assert!(error.contains(kind.name()) && error.contains("webgpu"), "{error}");
    }
}

#[test]
#[cfg(not(feature = "webgpu"))]
fn a_gpu_that_the_build_lacks_is_refused_with_the_features_name() {
    let error = block_on(start_device(DeviceKind::WebGpu)).unwrap_err().to_string();
    assert!(error.contains("feature `webgpu`"), "{error}");
}
