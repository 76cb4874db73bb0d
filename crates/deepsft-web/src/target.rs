//! A target in the engine: what finds it, and what makes meshes of it.

use crate::{
    clock::{Stopwatch, now_ms},
    estimate::estimate_object,
    failure::{Code, Failure},
    input::view_from,
    mesh::{mesh_object, template_mesh},
    object::{object, rgba},
};
use deepsft::{
    CameraOrigin, DeepSftError, Estimate, EstimateTimes, Estimator, Sighting, Target, TargetFinder, View,
    features::PictureGrade,
    geometry::{
        CalibratedCamera, Camera, CompletionOptions, ImageSize, Maps, MapsCompletion, Picture, Surface, Template,
        fitting::{FrameFitter, Start},
    },
};
use js_sys::{Array, Float32Array, Object};
use std::cell::RefCell;
use wasm_bindgen::prelude::*;

#[wasm_bindgen(typescript_custom_section)]
const TYPE: &str = r#"
/** A print as a frame shows it, laid flat. */
export interface RawFlatPrint {
  /** Columns. */
  width: number;
  /** Four numbers for each pixel, white where the frame does not show it. */
  rgba: Uint8ClampedArray<ArrayBuffer>;
  /** How much the frame shows of each pixel, 0 to 1. */
  confidence: Float32Array;
}
"#;

/// Corners that a picture must have: below, nothing tells it from anything else.
const MIN_CORNERS: usize = 12;

/// A target with its finders. What makes meshes is made when it is first needed.
pub struct EngineTarget {
    target: Target,
    /// Of what features find.
    grade: Option<PictureGrade>,
    /// Away while it works.
    finder: RefCell<Option<TargetFinder>>,
    /// For a network's maps; the finder has its own.
    fitter: RefCell<Option<FrameFitter>>,
    completion: RefCell<Option<MapsCompletion>>,
}

impl EngineTarget {
    /// The target of a model: its finder is made for the first video.
    pub fn of_model(target: Target) -> Self {
        Self {
            target,
            grade: None,
            finder: RefCell::default(),
            fitter: RefCell::default(),
            completion: RefCell::default(),
        }
    }

    /// A template that nothing was trained for.
    pub fn of_template(template: Template) -> Result<Self, Failure> {
        let target = Target::from_template(template);
        let finder = TargetFinder::new(target.clone()).map_err(Failure::of_target)?;
        let grade = finder.grade();
        if grade.as_ref().is_some_and(|grade| grade.corners < MIN_CORNERS) {
            return Err(Failure::new(
                Code::TargetUnusable,
                "The picture is blank, or nearly so, or too small: there is nothing in it to recognise it by.",
            ));
        }
        Ok(Self {
            grade,
            finder: RefCell::new(Some(finder)),
            ..Self::of_model(target)
        })
    }

    /// How much its picture shares with that of `other`, 0 to 1; from [`deepsft::ALIKE`] on the two are told apart from now on.
    pub fn tell_apart(&self, other: &Self) -> f64 {
        match (&mut *self.finder.borrow_mut(), &mut *other.finder.borrow_mut()) {
            (Some(own), Some(others)) => own.tell_apart(others),
            _ => 0.0,
        }
    }

    /// The model's own network, if the target is that of a model.
    pub fn network(&self) -> Option<&Estimator> {
        self.target.network()
    }

    /// Texture, size, mesh and grade: a plain object.
    pub fn description(&self) -> Object {
        let template = self.target.template();
        let (texture, size) = (template.texture(), template.size_mm());
        object([
            ("width", (texture.width() as f64).into()),
            ("height", (texture.height() as f64).into()),
            ("rgba", rgba(texture).into()),
            ("sizeMm", Array::of2(&size.x.into(), &size.y.into()).into()),
            ("mesh", template_mesh(template.mesh()).into()),
            ("grade", self.grade.as_ref().map_or(JsValue::NULL, grade_object)),
        ])
    }

    /// The camera that stands for images of `size`: the canonical one, zoomed to a focal length in pixels.
    pub fn view_camera(&self, size: ImageSize, focal: f64) -> Result<Camera, Failure> {
        view_from(&self.target.canonical_camera(size), focal)
    }

    /// Looks for so many copies of the print.
    pub fn look_for_copies(&self, copies: u32) {
        if let Some(finder) = &mut *self.finder.borrow_mut() {
            finder.look_for_copies(copies);
        }
    }

    /// What the finders see and the image confirms, as `camera` sees it, and the maps of a network.
    pub async fn find(
        &self,
        view: &mut View<'_>,
        camera: &Camera,
    ) -> Result<(Vec<Sighting>, Option<Maps>), DeepSftError> {
        let mut finder = self.taken_finder()?;
        let seen = finder.find(view, camera).await;
        self.finder.replace(Some(finder));
        seen
    }

    /// The print that an image shows, laid flat, `columns` pixels wide, without shading where it is to be `unshaded`: a plain object, the `RawFlatPrint` of TypeScript. Of the camera as
    /// for [`EngineTarget::estimate`].
    pub async fn flatten(
        &self,
        (image, camera): (&Picture, &Camera),
        origin: CameraOrigin,
        columns: usize,
        unshaded: bool,
    ) -> Result<Option<Object>, DeepSftError> {
        let (estimate, told) = self.found_in((image, camera), origin).await?;
        let camera = told.as_ref().map_or(camera, |told| &told.camera);
        let Some(surface) = estimate.surface.filter(|_| estimate.judgement.found) else {
            return Ok(None);
        };
        let template = self.target.template();
        let mut flat = surface.flatten(template, (image, camera), columns)?;
        if unshaded {
            flat = flat.without_shading(template.texture());
        }
        Ok(Some(object([
            ("width", (columns as u32).into()),
            ("rgba", rgba(&flat.picture).into()),
            ("confidence", Float32Array::from(flat.confidence.as_slice()).into()),
        ])))
    }

    /// The target in one image: a network's maps as they are, those of features fitted to the image. Where those are of a sheet it tells the
    /// camera, if that is not known.
    pub async fn estimate(
        &self,
        (image, camera): (&Picture, &Camera),
        origin: CameraOrigin,
    ) -> Result<Object, DeepSftError> {
        if let Some(network) = self.target.network() {
            let (estimate, times) = network.estimate_timed(image, camera, now_ms).await?;
            return Ok(estimate_object(&estimate, None, times, 0.0));
        }
        let mut stopwatch = Stopwatch::start();
        let (estimate, told) = self.found_in((image, camera), origin).await?;
        let (times, features_ms) = (EstimateTimes::default(), stopwatch.lap_ms());
        Ok(estimate_object(&estimate, told.as_ref(), times, features_ms))
    }

    async fn found_in(
        &self,
        (image, camera): (&Picture, &Camera),
        origin: CameraOrigin,
    ) -> Result<(Estimate, Option<CalibratedCamera>), DeepSftError> {
        let mut finder = self.taken_finder()?;
        let estimated = finder.estimate_with_camera(image, camera, origin).await;
        self.finder.replace(Some(finder));
        estimated
    }

    fn taken_finder(&self) -> Result<TargetFinder, DeepSftError> {
        match self.finder.take() {
            Some(finder) => Ok(finder),
            None => TargetFinder::new(self.target.clone()),
        }
    }

    /// The mesh from a network's maps of `camera`: fitted to its `canonical` image, or without it their ARAP completion.
    pub fn mesh(&self, canonical: Option<&Picture>, maps: Maps, camera: &Camera) -> Result<Option<Object>, Failure> {
        let template = self.target.template();
        let mut stopwatch = Stopwatch::start();
        let surface = match canonical {
            Some(image) => {
                let make = || FrameFitter::new(template);
                let mut fitter = self.fitter.borrow_mut();
                made(&mut fitter, make)?.fit(image, camera, &Start::Maps(maps.clone()))?
            }
            None => {
                let make = || MapsCompletion::new(template.mesh(), CompletionOptions::default());
                made(&mut self.completion.borrow_mut(), make)?.complete(&maps, camera)?
            }
        };
        let solve_ms = stopwatch.lap_ms();
        let drawn = |surface: Surface| mesh_object(&surface, &surface.maps(template.mesh()).within(&maps), solve_ms);
        Ok(surface.map(drawn))
    }
}

/// What is in `place`, made when it is first needed.
fn made<T, E>(place: &mut Option<T>, make: impl FnOnce() -> Result<T, E>) -> Result<&mut T, E> {
    Ok(match place {
        Some(made) => made,
        none => none.insert(make()?),
    })
}

fn grade_object(grade: &PictureGrade) -> JsValue {
    let reasons: Array = grade
        .advice
        .iter()
        .map(|sentence| JsValue::from(sentence.as_str()))
        .collect();
    object([("level", grade.level.name().into()), ("reasons", reasons.into())]).into()
}
