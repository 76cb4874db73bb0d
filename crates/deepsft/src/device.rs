//! Devices that networks run on: the processor everywhere, a GPU where the build and the machine have one.

use crate::error::DeepSftError;
use deepsft_inference::{DeviceDescription, DeviceKind};

/// A started device.
#[derive(Clone, Debug)]
#[non_exhaustive]
pub enum Device {
    /// The processor.
    Cpu,
    /// A GPU: the browser's WebGPU, natively what the platform offers best.
    #[cfg(feature = "webgpu")]
    WebGpu(deepsft_inference::Gpu),
}

/// Starts a device for networks to run on.
///
/// ```
/// use deepsft::{DeviceKind, start_device};
/// let (_device, description) = pollster::block_on(start_device(DeviceKind::Cpu))?;
/// assert!(!description.software);
/// # Ok::<(), deepsft::DeepSftError>(())
/// ```
///
/// # Errors
/// [`DeepSftError::DeviceUnavailable`] when this build or this machine has no such device, or when it is one for training.
pub async fn start_device(kind: DeviceKind) -> Result<(Device, DeviceDescription), DeepSftError> {
    let unavailable = |reason: &str| DeepSftError::DeviceUnavailable {
        device: kind,
        reason: reason.to_owned(),
    };
    match kind {
        DeviceKind::Cpu => Ok((Device::Cpu, DeviceDescription::cpu())),
        #[cfg(feature = "webgpu")]
        DeviceKind::WebGpu => {
            let gpu = deepsft_inference::Gpu::start().await;
            let gpu = gpu.map_err(|error| unavailable(&error.to_string()))?;
            let description = DeviceDescription {
                software: gpu.is_software(),
                ..DeviceDescription::new(kind, gpu.name())
            };
            Ok((Device::WebGpu(gpu), description))
        }
        DeviceKind::Vulkan | DeviceKind::Cuda => {
            Err(unavailable("it is for training; finished networks run on webgpu"))
        }
        _ => Err(unavailable("this build of deepsft has no feature `webgpu`")),
    }
}
