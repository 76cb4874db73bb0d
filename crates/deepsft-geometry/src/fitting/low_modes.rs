//! Low-mode search: other shapes that look almost the same, a folded corner or a bend the other way.

use super::close_up::CloseUp;
use super::measurements::Observation;
use super::mesh_fitter::{FitRound, Fitted, MeshFitter, Resolution};
use crate::error::Result;
use crate::surface::Surface;
use glam::DVec3;

/// Modes along which other shapes are looked for, the softest ones.
const MODES: usize = 4;

/// How far from the fit other shapes are begun, standard deviations of the mode.
const DEVIATIONS: f64 = 6.0;

/// Blurs of the rounds from there, pixels of the canonical image.
const BLURS_PX: [f32; 2] = [6.0, 1.2];

/// Solver steps of a round.
const STEPS: usize = 8;

/// Times that all modes are gone through.
const SWEEPS: usize = 2;

/// How many times more significant a shape has to be to be taken.
const MORE: f64 = 1.005;

/// How many times the energy of the fit it may have: a shape that the image confirms a little more, but that is bent much more, is not likelier.
const MOST_ENERGY: f64 = 1.1;

/// Confidence of a vertex from which the image around it says how soft a mode is.
const TRUSTED: f64 = 0.3;

/// Mean distance of vertices within which two shapes are one, a fraction of the print's longer side.
const SAME_SHAPE: f64 = 0.004;

/// Least depth of a vertex of a start, mm.
const LEAST_DEPTH_MM: f64 = 20.0;

/// Takes the sheet of `surface`, seen in `close_up`, to the shape that the image confirms most. Shapes are begun far out along
/// the softest modes of the fit, where the image and the sheet's stiffness hold it least, and fitted anew: the low-mode
/// search of Kolossvary and Guida (1996), which finds conformations of molecules.
pub(super) fn likeliest_shape(fitter: &mut MeshFitter, close_up: &CloseUp, surface: &mut Surface) -> Result<()> {
    let observation = Observation::new(&close_up.grey, &close_up.camera)?;
    let [.., last_blur] = BLURS_PX;
    let side = fitter.template.size_mm().max_element();
    let is_likelier = |other: &Fitted, than: &Fitted| {
        let is_other = other.distance(&than.vertices) >= SAME_SHAPE * side;
        let is_more_significant = other.correlation.significance() > MORE * than.correlation.significance();
        is_other && is_more_significant && other.energy < MOST_ENERGY * than.energy
    };
    let start = fitter.coarse_vertices(&surface.vertices_camera);
    let mut best = fitter.round(observation, &start, &round(last_blur), &[])?;
    let mut is_other = false;
    for _ in 0..SWEEPS {
        let mut is_better = false;
        for (mode, deviation) in softest_modes(fitter, observation, &best)? {
            for way in [-DEVIATIONS * deviation, DEVIATIONS * deviation] {
                let there = best.vertices.iter().zip(&mode).map(|(p, motion)| *p + way * *motion);
                let there: Vec<DVec3> = there.collect();
                if there.iter().any(|p| p.z < LEAST_DEPTH_MM) {
                    continue;
                }
                let mut other = Fitted::unmoved(there);
                for blur in BLURS_PX {
                    other = fitter.round(observation, &other.vertices, &round(blur), &[])?;
                    if other.distance(&best.vertices) < SAME_SHAPE * side {
                        break;
                    }
                }
                if is_likelier(&other, &best) {
                    (best, is_better) = (other, true);
                }
            }
        }
        is_other |= is_better;
        if !is_better {
            break;
        }
    }
    if is_other {
        let fine = FitRound {
            resolution: Resolution::Fine,
            ..round(last_blur)
        };
        let fitted = fitter.round(observation, &fitter.fine_vertices(&best.vertices), &fine, &[])?;
        fitted.replace(surface, surface.verdict.ambiguity);
    }
    Ok(())
}

fn round(blur: f32) -> FitRound<'static> {
    FitRound {
        border: true,
        ..FitRound::new(blur, STEPS)
    }
}

/// The softest modes of the coarse mesh where `found` has it, each with its standard deviation. None where there is no telling.
fn softest_modes(
    fitter: &mut MeshFitter,
    observation: Observation<'_>,
    found: &Fitted,
) -> Result<Vec<(Vec<DVec3>, f64)>> {
    let [.., blur] = BLURS_PX;
    let there = FitRound {
        steps: 0,
        trusted: Some((&found.correlation.confidence, TRUSTED)),
        ..round(blur)
    };
    let (_, modes) = fitter.round_and(
        observation,
        &found.vertices,
        &there,
        &[],
        |isometric, (_, terms), vertices| isometric.factorized(terms, vertices)?.softest_modes::<MODES>(),
    )?;
    Ok(modes.map_or_else(Vec::new, Vec::from))
}
