//! The engine: targets, and where they are in a frame.

use crate::{
    clock::Stopwatch,
    estimate::estimate_object,
    failure::{Code, Failure},
    input::{camera_origin, files_from, frame_from, maps_from, picture_from},
    mesh::positions,
    object::object,
    settle,
    target::EngineTarget,
    target_template::TargetTemplate,
};
use deepsft::{
    ALIKE, DeviceDescription, DeviceKind, EstimateTimes, ModelBundle, Target, View, geometry::Maps, start_device,
};
use js_sys::{Array, Object, Promise};
use std::{cell::RefCell, collections::BTreeMap, rc::Rc};
use wasm_bindgen::prelude::*;

/// Number of the target that came with the model.
const MODEL_TARGET: u32 = 0;

/// Finds targets in frames: that of a model by its network, pictures by their features.
#[wasm_bindgen]
pub struct Engine {
    core: Rc<Core>,
}

/// What a frame needs; kept alive by the frames under way when JavaScript frees the engine.
struct Core {
    device: DeviceDescription,
    model_name: Option<String>,
    targets: RefCell<BTreeMap<u32, Rc<EngineTarget>>>,
}

#[wasm_bindgen]
impl Engine {
    /// An engine, with a model on a device or without one.
    ///
    /// `files` are the model's files by name (`model.json`, `weights.bpk`, ...), as a `Map` or a list of pairs; its target has the
    /// number 0. `device` is `"cpu"` or `"webgpu"`. Rejects with an `Error` whose `code` is `model-corrupt`, `model-version`,
    /// `model-load`, `webgpu-unavailable`, `gpu-lost` or `internal`.
    #[wasm_bindgen(unchecked_return_type = "Promise<Engine>")]
    pub fn create(
        #[wasm_bindgen(unchecked_param_type = "Iterable<[string, Uint8Array]> | undefined")] files: JsValue,
        #[wasm_bindgen(unchecked_param_type = "\"cpu\" | \"webgpu\"")] device: String,
    ) -> Promise {
        settle::promise(async move {
            let kind: DeviceKind = device.parse().map_err(Failure::of_device)?;
            let bundle = match files.is_undefined() {
                true => None,
                false => Some(ModelBundle::from_files(&files_from(&files)?).map_err(Failure::of_model)?),
            };
            let (device, description) = start_device(kind).await.map_err(Failure::of_device)?;
            let mut targets = BTreeMap::new();
            if let Some(bundle) = &bundle {
                let target = Target::from_model(bundle, &device).map_err(Failure::of_model)?;
                targets.insert(MODEL_TARGET, Rc::new(EngineTarget::of_model(target)));
            }
            Ok(Self {
                core: Rc::new(Core {
                    device: description,
                    model_name: bundle.map(|bundle| bundle.name().to_owned()),
                    targets: RefCell::new(targets),
                }),
            })
        })
    }

    /// What runs where: a plain object.
    #[wasm_bindgen(
        unchecked_return_type = "{ device: \"cpu\" | \"webgpu\", adapterName: string, software: boolean, modelName: string | null, parameters: number, version: string }"
    )]
    pub fn info(&self) -> Object {
        let Core { device, model_name, .. } = &*self.core;
        let model = self.core.target(MODEL_TARGET).ok();
        let parameters = model.and_then(|model| Some(model.network()?.parameters()));
        object([
            ("device", device.kind.name().into()),
            ("adapterName", device.adapter_name.as_str().into()),
            ("software", device.software.into()),
            ("modelName", model_name.as_deref().map_or(JsValue::NULL, JsValue::from)),
            ("parameters", (parameters.unwrap_or(0) as f64).into()),
            ("version", env!("CARGO_PKG_VERSION").into()),
        ])
    }

    /// The focal length, pixels, that the EXIF data of a photograph's file tell for its picture, which is shown with `width` x `height`
    /// pixels.
    ///
    /// Resolves to `undefined` where they tell none: see [`deepsft_formats::camera_from_exif`].
    #[wasm_bindgen(js_name = exifFocal, unchecked_return_type = "Promise<number | undefined>")]
    pub fn exif_focal(file: Vec<u8>, width: u32, height: u32) -> Promise {
        settle::promise(async move {
            let camera = deepsft_formats::camera_from_exif(&file, (width as usize, height as usize));
            Ok(camera.map_or(JsValue::UNDEFINED, |camera| camera.focal().x.into()))
        })
    }

    /// Looks for a target without a network from now on.
    ///
    /// Resolves to the targets whose pictures resemble its own, and the share of the corners that they have in common, 0 to 1. Rejects with an
    /// `Error` whose `code` is `target-unusable` or `internal`.
    #[wasm_bindgen(js_name = addTarget, unchecked_return_type = "Promise<{ id: number, share: number }[]>")]
    pub fn add_target(&self, id: u32, template: TargetTemplate) -> Promise {
        let core = Rc::clone(&self.core);
        settle::promise(async move {
            let target = EngineTarget::of_template(template.0)?;
            let mut targets = core.targets.borrow_mut();
            let others = targets.iter().filter(|(known, _)| **known != id);
            let shares = others.map(|(other, known)| (*other, target.tell_apart(known)));
            let alike = shares.filter(|(_, share)| *share >= ALIKE);
            let alike = alike.map(|(other, share)| object([("id", other.into()), ("share", share.into())]));
            let alike: Array = alike.collect();
            targets.insert(id, Rc::new(target));
            Ok(alike)
        })
    }

    /// Looks for so many copies of a target's print in each frame of a video.
    #[wasm_bindgen(js_name = lookForCopies, unchecked_return_type = "Promise<void>")]
    pub fn look_for_copies(&self, id: u32, copies: u32) -> Promise {
        let core = Rc::clone(&self.core);
        settle::promise(async move {
            core.target(id)?.look_for_copies(copies);
            Ok(JsValue::UNDEFINED)
        })
    }

    /// Lets a target go.
    #[wasm_bindgen(js_name = removeTarget)]
    pub fn remove_target(&self, id: u32) {
        self.core.targets.borrow_mut().remove(&id);
    }

    /// Texture, size, mesh and grade of a target: a plain object; `undefined` when there is no such target.
    #[wasm_bindgen(
        js_name = describeTarget,
        unchecked_return_type = "{ width: number, height: number, rgba: Uint8ClampedArray<ArrayBuffer>, sizeMm: [number, number], mesh: { faces: Uint32Array, textureCoordinates: Float32Array }, grade: { level: \"hopeless\" | \"poor\" | \"fair\" | \"good\", reasons: string[] } | null } | undefined"
    )]
    pub fn describe_target(&self, id: u32) -> JsValue {
        let target = self.core.target(id);
        target.map_or(JsValue::UNDEFINED, |target| target.description().into())
    }

    /// The maps of one target in one frame.
    ///
    /// `rgba` are the frame's pixels (sRGB, not premultiplied), `camera` its intrinsics in pixels as
    /// `[fx, fy, cx, cy, k1, k2, p1, p2, k3]`, distortion in OpenCV's order, or with a fisheye's
    /// `[fx, fy, cx, cy, k1, k2, k3, k4]`. `source` is where it comes from: `exif` and
    /// `estimated` are not known, and a sheet tells them. Rejects with an `Error` whose
    /// `code` is `camera-intrinsics`, `image-unreadable`, `target-unknown`, `gpu-lost` or `internal`.
    #[wasm_bindgen(unchecked_return_type = "Promise<RawEstimate>")]
    pub fn estimate(
        &self,
        id: u32,
        #[wasm_bindgen(unchecked_param_type = "Uint8Array | Uint8ClampedArray")] rgba: Vec<u8>,
        width: usize,
        height: usize,
        camera: Vec<f64>,
        source: &str,
    ) -> Promise {
        let (core, origin) = (Rc::clone(&self.core), camera_origin(source));
        settle::promise(async move {
            let target = core.target(id)?;
            let (picture, camera) = frame_from(&rgba, (width, height), &camera)?;
            let estimate = target.estimate((&picture, &camera), origin).await;
            estimate.map_err(|error| core.failed(&error))
        })
    }

    /// The print of a target as one frame shows it, laid flat, `columns` pixels wide, without shading where it is to be `unshaded`: found and fitted as for [`Engine::estimate`], also
    /// where the target has a network. Resolves to `null` where it is not found. Rejects as [`Engine::estimate`].
    #[wasm_bindgen(unchecked_return_type = "Promise<RawFlatPrint | null>")]
    pub fn flatten(
        &self,
        id: u32,
        #[wasm_bindgen(unchecked_param_type = "Uint8Array | Uint8ClampedArray")] rgba: Vec<u8>,
        width: usize,
        height: usize,
        camera: Vec<f64>,
        source: &str,
        columns: usize,
        unshaded: bool,
    ) -> Promise {
        let (core, origin) = (Rc::clone(&self.core), camera_origin(source));
        settle::promise(async move {
            let target = core.target(id)?;
            let (picture, camera) = frame_from(&rgba, (width, height), &camera)?;
            let flat = target.flatten((&picture, &camera), origin, columns, unshaded).await;
            let flat = flat.map_err(|error| core.failed(&error))?;
            Ok(flat.map_or(JsValue::NULL, JsValue::from))
        })
    }

    /// Where several targets are in one frame, as for [`Engine::estimate`]: what a tracker needs to start them or to confirm
    /// them.
    ///
    /// A sighting is the vertices of the target's mesh (x, y, z each, camera frame, mm). With `estimated` the network's answer comes as
    /// an estimate too, if the model's target is among `ids`. `focal` is the focal length of the canonical image that is looked at, pixels: the
    /// training camera's, or a shorter one that sees more. Numbers that are no target have no answer. Rejects as
    /// [`Engine::estimate`].
    #[wasm_bindgen(
        unchecked_return_type = "Promise<{ answers: { id: number, sightings: Float32Array[] }[], estimate: RawEstimate | undefined }>"
    )]
    pub fn find(
        &self,
        ids: Vec<u32>,
        estimated: bool,
        #[wasm_bindgen(unchecked_param_type = "Uint8Array | Uint8ClampedArray")] rgba: Vec<u8>,
        width: usize,
        height: usize,
        camera: Vec<f64>,
        focal: f64,
    ) -> Promise {
        let core = Rc::clone(&self.core);
        settle::promise(async move {
            let (picture, camera) = frame_from(&rgba, (width, height), &camera)?;
            core.find((&ids, estimated), &mut View::new(&picture, &camera), focal)
                .await
        })
    }

    /// The whole mesh of a target in one frame from a network's maps: with the canonical image the mesh that explains it, without it their
    /// ARAP completion, whose visible vertices stay about where the maps have them.
    ///
    /// `width`, `focal`, `depth`, `registration` and `canonical` (RGBA) are those of a `RawEstimate`. Resolves to `null` when the maps show
    /// too little of the mesh. Rejects with an `Error` whose `code` is `image-unreadable`, `target-unknown` or `internal`.
    #[wasm_bindgen(unchecked_return_type = "Promise<RawMesh | null>")]
    pub fn mesh(
        &self,
        id: u32,
        width: u32,
        focal: f64,
        depth: Vec<f32>,
        registration: Vec<f32>,
        #[wasm_bindgen(unchecked_param_type = "Uint8Array | Uint8ClampedArray | undefined")] canonical: Option<Vec<u8>>,
    ) -> Promise {
        let core = Rc::clone(&self.core);
        settle::promise(async move {
            let maps = maps_from(width, depth, &registration)?;
            let canonical = canonical.map(|rgba| picture_from(&rgba, maps.size())).transpose()?;
            let target = core.target(id)?;
            let camera = target.view_camera(maps.size(), focal)?;
            let mesh = target.mesh(canonical.as_ref(), maps, &camera)?;
            Ok(mesh.map_or(JsValue::NULL, JsValue::from))
        })
    }
}

impl Core {
    fn target(&self, id: u32) -> Result<Rc<EngineTarget>, Failure> {
        let unknown = || Failure::new(Code::TargetUnknown, "The target was removed.");
        self.targets.borrow().get(&id).cloned().ok_or_else(unknown)
    }

    async fn find(&self, (ids, estimated): (&[u32], bool), view: &mut View<'_>, focal: f64) -> Result<Object, Failure> {
        let mut estimate = JsValue::UNDEFINED;
        let answers = Array::new();
        for &id in ids {
            let Ok(target) = self.target(id) else {
                continue;
            };
            let mut stopwatch = Stopwatch::start();
            let camera = target.view_camera(view.size(), focal)?;
            let found = target.find(view, &camera).await;
            let (sightings, maps) = found.map_err(|error| self.failed(&error))?;
            if let Some(network) = target.network().filter(|_| estimated) {
                let network_ms = stopwatch.lap_ms();
                let canonical = view.canonical(&camera).map_err(|error| self.failed(&error))?.clone();
                let maps = maps.unwrap_or_else(|| Maps::empty(camera.size()));
                let made = network.estimate_of(canonical, camera, maps);
                let times = EstimateTimes {
                    network_ms,
                    judge_ms: stopwatch.lap_ms(),
                    ..EstimateTimes::default()
                };
                estimate = estimate_object(&made.map_err(|error| self.failed(&error))?, None, times, 0.0).into();
            }
            let seen = sightings.iter().map(|seen| positions(&seen.vertices_camera));
            answers.push(&object([
                ("id", id.into()),
                ("sightings", seen.collect::<Array>().into()),
            ]));
        }
        Ok(object([("answers", answers.into()), ("estimate", estimate)]))
    }

    fn failed(&self, error: &deepsft::DeepSftError) -> Failure {
        Failure::of_frame(error, self.device.kind != DeviceKind::Cpu)
    }
}
