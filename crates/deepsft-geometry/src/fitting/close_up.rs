//! Close-ups: the part of the camera's own image around a sheet, from coarse to fine.

use super::correlation::POINT_STEP;
use super::isometric_mesh::Stiffness;
use super::measurements::Observation;
use super::mesh_fitter::{FitRound, Fitted, MeshFitter, Resolution};
use super::print::Print;
use crate::camera::{Camera, CanonicalWarp};
use crate::error::Result;
use crate::image::{GreyImage, ImageSize, Picture};
use crate::solver::Energy;
use crate::surface::Surface;
use crate::verdict::CLOSE_UP_DETAIL;
use glam::{DVec2, DVec3};

/// How much more detail each close-up shows than the one before it, at most.
const STEP: f64 = 2.0;

/// Most pixels of a close-up.
const MAX_PIXELS: f64 = 1e6;

/// Pixels of the canonical image around the sheet: it may move by a few.
const MARGIN_PX: f64 = 8.0;

/// Blurs of the rounds in each close-up, its pixels, and the blur at which the last is judged: photographs are rarely sharp to the pixel.
const BLURS_PX: [f32; 2] = [3.0, 0.7];
const JUDGED_BLUR_PX: f32 = 1.2;

/// Width of the window in which mean and contrast are taken, pixels: a window hardly larger than a letter sees no words.
const WINDOW_PX: f32 = 24.0;

/// Times that the first close-up is gone through: what is right pulls in what lies beside it.
const FIRST_TIMES: usize = 2;

/// Solver steps of a round, and steps of a rigid motion.
const STEPS: usize = 8;
const RIGID_STEPS: usize = 20;

/// Most points that are compared.
const MAX_POINTS: f64 = 40_000.0;

/// Explained fraction from which no softer mesh is tried, and how much more a softer one has to explain.
const SURE: f64 = 0.9;
pub(super) const MORE: f64 = 0.02;

/// What a camera with a longer focal length would see of a sheet.
pub(super) struct CloseUp {
    pub(super) grey: GreyImage,
    pub(super) camera: Camera,
    /// Its pixels along the side of a pixel of the surface's own camera.
    pub(super) detail: f64,
}

impl CloseUp {
    /// The image that `source` took, as `camera` shows it.
    pub(super) fn new(image: &Picture, source: &Camera, camera: Camera, detail: f64) -> Result<Self> {
        let grey = GreyImage::of(&CanonicalWarp::new(source, &camera).apply(image)?);
        Ok(Self { grey, camera, detail })
    }

    /// The round that says how far the image confirms a mesh.
    pub(super) fn judging(&self) -> FitRound<'static> {
        let area = self.camera.size().area() as f64;
        FitRound {
            resolution: Resolution::Fine,
            border: true,
            window: WINDOW_PX,
            detail: self.detail,
            point_step: ((area / MAX_POINTS).sqrt().ceil() as usize).max(POINT_STEP),
            ..FitRound::new(JUDGED_BLUR_PX, 0)
        }
    }
}

/// How a mesh may move on its way through the close-ups: stiffness, steps of a rigid motion, solver steps of a round.
type Pass = (Stiffness, usize, usize);

/// The way of a solid as it is at rest.
const RIGID: Pass = (Stiffness::WHOLE, RIGID_STEPS, 0);

/// The rays (x, y, 1) of a rectangle before a camera: the least x and y, and the greatest.
type Rays = (DVec2, DVec2);

/// The close-ups of `surface` in `image`, which `source` took. The last shows what the image has or what `print` has, whichever is
/// less; none where that is hardly more than the surface's own camera shows.
pub(super) fn close_ups(image: &Picture, source: &Camera, surface: &Surface, print: &Print) -> Result<Vec<CloseUp>> {
    let focal = surface.camera.focal();
    let Some((low, high)) = rays(source, surface, MARGIN_PX / focal.x) else {
        return Ok(Vec::new());
    };
    let vertices = &surface.vertices_camera;
    let depth_mm = vertices.iter().map(|p| p.z).sum::<f64>() / vertices.len() as f64;
    let of_image = (source.focal() / focal).min_element();
    let of_print = print.texels_per_mm * depth_mm / focal.x;
    let of_memory = (MAX_PIXELS / ((high - low) * focal).element_product()).sqrt();
    let finest = of_image.min(of_print).min(of_memory);
    if finest < CLOSE_UP_DETAIL {
        return Ok(Vec::new());
    }
    let count = finest.log(STEP).ceil().max(1.0);
    let details = (1..=count as i32).map(|k| finest.powf(f64::from(k) / count));
    let close_up = |detail: f64| {
        let focal = focal * detail;
        let sides = ((high - low) * focal).ceil();
        let size = ImageSize {
            width: sides.x as usize,
            height: sides.y as usize,
        };
        let camera = Camera::pinhole(size, focal, -low * focal)?;
        CloseUp::new(image, source, camera, detail)
    };
    details.map(close_up).collect()
}

/// Fits the fine mesh of `surface` to its close-ups, and says in the last how far it is confirmed. A solid is first moved as it is at
/// rest, and bends only where the image tells so. A softer mesh, which begins where the stiffer one ended and leaves the first close-up
/// out, is taken where it explains more. `None` without close-ups.
pub(super) fn fit_through(
    fitter: &mut MeshFitter,
    close_ups: &[CloseUp],
    surface: &Surface,
    priors: &[&dyn Energy],
) -> Result<Option<Fitted>> {
    let mut way: Vec<&CloseUp> = close_ups.iter().take(1).cycle().take(FIRST_TIMES - 1).collect();
    way.extend(close_ups);
    let finer: Vec<&CloseUp> = close_ups.iter().skip(usize::from(close_ups.len() > 1)).collect();
    let rigid = match fitter.template.is_sheet() {
        true => None,
        false => {
            let start = fitter.rigid(&surface.vertices_camera, &surface.confidence);
            fit_with(fitter, &way, RIGID, (&start, &surface.is_hidden), &[])?
        }
    };
    let mut best: Option<Fitted> = None;
    for stiffness in Stiffness::from_stiff_to_soft() {
        let (start, is_hidden) = match best.as_ref().or(rigid.as_ref()) {
            Some(best) => (&best.vertices, &best.correlation.is_hidden),
            None => (&surface.vertices_camera, &surface.is_hidden),
        };
        // What a coarser image made of a solid would bend it.
        let priors = if rigid.is_some() { &[] } else { priors };
        let way = if best.is_some() { &finer } else { &way };
        let Some(fitted) = fit_with(fitter, way, (stiffness, 0, STEPS), (start, is_hidden), priors)? else {
            return Ok(None);
        };
        let explained = fitted.correlation.explained;
        let is_less = |best: &Fitted| explained < best.correlation.explained + MORE;
        if best.as_ref().is_some_and(is_less) {
            break;
        }
        best = Some(fitted);
        if explained >= SURE {
            break;
        }
    }
    Ok(match (rigid, best) {
        (Some(rigid), Some(best)) => Some(rigid.unless_bent(best)),
        (_, best) => best,
    })
}

fn fit_with(
    fitter: &mut MeshFitter,
    way: &[&CloseUp],
    (stiffness, rigid_steps, steps): Pass,
    (start, is_hidden): (&[DVec3], &[bool]),
    priors: &[&dyn Energy],
) -> Result<Option<Fitted>> {
    let mut fitted: Option<Fitted> = None;
    for close_up in way {
        let observation = Observation::new(&close_up.grey, &close_up.camera)?;
        let is_hidden = fitted
            .as_ref()
            .map_or(is_hidden, |fitted| &fitted.correlation.is_hidden);
        let trust: Vec<f32> = is_hidden.iter().map(|hidden| if *hidden { 0.0 } else { 1.0 }).collect();
        let judging = FitRound {
            stiffness,
            ..close_up.judging()
        };
        let trusted = (!trust.is_empty()).then_some((&trust[..], 0.5));
        let rounds = BLURS_PX.map(|blur| FitRound {
            blur,
            trusted,
            rigid_steps,
            steps,
            ..judging
        });
        for round in rounds.iter().chain([&judging]) {
            let start = fitted.as_ref().map_or(start, |fitted| &fitted.vertices);
            fitted = Some(fitter.round(observation, start, round, priors)?);
        }
    }
    Ok(fitted)
}

/// The rays of the surface, with a margin, as far as all of the rectangle lies in `source`'s image. `None` where there are none.
fn rays(source: &Camera, surface: &Surface, margin: f64) -> Option<Rays> {
    let everything = (DVec2::NEG_INFINITY, DVec2::INFINITY);
    let before = surface.vertices_camera.iter().filter(|p| p.z > 0.0);
    let sheet = before.fold((everything.1, everything.0), |(low, high), p| {
        let ray = p.truncate() / p.z;
        (low.min(ray), high.max(ray))
    });
    // A lens that distorts bends the sides of its image: inside the innermost of each it has all rays.
    let image = source
        .border_rays()
        .fold(everything, |(low, high), [top, bottom, left, right]| {
            let (first, last) = (DVec2::new(left.x, top.y), DVec2::new(right.x, bottom.y));
            (low.max(first), high.min(last))
        });
    let (low, high) = ((sheet.0 - margin).max(image.0), (sheet.1 + margin).min(image.1));
    (low.is_finite() && high.is_finite() && low.cmplt(high).all()).then_some((low, high))
}
