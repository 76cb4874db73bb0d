//! Devices to train on: the CPU everywhere, a GPU where the build and the machine have one.
//!
//! This is the only place of the crate that names a backend.

use crate::error::NetworkError;
use burn::tensor::Device;
#[cfg(any(feature = "webgpu", feature = "vulkan"))]
use burn::tensor::wgpu::WgpuBackend;
use deepsft_inference::{DeviceDescription, DeviceKind};

/// Starts a device, before the first tensor on it. A second call for the same kind gives the same device.
///
/// ```
/// use deepsft_inference::DeviceKind;
/// use deepsft_network::start_device;
/// let (_device, description) = pollster::block_on(start_device(DeviceKind::Cpu))?;
/// assert!(!description.software);
/// # Ok::<(), deepsft_network::NetworkError>(())
/// ```
///
/// # Errors
/// [`NetworkError::DeviceUnavailable`] when this build or this machine has no such device, when it lacks
/// something burn needs, or when it was lost (a GPU that was reset does not come back within a process).
pub async fn start_device(kind: DeviceKind) -> Result<(Device, DeviceDescription), NetworkError> {
    match kind {
        DeviceKind::Cpu => Ok((Device::flex(), DeviceDescription::cpu())),
        #[cfg(feature = "webgpu")]
        DeviceKind::WebGpu => gpu::start(kind, WgpuBackend::Auto).await,
        #[cfg(feature = "vulkan")]
        DeviceKind::Vulkan => gpu::start(kind, WgpuBackend::Vulkan).await,
        #[cfg(feature = "cuda")]
        DeviceKind::Cuda => cuda::start(),
        #[allow(unreachable_patterns)] // In a build with all features.
        kind => Err(NetworkError::DeviceUnavailable {
            device: kind,
            reason: format!("this build has no feature `{kind}`"),
        }),
    }
}

#[cfg(any(feature = "webgpu", feature = "vulkan"))]
mod gpu {
    use super::{Device, DeviceDescription, DeviceKind};
    use crate::error::NetworkError;
    use burn::tensor::wgpu::{WgpuBackend, wgpu};
    use std::sync::{Mutex, PoisonError};

    /// The GPU devices of this process. burn can start each only once and never gives it up.
    static STARTED: Mutex<Vec<(Device, DeviceDescription)>> = Mutex::new(Vec::new());

    /// The device of `kind` that `api` offers first.
    pub(super) async fn start(kind: DeviceKind, api: WgpuBackend) -> Result<(Device, DeviceDescription), NetworkError> {
        let unavailable = |reason: String| NetworkError::DeviceUnavailable { device: kind, reason };
        if let Some(started) = started(kind) {
            return match started.0.flush() {
                Ok(()) => Ok(started),
                Err(error) => Err(unavailable(format!("the device was lost ({error})"))),
            };
        }
        let starting = Device::wgpu_options().graphics_api(api).init_with_setup_async().await;
        let (device, setup) = match (starting, started(kind)) {
            (Ok(new), _) => new,
            // Another caller was faster while this one waited.
            (Err(_), Some(started)) => return Ok(started),
            (Err(error), None) => return Err(unavailable(error.to_string())),
        };
        let adapter = setup.adapter.get_info();
        let description = DeviceDescription {
            software: adapter.device_type == wgpu::DeviceType::Cpu,
            ..DeviceDescription::new(kind, adapter.name)
        };
        let mut started = STARTED.lock().unwrap_or_else(PoisonError::into_inner);
        started.push((device.clone(), description.clone()));
        Ok((device, description))
    }

    fn started(kind: DeviceKind) -> Option<(Device, DeviceDescription)> {
        let started = STARTED.lock().unwrap_or_else(PoisonError::into_inner);
        started
            .iter()
            .find(|(_, description)| description.kind == kind)
            .cloned()
    }
}

#[cfg(feature = "cuda")]
mod cuda {
    use super::{Device, DeviceDescription, DeviceKind};
    use crate::error::NetworkError;
    use burn::tensor::DeviceType;

    /// The first CUDA device.
    pub(super) fn start() -> Result<(Device, DeviceDescription), NetworkError> {
        let kind = DeviceKind::Cuda;
        let none = || NetworkError::DeviceUnavailable {
            device: kind,
            reason: "no CUDA device was found".to_owned(),
        };
        let device = Device::enumerate(DeviceType::Cuda)
            .into_vec()
            .into_iter()
            .next()
            .ok_or_else(none)?;
        Ok((device, DeviceDescription::new(kind, "CUDA device 0")))
    }
}
