//! Measures the fit of the mesh: its errors, and those of the maps it starts from, as functions of what makes a
//! frame hard.
//!
//! Frames are synthetic. Apart from one level that says so they are rendered from a mesh with four times the faces of
//! the one that is fitted, so that the fit does not find its own mesh again.

use super::disturbance::{covered, disturbed_maps};
use super::outcome::{Errors, Level, Outcome, Series, mesh_rmse};
use super::plan::{Condition, LEAK_PX, Mask, Plan, Start, plans};
use anyhow::Result;
use deepsft::Estimator;
use deepsft_geometry::fitting::FrameFitter;
use deepsft_geometry::metrics::frame_metrics_between;
use deepsft_geometry::{Camera, GeometryError, Maps, Picture, Template};
use deepsft_synth::Sample;
use rayon::prelude::*;

/// A frame with what came out, for those who watch a study run.
#[derive(Clone, Copy, Debug)]
pub struct StudiedFrame<'a> {
    /// Name of the series.
    pub series: &'static str,
    /// Its unit.
    pub unit: &'static str,
    /// The level.
    pub level: f64,
    /// Number of the frame.
    pub index: u64,
    /// The picture that the mesh was fitted to.
    pub image: &'a Picture,
    /// The true maps of what is visible.
    pub truth: &'a Maps,
    /// The maps that the fit started from.
    pub start: &'a Maps,
    /// The maps of the fitted mesh.
    pub fitted: &'a Maps,
    /// The figures.
    pub outcome: &'a Outcome,
}

/// Number of frames that a study with `frames` a level goes through.
pub fn study_length(frames: u64) -> u64 {
    frames * plans().iter().map(|plan| plan.conditions.len() as u64).sum::<u64>()
}

/// Runs the study of `fitter`, which fits the mesh of `template`, from the maps of `estimator`: `frames` frames
/// of `seed` a level, calling `each` after every one that shows the object.
///
/// # Errors
/// When the device fails or something does not fit.
pub fn study_fit(
    estimator: &Estimator,
    fitter: &mut FrameFitter,
    template: &Template,
    frames: u64,
    seed: u64,
    mut each: impl FnMut(&StudiedFrame<'_>),
) -> Result<Vec<Series>> {
    let mut series = Vec::new();
    for plan in plans() {
        let mut rows = Vec::new();
        for condition in &plan.conditions {
            let synthesizer = condition.synthesizer(template, estimator.training_camera())?;
            let mut bench = Bench {
                estimator,
                fitter,
                template,
                seed,
            };
            let mut outcomes = Vec::new();
            let samples: Vec<Sample> = (0..frames)
                .into_par_iter()
                .map(|index| synthesizer.sample(seed, index))
                .collect();
            for (index, sample) in (0..).zip(&samples).filter(|(_, sample)| sample.has_template) {
                outcomes.push(bench.frame(&plan, condition, index, sample, &mut each)?);
            }
            rows.push(Level::new(condition.level, &outcomes));
        }
        series.push(Series {
            name: plan.name,
            unit: plan.unit,
            start: plan.start,
            rows,
        });
    }
    Ok(series)
}

/// What a frame is put through.
struct Bench<'a> {
    estimator: &'a Estimator,
    fitter: &'a mut FrameFitter,
    template: &'a Template,
    seed: u64,
}

/// A frame under its condition.
struct Disturbed {
    image: Picture,
    truth: Maps,
    start: Maps,
    found: bool,
}

impl Bench<'_> {
    fn frame(
        &mut self,
        plan: &Plan,
        condition: &Condition,
        index: u64,
        sample: &Sample,
        each: &mut impl FnMut(&StudiedFrame<'_>),
    ) -> Result<Outcome> {
        let believed = *self.estimator.training_camera();
        let Disturbed {
            image,
            truth,
            start,
            found,
        } = self.disturbed(condition, index, sample)?;
        let fit = if found {
            self.fitter.fit(&image, &believed, &start, None)?
        } else {
            None
        };
        let fitted = fit.as_ref().map_or(&start, |fit| &fit.maps);
        let grid = (self.template.grid()).ok_or(GeometryError::NotASheet {
            operation: "the study of the fit",
        })?;
        let outcome = Outcome {
            found,
            start: self.errors(&start, &believed, &truth, &sample.camera)?,
            fitted: self.errors(fitted, &believed, &truth, &sample.camera)?,
            accepted: fit.as_ref().map(|fit| fit.accepted),
            mesh_rmse_mm: (fit.as_ref().filter(|fit| fit.accepted))
                .and_then(|fit| mesh_rmse(&fit.vertices_camera, &sample.vertices_camera, grid)),
        };
        each(&StudiedFrame {
            series: plan.name,
            unit: plan.unit,
            level: condition.level,
            index,
            image: &image,
            truth: &truth,
            start: &start,
            fitted,
            outcome: &outcome,
        });
        Ok(outcome)
    }

    /// The picture, what is visible in it, and the maps to start from.
    fn disturbed(&self, condition: &Condition, index: u64, sample: &Sample) -> Result<Disturbed> {
        let (image, truth) = (sample.image.clone(), sample.truth.clone());
        if condition.start == Start::DisturbedTruth {
            let size = self.template.size_mm();
            let start = disturbed_maps(sample, size, condition.error_px, self.seed, index)?;
            return Ok(Disturbed {
                image,
                truth,
                start,
                found: true,
            });
        }
        let Some((fraction, mask)) = condition.hidden else {
            let (start, found) = self.estimate(&image)?;
            return Ok(Disturbed {
                image,
                truth,
                start,
                found,
            });
        };
        let cover = covered(sample, fraction, self.seed, index);
        let truth = cover.cut(&truth, 0);
        let (start, found) = match mask {
            Mask::Network => self.estimate(&cover.image)?,
            Mask::Exact | Mask::Careless => {
                let leak = if mask == Mask::Exact { 0 } else { LEAK_PX };
                let (start, found) = self.estimate(&image)?;
                (cover.cut(&start, leak), found)
            }
        };
        Ok(Disturbed {
            image: cover.image,
            truth,
            start,
            found,
        })
    }

    /// The estimator's maps, and whether it found the object. The camera it believes in is its own.
    fn estimate(&self, image: &Picture) -> Result<(Maps, bool)> {
        let camera = self.estimator.training_camera();
        let estimate = pollster::block_on(self.estimator.estimate(image, camera))?;
        Ok((estimate.maps, estimate.judgement.found))
    }

    fn errors(&self, predicted: &Maps, believed: &Camera, truth: &Maps, camera: &Camera) -> Result<Errors> {
        let size = self.template.size_mm();
        let metrics = frame_metrics_between((predicted, believed), (truth, camera), size)?;
        Ok(Errors::new(&metrics, predicted, truth))
    }
}
