//! A simulated time-of-flight depth camera in the style of the Kinect v2.

use rand::{Rng, RngExt};
use std::f64::consts::{FRAC_PI_2, TAU};

/// What a pixel of the depth camera looks at.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SeenDepth {
    /// Depth (z), mm; infinite where there is nothing.
    pub depth_mm: f64,
    /// Cosine of the angle between the surface's normal and the ray.
    pub cosine: f64,
}

impl SeenDepth {
    /// A surface that faces the camera.
    pub(super) fn facing(depth_mm: f64) -> Self {
        Self { depth_mm, cosine: 1.0 }
    }
}

/// The errors of the depth camera. The defaults are in the style of a Kinect v2 (our choice but for the axial noise).
///
/// The standard deviation of the axial noise at depth z in metres and angle of incidence a is, in mm,
/// 1.5 - 0.5 z + 0.3 z^2 + 0.1 z^(3/2) a^2 / (pi/2 - a)^2, the fit of Fankhauser et al. (2015, "Kinect v2 for mobile robot
/// navigation: evaluation and modeling"); `axial_noise` scales it. Systematic errors of the sensor (with the surface's
/// reflectance, between surfaces that light each other) are not simulated.
#[derive(Clone, Debug, PartialEq)]
pub struct DepthNoise {
    /// Factor on the standard deviation of the axial noise. Default 1.
    pub axial_noise: f64,
    /// Depths of neighbours that differ by more than this fraction are an edge. Default 0.03.
    pub edge: f64,
    /// Fraction of the pixels at an edge that measure nothing. Default 0.45.
    pub edge_holes: f64,
    /// Fraction of the pixels at an edge that measure a depth between the two surfaces, a "flying pixel". Default 0.3.
    pub flying: f64,
    /// Fraction of all pixels that measure nothing. Default 0.002.
    pub dropouts: f64,
    /// Angle of incidence beyond which nothing comes back, degrees. Default 80.
    pub max_angle_deg: f64,
    /// Least and greatest depth that is measured, mm. Default 500 to 4500.
    pub range_mm: [f64; 2],
    /// Step of the depth picture's numbers, mm. Default 1.
    pub step_mm: f64,
}

impl Default for DepthNoise {
    fn default() -> Self {
        Self {
            axial_noise: 1.0,
            edge: 0.03,
            edge_holes: 0.45,
            flying: 0.3,
            dropouts: 0.002,
            max_angle_deg: 80.0,
            range_mm: [500.0, 4500.0],
            step_mm: 1.0,
        }
    }
}

impl DepthNoise {
    /// Standard deviation of the axial noise, mm.
    pub fn deviation_mm(&self, depth_mm: f64, cosine: f64) -> f64 {
        let (z, angle) = (depth_mm / 1000.0, cosine.clamp(0.0, 1.0).acos());
        let slant = angle / (FRAC_PI_2 - angle).max(1e-3);
        self.axial_noise * (1.5 - 0.5 * z + 0.3 * z * z + 0.1 * z.powf(1.5) * slant * slant)
    }

    /// The depth picture of `seen`, both row-major with `width` columns. Its numbers count steps of `step_mm`; 0 says
    /// that nothing was measured.
    pub fn measure<R: Rng + ?Sized>(&self, seen: &[SeenDepth], width: usize, rng: &mut R) -> Vec<u16> {
        let min_cosine = self.max_angle_deg.to_radians().cos();
        (0..seen.len())
            .map(|pixel| {
                // The number of draws is always the same, so that a pixel's noise does not depend on its neighbours.
                let [chance, mix, drop] = [0; 3].map(|_| rng.random::<f64>());
                let normal = normal(rng);
                let SeenDepth { depth_mm, cosine } = seen[pixel];
                if !depth_mm.is_finite() || cosine < min_cosine || drop < self.dropouts {
                    return 0;
                }
                let mut depth = depth_mm;
                if let Some(other) = self.other_side(seen, width, pixel) {
                    if chance < self.edge_holes {
                        return 0;
                    }
                    if chance < self.edge_holes + self.flying {
                        depth += mix * (other - depth);
                    }
                }
                depth += normal * self.deviation_mm(depth, cosine);
                let [near, far] = self.range_mm;
                if (near..=far).contains(&depth) {
                    (depth / self.step_mm).round() as u16
                } else {
                    0
                }
            })
            .collect()
    }

    /// The depth of the neighbour that lies farthest from the pixel's own, if there is an edge between.
    fn other_side(&self, seen: &[SeenDepth], width: usize, pixel: usize) -> Option<f64> {
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
            .filter(|depth| depth.is_finite() && (depth - own).abs() > self.edge * own)
            .max_by(|a, b| (a - own).abs().total_cmp(&(b - own).abs()))
    }
}

/// A normal number (Box and Muller 1958).
fn normal<R: Rng + ?Sized>(rng: &mut R) -> f64 {
    let radius = (-2.0 * (1.0 - rng.random::<f64>()).ln()).sqrt();
    radius * (TAU * rng.random::<f64>()).cos()
}
