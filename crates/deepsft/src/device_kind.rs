//! The kinds of devices by name.

use std::fmt;

/// What computes.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
#[non_exhaustive]
pub enum DeviceKind {
    /// The processor, in every build: our executor for compact networks, burn's `flex` for the others and for training. One thread in a
    /// browser.
    Cpu,
    /// A GPU through wgpu: the browser's WebGPU, natively what the platform offers best. Builds with the
    /// feature `webgpu`.
    WebGpu,
    /// A GPU through Vulkan, with SPIR-V kernels. Native builds with the feature `vulkan`.
    Vulkan,
    /// An NVIDIA GPU through CUDA, whose libraries are looked for when the device is started. Native builds with the
    /// feature `cuda`.
    Cuda,
}

impl DeviceKind {
    /// The name people type and read: `cpu`, `webgpu`, `vulkan`, `cuda`.
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
