//! What a time-of-flight depth camera in the style of the Kinect v2 makes of true depths: a simulation.

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
    pub most_angle_deg: f64,
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
            most_angle_deg: 80.0,
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

    /// The numbers of the depth picture of `seen`, row-major with `width` columns, in steps; 0 where nothing is measured.
    pub fn measure<R: Rng + ?Sized>(&self, seen: &[SeenDepth], width: usize, rng: &mut R) -> Vec<u16> {
        let least_cosine = self.most_angle_deg.to_radians().cos();
        (0..seen.len())
            .map(|pixel| {
                // As many draws whatever is seen, so that a pixel's noise does not hang on its neighbours'.
                let [chance, mix, drop] = [0; 3].map(|_| rng.random::<f64>());
                let normal = normal(rng);
                let SeenDepth { depth_mm, cosine } = seen[pixel];
                if !depth_mm.is_finite() || cosine < least_cosine || drop < self.dropouts {
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::random::{Stream, generator};

    const WIDTH: usize = 200;

    fn wall(depth_mm: f64, angle_deg: f64) -> Vec<SeenDepth> {
        let cosine = f64::to_radians(angle_deg).cos();
        vec![SeenDepth { depth_mm, cosine }; WIDTH * WIDTH]
    }

    fn measure(noise: &DepthNoise, seen: &[SeenDepth]) -> Vec<u16> {
        noise.measure(seen, WIDTH, &mut generator(1, 2, Stream::DepthNoise))
    }

    #[test]
    fn a_wall_is_measured_with_the_deviation_of_the_fit() {
        // At 1 m, frontal: 1.5 - 0.5 + 0.3 = 1.3 mm. At 2 m and 60 degrees: 1.5 - 1 + 1.2 + 0.1 * 2.828 * (60 / 30)^2 =
        // 2.831 mm. Rounding to 1 mm adds a variance of 1/12 mm^2.
        for (depth, angle, expected) in [(1000.0, 0.0, 1.3), (2000.0, 60.0, 2.831_37)] {
            let noise = DepthNoise::default();
            assert!((noise.deviation_mm(depth, f64::to_radians(angle).cos()) - expected).abs() < 1e-4);
            let measured: Vec<f64> = measure(&noise, &wall(depth, angle))
                .into_iter()
                .filter(|&units| units > 0)
                .map(f64::from)
                .collect();
            let count = measured.len() as f64;
            assert!((count / 40_000.0 - 0.998).abs() < 1e-3, "dropouts: {count}");
            let mean = measured.iter().sum::<f64>() / count;
            let deviation = (measured.iter().map(|d| (d - mean).powi(2)).sum::<f64>() / count).sqrt();
            assert!((mean - depth).abs() < 0.06, "{mean}");
            assert!((deviation / (expected * expected + 1.0 / 12.0).sqrt() - 1.0).abs() < 0.02);
        }
    }

    #[test]
    fn at_an_edge_some_pixels_are_lost_and_some_fly_between_the_surfaces() {
        let mut seen = wall(1500.0, 0.0);
        for row in 0..WIDTH {
            seen[row * WIDTH..row * WIDTH + 100].fill(SeenDepth {
                depth_mm: 700.0,
                cosine: 1.0,
            });
        }
        let measured = measure(&DepthNoise::default(), &seen);
        let column = |x: usize| (0..WIDTH).map(move |row| row * WIDTH + x).map(|i| measured[i]);
        let holes = column(99).chain(column(100)).filter(|&d| d == 0).count() as f64 / 400.0;
        let flying = column(99)
            .chain(column(100))
            .filter(|d| (720..1480).contains(d))
            .count() as f64
            / 400.0;
        // 400 pixels: deviations of 0.025 and 0.023. Flying ones within 20 mm of a surface are not told apart.
        assert!((holes - 0.45).abs() < 0.08, "{holes}");
        assert!((flying - 0.29).abs() < 0.08, "{flying}");
        assert!(column(90).all(|d| d == 0 || d.abs_diff(700) < 10));
    }

    #[test]
    fn grazing_and_too_near_surfaces_measure_nothing() {
        assert!(
            measure(&DepthNoise::default(), &wall(1000.0, 81.0))
                .iter()
                .all(|&d| d == 0)
        );
        assert!(
            measure(&DepthNoise::default(), &wall(450.0, 0.0))
                .iter()
                .all(|&d| d == 0)
        );
        assert!(
            measure(&DepthNoise::default(), &wall(f64::INFINITY, 0.0))
                .iter()
                .all(|&d| d == 0)
        );
    }
}
