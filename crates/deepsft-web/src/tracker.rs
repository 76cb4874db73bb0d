//! The tracker: a template, frames of a video in, its mesh in each of them out.

use crate::{
    clock::Stopwatch,
    estimate::object,
    failure::Failure,
    input::{bundle_files, camera_from, maps_from, picture_from},
    mesh::{positions, template_mesh},
    settle,
};
use deepsft::{
    ModelBundle,
    geometry::{
        Camera, CanonicalWarp,
        tracking::{OneEuro, OneEuroOptions, TrackUpdate, Tracker, TrackingOptions},
    },
};
use js_sys::{Float32Array, Object, Promise};
use std::{cell::RefCell, rc::Rc};
use wasm_bindgen::prelude::*;

/// Follows the template's mesh through one video, beside an [`crate::Engine`] in another instance of this module that
/// says where the template is.
#[wasm_bindgen]
pub struct MeshTracker {
    core: Rc<RefCell<Core>>,
}

struct Core {
    tracker: Tracker,
    /// Started afresh with each track.
    smoothing: Option<OneEuro>,
    canonical: Camera,
    mesh: Object,
}

#[wasm_bindgen]
impl MeshTracker {
    /// A tracker for the template of a model.
    ///
    /// Of the model's `files`, by name, the description and those of the template are enough. With `smooth` each vertex passes
    /// a One-Euro filter; `min_cutoff` (Hz) and `beta` (Hz per mm/s) replace its defaults. Rejects with an `Error` whose
    /// `code` is `model-corrupt`, `model-version`, `model-load` or `internal`.
    #[wasm_bindgen(unchecked_return_type = "Promise<MeshTracker>")]
    pub fn create(
        #[wasm_bindgen(unchecked_param_type = "Iterable<[string, Uint8Array]>")] files: JsValue,
        smooth: bool,
        min_cutoff: Option<f64>,
        beta: Option<f64>,
    ) -> Promise {
        settle::promise(async move {
            let (template, canonical) =
                ModelBundle::template_from_files(&bundle_files(&files)?).map_err(|error| Failure::of_model(&error))?;
            let tracker = Tracker::new(&template, TrackingOptions::default())?;
            let defaults = OneEuroOptions::default();
            let options = OneEuroOptions {
                least_cutoff_hz: min_cutoff.unwrap_or(defaults.least_cutoff_hz),
                speed_coefficient: beta.unwrap_or(defaults.speed_coefficient),
                ..defaults
            };
            let core = Core {
                tracker,
                smoothing: smooth.then(|| OneEuro::new(options)),
                canonical,
                mesh: template_mesh(template.mesh()),
            };
            Ok(Self {
                core: Rc::new(RefCell::new(core)),
            })
        })
    }

    /// Faces and texture coordinates of the mesh, the same for every frame.
    #[wasm_bindgen(
        js_name = templateMesh,
        unchecked_return_type = "{ faces: Uint32Array, textureCoordinates: Float32Array }"
    )]
    pub fn template_mesh(&self) -> Object {
        self.core.borrow().mesh.clone()
    }

    /// The next frame of the video, as for [`crate::Engine::estimate`]; `number` and `time_s` ascend.
    ///
    /// Rejects with an `Error` whose `code` is `camera-intrinsics`, `image-unreadable` or `internal`.
    #[wasm_bindgen(unchecked_return_type = "Promise<RawTracked>")]
    pub fn follow(
        &self,
        number: u32,
        time_s: f64,
        #[wasm_bindgen(unchecked_param_type = "Uint8Array | Uint8ClampedArray")] rgba: Vec<u8>,
        width: u32,
        height: u32,
        camera: Vec<f64>,
    ) -> Promise {
        let core = Rc::clone(&self.core);
        settle::promise(async move {
            let camera = camera_from(width, height, &camera)?;
            core.borrow_mut().follow(number, time_s, &rgba, &camera)
        })
    }

    /// What the network says of frame `number`: depth and registration, both empty when it does not find the template there.
    ///
    /// Resolves to what the tracker makes of it. Rejects with an `Error` whose `code` is `image-unreadable` or `internal`.
    #[wasm_bindgen(
        unchecked_return_type = "Promise<\"started\" | \"confirmed\" | \"restarted\" | \"dropped\" | \"ignored\">"
    )]
    pub fn answer(&self, number: u32, depth: Vec<f32>, registration: Vec<f32>) -> Promise {
        let core = Rc::clone(&self.core);
        settle::promise(async move { core.borrow_mut().answer(number, depth, &registration) })
    }

    /// Depth and registration of the mesh in the latest frame, -1 where it is not seen.
    #[wasm_bindgen(unchecked_return_type = "{ depth: Float32Array, registration: Float32Array }")]
    pub fn maps(&self) -> Object {
        let maps = self.core.borrow_mut().tracker.maps();
        object([
            ("depth", Float32Array::from(maps.depth()).into()),
            (
                "registration",
                Float32Array::from(maps.registration().as_flattened()).into(),
            ),
        ])
    }
}

impl Core {
    fn follow(&mut self, number: u32, time_s: f64, rgba: &[u8], camera: &Camera) -> Result<RawTracked, Failure> {
        let mut stopwatch = Stopwatch::start();
        let picture = picture_from(rgba, camera.width(), camera.height())?;
        let canonical = CanonicalWarp::new(camera, &self.canonical).apply(&picture)?;
        let warp_ms = stopwatch.lap_ms();
        let tracked = self
            .tracker
            .follow(u64::from(number), time_s, &canonical, &self.canonical)?;
        let vertices = match &mut self.smoothing {
            Some(filter) if tracked.found => {
                let mut vertices = tracked.vertices_camera.clone();
                filter.smooth(time_s, &mut vertices);
                positions(&vertices)
            }
            _ => positions(&tracked.vertices_camera),
        };
        Ok(RawTracked {
            found: tracked.found,
            vertices,
            confidence: tracked.confidence.as_slice().into(),
            agreement: tracked.agreement,
            iterations: tracked.iterations as u32,
            times: object([("warpMs", warp_ms.into()), ("trackMs", stopwatch.lap_ms().into())]),
        })
    }

    fn answer(&mut self, number: u32, depth: Vec<f32>, registration: &[f32]) -> Result<&'static str, Failure> {
        let maps = if depth.is_empty() {
            None
        } else {
            Some(maps_from(depth, registration)?)
        };
        let answer = self.tracker.update(u64::from(number), maps.as_ref())?;
        if let (TrackUpdate::Started | TrackUpdate::Restarted, Some(filter)) = (answer, &mut self.smoothing) {
            filter.reset();
        }
        Ok(match answer {
            TrackUpdate::Started => "started",
            TrackUpdate::Confirmed => "confirmed",
            TrackUpdate::Restarted => "restarted",
            TrackUpdate::Dropped => "dropped",
            TrackUpdate::Ignored => "ignored",
        })
    }
}

/// The mesh in one frame. The arrays belong to JavaScript.
#[wasm_bindgen]
pub struct RawTracked {
    found: bool,
    vertices: Float32Array,
    confidence: Float32Array,
    agreement: f64,
    iterations: u32,
    times: Object,
}

#[wasm_bindgen]
impl RawTracked {
    /// Whether the template is being followed.
    #[wasm_bindgen(getter)]
    pub fn found(&self) -> bool {
        self.found
    }

    /// Vertices of the whole mesh, (x, y, z) each, camera frame, mm; empty unless found.
    #[wasm_bindgen(getter)]
    pub fn vertices(&self) -> Float32Array {
        self.vertices.clone()
    }

    /// How well the image confirms the mesh around each vertex, 0 to 1; 0 where the print is not seen or has no contrast.
    #[wasm_bindgen(getter)]
    pub fn confidence(&self) -> Float32Array {
        self.confidence.clone()
    }

    /// The same for the whole visible print.
    #[wasm_bindgen(getter)]
    pub fn agreement(&self) -> f64 {
        self.agreement
    }

    /// Solver iterations.
    #[wasm_bindgen(getter)]
    pub fn iterations(&self) -> u32 {
        self.iterations
    }

    /// Milliseconds of the canonical warp and of following.
    #[wasm_bindgen(getter, unchecked_return_type = "{ warpMs: number, trackMs: number }")]
    pub fn times(&self) -> Object {
        self.times.clone()
    }
}
