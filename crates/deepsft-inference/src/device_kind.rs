//! Names and descriptions of devices.

use std::fmt;
use std::str::FromStr;

/// A kind of device that a network runs on.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
#[non_exhaustive]
pub enum DeviceKind {
    /// The processor, in every build; in a browser one thread of it.
    Cpu,
    /// A GPU through wgpu: the browser's WebGPU, natively what the platform offers best. Builds with the
    /// feature `webgpu`.
    WebGpu,
    /// A GPU through Vulkan, with SPIR-V kernels, for training. Native builds with the feature `vulkan`.
    Vulkan,
    /// An NVIDIA GPU through CUDA, for training; its libraries are looked for when the device is started. Native builds with the
    /// feature `cuda`.
    Cuda,
}

impl DeviceKind {
    /// Returns the name that people type and read: `cpu`, `webgpu`, `vulkan`, `cuda`.
    pub fn name(self) -> &'static str {
        match self {
            Self::Cpu => "cpu",
            Self::WebGpu => "webgpu",
            Self::Vulkan => "vulkan",
            Self::Cuda => "cuda",
        }
    }
}

impl fmt::Display for DeviceKind {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}

/// Reports a name that no device has.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("there is no device {0:?}, only cpu, webgpu, vulkan and cuda")]
pub struct UnknownDevice(pub String);

impl FromStr for DeviceKind {
    type Err = UnknownDevice;

    /// # Errors
    /// [`UnknownDevice`] for another name than those of [`DeviceKind::name`].
    fn from_str(name: &str) -> Result<Self, UnknownDevice> {
        let known = [Self::Cpu, Self::WebGpu, Self::Vulkan, Self::Cuda];
        let unknown = || UnknownDevice(name.to_owned());
        known.into_iter().find(|kind| kind.name() == name).ok_or_else(unknown)
    }
}

/// Describes a started device to people.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct DeviceDescription {
    /// The kind that was asked for.
    pub kind: DeviceKind,
    /// The GPU adapter's name as its driver gives it (browsers often give an empty one), or what runs on the CPU.
    pub adapter_name: String,
    /// Whether the GPU is one that a program on the CPU plays, which is slower than [`DeviceKind::Cpu`].
    pub software: bool,
}

impl DeviceDescription {
    /// Describes a device that no program on the CPU plays.
    pub fn new(kind: DeviceKind, adapter_name: impl Into<String>) -> Self {
        Self {
            kind,
            adapter_name: adapter_name.into(),
            software: false,
        }
    }

    /// Describes the processor.
    pub fn cpu() -> Self {
        Self::new(DeviceKind::Cpu, "processor")
    }
}

/// The kind and the adapter's name.
impl fmt::Display for DeviceDescription {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}: {}", self.kind, self.adapter_name)
    }
}
