//! How far predicted maps are from the truth: the one definition of every figure we print.

use super::depth_and_registration::Maps;
use crate::camera::Camera;
use crate::error::{GeometryError, check_size};
use crate::mesh::Template;
use glam::{DVec2, DVec3};

/// Two neighbouring pixels whose depths differ by more than this fraction of the depth lie on two
/// sheets of the surface: 5 % of 500 mm over one pixel is a tilt of 87 degrees at f = 380.
const DEPTH_JUMP: f64 = 0.05;

/// Bounds on the singular values of the true map's Jacobian (mm of template per pixel), as multiples of
/// the pixel's footprint depth / f. A pixel of an isometric surface has the singular values
/// 0.8 to 1 (0.8 in the image's corners) and 1 / cos(tilt) footprints. Below the lower bound the
/// inverse only amplifies rounding; above the upper one (tilt 84 degrees) the neighbours lie on two
/// sides of a fold. Such pixels are left out of the figure in pixels.
const JACOBIAN_BOUNDS: [f64; 2] = [0.25, 10.0];

/// The rest shape on which errors of a registration are measured: a sheet of a size in mm, or a template.
///
/// Of a template that is no sheet they are distances in space. A texture position on another chart can be a millimetre away, and
/// one beside it on the same texture the width of the object.
#[derive(Clone, Copy, Debug)]
pub enum RestShape<'a> {
    /// A sheet, or a texture's unit square as large as that.
    Sheet(DVec2),
    /// Any template.
    Template(&'a Template),
}

impl From<DVec2> for RestShape<'_> {
    fn from(size_mm: DVec2) -> Self {
        Self::Sheet(size_mm)
    }
}

impl<'a> From<&'a Template> for RestShape<'a> {
    fn from(template: &'a Template) -> Self {
        Self::Template(template)
    }
}

impl RestShape<'_> {
    /// The place of `uv`, mm; `None` where the texture belongs to no face.
    fn point(&self, uv: DVec2) -> Option<DVec3> {
        match self {
            Self::Sheet(size_mm) => Some((uv * size_mm).extend(0.0)),
            Self::Template(template) => template.point_template(uv),
        }
    }

    /// Returns the vector from the place of `truth` to that of `predicted`, mm. Where the prediction is on no face it has the
    /// length of the difference in the texture; `None` where the truth is on none.
    pub fn error_mm(&self, predicted: DVec2, truth: DVec2) -> Option<DVec3> {
        let from = self.point(truth)?;
        Some(match (self, self.point(predicted)) {
            (_, Some(to)) => to - from,
            (Self::Template(template), None) => ((predicted - truth) * template.size_mm()).extend(0.0),
            (Self::Sheet(_), None) => return None,
        })
    }
}

/// The metrics of one frame. Errors are over the pixels inside both masks and `None` when there are
/// none: read them beside [`coverage`](Self::coverage).
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct FrameMetrics {
    /// RMSE of the depth (camera-frame z), mm.
    pub depth_rmse_mm: Option<f64>,
    /// RMSE of the registration in pixels of the maps. It is the image displacement that the texture error stands
    /// for, through the inverse of the true map's local Jacobian d(u, v) / d(pixel). In words: how far an overlay
    /// sits from the truth. Over the pixels whose Jacobian is well defined: the four neighbours are on the object and
    /// on the same sheet of it.
    pub registration_rmse_px: Option<f64>,
    /// RMSE of the registration in mm on the template.
    pub registration_rmse_mm: Option<f64>,
    /// RMSE of the 3D points X = rho (x, y, 1), mm.
    pub points_rmse_mm: Option<f64>,
    /// Intersection over union of the masks; `None` when both are empty.
    pub mask_iou: Option<f64>,
    /// Fraction of the true mask's pixels that are also predicted; `None` when the true mask is empty.
    pub coverage: Option<f64>,
}

/// Compares `predicted` with `truth`, both maps of `camera`'s image and of the same rest shape.
///
/// ```
/// use deepsft_geometry::{Maps, glam::DVec2, metrics::frame_metrics, training_camera};
/// let mut truth = Maps::empty((480, 270));
/// truth.set(0, 500.0, [0.5, 0.5]);
/// let mut predicted = truth.clone();
/// predicted.set(0, 503.0, [0.5, 0.5]);
/// let metrics = frame_metrics(&predicted, &truth, &training_camera(), DVec2::new(297.0, 210.0))?;
/// assert_eq!(metrics.depth_rmse_mm, Some(3.0));
/// # Ok::<(), deepsft_geometry::GeometryError>(())
/// ```
///
/// # Errors
/// [`GeometryError::MapSize`] when the maps are not of the camera's size.
pub fn frame_metrics<'a>(
    predicted: &Maps,
    truth: &Maps,
    camera: &Camera,
    rest: impl Into<RestShape<'a>>,
) -> Result<FrameMetrics, GeometryError> {
    let (width, rest) = (camera.size().width, rest.into());
    for size in [truth.size(), predicted.size()] {
        check_size(size, camera.size())?;
    }
    let [mut depth, mut points, mut pixels, mut millimetres] = [(); 4].map(|()| MeanSquare::default());
    let (mut both, mut either) = (0_usize, 0_usize);
    for pixel in 0..camera.size().area() {
        let inside = (predicted.inside(pixel), truth.inside(pixel));
        either += usize::from(inside.0 || inside.1);
        if inside != (true, true) {
            continue;
        }
        both += 1;
        let depth_error = f64::from(predicted.depth()[pixel]) - f64::from(truth.depth()[pixel]);
        depth.add(depth_error * depth_error);
        let centre = DVec2::new((pixel % width) as f64 + 0.5, (pixel / width) as f64 + 0.5);
        points.add((camera.ray_from_pixel(centre).extend(1.0) * depth_error).length_squared());
        if let Some(error_mm) = rest.error_mm(predicted.uv(pixel), truth.uv(pixel)) {
            millimetres.add(error_mm.length_squared());
        }
        if let Some(error_px) = registration_error_px(predicted, truth, camera, pixel, rest) {
            pixels.add(error_px.length_squared());
        }
    }
    let fraction = |of: usize| (of > 0).then(|| both as f64 / of as f64);
    Ok(FrameMetrics {
        depth_rmse_mm: depth.root(),
        registration_rmse_px: pixels.root(),
        registration_rmse_mm: millimetres.root(),
        points_rmse_mm: points.root(),
        mask_iou: fraction(either),
        coverage: fraction(truth.area()),
    })
}

/// Returns the registration error at one pixel (row-major), in pixels: by how much an overlay is displaced there.
/// [`FrameMetrics::registration_rmse_px`] is its root mean square. `None` where it is not defined.
pub fn registration_error_px<'a>(
    predicted: &Maps,
    truth: &Maps,
    camera: &Camera,
    pixel: usize,
    rest: impl Into<RestShape<'a>>,
) -> Option<DVec2> {
    let size = predicted.depth().len().min(truth.depth().len());
    if pixel >= size || !predicted.inside(pixel) || !truth.inside(pixel) {
        return None;
    }
    let rest = rest.into();
    let error_mm = rest.error_mm(predicted.uv(pixel), truth.uv(pixel))?;
    let [x, y] = jacobian_mm(truth, pixel, camera, rest)?;
    // The step in the image whose steps on the surface are nearest to the error.
    let (a, b, c) = (x.length_squared(), x.dot(y), y.length_squared());
    let (p, q) = (x.dot(error_mm), y.dot(error_mm));
    Some(DVec2::new(c * p - b * q, a * q - b * p) / (a * c - b * b))
}

/// Mean and median of one metric over frames.
///
/// ```
/// use deepsft_geometry::metrics::Summary;
/// let summary = Summary::of([Some(1.0), None, Some(2.0), Some(6.0)]).expect("three values");
/// assert_eq!((summary.mean, summary.median, summary.frames), (3.0, 2.0, 3));
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Summary {
    /// Arithmetic mean.
    pub mean: f64,
    /// The middle value; the mean of the two middle ones for an even number.
    pub median: f64,
    /// Number of frames that have the metric.
    pub frames: usize,
}

impl Summary {
    /// Summarises the frames that have the metric; `None` when none has.
    pub fn of(values: impl IntoIterator<Item = Option<f64>>) -> Option<Self> {
        let mut values: Vec<f64> = values.into_iter().flatten().collect();
        values.sort_unstable_by(f64::total_cmp);
        let frames = values.len();
        let (low, high) = (values.get(frames.checked_sub(1)? / 2)?, values.get(frames / 2)?);
        Some(Self {
            mean: values.iter().sum::<f64>() / frames as f64,
            median: f64::midpoint(*low, *high),
            frames,
        })
    }
}

#[derive(Default)]
pub(crate) struct MeanSquare {
    sum: f64,
    count: usize,
}

impl MeanSquare {
    pub(crate) fn add(&mut self, squared_error: f64) {
        self.sum += squared_error;
        self.count += 1;
    }

    pub(crate) fn root(&self) -> Option<f64> {
        (self.count > 0).then(|| (self.sum / self.count as f64).sqrt())
    }
}

/// The Jacobian d(template mm) / d(pixel) of `truth` at `pixel` by central differences, along x and along y, or `None` where
/// a neighbour is missing or on another sheet, or a singular value is out of [`JACOBIAN_BOUNDS`].
fn jacobian_mm(truth: &Maps, pixel: usize, camera: &Camera, rest: RestShape<'_>) -> Option<[DVec3; 2]> {
    let pairs = neighbours_on_sheet(truth, pixel)?;
    let mut slopes = [DVec3::ZERO; 2];
    for (slope, [from, to]) in slopes.iter_mut().zip(pairs) {
        *slope = rest.error_mm(truth.uv(to), truth.uv(from))? / 2.0;
    }
    // Singular values of a matrix of two columns: their squares have the sum |J|^2, and their product is that of the columns.
    let [x, y] = slopes;
    let (norm2, det) = (x.length_squared() + y.length_squared(), x.cross(y).length());
    let (sum, difference) = ((norm2 + 2.0 * det).sqrt(), (norm2 - 2.0 * det).max(0.0).sqrt());
    let footprint = f64::from(truth.depth()[pixel]) / camera.focal().max_element();
    let smallest = (sum - difference) / 2.0 / footprint;
    let largest = (sum + difference) / 2.0 / footprint;
    (smallest >= JACOBIAN_BOUNDS[0] && largest <= JACOBIAN_BOUNDS[1]).then_some(slopes)
}

/// d(u, v) / dx and d(u, v) / dy per pixel, where all four neighbours are on the same sheet.
pub(crate) fn central_differences(maps: &Maps, pixel: usize) -> Option<[DVec2; 2]> {
    let half = |[from, to]: [usize; 2]| (maps.uv(to) - maps.uv(from)) / 2.0;
    Some(neighbours_on_sheet(maps, pixel)?.map(half))
}

/// The pixels left and right of a pixel, above and below it, where all four are on the same sheet of the surface.
fn neighbours_on_sheet(maps: &Maps, pixel: usize) -> Option<[[usize; 2]; 2]> {
    let (width, height) = (maps.size().width, maps.size().height);
    let (x, y) = (pixel % width, pixel / width);
    if x == 0 || y == 0 || x + 1 >= width || y + 1 >= height {
        return None;
    }
    let depth = maps.depth()[pixel];
    let same_sheet = |other: usize| {
        maps.inside(other) && f64::from((maps.depth()[other] - depth).abs()) <= DEPTH_JUMP * f64::from(depth)
    };
    let pairs = [[pixel - 1, pixel + 1], [pixel - width, pixel + width]];
    pairs.as_flattened().iter().copied().all(same_sheet).then_some(pairs)
}
