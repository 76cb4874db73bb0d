//! The border of a sheet in the image: where the paper ends, the mesh ends.

use super::print::Print;
use crate::camera::Camera;
use crate::image::{GreyImage, Region};
use crate::maps::raster::VisibleSurface;
use crate::solver::{Energy, ResidualSink, Robust};
use glam::{DVec2, DVec3};

/// Between two points of the border, pixels.
const STEP_PX: f64 = 4.0;

/// How far from the mesh's border the paper's is looked for, and how deep the strip is, beyond that, which says how the paper looks.
const REACH_PX: i32 = 8;
const STRIP_PX: i32 = 6;

/// Most that the print may change near the border, grey levels: a print that goes on to the border holds the mesh itself.
const BLANK_LEVELS: f32 = 12.0;

/// The paper ends where the image differs from the strip by so much: standard deviations of the strip, and grey levels.
const DEVIATIONS: f64 = 4.0;
const LEVELS: f64 = 12.0;

/// The end of the paper is at least this steep: pixels from its first sign to what lies beside it.
const WIDTH_PX: f64 = 2.0;

/// Weight of a border that is seen everywhere.
const WEIGHT: f64 = 100.0;

/// Distance from which a point counts as an outlier, pixels: a hand's edge, not the paper's.
const ROBUST: Robust = Robust::Cauchy(1.0);

/// The border term: the weight times the sum of rho(d^2), with d the distance in pixels, across the border, of points of the mesh's
/// border from where the image shows the paper's end. It holds sheets whose margin is blank.
pub(super) struct Border<'a> {
    camera: &'a Camera,
    points: Vec<BorderPoint>,
    /// Of a point.
    weight: f64,
}

struct BorderPoint {
    /// Vertices of the side that it lies on, and the part of the way from the first to the second.
    side: [usize; 2],
    fraction: f64,
    /// Away from the sheet, in the image.
    outwards: DVec2,
    /// Where the image has the border, along that, pixels.
    place: f64,
}

impl BorderPoint {
    fn position(&self, vertices: &[DVec3]) -> DVec3 {
        let [a, b] = self.side.map(|v| vertices[v]);
        a.lerp(b, self.fraction)
    }
}

impl<'a> Border<'a> {
    /// Looks for the paper's end in an image, where that shows anything, along `sides`, two vertices each and one of the sheet beside them,
    /// of the mesh at `vertices`.
    pub(super) fn new(
        sides: &[[usize; 3]],
        vertices: &[DVec3],
        surface: &'a VisibleSurface,
        print: &Print,
        seen: (&GreyImage, &Region),
        detail: f64,
    ) -> Self {
        let camera = surface.camera();
        let (mut points, mut asked) = (Vec::new(), 0_usize);
        for &[a, b, c] in sides {
            let [Some(p), Some(q), Some(r)] = [a, b, c].map(|v| camera.project(vertices[v])) else {
                continue;
            };
            let Some(across) = (q - p).perp().try_normalize() else {
                continue;
            };
            let outwards = if across.dot(r - p) < 0.0 { across } else { -across };
            // A mesh that has gone wild may have sides of any length.
            let length = p.distance(q).min(camera.size().as_dvec2().length());
            let count = (length / STEP_PX).ceil();
            asked += count as usize;
            for k in 0..count as usize {
                let mut point = BorderPoint {
                    side: [a, b],
                    fraction: (k as f64 + 0.5) / count,
                    outwards,
                    place: 0.0,
                };
                let position = point.position(vertices);
                let Some(at) = camera.project(position) else { continue };
                if let Some(way) = paper_end(surface, print, seen, (at, outwards, position.z)) {
                    point.place = at.dot(outwards) + way;
                    points.push(point);
                }
            }
        }
        Self {
            camera,
            points,
            weight: WEIGHT * detail * detail / asked.max(1) as f64,
        }
    }
}

/// How far from `at` along `outwards` the paper ends, pixels. `None` where the print is not blank there, the sheet not seen, or no end to
/// be seen.
fn paper_end(
    surface: &VisibleSurface,
    print: &Print,
    (grey, shown): (&GreyImage, &Region),
    (at, outwards, depth): (DVec2, DVec2, f64),
) -> Option<f64> {
    let seen = |way: f64| {
        let at = at + way * outwards;
        shown.index(at.x as usize, at.y as usize)?;
        grey.sample(at)
    };
    let printed = |way: i32| {
        let at = at + f64::from(way) * outwards;
        let triangle = surface.triangle_at(at).filter(|triangle| triangle.front)?;
        Some(triangle.seen_point(at.x, at.y).uv.as_vec2().to_array())
    };
    let uvs: Vec<_> = (-REACH_PX - STRIP_PX..-1).map(printed).collect();
    if uvs.iter().any(Option::is_none) {
        return None;
    }
    let print = print.drawn(&uvs, depth, surface.camera().focal().x);
    let around = |(low, high): (f32, f32), v: &f32| (low.min(*v), high.max(*v));
    let (least, most) = print.iter().fold((f32::MAX, f32::MIN), around);
    if most - least > BLANK_LEVELS {
        return None;
    }
    let strip = (-REACH_PX - STRIP_PX..-REACH_PX).map(|way| seen(f64::from(way)));
    let strip = strip.collect::<Option<Vec<f64>>>()?;
    let mean = strip.iter().sum::<f64>() / strip.len() as f64;
    let variance = strip.iter().map(|v| (v - mean).powi(2)).sum::<f64>() / strip.len() as f64;
    let least = LEVELS.max(DEVIATIONS * variance.sqrt());
    // Half a pixel a step.
    let mut ways = (-2 * REACH_PX..2 * REACH_PX).map(|half| f64::from(half) / 2.0);
    // The image may end first, which is no end of the paper.
    let first = ways.find(|way| seen(*way).is_none_or(|value| (value - mean).abs() > least))?;
    if seen(first).is_none() || first <= f64::from(-REACH_PX) {
        return None;
    }
    let beside = seen(first + WIDTH_PX)? - mean;
    if beside.abs() < 1.5 * least {
        return None;
    }
    // Where half of the way from the paper's grey to the other is gone.
    let gone = |way: f64| Some((seen(way)? - mean) / beside);
    let mut before = (first - 1.0, gone(first - 1.0)?);
    for step in 1..=6 {
        let way = first - 1.0 + 0.5 * f64::from(step);
        let here = gone(way)?;
        if here >= 0.5 {
            return Some(before.0 + 0.5 * (0.5 - before.1) / (here - before.1).max(1e-3));
        }
        before = (way, here);
    }
    None
}

impl Energy for Border<'_> {
    fn name(&self) -> &'static str {
        "border"
    }

    fn energy(&self, vertices: &[DVec3]) -> f64 {
        let square = |point: &BorderPoint| {
            let pixel = self.camera.project(point.position(vertices));
            pixel.map_or(f64::INFINITY, |pixel| (pixel.dot(point.outwards) - point.place).powi(2))
        };
        self.weight * ROBUST.sum(self.points.iter().map(square))
    }

    fn linearize(&self, vertices: &[DVec3], sink: &mut dyn ResidualSink) {
        for point in &self.points {
            let Some((pixel, [dx, dy])) = self.camera.project_with_gradients(point.position(vertices)) else {
                continue;
            };
            let residual = pixel.dot(point.outwards) - point.place;
            let gradient = point.outwards.x * dx + point.outwards.y * dy;
            let [a, b] = point.side;
            let gradients = [(a, (1.0 - point.fraction) * gradient), (b, point.fraction * gradient)];
            sink.scalar(residual, self.weight * ROBUST.weight(residual * residual), &gradients);
        }
    }
}
