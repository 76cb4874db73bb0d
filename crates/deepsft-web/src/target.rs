//! A target in the engine: what finds it, and what makes meshes of it.

use crate::{
    clock::{Stopwatch, now_ms},
    estimate::{RawEstimate, Times},
    failure::{Code, Failure},
    input::view_from,
    mesh::{RawMesh, template_mesh},
    object::{object, rgba},
};
use deepsft::{
    DeepSftError, Estimator, Finder, ImageSize, Sighting, Target, TargetFinder, View,
    features::{FeatureFinder, PictureGrade, PictureTarget},
    geometry::{
        Camera, CompletionOptions, Maps, MapsCompletion, Picture, Surface, Template,
        fitting::{FitOptions, FrameFitter, Start},
    },
};
use js_sys::{Array, Object, Uint8ClampedArray};
use std::cell::RefCell;
use wasm_bindgen::JsValue;

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

    /// A sheet that nothing was trained for.
    pub fn of_sheet(template: Template) -> Result<Self, Failure> {
        let unusable = |error: DeepSftError| Failure::of_target(&error);
        let picture = PictureTarget::from_template(template.clone()).map_err(|error| unusable(error.into()))?;
        if picture.features().len() < MIN_CORNERS {
            return Err(Failure::new(
                Code::TargetUnusable,
                "The picture is blank, or nearly so, or too small: there is nothing in it to recognise it by.",
            ));
        }
        let target = Target::from_template(template);
        let grade = Some(picture.grade());
        let features = FeatureFinder::new(picture).map_err(|error| unusable(error.into()))?;
        let finder = TargetFinder::with_finders(target.clone(), vec![Finder::Features(Box::new(features))]);
        Ok(Self {
            grade,
            finder: RefCell::new(Some(finder)),
            ..Self::of_model(target)
        })
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
            ("rgba", Uint8ClampedArray::from(rgba(texture).as_slice()).into()),
            ("sizeMm", Array::of2(&size.x.into(), &size.y.into()).into()),
            ("mesh", template_mesh(template.mesh()).into()),
            ("grade", self.grade.as_ref().map_or(JsValue::NULL, grade_object)),
        ])
    }

    /// The camera that stands for images of `size`: the canonical one, zoomed to a focal length in pixels.
    pub fn view_camera(&self, size: ImageSize, focal: f64) -> Result<Camera, Failure> {
        view_from(&self.target.canonical_camera(size), focal)
    }

    /// What the finders see and the image confirms, as `camera` sees it.
    pub async fn find(&self, view: &mut View<'_>, camera: &Camera) -> Result<Vec<Sighting>, DeepSftError> {
        let mut finder = self.taken_finder()?;
        let seen = finder.find(view, camera).await;
        self.finder.replace(Some(finder));
        seen
    }

    /// The target in one image: a network's maps as they are, those of features fitted to the image.
    pub async fn estimate(&self, view: &mut View<'_>) -> Result<RawEstimate, DeepSftError> {
        if let Some(network) = self.target.network() {
            let (estimate, times) = network.estimate_timed(view.image(), view.camera(), now_ms).await?;
            let times = Times {
                warp_ms: times.warp_ms,
                network_ms: times.network_ms,
                judge_ms: times.judge_ms,
                ..Times::default()
            };
            return Ok(RawEstimate::new(&estimate, &times));
        }
        let mut stopwatch = Stopwatch::start();
        view.canonical(&self.target.canonical_camera(view.size()))?;
        let warp_ms = stopwatch.lap_ms();
        let mut finder = self.taken_finder()?;
        let estimate = finder.estimate(view).await;
        self.finder.replace(Some(finder));
        let times = Times {
            warp_ms,
            features_ms: stopwatch.lap_ms(),
            ..Times::default()
        };
        Ok(RawEstimate::new(&estimate?, &times))
    }

    fn taken_finder(&self) -> Result<TargetFinder, DeepSftError> {
        match self.finder.take() {
            Some(finder) => Ok(finder),
            None => TargetFinder::new(self.target.clone()),
        }
    }

    /// ARAP completion of maps of `camera`.
    pub fn complete(&self, maps: &Maps, camera: &Camera) -> Result<Option<RawMesh>, Failure> {
        let mut completion = self.completion.borrow_mut();
        let completion = match &mut *completion {
            Some(completion) => completion,
            none => none.insert(MapsCompletion::new(
                self.target.template().mesh(),
                CompletionOptions::default(),
            )?),
        };
        let mut stopwatch = Stopwatch::start();
        let completed = completion.complete(maps, camera)?;
        Ok(completed.map(|surface| self.raw_mesh(&surface, maps, stopwatch.lap_ms())))
    }

    /// The mesh fitted to a canonical image of `camera`, from a network's maps of it.
    pub fn fit(&self, canonical: &Picture, maps: Maps, camera: &Camera) -> Result<Option<RawMesh>, Failure> {
        let mut stopwatch = Stopwatch::start();
        let mut fitter = self.fitter.borrow_mut();
        let fitter = match &mut *fitter {
            Some(fitter) => fitter,
            none => none.insert(FrameFitter::new(self.target.template(), FitOptions::default())?),
        };
        let start = Start::Maps(maps.clone());
        let fitted = fitter.fit(canonical, camera, &start)?;
        Ok(fitted.map(|surface| self.raw_mesh(&surface, &maps, stopwatch.lap_ms())))
    }

    /// A surface with its maps, in the mask of those that it was made from.
    fn raw_mesh(&self, surface: &Surface, seen: &Maps, solve_ms: f64) -> RawMesh {
        let maps = surface.maps(self.target.template().mesh()).within(seen);
        RawMesh::of(surface, &maps, solve_ms)
    }
}

fn grade_object(grade: &PictureGrade) -> JsValue {
    let reasons: Array = grade
        .advice
        .iter()
        .map(|sentence| JsValue::from(sentence.as_str()))
        .collect();
    object([("level", grade.level.name().into()), ("reasons", reasons.into())]).into()
}
