//! Fits that have slipped: to a neighbouring row of a print that repeats itself, or onto a playing card's other half.

use super::frame_fitter::{CoarseFit, FrameFitter, JUDGED_BLUR_PX, MIN_MEASUREMENTS};
use super::lookalikes::{Lookalike, lookalikes};
use super::measurements::Measurement;
use super::mesh_fitter::{Resolution, Round};
use crate::camera::Camera;
use crate::error::GeometryError;
use crate::image::GreyImage;
use crate::maps::Maps;
use glam::{DVec2, DVec3};

/// Times that a fit moves on to a place that looks alike and that the image confirms more.
const MAX_SLIPS: usize = 3;

/// Agreement below which a fit is not worth trying elsewhere.
const MIN_PROMISING: f64 = 0.4;

/// Mean distance of vertices within which two meshes are one, fractions of the print's longer side: less than half of the
/// shortest shift.
const SAME_PLACE: f64 = 0.01;

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
    /// [`FrameFit::ambiguity`](super::FrameFit::ambiguity). It is looked up once, also for [`FrameFitter::fit_unmasked`].
    pub fn has_lookalikes(&mut self) -> bool {
        !self.lookalikes().is_empty()
    }

    fn lookalikes(&mut self) -> &[Lookalike] {
        let template = &self.mesh_fitter.template;
        self.lookalikes.get_or_insert_with(|| lookalikes(template))
    }

    /// `found` or, where the print looks alike elsewhere, the place there that the image confirms most; and how much it
    /// confirms of the next, as a fraction: `None` where the print looks alike nowhere, 1 where the fit is not worth trying
    /// elsewhere.
    pub(super) fn best_of_lookalikes(
        &mut self,
        frame: (&GreyImage, &Camera),
        maps: &Maps,
        (found, from): (CoarseFit, Start),
        blurs: &[f32],
    ) -> Result<(CoarseFit, Start, Option<f64>), GeometryError> {
        let lookalikes = self.lookalikes().to_vec();
        if lookalikes.is_empty() {
            return Ok((found, from, None));
        }
        if found.agreement.whole < MIN_PROMISING {
            return Ok((found, from, Some(1.0)));
        }
        let mut best = (self.confirmed(frame, &found)?, found, from);
        // The most that is confirmed of any other place.
        let mut next = 0.0_f64;
        for slips in 0..=MAX_SLIPS {
            let mut around: Option<(f64, CoarseFit, Start)> = None;
            for like in &lookalikes {
                let from = best.2.moved(like);
                if from.measured.len() < MIN_MEASUREMENTS {
                    continue;
                }
                let found = self.fitted_coarsely(frame, maps, &from, None, blurs)?;
                if self.is_same_place(&found.vertices, &best.1.vertices) {
                    continue;
                }
                let confirmed = self.confirmed(frame, &found)?;
                let lesser = match &around {
                    Some((most, ..)) if *most >= confirmed => confirmed,
                    _ => around
                        .replace((confirmed, found, from))
                        .map_or(0.0, |(confirmed, ..)| confirmed),
                };
                next = next.max(lesser);
            }
            let Some(around) = around else { break };
            if around.0 <= best.0 || slips == MAX_SLIPS {
                next = next.max(around.0);
                break;
            }
            next = next.max(best.0);
            best = around;
        }
        let (confirmed, found, from) = best;
        let ambiguity = if confirmed > 0.0 {
            (next / confirmed).min(1.0)
        } else {
            1.0
        };
        Ok((found, from, Some(ambiguity)))
    }

    /// Whether two coarse meshes lie on each other: then one has slid back.
    fn is_same_place(&self, a: &[DVec3], b: &[DVec3]) -> bool {
        let apart = a.iter().zip(b).map(|(a, b)| a.distance(*b)).sum::<f64>() / a.len().max(1) as f64;
        apart < SAME_PLACE * self.mesh_fitter.template.size_mm().max_element()
    }

    /// How much of the image confirms a coarse mesh, where the image shows anything at all.
    fn confirmed(&mut self, frame: (&GreyImage, &Camera), found: &CoarseFit) -> Result<f64, GeometryError> {
        let round = Round {
            steps: 0,
            ..self.round(Resolution::Coarse, JUDGED_BLUR_PX)
        };
        let judged = self
            .mesh_fitter
            .round(frame, &found.vertices, &round, |_, _| true, |_| true, &[])?;
        Ok(judged.agreement.whole * judged.agreement.points as f64)
    }
}
