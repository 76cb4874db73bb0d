//! How lenses bend rays: OpenCV's two models, their derivatives and their inverses.

use crate::error::{GeometryError, Result};
use glam::DVec2;
use std::f64::consts::FRAC_PI_2;

/// A lens distortion model: takes a ray (x, y, 1) to the pixel f * (x', y') + c.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum Lens {
    /// Nothing: (x', y') = (x, y).
    #[default]
    Pinhole,
    /// OpenCV's radial and tangential distortion (k1, k2, p1, p2, k3), for ordinary lenses.
    Polynomial([f64; 5]),
    /// OpenCV's `cv::fisheye` (Kannala and Brandt): at the angle t from the axis the distance from the centre is
    /// t (1 + k1 t^2 + k2 t^4 + k3 t^6 + k4 t^8), for lenses that see more than about 100 degrees.
    Fisheye([f64; 4]),
}

/// Squared length of the longest rays (x, y, 1) that a polynomial is checked for: 89.4 degrees from the axis.
const LONGEST_RAY_SQUARED: f64 = 1e4;

/// A distorted position is met when it is nearer than this to where it should be, in focal lengths.
const MET: f64 = 1e-13;

impl Lens {
    /// The same lens turned with its camera by a quarter anticlockwise.
    pub(super) fn turned_anticlockwise(self) -> Self {
        match self {
            Self::Polynomial([k1, k2, p1, p2, k3]) => Self::Polynomial([k1, k2, -p2, p1, k3]),
            other => other,
        }
    }

    /// Length of the longest ray (x, y, 1) up to which longer rays land farther out. Beyond it the model
    /// folds back: two rays would have one pixel, and real lenses do not.
    pub(super) fn reach(self) -> f64 {
        let first_fold = |slope: &[f64], end: f64| roots(slope, end).first().map(|square| square.sqrt());
        let fold = match self {
            Self::Pinhole => None,
            Self::Polynomial([k1, k2, _, _, k3]) => {
                first_fold(&[1.0, 3.0 * k1, 5.0 * k2, 7.0 * k3], LONGEST_RAY_SQUARED)
            }
            Self::Fisheye([k1, k2, k3, k4]) => {
                let slope = [1.0, 3.0 * k1, 5.0 * k2, 7.0 * k3, 9.0 * k4];
                first_fold(&slope, FRAC_PI_2 * FRAC_PI_2).map(f64::tan)
            }
        };
        fold.unwrap_or(f64::INFINITY)
    }

    /// Where the ray (x, y, 1) goes: (x', y').
    pub(super) fn distort(self, ray: DVec2) -> DVec2 {
        match self {
            Self::Pinhole => ray,
            Self::Polynomial([k1, k2, p1, p2, k3]) => {
                let r2 = ray.length_squared();
                let radial = 1.0 + r2 * (k1 + r2 * (k2 + r2 * k3));
                ray * radial
                    + DVec2::new(
                        2.0 * p1 * ray.x * ray.y + p2 * (r2 + 2.0 * ray.x * ray.x),
                        p1 * (r2 + 2.0 * ray.y * ray.y) + 2.0 * p2 * ray.x * ray.y,
                    )
            }
            Self::Fisheye(k) => {
                let r = ray.length();
                if r == 0.0 {
                    ray
                } else {
                    ray * (fisheye(k, r.atan()).0 / r)
                }
            }
        }
    }

    /// The derivatives of x' and of y' with respect to (x, y).
    pub(super) fn gradients(self, ray: DVec2) -> [DVec2; 2] {
        match self {
            Self::Pinhole => [DVec2::X, DVec2::Y],
            Self::Polynomial([k1, k2, p1, p2, k3]) => {
                let r2 = ray.length_squared();
                let radial = 1.0 + r2 * (k1 + r2 * (k2 + r2 * k3));
                // d radial / d ray = slope * ray.
                let slope = 2.0 * (k1 + r2 * (2.0 * k2 + r2 * 3.0 * k3));
                let mixed = slope * ray.x * ray.y + 2.0 * (p1 * ray.x + p2 * ray.y);
                let x = radial + slope * ray.x * ray.x + 2.0 * p1 * ray.y + 6.0 * p2 * ray.x;
                let y = radial + slope * ray.y * ray.y + 6.0 * p1 * ray.y + 2.0 * p2 * ray.x;
                [DVec2::new(x, mixed), DVec2::new(mixed, y)]
            }
            Self::Fisheye(k) => {
                let r = ray.length();
                if r == 0.0 {
                    return [DVec2::X, DVec2::Y];
                }
                let (radius, slope) = fisheye(k, r.atan());
                let (across, along) = (radius / r, slope / (1.0 + r * r));
                let direction = ray / r;
                let row = |axis: DVec2| axis * across + direction * (direction.dot(axis) * (along - across));
                [row(DVec2::X), row(DVec2::Y)]
            }
        }
    }

    /// The ray (x, y, 1) that goes to (x', y'). A place farther out than any ray within `reach` goes: the
    /// outermost ray in its direction.
    pub(super) fn undistort(self, distorted: DVec2, reach: f64) -> DVec2 {
        let radius = distorted.length();
        if self == Self::Pinhole || radius == 0.0 {
            return distorted;
        }
        let radial = distorted * (self.radial_inverse(radius, reach) / radius);
        match self {
            Self::Polynomial([_, _, p1, p2, _]) if (p1, p2) != (0.0, 0.0) => self.polished(radial, distorted, reach),
            _ => radial,
        }
    }

    /// The length of the ray that lands at `radius`, at most `reach`; tangential distortion left aside.
    fn radial_inverse(self, radius: f64, reach: f64) -> f64 {
        match self {
            Self::Pinhole => radius,
            Self::Polynomial([k1, k2, _, _, k3]) => {
                let at = |r: f64| {
                    let r2 = r * r;
                    let slope = 1.0 + r2 * (3.0 * k1 + r2 * (5.0 * k2 + r2 * 7.0 * k3));
                    (r * (1.0 + r2 * (k1 + r2 * (k2 + r2 * k3))), slope)
                };
                increasing_inverse(at, radius, reach.min(LONGEST_RAY_SQUARED.sqrt()))
            }
            // Rays at a right angle to the axis are no (x, y, 1).
            Self::Fisheye(k) => increasing_inverse(|angle| fisheye(k, angle), radius, reach.atan())
                .min(FRAC_PI_2 - 1e-9)
                .tan(),
        }
    }

    /// Newton's method from `ray`, for both coordinates at once.
    fn polished(self, mut ray: DVec2, distorted: DVec2, reach: f64) -> DVec2 {
        for _ in 0..30 {
            let missing = distorted - self.distort(ray);
            let [x, y] = self.gradients(ray);
            let determinant = x.perp_dot(y);
            if missing.length() < MET || determinant <= 0.0 {
                break;
            }
            ray += DVec2::new(missing.x * y.y - missing.y * x.y, missing.y * x.x - missing.x * y.x) / determinant;
            ray = ray.clamp_length_max(reach);
        }
        ray
    }
}

/// Distance from the centre at an angle from the axis, in focal lengths, and its derivative.
fn fisheye([k1, k2, k3, k4]: [f64; 4], angle: f64) -> (f64, f64) {
    let t2 = angle * angle;
    (
        angle * (1.0 + t2 * (k1 + t2 * (k2 + t2 * (k3 + t2 * k4)))),
        1.0 + t2 * (3.0 * k1 + t2 * (5.0 * k2 + t2 * (7.0 * k3 + t2 * 9.0 * k4))),
    )
}

/// The place in [0, `end`] where the increasing function `at` (value, derivative; 0 at 0) is `value`; `end` where
/// it stays below. Newton's method, and halving where that leaves the bracket.
fn increasing_inverse(at: impl Fn(f64) -> (f64, f64), value: f64, end: f64) -> f64 {
    if at(end).0 <= value {
        return end;
    }
    let (mut low, mut high) = (0.0, end);
    let mut place = value.min(end);
    for _ in 0..100 {
        let (actual, slope) = at(place);
        if (actual - value).abs() < MET {
            break;
        }
        match actual < value {
            true => low = place,
            false => high = place,
        }
        let newton = place + (value - actual) / slope;
        place = if newton > low && newton < high {
            newton
        } else {
            (low + high) / 2.0
        };
    }
    place
}

/// The roots of odd order of a polynomial (lowest power first) in (0, `end`], ascending: between two neighbouring roots of
/// its derivative there is at most one.
fn roots(polynomial: &[f64], end: f64) -> Vec<f64> {
    if polynomial.len() < 2 {
        return Vec::new();
    }
    let value = |x: f64| polynomial.iter().rev().fold(0.0, |sum, c| sum * x + c);
    let powers = (1..).zip(&polynomial[1..]);
    let derivative: Vec<f64> = powers.map(|(power, c)| f64::from(power) * c).collect();
    let mut borders = vec![0.0];
    borders.extend(roots(&derivative, end));
    borders.push(end);
    let crossing = |pair: &[f64]| {
        let (mut low, mut high) = (pair[0], pair[1]);
        let rising = value(low) < value(high);
        if (value(low) < 0.0) == (value(high) < 0.0) {
            return None;
        }
        for _ in 0..200 {
            let middle = (low + high) / 2.0;
            match (value(middle) < 0.0) == rising {
                true => low = middle,
                false => high = middle,
            }
        }
        Some(low)
    };
    borders.windows(2).filter_map(crossing).collect()
}

/// Refuses coefficients that are not finite, by their names.
pub(super) fn check_finite<const N: usize>(names: [&'static str; N], values: [f64; N]) -> Result<()> {
    let check = |(name, value): (_, f64)| check(name, value, value.is_finite(), "a finite coefficient");
    names.into_iter().zip(values).try_for_each(check)
}

/// Refuses a camera's parameter, by its name, unless it `is_valid`.
pub(super) fn check(parameter: &'static str, actual: f64, is_valid: bool, expected: &'static str) -> Result<()> {
    is_valid.then_some(()).ok_or(refused(parameter, actual, expected))
}

pub(super) fn refused(parameter: &'static str, actual: f64, expected: &'static str) -> GeometryError {
    GeometryError::CameraParameter {
        parameter,
        actual,
        expected,
    }
}
