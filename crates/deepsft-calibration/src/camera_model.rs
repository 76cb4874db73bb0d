//! Which of a camera's numbers are solved for.

use deepsft_geometry::glam::DVec2;
use deepsft_geometry::{Camera, GeometryError, ImageSize, Lens};
use serde::Serialize;

/// The camera parameters that a calibration solves for. All but [`CameraModel::Fisheye`] are cases of the last before it.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
#[non_exhaustive]
pub enum CameraModel {
    /// One focal length; the principal point is the image's centre.
    Focal,
    /// fx, fy, cx, cy.
    Pinhole,
    /// fx, fy, cx, cy, k1, k2.
    Radial,
    /// fx, fy, cx, cy, k1, k2, p1, p2, k3: OpenCV's default.
    Polynomial,
    /// fx, fy, cx, cy, and the k1, k2, k3, k4 of OpenCV's `cv::fisheye`.
    Fisheye,
}

/// A camera parameter with its standard deviation.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct CameraParameter {
    /// As in `camera.json`: `fx`, `cy`, `k1`; of [`CameraModel::Focal`] `f`.
    pub name: &'static str,
    /// Its value: pixels, or a coefficient.
    pub value: f64,
    /// Its standard deviation, in the same unit, from the residuals and their derivatives.
    pub standard_deviation: f64,
}

impl CameraModel {
    /// All models with their names.
    pub const NAMED: [(&str, Self); 5] = [
        ("focal", Self::Focal),
        ("pinhole", Self::Pinhole),
        ("radial", Self::Radial),
        ("polynomial", Self::Polynomial),
        ("fisheye", Self::Fisheye),
    ];

    /// Its name.
    pub fn name(self) -> &'static str {
        let named = Self::NAMED.into_iter().find(|(_, model)| *model == self);
        named.map_or("", |(name, _)| name)
    }

    pub(crate) fn names(self) -> &'static [&'static str] {
        match self {
            Self::Focal => &["f"],
            Self::Pinhole => &["fx", "fy", "cx", "cy"],
            Self::Radial => &["fx", "fy", "cx", "cy", "k1", "k2"],
            Self::Polynomial => &["fx", "fy", "cx", "cy", "k1", "k2", "p1", "p2", "k3"],
            Self::Fisheye => &["fx", "fy", "cx", "cy", "k1", "k2", "k3", "k4"],
        }
    }

    pub(crate) fn values(self, camera: &Camera) -> Vec<f64> {
        let (focal, centre) = (camera.focal(), camera.principal_point());
        let coefficients = match camera.lens() {
            Lens::Pinhole => vec![0.0; 5],
            Lens::Polynomial([k1, k2, p1, p2, k3]) => vec![k1, k2, p1, p2, k3],
            Lens::Fisheye(k) => k.to_vec(),
        };
        let mut values = match self {
            Self::Focal => vec![focal.x],
            _ => vec![focal.x, focal.y, centre.x, centre.y],
        };
        let rest = self.names().len() - values.len();
        values.extend(&coefficients[..rest]);
        values
    }

    pub(crate) fn camera(self, values: &[f64], size: ImageSize) -> Result<Camera, GeometryError> {
        if let &[f] = values {
            return Camera::pinhole(size, DVec2::splat(f), size.as_dvec2() / 2.0);
        }
        let pinhole = Camera::pinhole(size, DVec2::new(values[0], values[1]), DVec2::new(values[2], values[3]))?;
        match values[4..] {
            [k1, k2] => pinhole.with_distortion([k1, k2, 0.0, 0.0, 0.0]),
            [k1, k2, p1, p2, k3] => pinhole.with_distortion([k1, k2, p1, p2, k3]),
            [k1, k2, k3, k4] => pinhole.with_fisheye([k1, k2, k3, k4]),
            _ => Ok(pinhole),
        }
    }

    /// The derivatives with respect to the parameters of where `camera` shows the ray (x, y, 1).
    pub(crate) fn gradients(self, camera: &Camera, ray: DVec2, pixel: DVec2) -> Vec<DVec2> {
        let focal = camera.focal();
        let distorted = (pixel - camera.principal_point()) / focal;
        let r2 = ray.length_squared();
        let mut gradients = match self {
            Self::Focal => return vec![distorted],
            _ => vec![
                DVec2::new(distorted.x, 0.0),
                DVec2::new(0.0, distorted.y),
                DVec2::X,
                DVec2::Y,
            ],
        };
        let terms = match self {
            Self::Fisheye => {
                let (r, angle) = (r2.sqrt(), r2.sqrt().atan());
                let direction = ray / r.max(1e-300);
                [3, 5, 7, 9].map(|power| focal * direction * angle.powi(power)).to_vec()
            }
            _ => {
                let mixed = 2.0 * ray.x * ray.y;
                let along = DVec2::splat(r2) + 2.0 * ray * ray;
                let (p1, p2) = (DVec2::new(mixed, along.y), DVec2::new(along.x, mixed));
                let terms = [ray * r2, ray * r2 * r2, p1, p2, ray * r2 * r2 * r2];
                terms.map(|d| focal * d).to_vec()
            }
        };
        let rest = self.names().len() - gradients.len();
        gradients.extend(&terms[..rest]);
        gradients
    }
}
