//! The engine: a model on a device, frames in, maps out.

use crate::{
    adapter,
    clock::Stopwatch,
    estimate::{RawEstimate, Times, object, rgba},
    failure::{Code, Failure},
    settle,
};
use deepsft::{
    DeviceDescription, DeviceKind, Estimator, ModelBundle,
    geometry::{Camera, Picture},
    start_device,
};
use js_sys::{Array, Object, Promise, Uint8Array};
use std::{collections::BTreeMap, rc::Rc};
use wasm_bindgen::prelude::*;

/// A model on a device, ready for frames.
#[wasm_bindgen]
pub struct Engine {
    core: Rc<Core>,
}

/// What a frame needs; kept alive by the frames under way when JavaScript frees the engine.
struct Core {
    bundle: ModelBundle,
    estimator: Estimator,
    device: DeviceDescription,
}

#[wasm_bindgen]
impl Engine {
    /// Loads a model onto a device.
    ///
    /// `files` are the model's files by name (`model.json`, `weights.bpk`, ...), as a `Map` or a list of
    /// pairs. `device` is `"cpu"` or `"webgpu"`. Rejects with an `Error` whose `code` is `model-corrupt`,
    /// `model-version`, `model-load`, `webgpu-unavailable`, `gpu-lost` or `internal`.
    #[wasm_bindgen(unchecked_return_type = "Promise<Engine>")]
    pub fn create(
        #[wasm_bindgen(unchecked_param_type = "Iterable<[string, Uint8Array]>")] files: JsValue,
        #[wasm_bindgen(unchecked_param_type = "\"cpu\" | \"webgpu\"")] device: String,
    ) -> Promise {
        settle::promise(async move {
            let kind: DeviceKind = device.parse().map_err(|error| Failure::of_device(&error))?;
            let bundle = ModelBundle::from_files(&bundle_files(&files)?).map_err(|error| Failure::of_model(&error))?;
            let (device, mut description) = start_device(kind).await.map_err(|error| Failure::of_device(&error))?;
            if kind == DeviceKind::WebGpu
                && let Some((name, software)) = adapter::describe().await
            {
                description.adapter_name = name;
                description.software |= software;
            }
            let estimator = Estimator::new(&bundle, &device).map_err(|error| Failure::of_model(&error))?;
            Ok(Self {
                core: Rc::new(Core {
                    bundle,
                    estimator,
                    device: description,
                }),
            })
        })
    }

    /// What runs where: a plain object.
    #[wasm_bindgen(
        unchecked_return_type = "{ device: \"cpu\" | \"webgpu\", adapterName: string, software: boolean, modelName: string, parameters: number, version: string }"
    )]
    pub fn info(&self) -> Object {
        let Core {
            bundle,
            estimator,
            device,
        } = &*self.core;
        object([
            ("device", device.kind.name().into()),
            ("adapterName", device.adapter_name.as_str().into()),
            ("software", device.software.into()),
            ("modelName", bundle.name().into()),
            ("parameters", (estimator.parameters() as f64).into()),
            ("version", env!("CARGO_PKG_VERSION").into()),
        ])
    }

    /// The maps of one frame.
    ///
    /// `rgba` are the frame's pixels (sRGB, not premultiplied), `camera` its intrinsics in pixels as
    /// `[fx, fy, cx, cy, k1, k2, p1, p2, k3]`, distortion in OpenCV's order. Rejects with an `Error` whose
    /// `code` is `camera-intrinsics`, `image-unreadable`, `gpu-lost` or `internal`.
    #[wasm_bindgen(unchecked_return_type = "Promise<RawEstimate>")]
    pub fn estimate(
        &self,
        #[wasm_bindgen(unchecked_param_type = "Uint8Array | Uint8ClampedArray")] rgba: Vec<u8>,
        width: u32,
        height: u32,
        camera: Vec<f64>,
    ) -> Promise {
        let core = Rc::clone(&self.core);
        settle::promise(async move { core.estimate(&rgba, width, height, &camera).await })
    }

    /// The picture on the template: a plain object with RGBA bytes.
    #[wasm_bindgen(js_name = templateTexture, unchecked_return_type = "{ width: number, height: number, rgba: Uint8Array }")]
    pub fn template_texture(&self) -> Object {
        let texture = self.core.bundle.template().texture();
        let bytes = Uint8Array::from(rgba(texture).as_slice());
        object([
            ("width", (texture.width() as f64).into()),
            ("height", (texture.height() as f64).into()),
            ("rgba", bytes.into()),
        ])
    }

    /// Width and height of the flat template, mm.
    #[wasm_bindgen(js_name = templateSizeMm, unchecked_return_type = "[number, number]")]
    pub fn template_size_mm(&self) -> Array {
        let size = self.core.bundle.template().size_mm();
        Array::of2(&size.x.into(), &size.y.into())
    }
}

impl Core {
    async fn estimate(&self, rgba: &[u8], width: u32, height: u32, camera: &[f64]) -> Result<RawEstimate, Failure> {
        let on_gpu = self.device.kind != DeviceKind::Cpu;
        let failed = |error| Failure::of_frame(&error, on_gpu);
        let camera = camera_from(width, height, camera)?;
        let mut stopwatch = Stopwatch::start();
        let picture = picture_from(rgba, width, height)?;
        let canonical = self.estimator.canonical_image(&picture, &camera).map_err(failed)?;
        let warp_ms = stopwatch.lap_ms();
        let maps = self.estimator.infer(&canonical).await.map_err(failed)?;
        let network_ms = stopwatch.lap_ms();
        let judgement = self.estimator.judge(&canonical, &maps).map_err(failed)?;
        let judge_ms = stopwatch.lap_ms();
        let times = Times {
            warp_ms,
            network_ms,
            judge_ms,
        };
        Ok(RawEstimate::new(
            &maps,
            &canonical,
            judgement.found,
            judgement.confidence,
            &times,
        ))
    }
}

/// The files of a model out of a JavaScript `Map` or list of pairs.
fn bundle_files(files: &JsValue) -> Result<BTreeMap<String, Vec<u8>>, Failure> {
    let refused = || {
        Failure::new(
            Code::ModelLoad,
            "The model's files must be a Map from names to Uint8Arrays.",
        )
    };
    let entries = js_sys::try_iter(files).ok().flatten().ok_or_else(refused)?;
    entries
        .map(|entry| {
            let pair = entry
                .ok()
                .and_then(|entry| entry.dyn_into::<Array>().ok())
                .ok_or_else(refused)?;
            let name = pair.get(0).as_string().ok_or_else(refused)?;
            let bytes = pair.get(1).dyn_into::<Uint8Array>().map_err(|_| refused())?;
            Ok((name, bytes.to_vec()))
        })
        .collect()
}

/// The camera of an image of this size out of `[fx, fy, cx, cy, k1, k2, p1, p2, k3]`.
fn camera_from(width: u32, height: u32, numbers: &[f64]) -> Result<Camera, Failure> {
    let &[fx, fy, cx, cy, k1, k2, p1, p2, k3] = numbers else {
        let message = format!(
            "A camera has 9 numbers (fx, fy, cx, cy, k1, k2, p1, p2, k3), not {}.",
            numbers.len()
        );
        return Err(Failure::new(Code::CameraIntrinsics, message));
    };
    Ok(Camera::pinhole(width, height, fx, fy, cx, cy)?.with_distortion([k1, k2, p1, p2, k3])?)
}

/// The picture of RGBA bytes, alpha left out.
fn picture_from(rgba: &[u8], width: u32, height: u32) -> Result<Picture, Failure> {
    let (width, height) = (width as usize, height as usize);
    let expected = width.saturating_mul(height).saturating_mul(4);
    if rgba.len() != expected {
        let message = format!(
            "An image of {width} x {height} pixels has {expected} bytes of RGBA, not {}.",
            rgba.len()
        );
        return Err(Failure::new(Code::ImageUnreadable, message));
    }
    let rgb = rgba
        .as_chunks::<4>()
        .0
        .iter()
        .flat_map(|&[r, g, b, _]| [r, g, b])
        .collect();
    Ok(Picture::new(width, height, rgb)?)
}
