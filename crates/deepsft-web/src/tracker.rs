//! The tracker: targets, frames of a video in, their meshes in each of them out.

use crate::{
    clock::Stopwatch,
    estimate::object,
    failure::{Code, Failure},
    input::{camera_from, files_from, maps_from, picture_from, printed_sheet, template_from, view_from},
    mesh::positions,
    settle,
};
use deepsft::{
    DeepSftError, ModelBundle, View,
    geometry::{
        CalibratedCamera, Camera, Maps, Picture, SelfCalibration, SelfCalibrationOptions, Template, canonical_camera,
        tracking::{OneEuro, OneEuroOptions, TrackUpdate, Tracked, Tracker, TrackerImage, TrackingOptions},
        training_camera,
    },
};
use js_sys::{Array, Float32Array, Object, Promise};
use std::{cell::RefCell, collections::BTreeMap, hint::black_box, rc::Rc};
use wasm_bindgen::prelude::*;

/// Follows the meshes of targets through one video, beside an [`crate::Engine`] in another instance of this module that
/// says where they are.
#[wasm_bindgen]
pub struct MeshTracker {
    core: Rc<RefCell<Core>>,
}

struct Core {
    /// Of the meshes; none when absent.
    smoothing: Option<OneEuroOptions>,
    tracks: BTreeMap<u32, Track>,
}

struct Track {
    tracker: Tracker,
    /// Started afresh with each track.
    smoothing: Option<OneEuro>,
    /// The camera of canonical images that lie across.
    training: Camera,
    template: Template,
    /// Made when the camera is to be found.
    calibration: Option<SelfCalibration>,
}

/// Frames between two steps of the search for the camera; each takes about as long as following a frame.
const CALIBRATION_INTERVAL: u32 = 2;

/// What following a sheet takes for a moment where it fills the view, for each pixel: half as much of an A4 sheet 400 mm away.
const ROOM_BYTES: usize = 56;

/// Correlation from which a mesh is good enough to tell of the camera.
const TELLING_CORRELATION: f64 = 0.6;

#[wasm_bindgen]
impl MeshTracker {
    /// A tracker that follows nothing yet.
    ///
    /// With `smooth` each vertex passes a One-Euro filter; `min_cutoff` (Hz) and `beta` (Hz per mm/s) replace its defaults.
    #[wasm_bindgen(constructor)]
    pub fn new(smooth: bool, min_cutoff: Option<f64>, beta: Option<f64>) -> Self {
        let defaults = OneEuroOptions::default();
        let options = OneEuroOptions {
            min_cutoff_hz: min_cutoff.unwrap_or(defaults.min_cutoff_hz),
            speed_coefficient: beta.unwrap_or(defaults.speed_coefficient),
            ..defaults
        };
        Self {
            core: Rc::new(RefCell::new(Core {
                smoothing: smooth.then_some(options),
                tracks: BTreeMap::new(),
            })),
        }
    }

    /// Follows the template of a model too. Of the model's `files`, by name, the description and those of the template are
    /// enough.
    ///
    /// Rejects with an `Error` whose `code` is `model-corrupt`, `model-version`, `model-load`, `target-unusable` or `internal`.
    #[wasm_bindgen(js_name = addModel, unchecked_return_type = "Promise<void>")]
    pub fn add_model(
        &self,
        id: u32,
        #[wasm_bindgen(unchecked_param_type = "Iterable<[string, Uint8Array]>")] files: JsValue,
    ) -> Promise {
        self.adding(id, move || {
            ModelBundle::template_from_files(&files_from(&files)?).map_err(|error| Failure::of_model(&error))
        })
    }

    /// Follows a sheet too that is given as the files of a template's folder, by name.
    ///
    /// Rejects with an `Error` whose `code` is `target-unusable`, `model-version`, `model-load` or `internal`.
    #[wasm_bindgen(js_name = addTemplate, unchecked_return_type = "Promise<void>")]
    pub fn add_template(
        &self,
        id: u32,
        #[wasm_bindgen(unchecked_param_type = "Iterable<[string, Uint8Array]>")] files: JsValue,
    ) -> Promise {
        self.adding(id, move || {
            Ok((template_from(&files_from(&files)?)?, training_camera()))
        })
    }

    /// Follows a printed picture too, as [`crate::Engine::add_picture`].
    ///
    /// Rejects with an `Error` whose `code` is `target-unusable`, `image-unreadable` or `internal`.
    #[wasm_bindgen(js_name = addPicture, unchecked_return_type = "Promise<void>")]
    pub fn add_picture(
        &self,
        id: u32,
        #[wasm_bindgen(unchecked_param_type = "Uint8Array | Uint8ClampedArray")] rgba: Vec<u8>,
        width: usize,
        height: usize,
        width_mm: f64,
        height_mm: f64,
    ) -> Promise {
        self.adding(id, move || {
            let template = printed_sheet(&rgba, (width, height), (width_mm, height_mm))?;
            Ok((template, training_camera()))
        })
    }

    /// Follows a target no longer.
    #[wasm_bindgen(js_name = removeTarget)]
    pub fn remove_target(&self, id: u32) {
        self.core.borrow_mut().tracks.remove(&id);
    }

    /// The next frame of the video, as for [`crate::Engine::estimate`]; `number` and `time_s` ascend: a time that does
    /// not starts the tracker afresh, as for another camera or file. `focal` is the focal length of the
    /// canonical image that it is followed in, pixels: the training camera's, or a shorter one that sees more.
    ///
    /// Resolves to the meshes of all targets in it: `vertices` (x, y, z each, camera frame, mm; empty unless found),
    /// `confidence` (of each vertex, 0 to 1), `correlation` (of the whole visible print), solver `iterations`. With `calibrate` the
    /// meshes also tell of the camera: `focal` is there in frames in which it was found, the true focal length as a multiple of the
    /// given one with its standard deviation, a fraction of it. Rejects with an `Error` whose `code` is `camera-intrinsics`,
    /// `image-unreadable` or `internal`.
    #[wasm_bindgen(
        unchecked_return_type = "Promise<{ targets: { id: number, found: boolean, vertices: Float32Array, confidence: Float32Array, correlation: number, iterations: number }[], focal: { ratio: number, deviation: number } | null, warpMs: number, trackMs: number }>"
    )]
    pub fn follow(
        &self,
        number: u32,
        time_s: f64,
        #[wasm_bindgen(unchecked_param_type = "Uint8Array | Uint8ClampedArray")] rgba: Vec<u8>,
        width: usize,
        height: usize,
        camera: Vec<f64>,
        focal: f64,
        calibrate: bool,
    ) -> Promise {
        let core = Rc::clone(&self.core);
        settle::promise(async move {
            let camera = camera_from((width, height), &camera)?;
            let picture = picture_from(&rgba, (width, height))?;
            core.borrow_mut()
                .follow((number, time_s), &mut View::new(&picture, &camera), focal, calibrate)
        })
    }

    /// Where a finder sees target `id` in frame `number`, in a canonical image of `width` columns; depth and registration both empty: it
    /// is not there.
    ///
    /// Resolves to what the tracker makes of it. Rejects with an `Error` whose `code` is `image-unreadable`,
    /// `target-unknown` or `internal`.
    #[wasm_bindgen(
        unchecked_return_type = "Promise<\"started\" | \"confirmed\" | \"restarted\" | \"dropped\" | \"ignored\">"
    )]
    pub fn answer(&self, id: u32, number: u32, width: u32, depth: Vec<f32>, registration: Vec<f32>) -> Promise {
        let core = Rc::clone(&self.core);
        settle::promise(async move {
            let maps = match depth.is_empty() {
                true => None,
                false => Some(maps_from(width, depth, &registration)?),
            };
            core.borrow_mut().track(id)?.answer(number, maps.as_ref())
        })
    }

    /// Depth and registration of a target's mesh in the latest frame, -1 where it is not seen.
    ///
    /// Rejects with an `Error` whose `code` is `target-unknown`.
    #[wasm_bindgen(
        unchecked_return_type = "Promise<{ width: number, focal: number, depth: Float32Array, registration: Float32Array }>"
    )]
    pub fn maps(&self, id: u32) -> Promise {
        let core = Rc::clone(&self.core);
        settle::promise(async move {
            let mut core = core.borrow_mut();
            let track = core.track(id)?;
            let maps = track.tracker.maps();
            let camera = track.tracker.camera().unwrap_or(track.training);
            let registration = Float32Array::from(maps.registration().as_flattened());
            Ok(object([
                ("width", (maps.width() as u32).into()),
                ("focal", camera.focal().x.into()),
                ("depth", Float32Array::from(maps.depth()).into()),
                ("registration", registration.into()),
            ]))
        })
    }

    fn adding(&self, id: u32, template: impl FnOnce() -> Result<(Template, Camera), Failure> + 'static) -> Promise {
        let core = Rc::clone(&self.core);
        settle::promise(async move {
            let (template, training) = template()?;
            core.borrow_mut().add(id, &template, training)?;
            Ok(JsValue::UNDEFINED)
        })
    }
}

impl Core {
    fn add(&mut self, id: u32, template: &Template, training: Camera) -> Result<(), Failure> {
        let tracker = Tracker::new(template, TrackingOptions::default());
        let track = Track {
            tracker: tracker.map_err(|error| Failure::of_target(&error.into()))?,
            smoothing: self.smoothing.clone().map(OneEuro::new),
            training,
            template: template.clone(),
            calibration: None,
        };
        self.tracks.insert(id, track);
        Ok(())
    }

    fn track(&mut self, id: u32) -> Result<&mut Track, Failure> {
        let unknown = || Failure::new(Code::TargetUnknown, "The target is not followed.");
        self.tracks.get_mut(&id).ok_or_else(unknown)
    }

    fn follow(
        &mut self,
        (number, time_s): (u32, f64),
        view: &mut View<'_>,
        focal: f64,
        calibrate: bool,
    ) -> Result<Object, Failure> {
        let (mut whole, mut stopwatch) = (Stopwatch::start(), Stopwatch::start());
        let failed = |error: DeepSftError| Failure::of_frame(&error, false);
        // Targets share the canonical image.
        let mut shared: Option<(Camera, TrackerImage)> = None;
        // All have forgotten it; the others drop it.
        let mut spare = self
            .tracks
            .values_mut()
            .filter_map(|track| track.tracker.spare_image())
            .last();
        let mut warp_ms = 0.0;
        let targets = Array::new();
        let mut calibrated: Option<CalibratedCamera> = None;
        for (&id, track) in &mut self.tracks {
            let nearest = canonical_camera(&track.training, view.size());
            let canonical = view_from(&nearest, focal)?;
            let image = match shared.take().filter(|(camera, _)| *camera == canonical) {
                Some((_, image)) => image,
                None => {
                    stopwatch.lap_ms();
                    let image = TrackerImage::of_into(view.canonical(&canonical).map_err(failed)?, spare.take());
                    make_room(canonical.size());
                    warp_ms += stopwatch.lap_ms();
                    image
                }
            };
            let tracked = track
                .tracker
                .follow_shared(u64::from(number), time_s, &image, &canonical)?;
            targets.push(&tracked_target(id, tracked, &mut track.smoothing, time_s));
            if calibrate {
                // All of one camera's images.
                let picture = view.canonical(&nearest).map_err(failed)?;
                if let Some(found) = track.calibrated(picture, &nearest, number)?
                    && calibrated
                        .as_ref()
                        .is_none_or(|best| found.focal_deviation < best.focal_deviation)
                {
                    calibrated = Some(found);
                }
            } else if let Some(calibration) = &mut track.calibration {
                // Made anew at each change of the camera it would tear the memory to pieces, which then grows.
                calibration.reset();
            }
            shared = Some((canonical, image));
        }
        Ok(object([
            ("targets", targets.into()),
            (
                "focal",
                calibrated.map_or(JsValue::NULL, |found| focal_ratio(&found).into()),
            ),
            ("warpMs", warp_ms.into()),
            ("trackMs", (whole.lap_ms() - warp_ms).into()),
        ]))
    }
}

impl Track {
    /// Lets the mesh in the newest frame, whose canonical image is `picture`, tell of the camera.
    fn calibrated(
        &mut self,
        picture: &Picture,
        canonical: &Camera,
        number: u32,
    ) -> Result<Option<CalibratedCamera>, Failure> {
        let calibration = match &mut self.calibration {
            Some(calibration) => calibration,
            none => none.insert(SelfCalibration::new(&self.template, SelfCalibrationOptions::default())?),
        };
        let tracked = self.tracker.current();
        if tracked.found && tracked.correlation >= TELLING_CORRELATION {
            calibration.offer(picture, canonical, &tracked.vertices_camera)?;
        }
        if !number.is_multiple_of(CALIBRATION_INTERVAL) {
            return Ok(None);
        }
        Ok(calibration.step()?)
    }

    fn answer(&mut self, number: u32, maps: Option<&Maps>) -> Result<&'static str, Failure> {
        let update = self.tracker.update(u64::from(number), maps)?;
        if let (TrackUpdate::Started | TrackUpdate::Restarted, Some(filter)) = (update, &mut self.smoothing) {
            filter.reset();
        }
        Ok(update.name())
    }
}

/// Makes room for what a frame takes for a moment where the sheet fills the view, without touching it. Memory of WebAssembly never
/// shrinks: so it grows in the first frames, and not when the sheet first comes near in a page that has long been at work.
fn make_room((width, height): (usize, usize)) {
    black_box(Vec::<u8>::with_capacity(ROOM_BYTES * width * height));
}

/// A focal length that was found, as a plain object.
fn focal_ratio(found: &CalibratedCamera) -> Object {
    object([
        ("ratio", (found.camera.focal().x / found.assumed.focal().x).into()),
        ("deviation", found.focal_deviation.into()),
    ])
}

/// The mesh of a target in one frame: a plain object, whose arrays belong to JavaScript.
fn tracked_target(id: u32, tracked: &Tracked, smoothing: &mut Option<OneEuro>, time_s: f64) -> Object {
    let vertices = match smoothing {
        Some(filter) if tracked.found => {
            let mut vertices = tracked.vertices_camera.clone();
            filter.smooth(time_s, &mut vertices);
            positions(&vertices)
        }
        _ => positions(&tracked.vertices_camera),
    };
    object([
        ("id", id.into()),
        ("found", tracked.found.into()),
        ("vertices", vertices.into()),
        ("confidence", Float32Array::from(tracked.confidence.as_slice()).into()),
        ("correlation", tracked.correlation.into()),
        ("iterations", (tracked.iterations as u32).into()),
    ])
}
