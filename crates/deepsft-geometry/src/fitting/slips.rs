//! Fits that have slipped: to a neighbouring row of a print that repeats itself, or onto a playing card's other half.

use super::frame_fitter::{CoarseFit, FEWEST_MEASUREMENTS, FrameFitter, JUDGED_BLUR_PX};
use super::lookalikes::{Lookalike, lookalikes};
use super::measurements::Measurement;
use super::mesh_fitter::{Resolution, Round};
use crate::camera::Camera;
use crate::error::GeometryError;
use crate::image::GreyImage;
use crate::maps::Maps;
use glam::DVec2;

/// Times that a fit moves on to a place that looks alike and that the image confirms more.
const MOST_SLIPS: usize = 3;

/// Agreement below which a fit is not worth trying elsewhere.
const LEAST_PROMISING: f64 = 0.4;

/// What a fit starts from.
pub(super) struct Start {
    pub(super) measured: Vec<Measurement>,
    /// Whether they lie elsewhere on the print than the maps say.
    pub(super) is_moved: bool,
}

impl Start {
    /// The same pixels at the places of the print that look as theirs do.
    fn moved(&self, like: &Lookalike) -> Self {
        let is_on_print = |uv: &DVec2| uv.cmpge(DVec2::ZERO).all() && uv.cmple(DVec2::ONE).all();
        let moved = |m: &Measurement| {
            let uv = Some(like.of(m.uv)).filter(is_on_print)?;
            Some(Measurement { uv, ..*m })
        };
        Self {
            measured: self.measured.iter().filter_map(moved).collect(),
            is_moved: true,
        }
    }
}

impl FrameFitter {
    /// Whether the print repeats itself or looks the same when turned, so that features can slip: see
    /// [`FrameFit::ambiguity`].
    pub fn has_lookalikes(&mut self) -> bool {
        !self.lookalikes().is_empty()
    }

    fn lookalikes(&mut self) -> &[Lookalike] {
        let template = &self.mesh_fitter.template;
        self.lookalikes.get_or_insert_with(|| lookalikes(template))
    }

    /// `found` or, where the print looks alike elsewhere, the place there that the image confirms most; how much it confirms
    /// of the next, as a fraction.
    pub(super) fn best_of_lookalikes(
        &mut self,
        frame: (&GreyImage, &Camera),
        maps: &Maps,
        (found, from): (CoarseFit, Start),
        blurs: &[f32],
    ) -> Result<(CoarseFit, Start, f64), GeometryError> {
        let lookalikes = self.lookalikes().to_vec();
        if lookalikes.is_empty() {
            return Ok((found, from, 0.0));
        }
        if found.agreement.whole < LEAST_PROMISING {
            return Ok((found, from, 1.0));
        }
        let mut best = (self.confirmed(frame, &found)?, found, from);
        let mut next = 0.0;
        for _ in 0..MOST_SLIPS {
            let mut around: Option<(f64, CoarseFit, Start)> = None;
            for like in &lookalikes {
                let from = best.2.moved(like);
                if from.measured.len() < FEWEST_MEASUREMENTS {
                    continue;
                }
                let found = self.fitted_coarsely(frame, maps, &from, None, blurs)?;
                let confirmed = self.confirmed(frame, &found)?;
                if around.as_ref().is_none_or(|(most, ..)| confirmed > *most) {
                    around = Some((confirmed, found, from));
                }
            }
            let Some(around) = around else { break };
            next = around.0;
            if next <= best.0 {
                break;
            }
            best = around;
        }
        let (confirmed, found, from) = best;
        let ambiguity = if confirmed > 0.0 {
            (next / confirmed).min(1.0)
        } else {
            0.0
        };
        Ok((found, from, ambiguity))
    }

    /// How much of the image confirms a coarse mesh, where the image shows anything at all.
    fn confirmed(&mut self, frame: (&GreyImage, &Camera), found: &CoarseFit) -> Result<f64, GeometryError> {
        let round = Round {
            steps: 0,
            ..self.round(Resolution::Coarse, JUDGED_BLUR_PX)
        };
        let judged = self
            .mesh_fitter
            .round(frame, &found.vertices, &round, |_| true, |_| true, &[])?;
        Ok(judged.agreement.whole * judged.agreement.points as f64)
    }
}
