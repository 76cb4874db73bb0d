//! A simulated time-of-flight depth camera in the style of the Kinect v2 (our choice but for the axial noise). Systematic
//! errors of the sensor (with the surface's reflectance, between surfaces that light each other) are not simulated.

use rand::{Rng, RngExt};
use std::f64::consts::{FRAC_PI_2, TAU};

/// What a pixel of the depth camera looks at.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct SeenDepth {
    /// Depth (z), mm; infinite where there is nothing.
    pub(crate) depth_mm: f64,
    /// Cosine of the angle between the surface's normal and the ray.
    pub(crate) cosine: f64,
}

impl SeenDepth {
    pub(crate) fn facing(depth_mm: f64) -> Self {
        Self { depth_mm, cosine: 1.0 }
    }
}

/// Depths of neighbours that differ by more than this fraction are an edge.
const EDGE: f64 = 0.03;
/// Fraction of the pixels at an edge that measure nothing, and of those that measure a depth between the two surfaces.
const EDGE_HOLES: f64 = 0.45;
const FLYING: f64 = 0.3;
/// Fraction of all pixels that measure nothing.
const DROPOUTS: f64 = 0.002;
/// Angle of incidence beyond which nothing comes back, degrees.
const MAX_ANGLE_DEG: f64 = 80.0;
/// Least and greatest depth that is measured, mm.
const RANGE_MM: [f64; 2] = [500.0, 4500.0];

/// Standard deviation of the axial noise, mm. At depth z in metres and angle of incidence a it is
/// 1.5 - 0.5 z + 0.3 z^2 + 0.1 z^(3/2) a^2 / (pi/2 - a)^2, the fit of Fankhauser et al. (2015, "Kinect v2 for mobile robot
/// navigation: evaluation and modeling").
pub(crate) fn deviation_mm(depth_mm: f64, cosine: f64) -> f64 {
    let (z, angle) = (depth_mm / 1000.0, cosine.clamp(0.0, 1.0).acos());
    let slant = angle / (FRAC_PI_2 - angle).max(1e-3);
    1.5 - 0.5 * z + 0.3 * z * z + 0.1 * z.powf(1.5) * slant * slant
}

/// The depth picture of `seen`, mm, both row-major with `width` columns; 0 says that nothing was measured.
pub(crate) fn measure<R: Rng + ?Sized>(seen: &[SeenDepth], width: usize, rng: &mut R) -> Vec<u16> {
    let min_cosine = MAX_ANGLE_DEG.to_radians().cos();
    (0..seen.len())
        .map(|pixel| {
            // The number of draws is always the same, so that a pixel's noise does not depend on its neighbours.
            let [chance, mix, drop] = [0; 3].map(|_| rng.random::<f64>());
            let normal = normal(rng);
            let SeenDepth { depth_mm, cosine } = seen[pixel];
            if !depth_mm.is_finite() || cosine < min_cosine || drop < DROPOUTS {
                return 0;
            }
            let mut depth = depth_mm;
            if let Some(other) = other_side(seen, width, pixel) {
                if chance < EDGE_HOLES {
                    return 0;
                }
                if chance < EDGE_HOLES + FLYING {
                    depth += mix * (other - depth);
                }
            }
            depth += normal * deviation_mm(depth, cosine);
            let [near, far] = RANGE_MM;
            if (near..=far).contains(&depth) {
                depth.round() as u16
            } else {
                0
            }
        })
        .collect()
}

/// The depth of the neighbour that lies farthest from the pixel's own, if there is an edge between.
fn other_side(seen: &[SeenDepth], width: usize, pixel: usize) -> Option<f64> {
    let own = seen[pixel].depth_mm;
    let column = pixel % width;
    let neighbours = [
        (column > 0).then(|| pixel - 1),
        (column + 1 < width).then(|| pixel + 1),
        pixel.checked_sub(width),
        Some(pixel + width),
    ];
    neighbours
        .into_iter()
        .flatten()
        .filter_map(|neighbour| seen.get(neighbour))
        .map(|neighbour| neighbour.depth_mm)
        .filter(|depth| depth.is_finite() && (depth - own).abs() > EDGE * own)
        .max_by(|a, b| (a - own).abs().total_cmp(&(b - own).abs()))
}
/// A normal number (Box and Muller 1958).
fn normal<R: Rng + ?Sized>(rng: &mut R) -> f64 {
    let radius = (-2.0 * (1.0 - rng.random::<f64>()).ln()).sqrt();
    radius * (TAU * rng.random::<f64>()).cos()
}
