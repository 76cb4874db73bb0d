//! The fit of one target, which the finders of targets that resemble it ask too.

use crate::error::DeepSftError;
use deepsft_geometry::fitting::{FitOptions, FrameFitter};
use deepsft_geometry::{Camera, GeometryError, Picture, Surface, Template};
use std::sync::{Arc, Mutex, PoisonError, Weak};

/// Explained fraction below which a mesh may lie off, where no print is confirmed as it could be, and how many times the evidence of any
/// lookalike it must have there. Of 121 right fits to frames of cards the image confirmed 0.70 or more, of a wrong one that lay off 0.45.
const UNSURE: f64 = 0.6;
const UNSURE_TIMES: f32 = 2.0;

/// The fit of a target, made for the first image in which something is seen.
#[derive(Debug)]
pub(super) struct TargetFitter {
    template: Template,
    fitter: Mutex<Option<FrameFitter>>,
}

impl TargetFitter {
    pub(super) fn new(template: &Template) -> Arc<Self> {
        Arc::new(Self {
            template: template.clone(),
            fitter: Mutex::default(),
        })
    }

    /// Lets the fit do something.
    pub(super) fn with<T>(
        &self,
        work: impl FnOnce(&mut FrameFitter) -> Result<T, GeometryError>,
    ) -> Result<T, DeepSftError> {
        let mut fitter = self.fitter.lock().unwrap_or_else(PoisonError::into_inner);
        let made = match fitter.take() {
            Some(made) => made,
            None => FrameFitter::new(&self.template, FitOptions::default())?,
        };
        Ok(work(fitter.insert(made))?)
    }

    /// Whether the image confirms one of `lookalikes` more than this target where `surface` has it: each is drawn on that very mesh. One
    /// with another mesh does not count.
    pub(super) fn is_outdone(
        &self,
        lookalikes: &[Weak<Self>],
        (image, camera): (&Picture, &Camera),
        surface: &Surface,
    ) -> Result<bool, DeepSftError> {
        let mesh = self.template.mesh();
        let evidence = |of: &Self, times: f32| {
            // What is twice as large looks the same from twice as far.
            let scale = of.template.size_mm().x / self.template.size_mm().x;
            let vertices: Vec<_> = surface.vertices_camera.iter().map(|p| *p * scale).collect();
            let confidence = of.with(|fitter| fitter.confidence_at(image, camera, &vertices))?;
            let drawn = Surface {
                confidence: confidence.iter().map(|confidence| times * confidence).collect(),
                ..surface.clone()
            };
            Ok::<_, DeepSftError>(drawn.evidence(mesh, camera))
        };
        let is_unsure = surface.verdict.explained < UNSURE;
        let times = if is_unsure { UNSURE_TIMES } else { 1.0 };
        let mut own = None;
        for lookalike in lookalikes.iter().filter_map(Weak::upgrade) {
            if lookalike.template.mesh().faces() != mesh.faces() {
                continue;
            }
            let own = match &own {
                Some(own) => own,
                None => own.insert(evidence(self, 1.0)?),
            };
            if own.gives_way_to(&evidence(&lookalike, times)?) {
                return Ok(true);
            }
        }
        Ok(false)
    }
}
