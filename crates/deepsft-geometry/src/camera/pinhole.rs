//! Pinhole camera with intrinsics and lens distortion.

use crate::error::GeometryError;
use glam::{DVec2, DVec3};

/// A pinhole camera: image size, intrinsics in pixels, and distortion in OpenCV's order
/// (k1, k2, p1, p2, k3). The values have been checked: sides and focal lengths are positive, all
/// numbers are finite.
///
/// ```
/// use deepsft_geometry::{Camera, glam::DVec3};
/// let camera = Camera::pinhole(1280, 720, 1000.0, 1000.0, 640.0, 360.0)?;
/// let pixel = camera.project(DVec3::new(10.0, 0.0, 500.0)).expect("in front of the camera");
/// assert_eq!((pixel.x, pixel.y), (660.0, 360.0));
/// # Ok::<(), deepsft_geometry::GeometryError>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Camera {
    width: u32,
    height: u32,
    fx: f64,
    fy: f64,
    cx: f64,
    cy: f64,
    distortion: [f64; 5],
}

/// Focal length of an unknown phone or web camera as a fraction of the image's long side: the median
/// of a public table of 98 phones (0.73 to 1.01 covers 80 % of them).
const TYPICAL_FOCAL_FRACTION: f64 = 0.79;

/// The cameras of the paper (its table of intrinsics) by name: (name, width, height, [fx, fy, cx, cy]) in
/// pixels. The paper prints 1270 x 720 for the Realsense; the sensor's stream has 1280 x 720.
pub const PAPER_CAMERAS: [(&str, u32, u32, [f64; 4]); 3] = [
    ("kinect-v2", 1920, 1080, [1057.8, 1064.0, 947.6, 530.4]),
    ("realsense-d435", 1280, 720, [915.5, 915.5, 645.5, 366.3]),
    ("gopro-hero3", 1920, 1080, [1686.8, 1694.2, 952.8, 563.5]),
];

const DISTORTION_NAMES: [&str; 5] = ["k1", "k2", "p1", "p2", "k3"];

impl Camera {
    /// A camera without lens distortion. `width`, `height`, `fx`, `fy`, `cx`, `cy` in pixels, the
    /// image's corner at (0, 0) (so the centre of a 480-pixel row is 240).
    ///
    /// # Errors
    /// [`GeometryError::CameraParameter`] for an empty image, a focal length that is not positive,
    /// or a number that is not finite.
    pub fn pinhole(width: u32, height: u32, fx: f64, fy: f64, cx: f64, cy: f64) -> Result<Self, GeometryError> {
        let [side, focal, centre] = [
            "at least 1 pixel",
            "a positive finite focal length in pixels",
            "a finite principal point in pixels",
        ];
        let checks = [
            ("width", f64::from(width), width > 0, side),
            ("height", f64::from(height), height > 0, side),
            ("fx", fx, fx.is_finite() && fx > 0.0, focal),
            ("fy", fy, fy.is_finite() && fy > 0.0, focal),
            ("cx", cx, cx.is_finite(), centre),
            ("cy", cy, cy.is_finite(), centre),
        ];
        if let Some(&(parameter, actual, _, expected)) = checks.iter().find(|(_, _, valid, _)| !valid) {
            return Err(GeometryError::CameraParameter {
                parameter,
                actual,
                expected,
            });
        }
        Ok(Self {
            width,
            height,
            fx,
            fy,
            cx,
            cy,
            distortion: [0.0; 5],
        })
    }

    /// The same camera with OpenCV's distortion coefficients (k1, k2, p1, p2, k3).
    ///
    /// # Errors
    /// [`GeometryError::CameraParameter`] when a coefficient is not finite.
    pub fn with_distortion(mut self, distortion: [f64; 5]) -> Result<Self, GeometryError> {
        for (parameter, actual) in DISTORTION_NAMES.into_iter().zip(distortion) {
            if !actual.is_finite() {
                return Err(GeometryError::CameraParameter {
                    parameter,
                    actual,
                    expected: "a finite coefficient",
                });
            }
        }
        self.distortion = distortion;
        Ok(self)
    }

    /// A guess for an image of unknown origin: principal point at the centre, focal length 0.79 of
    /// the long side (the median of 98 phones).
    ///
    /// # Errors
    /// [`GeometryError::CameraParameter`] for an empty image.
    pub fn typical(width: u32, height: u32) -> Result<Self, GeometryError> {
        let focal = TYPICAL_FOCAL_FRACTION * f64::from(width.max(height));
        let focal = if focal > 0.0 { focal } else { 1.0 };
        let (cx, cy) = (f64::from(width) / 2.0, f64::from(height) / 2.0);
        Self::pinhole(width, height, focal, focal, cx, cy)
    }

    /// The same camera for an image resized to `width` x `height`: intrinsics scale with the sides.
    ///
    /// # Errors
    /// [`GeometryError::CameraParameter`] for an empty image.
    pub fn resized(&self, width: u32, height: u32) -> Result<Self, GeometryError> {
        if width == 0 || height == 0 {
            return Self::pinhole(width, height, self.fx, self.fy, self.cx, self.cy);
        }
        let sx = f64::from(width) / f64::from(self.width);
        let sy = f64::from(height) / f64::from(self.height);
        Self::pinhole(width, height, self.fx * sx, self.fy * sy, self.cx * sx, self.cy * sy)?
            .with_distortion(self.distortion)
    }

    /// The same camera for an image at half the size (sides rounded down), each pixel the mean of four.
    ///
    /// # Errors
    /// [`GeometryError::CameraParameter`] for an image of one row or column.
    pub(crate) fn halved(&self) -> Result<Self, GeometryError> {
        let half = |number: f64| number / 2.0;
        let (width, height) = (self.width / 2, self.height / 2);
        Self::pinhole(
            width,
            height,
            half(self.fx),
            half(self.fy),
            half(self.cx),
            half(self.cy),
        )?
        .with_distortion(self.distortion)
    }

    /// The same camera held a quarter turned: its images are this one's, turned by a quarter anticlockwise. A point (x, y, z) of this
    /// camera is (y, -x, z) of the turned one.
    #[must_use]
    pub fn turned_anticlockwise(&self) -> Self {
        let [k1, k2, p1, p2, k3] = self.distortion;
        Self {
            width: self.height,
            height: self.width,
            fx: self.fy,
            fy: self.fx,
            cx: self.cy,
            cy: f64::from(self.width) - self.cx,
            distortion: [k1, k2, -p2, p1, k3],
        }
    }

    /// Image width, pixels.
    pub fn width(&self) -> u32 {
        self.width
    }

    /// Image height, pixels.
    pub fn height(&self) -> u32 {
        self.height
    }

    /// Columns and rows of the image, pixels.
    pub fn size(&self) -> (usize, usize) {
        (self.width as usize, self.height as usize)
    }

    /// Focal lengths (fx, fy), pixels.
    pub fn focal(&self) -> DVec2 {
        DVec2::new(self.fx, self.fy)
    }

    /// Principal point (cx, cy), pixels.
    pub fn principal_point(&self) -> DVec2 {
        DVec2::new(self.cx, self.cy)
    }

    /// Distortion coefficients (k1, k2, p1, p2, k3), OpenCV's order.
    pub fn distortion(&self) -> [f64; 5] {
        self.distortion
    }

    /// Image position in pixels of a camera point in mm; `None` at or behind the camera's plane.
    pub fn project(&self, p_camera: DVec3) -> Option<DVec2> {
        (p_camera.z > 0.0).then(|| self.pixel_from_ray(p_camera.truncate() / p_camera.z))
    }

    /// [`Camera::project`] and the gradients of both image coordinates with respect to the point, pixels per mm;
    /// `None` at or behind the camera's plane.
    pub fn project_with_gradients(&self, p_camera: DVec3) -> Option<(DVec2, [DVec3; 2])> {
        let pixel = self.project(p_camera)?;
        let ray = p_camera.truncate() / p_camera.z;
        let [k1, k2, p1, p2, k3] = self.distortion;
        let r2 = ray.length_squared();
        let radial = 1.0 + r2 * (k1 + r2 * (k2 + r2 * k3));
        // d radial / d ray = slope * ray.
        let slope = 2.0 * (k1 + r2 * (2.0 * k2 + r2 * 3.0 * k3));
        let mixed = slope * ray.x * ray.y + 2.0 * (p1 * ray.x + p2 * ray.y);
        let rows = [
            DVec2::new(
                radial + slope * ray.x * ray.x + 2.0 * p1 * ray.y + 6.0 * p2 * ray.x,
                mixed,
            ),
            DVec2::new(
                mixed,
                radial + slope * ray.y * ray.y + 6.0 * p1 * ray.y + 2.0 * p2 * ray.x,
            ),
        ];
        // d ray / d p = (1, 0, -x) / z and (0, 1, -y) / z.
        let chain = |row: DVec2, focal: f64| row.extend(-row.dot(ray)) * (focal / p_camera.z);
        Some((pixel, [chain(rows[0], self.fx), chain(rows[1], self.fy)]))
    }

    /// Image position in pixels of the ray (x, y, 1), distortion applied.
    pub fn pixel_from_ray(&self, ray: DVec2) -> DVec2 {
        self.distort(ray) * self.focal() + self.principal_point()
    }

    /// The ray (x, y, 1) through an image position in pixels, distortion removed. The inverse of
    /// [`Camera::pixel_from_ray`] by fixed-point iteration as in OpenCV's `undistortPoints`, exact to
    /// 1e-9 for the mild distortion of ordinary lenses.
    pub fn ray_from_pixel(&self, pixel: DVec2) -> DVec2 {
        let distorted = (pixel - self.principal_point()) / self.focal();
        if self.distortion == [0.0; 5] {
            return distorted;
        }
        let mut ray = distorted;
        for _ in 0..50 {
            let step = distorted - self.distort(ray);
            ray += step;
            if step.length_squared() < 1e-24 {
                break;
            }
        }
        ray
    }

    /// The camera point in mm at depth `depth_mm` (its z) behind an image position: X = rho (x, y, 1).
    pub fn unproject(&self, pixel: DVec2, depth_mm: f64) -> DVec3 {
        self.ray_from_pixel(pixel).extend(1.0) * depth_mm
    }

    /// OpenCV's radial and tangential model on the normalised image plane.
    fn distort(&self, p: DVec2) -> DVec2 {
        let [k1, k2, p1, p2, k3] = self.distortion;
        let r2 = p.length_squared();
        let radial = 1.0 + r2 * (k1 + r2 * (k2 + r2 * k3));
        DVec2::new(
            p.x * radial + 2.0 * p1 * p.x * p.y + p2 * (r2 + 2.0 * p.x * p.x),
            p.y * radial + p1 * (r2 + 2.0 * p.y * p.y) + 2.0 * p2 * p.x * p.y,
        )
    }
}
