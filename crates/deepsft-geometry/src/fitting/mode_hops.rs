//! Mode hops: fits on a neighbouring row of a print that repeats itself, or on a playing card's other half.

use super::coarse_fitter::{CoarseStart, MIN_MEASUREMENTS};
use super::measurements::Observation;
use super::mesh_fitter::{Fitted, MeshFitter};
use super::self_similarity::SelfSimilarity;
use crate::error::Result;
use crate::verdict::Verdict;

/// Times that a fit moves on to a place that looks alike and that the image confirms more.
const MAX_HOPS: usize = 3;

/// Correlation, or explained fraction, from which a fit is worth trying elsewhere. A form that was filled in correlates badly with the empty
/// one where it lies right, for the ink between its lines counts; but what is printed around is explained.
pub(super) const MIN_CORRELATION: f64 = 0.4;
const MIN_EXPLAINED: f64 = 0.3;

/// Mean distance of vertices within which two meshes are one, fractions of the print's longer side: less than half of the
/// shortest shift.
const SAME_PLACE: f64 = 0.01;

/// `found` or, where the print looks alike elsewhere, the place there that the image confirms most; and how much it
/// confirms of the next, as a fraction: `None` where the print looks alike nowhere, 1 where the fit is not worth trying
/// elsewhere.
pub(super) fn best_of_mode_hops<'a>(
    fitter: &mut MeshFitter,
    self_similarities: &[SelfSimilarity],
    observation: Observation<'_>,
    (found, from): (Fitted, CoarseStart<'a>),
    blurs: &[f32],
) -> Result<(Fitted, CoarseStart<'a>, Option<f64>)> {
    if self_similarities.is_empty() {
        return Ok((found, from, None));
    }
    if !is_promising(&found.correlation.verdict(None)) {
        return Ok((found, from, Some(1.0)));
    }
    let side = fitter.template.size_mm().max_element();
    let mut best = (fitter.confirmed(observation, &found)?, found, from);
    // The most that is confirmed of any other place.
    let mut next = 0.0_f64;
    for hops in 0..=MAX_HOPS {
        let mut around: Option<(f64, Fitted, CoarseStart<'a>)> = None;
        for like in self_similarities {
            let from = best.2.moved(like);
            if from.measured.len() < MIN_MEASUREMENTS {
                continue;
            }
            let found = fitter.fit_coarse(observation, &from, blurs)?;
            if is_same_place(&found, &best.1, side) {
                continue;
            }
            let confirmed = fitter.confirmed(observation, &found)?;
            let is_another = matches!(&around, Some((_, other, _)) if !is_same_place(&found, other, side));
            let most = around.as_ref().map(|(most, ..)| *most);
            let lesser = match most.filter(|most| *most >= confirmed) {
                Some(_) => confirmed,
                None => around.replace((confirmed, found, from)).map_or(0.0, |(most, ..)| most),
            };
            // Two motions may lead to one place: it is not its own rival.
            if is_another {
                next = next.max(lesser);
            }
        }
        let Some(around) = around else { break };
        if around.0 <= best.0 || hops == MAX_HOPS {
            next = next.max(around.0);
            break;
        }
        next = next.max(best.0);
        best = around;
    }
    let (confirmed, found, from) = best;
    let ambiguity = (confirmed > 0.0).then(|| (next / confirmed).min(1.0));
    Ok((found, from, ambiguity.or(Some(1.0))))
}

fn is_promising(verdict: &Verdict) -> bool {
    verdict.correlation >= MIN_CORRELATION || verdict.explained >= MIN_EXPLAINED
}

/// Whether two coarse meshes lie on each other: then one has slid back.
fn is_same_place(a: &Fitted, b: &Fitted, side: f64) -> bool {
    a.distance(&b.vertices) < SAME_PLACE * side
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::camera::training_camera;
    use crate::fitting::measurements::Start;
    use crate::fitting::mesh_fitter::RIGIDITY;
    use crate::fitting::self_similarity::self_similarities;
    use crate::image::{GreyImage, Picture};
    use crate::maps::raster::VisibleSurface;
    use crate::mesh::Template;
    use glam::{DVec2, DVec3};

    #[test]
    fn a_filled_in_form_is_worth_trying_elsewhere_and_a_fit_that_explains_little_is_not() {
        let of = |correlation: f64, explained: f64| Verdict {
            correlation,
            explained,
            ..Verdict::default()
        };
        let promising =
            [(0.36, 0.5), (0.45, 0.2), (0.36, 0.2)].map(|(whole, explained)| is_promising(&of(whole, explained)));
        assert_eq!(promising, [true, true, false]);
    }

    #[test]
    fn a_place_that_two_motions_lead_to_is_not_its_own_rival() {
        // 6 x 4 motifs without a symmetry of their own, 50 mm apart.
        let motif = |x: usize, y: usize| match (x % 100, y % 100) {
            (10..70, 15..35) | (10..30, 15..85) => [20; 3],
            (50..85, 60..85) => [140, 60, 60],
            _ => [240; 3],
        };
        let template = Template::thin_shell(Picture::from_fn(600, 400, motif), 300.0, 200.0).unwrap();
        let camera = training_camera();
        let vertices = template.mesh().vertices().iter();
        let vertices: Vec<DVec3> = vertices.map(|p| p + 450.0 * DVec3::Z).collect();
        let maps = VisibleSurface::new(template.mesh(), &vertices, &camera).maps();
        let image = Picture::from_fn(maps.size().width, maps.size().height, |x, y| {
            let [u, v] = maps.registration()[y * maps.size().width + x];
            let texel = |at: f32, count: usize| (at * count as f32) as usize;
            if maps.inside(y * maps.size().width + x) {
                motif(texel(u, 600), texel(v, 400))
            } else {
                [90; 3]
            }
        });
        let all = self_similarities(&template);
        let centre = DVec2::splat(0.5);
        let shift = |columns: f64| {
            let there = centre + DVec2::new(columns / 6.0, 0.0);
            let leads_there = |like: &&SelfSimilarity| like.of(centre).distance(there) < 0.02;
            *all.iter().find(leads_there).unwrap()
        };
        let grey = GreyImage::of(&image);
        let mut fitter = MeshFitter::new(&template, RIGIDITY).unwrap();
        let start = Start::Maps(maps);
        let right = fitter.start(&start, &camera).unwrap().unwrap();
        let wrong = right.moved(&shift(1.0));
        let observation = Observation::new(&grey, &camera).unwrap();
        let found = fitter.fit_coarse(observation, &wrong, &[3.0]).unwrap();
        let (back, best) = (shift(-1.0), (found, wrong));
        let (.., ambiguity) = best_of_mode_hops(&mut fitter, &[back; 2], observation, best, &[3.0]).unwrap();
        assert!(ambiguity.unwrap() < 0.95, "{ambiguity:?}");
    }
}
