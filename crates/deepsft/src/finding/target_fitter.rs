//! The fit of one target, which the finders of targets that resemble it ask too.

use crate::error::DeepSftError;
use deepsft_geometry::fitting::{FrameFitter, Start};
use deepsft_geometry::{Camera, GeometryError, Picture, Surface, Template};
use std::sync::{Arc, Mutex, PoisonError, Weak};

/// Explained fraction below which a mesh may lie off, where no print is confirmed as it could be, and how many times the evidence of any
/// lookalike it must have there. Of 198 right fits to frames of cards all but two explain 0.70 or more, these 0.51 and 0.36, a wrong one
/// that lay off 0.45.
const UNSURE: f64 = 0.5;
const UNSURE_TIMES: f32 = 2.0;

/// Explained fraction below which the lookalikes are fitted where a mesh lies, if the image confirms this fraction as much of them before,
/// and that such a fit must have. Of 200 frames of twelve cards five had a second card by its frame alone, 0.62 to 0.78 explained and
/// some millimetres off, where the right card explained 0.85 or more once it was fitted.
const SURE: f64 = 0.8;
const CLOSE: f32 = 0.5;

/// How many times its own evidence a lookalike has below [`SURE`], if the two share no corner. Drawn in the image of close-ups the best
/// lookalike of a right card had 0.81 of its evidence or less, of a wrong one that lay by its frame alone 0.92.
const DOUBTFUL_TIMES: f64 = 1.2;

/// An image and the camera that took it.
pub(super) type Seen<'a> = (&'a Picture, &'a Camera);

/// A target whose print resembles that of another.
#[derive(Clone, Debug)]
pub(super) struct Lookalike {
    /// Its fit, as long as the target lives.
    pub(super) fitter: Weak<TargetFitter>,
    /// Fraction of corners that both have.
    pub(super) share: f64,
}

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
            None => FrameFitter::new(&self.template)?,
        };
        Ok(work(fitter.insert(made))?)
    }

    /// Whether an image confirms one of `lookalikes` more than this target where `surface` has it: each is drawn on that very mesh in
    /// `closest`, and where that leaves a doubt fitted from there in `canonical`. One with another mesh does not count. `is_final`: before the
    /// last fit a doubt says nothing.
    pub(super) fn is_outdone(
        &self,
        lookalikes: &[Lookalike],
        (closest, canonical): (Seen<'_>, Seen<'_>),
        surface: &Surface,
        is_final: bool,
    ) -> Result<bool, DeepSftError> {
        let (image, camera) = closest;
        let mesh = self.template.mesh();
        // What is twice as large looks the same from twice as far.
        let vertices_of = |of: &Self| -> Vec<_> {
            let scale = of.template.size_mm().x / self.template.size_mm().x;
            surface.vertices_camera.iter().map(|p| *p * scale).collect()
        };
        let evidence = |of: &Self, times: f32| {
            let confidence = of.with(|fitter| fitter.confidence_at(image, camera, &vertices_of(of)))?;
            let drawn = Surface {
                confidence: confidence.iter().map(|confidence| times * confidence).collect(),
                ..surface.clone()
            };
            Ok::<_, DeepSftError>(drawn.evidence(mesh, camera))
        };
        let fitted = |of: &Self| {
            let (image, camera) = canonical;
            let fitted = of.with(|fitter| fitter.fit(image, camera, &Start::Mesh(vertices_of(of))))?;
            let told = |fitted: Surface| (fitted.verdict.explained, fitted.evidence(of.template.mesh(), camera));
            Ok::<_, DeepSftError>(fitted.map(told))
        };
        let explained = surface.verdict.explained;
        let mut own = None;
        for Lookalike { fitter, share } in lookalikes {
            let Some(lookalike) = fitter.upgrade() else { continue };
            if lookalike.template.mesh().faces() != mesh.faces() {
                continue;
            }
            let own = match &own {
                Some(own) => own,
                None => own.insert(evidence(self, 1.0)?),
            };
            // A lead counts only where fine print does.
            let is_close = camera != canonical.1;
            let times = if is_final && explained < UNSURE {
                UNSURE_TIMES
            } else if is_final && explained < SURE && is_close {
                (1.0 + (DOUBTFUL_TIMES - 1.0) * (1.0 - share)) as f32
            } else {
                1.0
            };
            let drawn = evidence(&lookalike, times)?;
            if own.gives_way_to(&drawn) {
                return Ok(true);
            }
            let is_in_doubt = is_final && explained < SURE && own.is_rivalled_by(&drawn, CLOSE);
            if is_in_doubt
                && let Some((explained, better)) = fitted(&lookalike)?
                && explained >= SURE
                && fitted(self)?.is_none_or(|(_, own)| own.gives_way_to(&better))
            {
                return Ok(true);
            }
        }
        Ok(false)
    }
}
