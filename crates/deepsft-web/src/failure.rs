//! Failures as JavaScript sees them: an `Error` with a stable `code` and a sentence for people.

use deepsft::{DeepSftError, FormatError, geometry::GeometryError};
use js_sys::{Error, Reflect};
use wasm_bindgen::prelude::*;

/// What went wrong, for programs. The names are part of the JavaScript package's contract.
#[wasm_bindgen]
#[derive(Clone, Copy)]
pub enum Code {
    /// A file of the model is missing, truncated, altered or does not fit the others.
    ModelCorrupt = "model-corrupt",
    /// The model needs another version of this engine.
    ModelVersion = "model-version",
    /// The model was not handed over in the form [`crate::Engine::create`] asks for.
    ModelLoad = "model-load",
    /// No WebGPU, no adapter, or an adapter that lacks a feature.
    WebGpuUnavailable = "webgpu-unavailable",
    /// The GPU device was lost in the middle of the work.
    GpuLost = "gpu-lost",
    /// Intrinsics no camera can have.
    CameraIntrinsics = "camera-intrinsics",
    /// Pixels that are no image.
    ImageUnreadable = "image-unreadable",
    /// A picture or template that cannot be looked for.
    TargetUnusable = "target-unusable",
    /// A target that the engine does not have.
    TargetUnknown = "target-unknown",
    /// A defect of ours.
    Internal = "internal",
}

/// A failure on its way to JavaScript.
#[derive(Clone)]
pub struct Failure {
    code: Code,
    message: String,
}

impl Failure {
    pub fn new(code: Code, message: impl Into<String>) -> Self {
        Self {
            code,
            message: message.into(),
        }
    }

    /// A failure of the core while it read a model and put it on its device.
    pub fn of_model(error: DeepSftError) -> Self {
        let code = match error {
            DeepSftError::BundleVersion { .. } | DeepSftError::Format(FormatError::TemplateVersion { .. }) => {
                Code::ModelVersion
            }
            DeepSftError::DeviceUnavailable { .. } | DeepSftError::Execution { .. } => return Self::of_device(error),
            _ => Code::ModelCorrupt,
        };
        Self::new(code, format!("The model cannot be used: {error}."))
    }

    /// A failure of the core while it prepared a picture or template to be looked for.
    pub fn of_target(error: impl Into<DeepSftError>) -> Self {
        let error = error.into();
        let code = match error {
            DeepSftError::Format(FormatError::TemplateVersion { .. }) => Code::ModelVersion,
            _ => Code::TargetUnusable,
        };
        Self::new(code, format!("This cannot be looked for: {error}."))
    }

    /// A failure of the core while it started a device.
    pub fn of_device(error: impl Into<DeepSftError>) -> Self {
        let message = format!("The engine cannot start: {}.", error.into());
        Self::new(Code::WebGpuUnavailable, message)
    }

    /// A failure of the core while it worked on a frame. Computing on a GPU fails when the GPU goes away.
    pub fn of_frame(error: &DeepSftError, on_gpu: bool) -> Self {
        match error {
            DeepSftError::Geometry(GeometryError::CameraParameter { .. }) => Self::new(
                Code::CameraIntrinsics,
                format!("The camera's intrinsics cannot be used: {error}."),
            ),
            DeepSftError::Geometry(GeometryError::PictureSize { .. } | GeometryError::MapSize { .. }) => {
                Self::new(Code::ImageUnreadable, format!("The image cannot be used: {error}."))
            }
            DeepSftError::Execution { .. } if on_gpu => Self::new(Code::GpuLost, format!("The GPU was lost: {error}.")),
            _ => Self::new(Code::Internal, format!("The frame could not be worked on: {error}.")),
        }
    }
}

impl From<GeometryError> for Failure {
    fn from(error: GeometryError) -> Self {
        Self::of_frame(&error.into(), false)
    }
}

impl From<Failure> for JsValue {
    fn from(Failure { code, message }: Failure) -> Self {
        let error = Error::new(&message);
        error.set_name("DeepSftError");
        // Only fails on objects that were frozen; this one was made two lines above.
        let _ = Reflect::set(error.unchecked_ref(), &"code".into(), &code.into());
        error.into()
    }
}
