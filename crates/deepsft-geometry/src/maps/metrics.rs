//! How far predicted maps are from the truth: the one definition of every figure we print.

use super::depth_and_registration::Maps;
use crate::camera::Camera;
use crate::error::{GeometryError, check_size};
use glam::{DMat2, DVec2};

/// Two neighbouring pixels whose depths differ by more than this fraction of the depth lie on two
/// sheets of the surface: 5 % of 500 mm over one pixel is a tilt of 87 degrees at f = 380.
const DEPTH_JUMP: f64 = 0.05;

/// Bounds on the singular values of the true map's Jacobian (mm of template per pixel), as multiples of
/// the pixel's footprint depth / f. A pixel of an isometric surface has the singular values
/// 0.8 to 1 (0.8 in the image's corners) and 1 / cos(tilt) footprints. Below the lower bound the
/// inverse only amplifies rounding; above the upper one (tilt 84 degrees) the neighbours lie on two
/// sides of a fold. Such pixels are left out of the figure in pixels.
const JACOBIAN_BOUNDS: [f64; 2] = [0.25, 10.0];

/// The metrics of one frame. Errors are over the pixels inside both masks and `None` when there are
/// none: read them beside [`coverage`](Self::coverage).
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct FrameMetrics {
    /// RMSE of the depth (camera-frame z), mm.
    pub depth_rmse_mm: Option<f64>,
    /// RMSE of the registration in pixels of the maps: the image displacement that the texture error
    /// stands for, through the inverse of the true map's local Jacobian d(u, v) / d(pixel). In words:
    /// how far an overlay sits from the truth. Over the pixels whose Jacobian is well defined: the
    /// four neighbours are on the object and on the same sheet of it.
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

/// Compares `predicted` with `truth`, both maps of `camera`'s image; `template_size_mm` is the size of
/// the texture map's unit square on the template.
///
/// ```
/// use deepsft_geometry::{Maps, glam::DVec2, metrics::frame_metrics, training_camera};
/// let mut truth = Maps::empty(480, 270);
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
pub fn frame_metrics(
    predicted: &Maps,
    truth: &Maps,
    camera: &Camera,
    template_size_mm: DVec2,
) -> Result<FrameMetrics, GeometryError> {
    frame_metrics_between((predicted, camera), (truth, camera), template_size_mm)
}

/// As [`frame_metrics`], for maps that were made believing in another camera than the true one: each side's 3D points
/// come from its own camera. Both cameras have one image size, and a pixel is the same pixel of both.
///
/// # Errors
/// [`GeometryError::MapSize`] when maps or the cameras' images are not all of one size.
pub fn frame_metrics_between(
    (predicted, believed): (&Maps, &Camera),
    (truth, camera): (&Maps, &Camera),
    template_size_mm: DVec2,
) -> Result<FrameMetrics, GeometryError> {
    let (width, height) = camera.size();
    for size in [truth.size(), predicted.size(), believed.size()] {
        check_size(size, camera.size())?;
    }
    let (mut depth, mut points, mut pixels, mut millimetres) = (
        MeanSquare::default(),
        MeanSquare::default(),
        MeanSquare::default(),
        MeanSquare::default(),
    );
    let (mut both, mut either) = (0_usize, 0_usize);
    for pixel in 0..width * height {
        let inside = (predicted.inside(pixel), truth.inside(pixel));
        either += usize::from(inside.0 || inside.1);
        if inside != (true, true) {
            continue;
        }
        both += 1;
        let depth_error = f64::from(predicted.depth()[pixel]) - f64::from(truth.depth()[pixel]);
        depth.add(depth_error * depth_error);
        let centre = DVec2::new((pixel % width) as f64 + 0.5, (pixel / width) as f64 + 0.5);
        let point =
            |camera: &Camera, maps: &Maps| camera.ray_from_pixel(centre).extend(1.0) * f64::from(maps.depth()[pixel]);
        points.add((point(believed, predicted) - point(camera, truth)).length_squared());
        let error_mm = (predicted.uv(pixel) - truth.uv(pixel)) * template_size_mm;
        millimetres.add(error_mm.length_squared());
        if let Some(error_px) = registration_error_px(predicted, (truth, camera), pixel, template_size_mm) {
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

/// The error behind [`FrameMetrics::registration_rmse_px`] at one pixel, row-major, of maps of one size: by how many pixels an
/// overlay is displaced there. `None` where it is not defined.
pub fn registration_error_px(
    predicted: &Maps,
    (truth, camera): (&Maps, &Camera),
    pixel: usize,
    template_size_mm: DVec2,
) -> Option<DVec2> {
    let size = predicted.depth().len().min(truth.depth().len());
    if pixel >= size || !predicted.inside(pixel) || !truth.inside(pixel) {
        return None;
    }
    let error_mm = (predicted.uv(pixel) - truth.uv(pixel)) * template_size_mm;
    let jacobian = jacobian_mm(truth, pixel, camera, template_size_mm)?;
    Some(jacobian.inverse() * error_mm)
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

/// A mean of squared errors in the making.
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

/// The Jacobian d(template mm) / d(pixel) of `truth` at `pixel` by central differences, or `None` where
/// a neighbour is missing or on another sheet, or a singular value is out of [`JACOBIAN_BOUNDS`].
fn jacobian_mm(truth: &Maps, pixel: usize, camera: &Camera, template_size_mm: DVec2) -> Option<DMat2> {
    let [dx, dy] = central_differences(truth, pixel)?;
    let jacobian = DMat2::from_cols(dx * template_size_mm, dy * template_size_mm);
    // Singular values of a 2x2 matrix: their squares have the sum |J|^2 and the product det(J)^2.
    let norm2 = jacobian.x_axis.length_squared() + jacobian.y_axis.length_squared();
    let det = jacobian.determinant().abs();
    let (sum, difference) = ((norm2 + 2.0 * det).sqrt(), (norm2 - 2.0 * det).max(0.0).sqrt());
    let footprint = f64::from(truth.depth()[pixel]) / camera.focal().max_element();
    let smallest = (sum - difference) / 2.0 / footprint;
    let largest = (sum + difference) / 2.0 / footprint;
    (smallest >= JACOBIAN_BOUNDS[0] && largest <= JACOBIAN_BOUNDS[1]).then_some(jacobian)
}

/// d(u, v) / dx and d(u, v) / dy per pixel, where all four neighbours are on the same sheet.
pub(crate) fn central_differences(maps: &Maps, pixel: usize) -> Option<[DVec2; 2]> {
    let (width, height) = (maps.width(), maps.height());
    let (x, y) = (pixel % width, pixel / width);
    if x == 0 || y == 0 || x + 1 >= width || y + 1 >= height {
        return None;
    }
    let depth = maps.depth()[pixel];
    let same_sheet = |other: usize| {
        maps.inside(other) && f64::from((maps.depth()[other] - depth).abs()) <= DEPTH_JUMP * f64::from(depth)
    };
    let (left, right, up, down) = (pixel - 1, pixel + 1, pixel - width, pixel + width);
    [left, right, up, down].into_iter().all(same_sheet).then(|| {
        [
            (maps.uv(right) - maps.uv(left)) / 2.0,
            (maps.uv(down) - maps.uv(up)) / 2.0,
        ]
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::camera::training_camera;

    const SHEET_MM: DVec2 = DVec2::new(200.0, 100.0);

    /// Maps are f32: depths near 500 are exact, texture coordinates good to 2^-24, which the inverse
    /// Jacobian (up to 400 px per unit of u here, 200 of v) turns into 2.4e-5 px.
    const F32_PX: f64 = 5e-5;

    /// A plane of constant depth 380 mm: one pixel is 1 mm at f = 380. Texture (0, 0) is at the pixel
    /// corner (100, 50), the sheet fills 200 x 100 pixels.
    fn frontal() -> Maps {
        let mut maps = Maps::empty(480, 270);
        for y in 50..150 {
            for x in 100..300 {
                maps.set(
                    y * 480 + x,
                    380.0,
                    [(x as f32 + 0.5 - 100.0) / 200.0, (y as f32 + 0.5 - 50.0) / 100.0],
                );
            }
        }
        maps
    }

    fn changed(maps: &Maps, change: impl Fn(usize, f32, [f32; 2]) -> Option<(f32, [f32; 2])>) -> Maps {
        let mut out = maps.clone();
        for pixel in 0..maps.depth().len() {
            if maps.inside(pixel) {
                match change(pixel, maps.depth()[pixel], maps.registration()[pixel]) {
                    Some((depth, uv)) => out.set(pixel, depth, uv),
                    None => out.clear(pixel),
                }
            }
        }
        out
    }

    fn compare(predicted: &Maps, truth: &Maps) -> FrameMetrics {
        frame_metrics(predicted, truth, &training_camera(), SHEET_MM).unwrap()
    }

    #[test]
    fn the_truth_itself_has_no_error() {
        let truth = frontal();
        assert_eq!(
            compare(&truth, &truth),
            FrameMetrics {
                depth_rmse_mm: Some(0.0),
                registration_rmse_px: Some(0.0),
                registration_rmse_mm: Some(0.0),
                points_rmse_mm: Some(0.0),
                mask_iou: Some(1.0),
                coverage: Some(1.0),
            }
        );
    }

    #[test]
    fn a_shift_of_three_and_four_pixels_is_five_pixels_and_five_millimetres() {
        let truth = frontal();
        // 3 px = 3 mm = 3 / 200 in u; 4 px = 4 mm = 4 / 100 in v; hypotenuse 5.
        let predicted = changed(&truth, |_, depth, [u, v]| Some((depth, [u + 0.015, v + 0.04])));
        let metrics = compare(&predicted, &truth);
        assert!(
            (metrics.registration_rmse_px.unwrap() - 5.0).abs() < F32_PX,
            "{metrics:?}"
        );
        assert!(
            (metrics.registration_rmse_mm.unwrap() - 5.0).abs() < F32_PX,
            "{metrics:?}"
        );
        assert_eq!(metrics.depth_rmse_mm, Some(0.0));
        // The overlay sits 3 px to the left and 4 px above: the pixel says what is right of and below it.
        let at = |pixel| registration_error_px(&predicted, (&truth, &training_camera()), pixel, SHEET_MM);
        let displacement = at(100 * 480 + 200).unwrap();
        assert!(
            (displacement - DVec2::new(3.0, 4.0)).length() < F32_PX,
            "{displacement}"
        );
        // A corner of the sheet lacks neighbours, the first pixel the sheet, the last the image.
        assert_eq!([at(50 * 480 + 100), at(0), at(480 * 270)], [None; 3]);
    }

    #[test]
    fn a_rotated_sheet_twice_as_far_has_half_the_pixels_for_the_same_millimetres() {
        // In-plane rotation by 90 degrees at 760 mm: a pixel is 2 mm, x runs along v, y against u.
        let mut truth = Maps::empty(480, 270);
        for y in 0..100 {
            for x in 0..50 {
                truth.set(
                    (y + 20) * 480 + x + 30,
                    760.0,
                    [1.0 - (y as f32 + 0.5) / 100.0, (x as f32 + 0.5) / 50.0],
                );
            }
        }
        let predicted = changed(&truth, |_, depth, [u, v]| Some((depth, [u + 0.03, v])));
        let metrics = compare(&predicted, &truth);
        assert!(
            (metrics.registration_rmse_mm.unwrap() - 6.0).abs() < F32_PX,
            "{metrics:?}"
        );
        assert!(
            (metrics.registration_rmse_px.unwrap() - 3.0).abs() < F32_PX,
            "{metrics:?}"
        );
    }

    #[test]
    fn a_slanted_sheet_moves_less_in_the_image_than_on_the_template() {
        // Foreshortened by 60 degrees along x: a pixel is 2 mm of template in u and 1 mm in v.
        let truth = changed(&frontal(), |_, depth, [u, v]| {
            (u < 0.5).then_some((depth, [2.0 * u, v]))
        });
        let predicted = changed(&truth, |_, depth, [u, v]| Some((depth, [u + 0.02, v + 0.03])));
        let metrics = compare(&predicted, &truth);
        // Template (4, 3) mm; image (2, 3) px.
        assert!(
            (metrics.registration_rmse_mm.unwrap() - 5.0).abs() < F32_PX,
            "{metrics:?}"
        );
        assert!(
            (metrics.registration_rmse_px.unwrap() - 13.0_f64.sqrt()).abs() < F32_PX,
            "{metrics:?}"
        );
    }

    #[test]
    fn a_depth_error_on_half_of_the_pixels_enters_as_a_root_mean_square() {
        let truth = frontal();
        let predicted = changed(&truth, |pixel, depth, uv| {
            Some((depth + if pixel % 2 == 0 { 4.0 } else { 0.0 }, uv))
        });
        let metrics = compare(&predicted, &truth);
        assert!((metrics.depth_rmse_mm.unwrap() - 8.0_f64.sqrt()).abs() < 1e-12);
        // Points move along their rays, which are longer than their z.
        assert!(metrics.points_rmse_mm > metrics.depth_rmse_mm);
    }

    #[test]
    fn a_point_error_is_the_depth_error_times_the_length_of_the_ray() {
        // The ray through pixel (430, 134) of the 380-pixel camera is (190.5, -0.5, 380) / 380.
        let (mut truth, mut predicted) = (Maps::empty(480, 270), Maps::empty(480, 270));
        truth.set(134 * 480 + 430, 400.0, [0.5; 2]);
        predicted.set(134 * 480 + 430, 410.0, [0.5; 2]);
        let expected = 10.0 * (190.5_f64.powi(2) + 0.25 + 380.0_f64.powi(2)).sqrt() / 380.0;
        assert!((compare(&predicted, &truth).points_rmse_mm.unwrap() - expected).abs() < 1e-9);
    }

    #[test]
    fn a_believed_focal_length_moves_the_points_and_not_the_pixels() {
        // Pixel (430, 134) is 190.5 px right of and 0.5 px above the axis. Believing f = 760 instead of 380 halves the
        // ray's slope: at 400 mm the points are 400 (190.5, 0.5) (1/380 - 1/760) apart.
        let mut truth = Maps::empty(480, 270);
        truth.set(134 * 480 + 430, 400.0, [0.5; 2]);
        let believed = Camera::pinhole(480, 270, 760.0, 760.0, 240.0, 135.0).unwrap();
        let camera = training_camera();
        let metrics = frame_metrics_between((&truth, &believed), (&truth, &camera), SHEET_MM).unwrap();
        let expected = 400.0 * 190.5_f64.hypot(0.5) / 760.0;
        assert!((metrics.points_rmse_mm.unwrap() - expected).abs() < 1e-9);
        assert_eq!(metrics.depth_rmse_mm, Some(0.0));
        let small = Camera::pinhole(48, 27, 76.0, 76.0, 24.0, 13.5).unwrap();
        assert!(frame_metrics_between((&truth, &small), (&truth, &camera), SHEET_MM).is_err());
    }

    #[test]
    fn a_mask_shifted_by_half_its_width_has_an_iou_of_one_third() {
        let truth = frontal();
        let mut predicted = Maps::empty(480, 270);
        for pixel in (0..truth.depth().len()).filter(|&pixel| truth.inside(pixel)) {
            predicted.set(pixel + 100, 380.0, truth.registration()[pixel]);
        }
        let metrics = compare(&predicted, &truth);
        assert_eq!(metrics.mask_iou, Some(1.0 / 3.0));
        assert_eq!(metrics.coverage, Some(0.5));
    }

    #[test]
    fn frames_without_overlap_have_masks_to_compare_but_no_errors() {
        let (truth, nothing) = (frontal(), Maps::empty(480, 270));
        let missed = FrameMetrics {
            mask_iou: Some(0.0),
            coverage: Some(0.0),
            ..FrameMetrics::default()
        };
        assert_eq!(compare(&nothing, &truth), missed);
        let invented = FrameMetrics {
            mask_iou: Some(0.0),
            ..FrameMetrics::default()
        };
        assert_eq!(compare(&truth, &nothing), invented);
        assert_eq!(compare(&nothing, &nothing), FrameMetrics::default());
    }

    #[test]
    fn pixels_beside_a_depth_jump_are_left_out_of_the_figure_in_pixels() {
        // Rows from 100 on lie 20 % further away, and the prediction is wrong only along the jump.
        let truth = changed(&frontal(), |pixel, _, uv| {
            Some((if pixel / 480 < 100 { 380.0 } else { 456.0 }, uv))
        });
        let predicted = changed(&truth, |pixel, depth, [u, v]| {
            let beside = (99..=100).contains(&(pixel / 480));
            Some((depth, [if beside { u + 0.5 } else { u }, v]))
        });
        let metrics = compare(&predicted, &truth);
        assert_eq!(metrics.registration_rmse_px, Some(0.0));
        // 2 of 100 rows are off by 100 mm.
        assert!((metrics.registration_rmse_mm.unwrap() - 2.0_f64.sqrt() * 10.0).abs() < 1e-6);
    }

    #[test]
    fn a_registration_that_stands_still_has_no_figure_in_pixels() {
        let truth = changed(&frontal(), |_, depth, [_, v]| Some((depth, [0.5, v])));
        let predicted = changed(&truth, |_, depth, [u, v]| Some((depth, [u + 0.1, v])));
        let metrics = compare(&predicted, &truth);
        assert_eq!(metrics.registration_rmse_px, None);
        assert!((metrics.registration_rmse_mm.unwrap() - 20.0).abs() < 1e-5);
    }

    #[test]
    fn maps_of_another_size_are_refused() {
        let error = frame_metrics(&Maps::empty(240, 135), &frontal(), &training_camera(), SHEET_MM).unwrap_err();
        assert_eq!(
            error,
            GeometryError::MapSize {
                actual: (240, 135),
                expected: (480, 270)
            }
        );
    }

    #[test]
    fn the_median_of_an_even_number_is_the_mean_of_the_middle_two() {
        let summary = Summary::of([Some(4.0), Some(1.0), Some(2.0), Some(9.0)]).unwrap();
        assert_eq!(
            summary,
            Summary {
                mean: 4.0,
                median: 3.0,
                frames: 4
            }
        );
        assert_eq!(Summary::of([None, None]), None);
    }
}
