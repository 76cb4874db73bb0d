//! The tracker: a session of one video, its arguments and results as JavaScript has them.

use crate::{
    clock::{Stopwatch, now_s},
    failure::{Code, Failure},
    input::{camera_from, files_from, frame_from, view_from},
    mesh::surface_object,
    object::object,
    settle,
    target_template::TargetTemplate,
};
use deepsft::{
    DeepSftError, ModelBundle, View,
    geometry::{Camera, Template, canonical_camera, glam::Vec3, tracking::OneEuroOptions, training_camera},
    session::{Answer, Effect, Followed, Question, Session, SessionOptions, Source},
};
use js_sys::{Array, Float32Array, Object, Promise};
use std::{cell::RefCell, hint::black_box, rc::Rc};
use wasm_bindgen::prelude::*;

/// Follows the meshes of targets through one video, beside an [`crate::Engine`] in another instance of this module that
/// says where they are.
#[wasm_bindgen]
pub struct MeshTracker {
    core: Rc<RefCell<Core>>,
}

struct Core {
    session: Session,
    /// The camera of the last frame.
    source: Option<Camera>,
}

#[wasm_bindgen]
extern "C" {
    /// What finders see of one target.
    #[wasm_bindgen(typescript_type = "{ id: number, sightings: Float32Array[] }")]
    pub type RawAnswer;
    #[wasm_bindgen(method, getter)]
    fn id(this: &RawAnswer) -> u32;
    #[wasm_bindgen(method, getter)]
    fn sightings(this: &RawAnswer) -> Vec<Float32Array>;
}

/// What following a sheet takes for a moment where it fills the view, for each pixel: half as much of an A4 sheet 400 mm away.
const ROOM_BYTES: usize = 56;

/// The copies of a target have its number and as many times this more: no page has so many targets.
const COPIES_APART: u32 = 1 << 24;

#[wasm_bindgen]
impl MeshTracker {
    /// A tracker that follows nothing yet.
    ///
    /// With `smooth` each vertex passes a One-Euro filter; `min_cutoff` (Hz) and `beta` (Hz per mm/s) replace its defaults.
    #[wasm_bindgen(constructor)]
    pub fn new(smooth: bool, min_cutoff: Option<f64>, beta: Option<f64>) -> Self {
        let defaults = OneEuroOptions::default();
        let smoothing = OneEuroOptions {
            min_cutoff_hz: min_cutoff.unwrap_or(defaults.min_cutoff_hz),
            speed_coefficient: beta.unwrap_or(defaults.speed_coefficient),
        };
        let options = SessionOptions {
            smoothing: smooth.then_some(smoothing),
            ..SessionOptions::default()
        };
        let core = Core {
            session: Session::new(options),
            source: None,
        };
        Self {
            core: Rc::new(RefCell::new(core)),
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
        self.adding((id, true), move || {
            ModelBundle::template_from_files(&files_from(&files)?).map_err(Failure::of_model)
        })
    }

    /// Follows a target without a network too.
    ///
    /// Rejects with an `Error` whose `code` is `target-unusable` or `internal`.
    #[wasm_bindgen(js_name = addTarget, unchecked_return_type = "Promise<void>")]
    pub fn add_target(&self, id: u32, template: TargetTemplate) -> Promise {
        self.adding((id, false), move || Ok((template.0, training_camera())))
    }

    /// Follows up to so many copies of a target's print, which is followed already.
    ///
    /// Rejects with an `Error` whose `code` is `target-unusable` or `internal`.
    #[wasm_bindgen(js_name = lookForCopies, unchecked_return_type = "Promise<void>")]
    pub fn look_for_copies(&self, id: u32, copies: u32) -> Promise {
        let core = Rc::clone(&self.core);
        settle::promise(async move {
            let session = &mut core.borrow_mut().session;
            let added = (1..copies).try_for_each(|copy| session.add_copy(id + copy * COPIES_APART, id));
            added.map_err(Failure::of_target)?;
            Ok(JsValue::UNDEFINED)
        })
    }

    /// Follows a target no longer.
    #[wasm_bindgen(js_name = removeTarget)]
    pub fn remove_target(&self, id: u32) {
        self.core.borrow_mut().session.remove(id);
    }

    /// The next frame of the video, as for [`crate::Engine::estimate`], at `time_s`, ascending; `afresh`: the first of another camera or
    /// file. `source` is the camera that took it, `[width, height, fx, ...]`, and `focal_deviation` how sure its focal length is, a fraction:
    /// infinite for a guess, 0 where nobody wants it better. `focal` is the focal length, pixels, of the canonical image that it is followed
    /// in, and `asked` the targets that finders look for in it.
    ///
    /// Resolves to the meshes of all targets in it, and of their copies after them: `surface` (null unless found), `correlation` (of the whole visible print), solver `iterations`; whether all began `afresh` with it; the focal length
    /// where it is told, a multiple of the given one with its standard deviation, a fraction of it; and what the next frame is for. Rejects
    /// with an `Error` whose `code` is `camera-intrinsics`, `image-unreadable` or `internal`.
    #[wasm_bindgen(
        unchecked_return_type = "Promise<{ targets: { id: number, copy: number, found: boolean, held: boolean, surface: RawSurface | null, correlation: number, iterations: number }[], afresh: boolean, focal: { ratio: number, deviation: number } | null, next: { focal: number, intervalMs: number, question: { ids: number[], onlyConfirms: boolean } | null }, warpMs: number, trackMs: number }>"
    )]
    pub fn follow(
        &self,
        time_s: f64,
        afresh: bool,
        #[wasm_bindgen(unchecked_param_type = "Uint8Array | Uint8ClampedArray")] rgba: Vec<u8>,
        width: usize,
        height: usize,
        camera: Vec<f64>,
        source: Vec<f64>,
        focal_deviation: f64,
        focal: f64,
        asked: Option<Vec<u32>>,
        only_confirms: bool,
    ) -> Promise {
        let core = Rc::clone(&self.core);
        settle::promise(async move {
            let (picture, camera) = frame_from(&rgba, (width, height), &camera)?;
            let source = Source {
                camera: source_from(&source)?,
                focal_deviation,
            };
            let core = &mut *core.borrow_mut();
            if afresh {
                core.session.restart();
            }
            if let Some(targets) = asked {
                core.session.ask(Question { targets, only_confirms }, now_s());
            }
            core.follow((time_s, focal), &source, &mut View::new(&picture, &camera))
        })
    }

    /// Where finders see the targets in the frame that they were asked about. It took them `took_ms`, and the page last missed a frame
    /// `since_missed_ms` ago.
    ///
    /// Resolves to what the tracker makes of it, and what the next frame is for. Rejects with an `Error` whose `code` is `image-unreadable`
    /// or `internal`.
    #[wasm_bindgen(
        unchecked_return_type = "Promise<{ effects: { id: number, effect: \"started\" | \"confirmed\" | \"restarted\" | \"dropped\" | \"ignored\" }[], next: { focal: number, intervalMs: number, question: { ids: number[], onlyConfirms: boolean } | null } | null }>"
    )]
    pub fn answer(&self, answers: Vec<RawAnswer>, took_ms: f64, since_missed_ms: f64) -> Promise {
        let core = Rc::clone(&self.core);
        settle::promise(async move {
            let answers = answers.iter().map(answer_from).collect::<Vec<Answer>>();
            let core = &mut *core.borrow_mut();
            let [took_s, since_missed_s] = [took_ms, since_missed_ms].map(|ms| ms / 1000.0);
            let heard = core.session.answer(&answers, now_s(), took_s, since_missed_s);
            let effects = heard.map_err(|error| Failure::of_frame(&error, false))?;
            let effect = |effect: &Effect| {
                object([
                    ("id", (effect.target % COPIES_APART).into()),
                    ("effect", effect.update.name().into()),
                ])
            };
            Ok(object([
                ("effects", effects.iter().map(effect).collect::<Array>().into()),
                ("next", core.next()),
            ]))
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
            let unknown = || Failure::new(Code::TargetUnknown, "The target is not followed.");
            let (camera, maps) = core.borrow().session.maps(id).ok_or_else(unknown)?;
            let registration = Float32Array::from(maps.registration().as_flattened());
            Ok(object([
                ("width", (maps.size().width as u32).into()),
                ("focal", camera.focal().x.into()),
                ("depth", Float32Array::from(maps.depth()).into()),
                ("registration", registration.into()),
            ]))
        })
    }

    fn adding(
        &self,
        (id, can_deny): (u32, bool),
        template: impl FnOnce() -> Result<(Template, Camera), Failure> + 'static,
    ) -> Promise {
        let core = Rc::clone(&self.core);
        settle::promise(async move {
            let (template, training) = template()?;
            let added = core.borrow_mut().session.add(id, &template, training, can_deny);
            added.map_err(Failure::of_target)?;
            Ok(JsValue::UNDEFINED)
        })
    }
}

impl Core {
    fn follow(
        &mut self,
        (time_s, focal): (f64, f64),
        source: &Source,
        image: &mut View<'_>,
    ) -> Result<Object, Failure> {
        let failed = |error: DeepSftError| Failure::of_frame(&error, false);
        let mut stopwatch = Stopwatch::start();
        let view = view_from(&canonical_camera(&training_camera(), image.size()), focal)?;
        // Made room for, without touching it: memory of WebAssembly never shrinks, so it grows in the first frames, and not when the sheet first
        // comes near in a page that has long been at work.
        black_box(Vec::<u8>::with_capacity(ROOM_BYTES * view.size().area()));
        image.canonical(&view).map_err(failed)?;
        let warp_ms = stopwatch.lap_ms();
        let frame = self.session.frame(time_s, source, &view, image).map_err(failed)?;
        let track_ms = stopwatch.lap_ms();
        self.source = Some(source.camera);
        let targets: Array = frame.targets.iter().map(target_object).collect();
        let focal = frame.calibrated.map_or(JsValue::NULL, |found| {
            let ratio = found.camera.focal().x / found.assumed.focal().x;
            object([("ratio", ratio.into()), ("deviation", found.focal_deviation.into())]).into()
        });
        Ok(object([
            ("targets", targets.into()),
            ("afresh", frame.afresh.into()),
            ("focal", focal),
            ("next", self.next()),
            ("warpMs", warp_ms.into()),
            ("trackMs", track_ms.into()),
        ]))
    }

    /// What the next frame is for, if the camera stays the same; null before the first.
    fn next(&self) -> JsValue {
        let Some(source) = &self.source else {
            return JsValue::NULL;
        };
        let next = self.session.next(source, now_s());
        let question = next
            .question
            .map_or(JsValue::NULL, |Question { targets, only_confirms }| {
                let ids = Array::from_iter(targets.into_iter().map(JsValue::from));
                object([("ids", ids.into()), ("onlyConfirms", only_confirms.into())]).into()
            });
        object([
            ("focal", next.view.focal().x.into()),
            ("intervalMs", (1000.0 * next.interval_s).into()),
            ("question", question),
        ])
        .into()
    }
}

/// The camera of `[width, height, fx, ...]`.
fn source_from(numbers: &[f64]) -> Result<Camera, Failure> {
    match numbers {
        [width, height, intrinsics @ ..] => camera_from((*width as usize, *height as usize), intrinsics),
        short => camera_from((0, 0), short),
    }
}

fn answer_from(answer: &RawAnswer) -> Answer {
    let vertices = |seen: &Float32Array| {
        let coordinates = seen.to_vec();
        let points = coordinates.as_chunks::<3>().0.iter();
        points.map(|&point| Vec3::from(point).as_dvec3()).collect()
    };
    Answer {
        target: answer.id(),
        starts: answer.sightings().iter().map(vertices).collect(),
    }
}

/// A target in one frame: a plain object, whose arrays belong to JavaScript.
fn target_object(followed: &Followed) -> Object {
    let surface = followed.surface.as_ref();
    object([
        ("id", (followed.target % COPIES_APART).into()),
        ("copy", (followed.target / COPIES_APART).into()),
        ("found", followed.found.into()),
        ("held", followed.held.into()),
        (
            "surface",
            surface.map_or(JsValue::NULL, |surface| surface_object(surface).into()),
        ),
        ("correlation", followed.correlation.into()),
        ("iterations", (followed.iterations as u32).into()),
    ])
}
