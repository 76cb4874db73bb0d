//! The template's texture against the image.

use crate::camera::Camera;
use crate::error::{GeometryError, check_size};
use crate::image::ContrastNormalizedImage;
use crate::mesh::{AnchoredPoint, SurfacePoint, TriangleMesh};
use crate::solver::energy::{Energy, ResidualSink, Robust, check_robust, check_weight};
use glam::{DVec2, DVec3};

/// A template point and what is printed there.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TexturePoint {
    /// The point on the template.
    pub point: SurfacePoint,
    /// The template's normalised grey value there (blurred and normalised over the same length on the object as
    /// the image is).
    pub value: f64,
}

/// The photo-consistency term: image against template at template points, both normalised in local contrast. It is
/// the weight times the sum of rho((I(pi(p)) - T)^2); light, exposure and gain drop out. The residual is in local
/// deviations. Points that project outside the image count as a residual of 1 that does not move. The paper's
/// photo-consistency loss trains its network; as a fit of the mesh it is the direct method of Shape-from-Template (Yu
/// et al. 2015, Ngo et al. 2015).
#[derive(Clone, Debug)]
pub struct PhotoConsistency<'a> {
    image: &'a ContrastNormalizedImage,
    camera: Camera,
    points: Vec<(AnchoredPoint, f64)>,
    weight: f64,
    robust: Robust,
}

/// One photo-consistency residual, linearised.
pub(crate) struct PixelResidual {
    pub(crate) residual: f64,
    /// The robust weight included.
    pub(crate) weight: f64,
    /// With respect to the three vertices around the point, per mm.
    pub(crate) vertex_gradients: [(usize, DVec3); 3],
    /// With respect to where the image shows the point, per pixel.
    pub(crate) pixel_gradient: DVec2,
    /// The point, camera frame, mm.
    pub(crate) p_camera: DVec3,
}

impl<'a> PhotoConsistency<'a> {
    /// Takes the template's points (every few millimetres) and one frame's normalised `image`. Its pixels are those
    /// of `camera`; `robust` has its scale in local deviations (Cauchy at 0.8 worked best). Converges from about the
    /// blur's width in pixels: solve from coarse to fine.
    ///
    /// # Errors
    /// [`GeometryError::MapSize`] when the image is not of the camera's size, [`GeometryError::Weight`] for weights that cannot be.
    pub fn new(
        template: &TriangleMesh,
        camera: &Camera,
        image: &'a ContrastNormalizedImage,
        points: &[TexturePoint],
        weight: f64,
        robust: Robust,
    ) -> Result<Self, GeometryError> {
        check_weight("photo-consistency", weight)?;
        check_robust("photo-consistency", robust)?;
        check_size(image.size(), camera.size())?;
        let known = points.iter().filter(|p| p.value.is_finite());
        let kept = |p: &TexturePoint| Some((AnchoredPoint::new(template, p.point)?, p.value));
        Ok(Self {
            image,
            camera: *camera,
            points: known.filter_map(kept).collect(),
            weight,
            robust,
        })
    }

    /// Shows the residual of every point before the camera.
    pub(crate) fn linearize_pixels(&self, vertices: &[DVec3], mut visit: impl FnMut(PixelResidual)) {
        for (point, value) in &self.points {
            let p_camera = point.position(vertices);
            if let Some((pixel, [dx, dy])) = self.camera.project_with_gradients(p_camera) {
                let (residual, gradient) = self.residual(pixel, *value);
                visit(PixelResidual {
                    residual,
                    weight: self.weight * self.robust.weight(residual * residual),
                    vertex_gradients: point.spread(gradient.x * dx + gradient.y * dy),
                    pixel_gradient: gradient,
                    p_camera,
                });
            }
        }
    }

    /// Residual and image gradient at an image position.
    fn residual(&self, pixel: DVec2, value: f64) -> (f64, DVec2) {
        let seen = self.image.sample_continued(pixel);
        seen.map_or((1.0, DVec2::ZERO), |(seen, gradient)| (seen - value, gradient))
    }
}

impl Energy for PhotoConsistency<'_> {
    fn name(&self) -> &'static str {
        "photo-consistency"
    }

    fn energy(&self, vertices: &[DVec3]) -> f64 {
        let square = |(point, value): &(AnchoredPoint, f64)| {
            let pixel = self.camera.project(point.position(vertices));
            pixel.map_or(f64::INFINITY, |pixel| self.residual(pixel, *value).0.powi(2))
        };
        self.weight * self.robust.sum(self.points.iter().map(square))
    }

    fn linearize(&self, vertices: &[DVec3], sink: &mut dyn ResidualSink) {
        self.linearize_pixels(vertices, |at| {
            sink.scalar(at.residual, at.weight, &at.vertex_gradients);
        });
    }
}
