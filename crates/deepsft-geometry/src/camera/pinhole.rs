//! A camera: intrinsics and lens.

use super::lens::{Lens, check, check_finite};
use crate::error::GeometryError;
use crate::image::ImageSize;
use glam::{DVec2, DVec3, Vec2Swizzles};

/// A camera: image size, intrinsics in pixels, and its [`Lens`]. The values have been checked: sides and focal
/// lengths are positive, all numbers are finite.
///
/// ```
/// use deepsft_geometry::{Camera, glam::{DVec2, DVec3}};
/// let camera = Camera::pinhole((1280, 720), DVec2::splat(1000.0), DVec2::new(640.0, 360.0))?;
/// let pixel = camera.project(DVec3::new(10.0, 0.0, 500.0)).expect("in front of the camera");
/// assert_eq!((pixel.x, pixel.y), (660.0, 360.0));
/// # Ok::<(), deepsft_geometry::GeometryError>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Camera {
    size: ImageSize,
    focal: DVec2,
    principal_point: DVec2,
    lens: Lens,
    /// [`Lens::reach`] of the lens.
    reach: f64,
}

/// Focal length of an unknown phone or web camera as a fraction of the image's long side: the median
/// of a public table of 98 phones (0.73 to 1.01 covers 80 % of them).
const TYPICAL_FOCAL_FRACTION: f64 = 0.79;

/// Places along each side of an image that say which rays it holds.
const BORDER_PLACES: usize = 16;

impl Camera {
    /// A camera without lens distortion. `focal` is (fx, fy), `principal_point` (cx, cy), all in pixels,
    /// the image's corner at (0, 0) (so the centre of a 480-pixel row is 240).
    ///
    /// # Errors
    /// [`GeometryError::CameraParameter`] for an empty image, a focal length that is not positive,
    /// or a number that is not finite.
    pub fn pinhole(size: impl Into<ImageSize>, focal: DVec2, principal_point: DVec2) -> Result<Self, GeometryError> {
        let size = size.into();
        let [side, length, centre] = [
            "at least 1 pixel",
            "a positive finite focal length in pixels",
            "a finite principal point in pixels",
        ];
        check("width", size.width as f64, size.width > 0, side)?;
        check("height", size.height as f64, size.height > 0, side)?;
        check("fx", focal.x, focal.x.is_finite() && focal.x > 0.0, length)?;
        check("fy", focal.y, focal.y.is_finite() && focal.y > 0.0, length)?;
        check("cx", principal_point.x, principal_point.x.is_finite(), centre)?;
        check("cy", principal_point.y, principal_point.y.is_finite(), centre)?;
        Ok(Self {
            size,
            focal,
            principal_point,
            lens: Lens::Pinhole,
            reach: f64::INFINITY,
        })
    }

    /// The same camera with OpenCV's distortion coefficients (k1, k2, p1, p2, k3); a [`Lens::Pinhole`] when all are 0.
    ///
    /// # Errors
    /// [`GeometryError::CameraParameter`] when a coefficient is not finite.
    pub fn with_distortion(self, distortion: [f64; 5]) -> Result<Self, GeometryError> {
        check_finite(["k1", "k2", "p1", "p2", "k3"], distortion)?;
        Ok(self.with_lens(match distortion == [0.0; 5] {
            true => Lens::Pinhole,
            false => Lens::Polynomial(distortion),
        }))
    }

    /// The same camera with the coefficients (k1, k2, k3, k4) of OpenCV's `cv::fisheye`.
    ///
    /// # Errors
    /// [`GeometryError::CameraParameter`] when a coefficient is not finite.
    pub fn with_fisheye(self, coefficients: [f64; 4]) -> Result<Self, GeometryError> {
        check_finite(["k1", "k2", "k3", "k4"], coefficients)?;
        Ok(self.with_lens(Lens::Fisheye(coefficients)))
    }

    fn with_lens(self, lens: Lens) -> Self {
        let reach = lens.reach();
        Self { lens, reach, ..self }
    }

    /// A camera of the paper (its table of intrinsics) by its name: `kinect-v2`, `realsense-d435` or `gopro-hero3`. The paper prints
    /// 1270 x 720 for the Realsense; the sensor's stream has 1280 x 720.
    pub fn preset(name: &str) -> Option<Self> {
        let (size, [fx, fy, cx, cy]) = match name {
            "kinect-v2" => ((1920, 1080), [1057.8, 1064.0, 947.6, 530.4]),
            "realsense-d435" => ((1280, 720), [915.5, 915.5, 645.5, 366.3]),
            "gopro-hero3" => ((1920, 1080), [1686.8, 1694.2, 952.8, 563.5]),
            _ => return None,
        };
        Self::pinhole(size, DVec2::new(fx, fy), DVec2::new(cx, cy)).ok()
    }

    /// Guesses the camera of an image of `size` from an unknown source. The principal point is the
    /// centre, the focal length 0.79 of the long side (the median of 98 phones).
    ///
    /// # Errors
    /// [`GeometryError::CameraParameter`] for an empty image.
    pub fn typical(size: impl Into<ImageSize>) -> Result<Self, GeometryError> {
        let size = size.into();
        let sides = size.as_dvec2();
        let focal = TYPICAL_FOCAL_FRACTION * sides.max_element();
        Self::pinhole(size, DVec2::splat(focal), sides / 2.0)
    }

    /// The same camera for an image resized to `size`: intrinsics scale with the sides.
    ///
    /// # Errors
    /// [`GeometryError::CameraParameter`] for an empty image.
    pub fn resized(&self, size: impl Into<ImageSize>) -> Result<Self, GeometryError> {
        let size = size.into();
        let scale = size.as_dvec2() / self.size.as_dvec2();
        let scaled = Self::pinhole(size, self.focal * scale, self.principal_point * scale)?;
        Ok(scaled.with_lens(self.lens))
    }

    /// The same camera for an image at half the size (sides rounded down), each pixel the mean of four.
    pub(crate) fn halved(&self) -> Result<Self, GeometryError> {
        let halved = Self::pinhole(self.size.halved(), self.focal / 2.0, self.principal_point / 2.0)?;
        Ok(halved.with_lens(self.lens))
    }

    /// The same camera held a quarter turned: its images are this one's, turned by a quarter anticlockwise. A point (x, y, z) of this
    /// camera is (y, -x, z) of the turned one.
    #[must_use]
    pub fn turned_anticlockwise(&self) -> Self {
        Self {
            size: (self.size.height, self.size.width).into(),
            focal: self.focal.yx(),
            principal_point: DVec2::new(self.principal_point.y, self.size.width as f64 - self.principal_point.x),
            lens: self.lens.turned_anticlockwise(),
            reach: self.reach,
        }
    }

    /// The same camera with other focal lengths, `scale` times its own: below 1 it sees more.
    pub fn zoomed(&self, scale: f64) -> Self {
        let focal = scale * self.focal;
        Self { focal, ..*self }
    }

    /// Whether the two differ in nothing but their focal lengths.
    pub fn is_zoom_of(&self, other: &Self) -> bool {
        let focal = other.focal;
        Self { focal, ..*self } == *other
    }

    /// Columns and rows of the image, pixels.
    pub fn size(&self) -> ImageSize {
        self.size
    }

    /// Focal lengths (fx, fy), pixels.
    pub fn focal(&self) -> DVec2 {
        self.focal
    }

    /// Principal point (cx, cy), pixels.
    pub fn principal_point(&self) -> DVec2 {
        self.principal_point
    }

    /// What the lens does to rays.
    pub fn lens(&self) -> Lens {
        self.lens
    }

    /// Projects a camera point (mm) to an image position (pixels). `None` at or behind the camera's plane, and where
    /// the lens model folds back (see [`Camera::pixel_from_ray`]).
    pub fn project(&self, p_camera: DVec3) -> Option<DVec2> {
        if p_camera.z <= 0.0 {
            return None;
        }
        self.pixel_from_ray(p_camera.truncate() / p_camera.z)
    }

    /// Projects as [`Camera::project`] does, with the gradients of both coordinates by the point, pixels per mm.
    /// `None` where that gives none.
    pub fn project_with_gradients(&self, p_camera: DVec3) -> Option<(DVec2, [DVec3; 2])> {
        let pixel = self.project(p_camera)?;
        let ray = p_camera.truncate() / p_camera.z;
        let [x, y] = self.lens.gradients(ray);
        // d ray / d p = (1, 0, -x) / z and (0, 1, -y) / z.
        let chain = |row: DVec2, focal: f64| row.extend(-row.dot(ray)) * (focal / p_camera.z);
        Some((pixel, [chain(x, self.focal.x), chain(y, self.focal.y)]))
    }

    /// Image position in pixels of the ray (x, y, 1), distortion applied. `None` for a ray so far from the axis that
    /// the lens model folds back: it would bring what lies outside of the image into it once more.
    pub fn pixel_from_ray(&self, ray: DVec2) -> Option<DVec2> {
        (ray.length() <= self.reach).then(|| self.lens.distort(ray) * self.focal() + self.principal_point())
    }

    /// Unprojects an image position (pixels) to the undistorted ray (x, y, 1). It is the inverse of
    /// [`Camera::pixel_from_ray`], exact to 1e-8 px. For a position that no ray has, beyond the place where the lens
    /// model folds back, the outermost ray in its direction.
    pub fn ray_from_pixel(&self, pixel: DVec2) -> DVec2 {
        let distorted = (pixel - self.principal_point()) / self.focal();
        self.lens.undistort(distorted, self.reach)
    }

    /// Rays (x, y, 1) of places at the top, the bottom, the left and the right of the image's border, all along it: together they say
    /// which rays the image holds.
    pub(crate) fn border_rays(&self) -> impl Iterator<Item = [DVec2; 4]> + '_ {
        let size = self.size.as_dvec2();
        (0..=BORDER_PLACES).map(move |k| {
            let at = size * (k as f64 / BORDER_PLACES as f64);
            let places = [(at.x, 0.0), (at.x, size.y), (0.0, at.y), (size.x, at.y)];
            places.map(|(x, y)| self.ray_from_pixel(DVec2::new(x, y)))
        })
    }

    /// The camera point in mm at depth `depth_mm` (its z) behind an image position: X = rho (x, y, 1).
    pub fn unproject(&self, pixel: DVec2, depth_mm: f64) -> DVec3 {
        self.ray_from_pixel(pixel).extend(1.0) * depth_mm
    }
}
