//! The engine: a model on a device, frames in, maps out.

use crate::{
    adapter,
    clock::Stopwatch,
    estimate::{RawEstimate, Times, object, rgba},
    failure::Failure,
    input::{bundle_files, camera_from, maps_from, picture_from},
    mesh::{RawMesh, template_mesh},
    settle,
};
use deepsft::{
    DeviceDescription, DeviceKind, Estimator, ModelBundle,
    geometry::{
        CANONICAL_HEIGHT, CANONICAL_WIDTH, CompletionOptions, MapsCompletion,
        fitting::{FitOptions, FrameFitter},
    },
    start_device,
};
use js_sys::{Array, Object, Promise, Uint8Array};
use std::{cell::RefCell, rc::Rc};
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
    /// Made for the first frame that is fitted.
    fitter: RefCell<Option<FrameFitter>>,
    /// Made for the first frame that is completed.
    completion: RefCell<Option<MapsCompletion>>,
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
                    fitter: RefCell::new(None),
                    completion: RefCell::new(None),
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
            ..
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

    /// Fits the template's mesh to one frame: the mesh that explains the canonical image, found from the network's maps.
    ///
    /// `depth`, `registration` and `canonical` (RGBA) are those of a [`RawEstimate`]. Resolves to `undefined` when the maps
    /// show too little to fit a mesh to. Rejects with an `Error` whose `code` is `image-unreadable` or `internal`.
    #[wasm_bindgen(unchecked_return_type = "Promise<RawMesh | undefined>")]
    pub fn fit(
        &self,
        depth: Vec<f32>,
        registration: Vec<f32>,
        #[wasm_bindgen(unchecked_param_type = "Uint8Array | Uint8ClampedArray")] canonical: Vec<u8>,
    ) -> Promise {
        let core = Rc::clone(&self.core);
        settle::promise(async move {
            let fitted = core.fit(depth, &registration, &canonical)?;
            Ok(fitted.map_or(JsValue::UNDEFINED, JsValue::from))
        })
    }

    /// ARAP completion of one frame, without its image: visible vertices stay about where the maps have them, the others follow as
    /// rigidly as possible.
    ///
    /// `depth` and `registration` are those of a [`RawEstimate`]. Resolves to `undefined` when they show fewer than 6
    /// vertices. Rejects with an `Error` whose `code` is `image-unreadable` or `internal`.
    #[wasm_bindgen(unchecked_return_type = "Promise<RawMesh | undefined>")]
    pub fn complete(&self, depth: Vec<f32>, registration: Vec<f32>) -> Promise {
        let core = Rc::clone(&self.core);
        settle::promise(async move {
            let completed = core.complete(depth, &registration)?;
            Ok(completed.map_or(JsValue::UNDEFINED, JsValue::from))
        })
    }

    /// Faces and texture coordinates of the template's mesh, the same for every frame.
    #[wasm_bindgen(
        js_name = templateMesh,
        unchecked_return_type = "{ faces: Uint32Array, textureCoordinates: Float32Array }"
    )]
    pub fn template_mesh(&self) -> Object {
        template_mesh(self.core.bundle.template().mesh())
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

    fn complete(&self, depth: Vec<f32>, registration: &[f32]) -> Result<Option<RawMesh>, Failure> {
        let maps = maps_from(depth, registration)?;
        let mut completion = self.completion.borrow_mut();
        let completion = match &mut *completion {
            Some(completion) => completion,
            none => none.insert(MapsCompletion::new(
                self.bundle.template().mesh(),
                CompletionOptions::default(),
            )?),
        };
        let mut stopwatch = Stopwatch::start();
        let completed = completion.complete(&maps, self.estimator.canonical_camera(), None)?;
        Ok(completed.map(|completed| RawMesh::of_completion(&completed, stopwatch.lap_ms())))
    }

    fn fit(&self, depth: Vec<f32>, registration: &[f32], canonical: &[u8]) -> Result<Option<RawMesh>, Failure> {
        let maps = maps_from(depth, registration)?;
        let canonical = picture_from(canonical, CANONICAL_WIDTH as u32, CANONICAL_HEIGHT as u32)?;
        let mut fitter = self.fitter.borrow_mut();
        let fitter = match &mut *fitter {
            Some(fitter) => fitter,
            none => none.insert(FrameFitter::new(self.bundle.template(), FitOptions::default())?),
        };
        let mut stopwatch = Stopwatch::start();
        let fitted = fitter.fit(&canonical, self.estimator.canonical_camera(), &maps, None)?;
        Ok(fitted.map(|fitted| RawMesh::of_fit(&fitted, stopwatch.lap_ms())))
    }
}
