//! A camera: intrinsics and lens.

use super::lens::Lens;
use crate::error::GeometryError;
use glam::{DVec2, DVec3};

/// A camera: image size, intrinsics in pixels, and its [`Lens`]. The values have been checked: sides and focal
/// lengths are positive, all numbers are finite.
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
    lens: Lens,
    /// [`Lens::reach`] of the lens.
    reach: f64,
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
            lens: Lens::Pinhole,
            reach: f64::INFINITY,
        })
    }

    /// The same camera with OpenCV's distortion coefficients (k1, k2, p1, p2, k3).
    ///
    /// # Errors
    /// [`GeometryError::CameraParameter`] when a coefficient is not finite.
    pub fn with_distortion(self, distortion: [f64; 5]) -> Result<Self, GeometryError> {
        Ok(self.with_lens(Lens::polynomial(distortion)?))
    }

    /// The same camera with the coefficients (k1, k2, k3, k4) of OpenCV's `cv::fisheye`.
    ///
    /// # Errors
    /// [`GeometryError::CameraParameter`] when a coefficient is not finite.
    pub fn with_fisheye(self, coefficients: [f64; 4]) -> Result<Self, GeometryError> {
        Ok(self.with_lens(Lens::fisheye(coefficients)?))
    }

    fn with_lens(self, lens: Lens) -> Self {
        let reach = lens.reach();
        Self { lens, reach, ..self }
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
        let scaled = Self::pinhole(width, height, self.fx * sx, self.fy * sy, self.cx * sx, self.cy * sy)?;
        Ok(scaled.with_lens(self.lens))
    }

    /// The same camera for an image at half the size (sides rounded down), each pixel the mean of four.
    ///
    /// # Errors
    /// [`GeometryError::CameraParameter`] for an image of one row or column.
    pub(crate) fn halved(&self) -> Result<Self, GeometryError> {
        let half = |number: f64| number / 2.0;
        let (width, height) = (self.width / 2, self.height / 2);
        let halved = Self::pinhole(
            width,
            height,
            half(self.fx),
            half(self.fy),
            half(self.cx),
            half(self.cy),
        )?;
        Ok(halved.with_lens(self.lens))
    }

    /// The same camera held a quarter turned: its images are this one's, turned by a quarter anticlockwise. A point (x, y, z) of this
    /// camera is (y, -x, z) of the turned one.
    #[must_use]
    pub fn turned_anticlockwise(&self) -> Self {
        Self {
            width: self.height,
            height: self.width,
            fx: self.fy,
            fy: self.fx,
            cx: self.cy,
            cy: f64::from(self.width) - self.cx,
            lens: self.lens.turned_anticlockwise(),
            reach: self.reach,
        }
    }

    /// The same camera with other focal lengths, `scale` times its own: below 1 it sees more.
    pub(crate) fn zoomed(&self, scale: f64) -> Self {
        Self {
            fx: scale * self.fx,
            fy: scale * self.fy,
            ..*self
        }
    }

    /// Whether the two differ in nothing but their focal lengths.
    pub(crate) fn is_zoom_of(&self, other: &Self) -> bool {
        let (fx, fy) = (other.fx, other.fy);
        Self { fx, fy, ..*self } == *other
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

    /// What the lens does to rays.
    pub fn lens(&self) -> Lens {
        self.lens
    }

    /// Image position in pixels of a camera point in mm; `None` at or behind the camera's plane, and where the lens model
    /// folds back (see [`Camera::pixel_from_ray`]).
    pub fn project(&self, p_camera: DVec3) -> Option<DVec2> {
        if p_camera.z <= 0.0 {
            return None;
        }
        self.pixel_from_ray(p_camera.truncate() / p_camera.z)
    }

    /// [`Camera::project`] and the gradients of both image coordinates with respect to the point, pixels per mm;
    /// `None` where that gives none.
    pub fn project_with_gradients(&self, p_camera: DVec3) -> Option<(DVec2, [DVec3; 2])> {
        let pixel = self.project(p_camera)?;
        let ray = p_camera.truncate() / p_camera.z;
        let [x, y] = self.lens.gradients(ray);
        // d ray / d p = (1, 0, -x) / z and (0, 1, -y) / z.
        let chain = |row: DVec2, focal: f64| row.extend(-row.dot(ray)) * (focal / p_camera.z);
        Some((pixel, [chain(x, self.fx), chain(y, self.fy)]))
    }

    /// Image position in pixels of the ray (x, y, 1), distortion applied. `None` for a ray so far from the axis that
    /// the lens model folds back: it would bring what lies outside of the image into it once more.
    pub fn pixel_from_ray(&self, ray: DVec2) -> Option<DVec2> {
        (ray.length() <= self.reach).then(|| self.lens.distort(ray) * self.focal() + self.principal_point())
    }

    /// The ray (x, y, 1) through an image position in pixels, distortion removed: the inverse of
    /// [`Camera::pixel_from_ray`], exact to 1e-8 px. For a position that no ray has, beyond the place where the lens model
    /// folds back, the outermost ray in its direction.
    pub fn ray_from_pixel(&self, pixel: DVec2) -> DVec2 {
        let distorted = (pixel - self.principal_point()) / self.focal();
        self.lens.undistort(distorted, self.reach)
    }

    /// The camera point in mm at depth `depth_mm` (its z) behind an image position: X = rho (x, y, 1).
    pub fn unproject(&self, pixel: DVec2, depth_mm: f64) -> DVec3 {
        self.ray_from_pixel(pixel).extend(1.0) * depth_mm
    }
}
