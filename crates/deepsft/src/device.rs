//! Devices to compute on: the CPU everywhere, a GPU where the build and the machine have one.
//!
//! This is the only place of the crate that names a backend.

use crate::device_kind::DeviceKind;
use crate::error::DeepSftError;
use burn::tensor::Device;
use std::fmt;
use std::str::FromStr;

/// Name of the CPU's engine where a GPU would have an adapter's name.
const CPU_NAME: &str = "CPU (burn flex)";

impl FromStr for DeviceKind {
    type Err = DeepSftError;

    /// # Errors
    /// [`DeepSftError::DeviceUnknown`] for another name than those of [`DeviceKind::name`].
    fn from_str(name: &str) -> Result<Self, DeepSftError> {
        let known = [Self::Cpu, Self::WebGpu, Self::Vulkan, Self::Cuda];
        let unknown = || DeepSftError::DeviceUnknown { name: name.to_owned() };
        known.into_iter().find(|kind| kind.name() == name).ok_or_else(unknown)
    }
}

/// What a started device is, for people.
#[derive(Clone, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub struct DeviceDescription {
    /// The kind that was asked for.
    pub kind: DeviceKind,
    /// The GPU adapter's name as its driver gives it (browsers often give an empty one), or what runs on
    /// the CPU.
    pub adapter_name: String,
    /// Whether the GPU is one that a program on the CPU plays, which is slower than [`DeviceKind::Cpu`].
    pub software: bool,
}

/// The kind and the adapter's name.
impl fmt::Display for DeviceDescription {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}: {}", self.kind, self.adapter_name)
    }
}

/// Starts a device, before the first tensor on it. A second call for the same kind gives the same device.
///
/// ```
/// use deepsft::{DeviceKind, start_device};
/// let (_device, description) = pollster::block_on(start_device(DeviceKind::Cpu))?;
/// assert!(!description.software);
/// # Ok::<(), deepsft::DeepSftError>(())
/// ```
///
/// # Errors
/// [`DeepSftError::DeviceUnavailable`] when this build or this machine has no such device, when it lacks
/// something burn needs, or when it was lost (a GPU that was reset does not come back within a process;
/// in a browser, within a page's or worker's WebAssembly instance).
pub async fn start_device(kind: DeviceKind) -> Result<(Device, DeviceDescription), DeepSftError> {
    match kind {
        DeviceKind::Cpu => {
            let adapter_name = CPU_NAME.to_owned();
            Ok((
                Device::flex(),
                DeviceDescription {
                    kind,
                    adapter_name,
                    software: false,
                },
            ))
        }
        DeviceKind::WebGpu | DeviceKind::Vulkan => gpu::start(kind).await,
        DeviceKind::Cuda => cuda::start(),
    }
}

/// Starts the first `count` devices of a kind, for a training that shares its batches among them. One is that of
/// [`start_device`]; several are discrete GPUs in burn's order, started by their first tensor: integrated and software
/// adapters beside them would hold every step up.
///
/// The processor is one device to burn whatever its cores: `count` of [`DeviceKind::Cpu`] are `count` times that one, and
/// what is shared is work among threads.
///
/// # Errors
/// As [`start_device`]; [`DeepSftError::DevicesTooFew`] when the machine has fewer, with their number.
pub async fn start_devices(kind: DeviceKind, count: usize) -> Result<(Vec<Device>, DeviceDescription), DeepSftError> {
    let listed = match kind {
        _ if count <= 1 => None,
        DeviceKind::Cpu => None,
        DeviceKind::WebGpu | DeviceKind::Vulkan => Some(gpu::list(kind)?),
        DeviceKind::Cuda => Some(cuda::list()?),
    };
    let Some(mut devices) = listed else {
        let (device, description) = start_device(kind).await?;
        return Ok((vec![device; count.max(1)], description));
    };
    if devices.len() < count {
        return Err(DeepSftError::DevicesTooFew {
            device: kind,
            asked: count,
            found: devices.len(),
        });
    }
    devices.truncate(count);
    let description = DeviceDescription {
        kind,
        adapter_name: format!("{count} GPUs"),
        software: false,
    };
    Ok((devices, description))
}

#[cfg(any(feature = "webgpu", feature = "vulkan"))]
mod gpu {
    use super::{Device, DeviceDescription, DeviceKind};
    use crate::error::DeepSftError;
    use burn::tensor::wgpu::{WgpuBackend, wgpu};
    use burn::tensor::{DeviceKind as Adapter, DeviceType};
    use std::sync::{Mutex, PoisonError};

    /// The GPU devices of this process. burn can start each only once and never gives it up.
    static STARTED: Mutex<Vec<(Device, DeviceDescription)>> = Mutex::new(Vec::new());

    pub(super) async fn start(kind: DeviceKind) -> Result<(Device, DeviceDescription), DeepSftError> {
        let unavailable = |reason: String| DeepSftError::DeviceUnavailable { device: kind, reason };
        let api = match kind {
            DeviceKind::WebGpu if cfg!(feature = "webgpu") => WgpuBackend::Auto,
            DeviceKind::Vulkan if cfg!(feature = "vulkan") => WgpuBackend::Vulkan,
            _ => return Err(unavailable(format!("this build of deepsft has no feature `{kind}`"))),
        };
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
        let features = setup.adapter.features();
        if cfg!(target_family = "wasm") && !features.contains(wgpu::Features::TIMESTAMP_QUERY) {
            // burn would panic at the first tensor: without time stamps it wants to wait, and a browser
            // must not.
            return Err(unavailable("the adapter lacks the feature timestamp-query".to_owned()));
        }
        let adapter = setup.adapter.get_info();
        let software = adapter.device_type == wgpu::DeviceType::Cpu;
        let description = DeviceDescription {
            kind,
            adapter_name: adapter.name,
            software,
        };
        let mut started = STARTED.lock().unwrap_or_else(PoisonError::into_inner);
        started.push((device.clone(), description.clone()));
        Ok((device, description))
    }

    /// All discrete GPUs that are reached through a kind.
    pub(super) fn list(kind: DeviceKind) -> Result<Vec<Device>, DeepSftError> {
        let (listed, number): (_, fn(usize) -> Device) = match kind {
            #[cfg(feature = "webgpu")]
            DeviceKind::WebGpu => (Device::enumerate(DeviceType::Wgpu), |n| {
                Device::wgpu(Adapter::DiscreteGpu(n))
            }),
            #[cfg(feature = "vulkan")]
            DeviceKind::Vulkan => (Device::enumerate(DeviceType::Vulkan), |n| {
                Device::vulkan(Adapter::DiscreteGpu(n))
            }),
            _ => {
                return Err(DeepSftError::DeviceUnavailable {
                    device: kind,
                    reason: format!("this build of deepsft has no feature `{kind}`"),
                });
            }
        };
        let listed = listed.into_vec();
        Ok((0..).map(number).take_while(|gpu| listed.contains(gpu)).collect())
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
    use crate::error::DeepSftError;
    use burn::tensor::DeviceType;

    /// The first CUDA device.
    pub(super) fn start() -> Result<(Device, DeviceDescription), DeepSftError> {
        let kind = DeviceKind::Cuda;
        let device = list()?
            .into_iter()
            .next()
            .ok_or_else(|| DeepSftError::DeviceUnavailable {
                device: kind,
                reason: "no CUDA device was found".to_owned(),
            })?;
        let description = DeviceDescription {
            kind,
            adapter_name: "CUDA device 0".to_owned(),
            software: false,
        };
        Ok((device, description))
    }

    /// All CUDA devices.
    pub(super) fn list() -> Result<Vec<Device>, DeepSftError> {
        Ok(Device::enumerate(DeviceType::Cuda).into_vec())
    }
}

#[cfg(not(feature = "cuda"))]
mod cuda {
    use super::{Device, DeviceDescription, DeviceKind};
    use crate::error::DeepSftError;

    pub(super) fn start() -> Result<(Device, DeviceDescription), DeepSftError> {
        Err(absent())
    }

    pub(super) fn list() -> Result<Vec<Device>, DeepSftError> {
        Err(absent())
    }

    fn absent() -> DeepSftError {
        let kind = DeviceKind::Cuda;
        DeepSftError::DeviceUnavailable {
            device: kind,
            reason: format!("this build of deepsft has no feature `{kind}`"),
        }
    }
}

#[cfg(not(any(feature = "webgpu", feature = "vulkan")))]
mod gpu {
    use super::{Device, DeviceDescription, DeviceKind};
    use crate::error::DeepSftError;

    pub(super) async fn start(kind: DeviceKind) -> Result<(Device, DeviceDescription), DeepSftError> {
        Err(absent(kind))
    }

    pub(super) fn list(kind: DeviceKind) -> Result<Vec<Device>, DeepSftError> {
        Err(absent(kind))
    }

    fn absent(kind: DeviceKind) -> DeepSftError {
        DeepSftError::DeviceUnavailable {
            device: kind,
            reason: format!("this build of deepsft has no feature `{kind}`"),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use burn::tensor::Tensor;
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
    fn the_cpu_is_as_many_devices_as_are_asked_for() {
        for count in [1, 3] {
            let (devices, description) = block_on(start_devices(DeviceKind::Cpu, count)).unwrap();
            assert_eq!((devices.len(), description.kind), (count, DeviceKind::Cpu));
        }
    }

    #[test]
    #[cfg(not(any(feature = "webgpu", feature = "vulkan", feature = "cuda")))]
    fn a_gpu_that_the_build_lacks_is_refused_with_the_features_name() {
        for kind in [DeviceKind::WebGpu, DeviceKind::Vulkan, DeviceKind::Cuda] {
            for count in [1, 2] {
                let error = block_on(start_devices(kind, count)).unwrap_err().to_string();
                assert!(error.contains(&format!("feature `{kind}`")), "{error}");
            }
        }
    }

    #[test]
    fn devices_are_named_as_people_type_them() {
        for kind in [
            DeviceKind::Cpu,
            DeviceKind::WebGpu,
            DeviceKind::Vulkan,
            DeviceKind::Cuda,
        ] {
            assert_eq!(kind.to_string().parse::<DeviceKind>().unwrap(), kind);
        }
        let error = "tpu".parse::<DeviceKind>().unwrap_err().to_string();
        assert!(error.contains("tpu") && error.contains("vulkan"), "{error}");
    }
}
