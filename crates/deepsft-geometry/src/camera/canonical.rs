//! Canonical warp: from any camera's image to the one imaging geometry the network was trained with
//! (the paper's adaptation A = K_train K_test^-1, after lens distortion is removed).

use super::lens::Lens;
use super::pinhole::Camera;
use crate::error::{GeometryError, check_size};
use crate::image::{ImageSize, Picture};
use glam::DVec2;

/// Columns of the network's input and of maps, of upright images rows.
pub const CANONICAL_WIDTH: usize = 480;
/// Rows of the network's input and of maps, of upright images columns.
pub const CANONICAL_HEIGHT: usize = 270;

/// Focal length of the training camera, pixels of the canonical image: 0.79 of its long side, what a
/// typical phone has (our choice; the paper used its Kinect's).
pub const TRAINING_FOCAL: f64 = 380.0;

/// Value of canonical pixels that lie outside the camera's image.
const OUTSIDE_IMAGE: u8 = 0;

/// Most taps along each side that average the source pixels under one canonical pixel.
const MAX_TAPS: usize = 16;

/// The camera K_train that synthetic data is rendered with: 480 x 270 pixels, f = 380, centred.
pub fn training_camera() -> Camera {
    #[expect(clippy::expect_used, reason = "constants, checked by a test")]
    Camera::pinhole(
        (CANONICAL_WIDTH, CANONICAL_HEIGHT),
        DVec2::splat(TRAINING_FOCAL),
        DVec2::new(240.0, 135.0),
    )
    .expect("constant intrinsics are valid")
}

/// Returns `training`, rotated by 90 degrees when `size` is portrait and `training` is landscape, or
/// vice versa. Of an upright image the other way would cut off more than 40 %.
pub fn canonical_camera(training: &Camera, size: impl Into<ImageSize>) -> Camera {
    if size.into().is_upright() == training.size().is_upright() {
        *training
    } else {
        training.turned_anticlockwise()
    }
}

/// Where each pixel of the canonical image lies in a camera's image.
///
/// Exact for the pixel-centre convention: a camera that is the training camera scaled by an integer
/// k gives the mean over k x k source pixels; one that is a crop or a padding of it copies pixels.
#[derive(Clone, Debug, PartialEq)]
pub struct CanonicalWarp {
    source: Camera,
    canonical: Camera,
    taps: usize,
}

impl CanonicalWarp {
    /// The warp from `source` images to `canonical` ones.
    pub fn new(source: &Camera, canonical: &Camera) -> Self {
        let scale = (source.focal() / canonical.focal()).max_element();
        Self {
            source: *source,
            canonical: *canonical,
            taps: (scale.ceil() as usize).clamp(1, MAX_TAPS),
        }
    }

    /// Source image position in pixels of a canonical image position in pixels; `None` where the source's lens sees nothing.
    pub fn source_from_canonical(&self, pixel: DVec2) -> Option<DVec2> {
        self.source.pixel_from_ray(self.canonical.ray_from_pixel(pixel))
    }

    /// Resamples `picture` to the canonical image. Each pixel is the mean of a grid of bilinear samples over the
    /// source area it covers (one when the source is not finer), black outside the source image.
    ///
    /// # Errors
    /// [`GeometryError::MapSize`] when the picture is not of the source camera's size.
    pub fn apply(&self, picture: &Picture) -> Result<Picture, GeometryError> {
        check_size(picture.size(), self.source.size())?;
        if (self.source.lens(), self.canonical.lens()) == (Lens::Pinhole, Lens::Pinhole) {
            Ok(self.apply_separable(picture))
        } else {
            Ok(self.apply_sampled(picture))
        }
    }

    /// Sample by sample, for any camera.
    fn apply_sampled(&self, picture: &Picture) -> Picture {
        let step = 1.0 / self.taps as f64;
        Picture::from_fn(self.canonical.size().width, self.canonical.size().height, |x, y| {
            let mut sum = [0.0_f32; 3];
            for tap in 0..self.taps * self.taps {
                let offset = DVec2::new((tap % self.taps) as f64 + 0.5, (tap / self.taps) as f64 + 0.5) * step;
                let at = self.source_from_canonical(DVec2::new(x as f64, y as f64) + offset);
                let inside = at.filter(|at| picture.size().holds(*at));
                let color = inside.map_or([f32::from(OUTSIDE_IMAGE); 3], |at| picture.sample(at.x, at.y));
                for (s, c) in sum.iter_mut().zip(color) {
                    *s += c;
                }
            }
            let taps = (self.taps * self.taps) as f32;
            sum.map(|s| (s / taps + 0.5) as u8)
        })
    }

    /// The same mean between cameras without distortion: columns lie above columns and rows above rows, so
    /// the weights of a pixel's samples are a product of a column's and a row's.
    fn apply_separable(&self, picture: &Picture) -> Picture {
        let (width, height) = (self.canonical.size().width, self.canonical.size().height);
        let (from, to) = (self.canonical.principal_point(), self.source.principal_point());
        let (from_focal, to_focal) = (self.canonical.focal(), self.source.focal());
        let column_at = |x: f64| (x - from.x) / from_focal.x * to_focal.x + to.x;
        let row_at = |y: f64| (y - from.y) / from_focal.y * to_focal.y + to.y;
        let column = |x: usize| source_weights(x, self.taps, picture.width(), column_at);
        let columns: Vec<_> = (0..width).map(column).collect();
        let stride = 3 * picture.width();
        let mut rgb = Vec::with_capacity(3 * width * height);
        // The weighted sum of the source rows under one canonical row.
        let mut row = vec![0.0_f32; stride];
        for y in 0..height {
            row.fill(0.0);
            let (first, weights) = source_weights(y, self.taps, picture.height(), row_at);
            let sources = picture.rgb()[stride * first..].chunks_exact(stride);
            for (source, &weight) in sources.zip(&weights) {
                for (sum, &value) in row.iter_mut().zip(source) {
                    *sum += weight * f32::from(value);
                }
            }
            for (first, weights) in &columns {
                let mut sum = [0.0_f32; 3];
                for (color, &weight) in row[3 * first..].as_chunks().0.iter().zip(weights) {
                    for (s, c) in sum.iter_mut().zip::<&[f32; 3]>(color) {
                        *s += weight * c;
                    }
                }
                rgb.extend(sum.map(|s| (s + 0.5) as u8));
            }
        }
        Picture::from_rows(width, height, rgb)
    }
}

/// What each source pixel along one axis counts for canonical pixel `index`: the mean of `taps` linear samples of a source of `length`
/// pixels, at the places `source_at` of the canonical positions in between; edges repeated, nothing outside. The first source pixel that
/// counts, and the weights of it and those after it, which sum to the fraction of the canonical pixel inside the source.
fn source_weights(index: usize, taps: usize, length: usize, source_at: impl Fn(f64) -> f64) -> (usize, Vec<f32>) {
    let places = (0..taps)
        .map(|tap| source_at(index as f64 + (tap as f64 + 0.5) / taps as f64))
        .filter(|at| (0.0..=length as f64).contains(at))
        .map(|at| (at - 0.5).clamp(0.0, (length - 1) as f64));
    let mut first = 0;
    let mut weights: Vec<f32> = Vec::new();
    for place in places {
        // Cameras look the same way round: places ascend.
        let low = place as usize;
        if weights.is_empty() {
            first = low;
        }
        weights.resize((low + 2 - first).max(weights.len()), 0.0);
        let fraction = (place - low as f64) as f32;
        weights[low - first] += (1.0 - fraction) / taps as f32;
        weights[low + 1 - first] += fraction / taps as f32;
    }
    // The last source pixel has no neighbour; its weight was nought.
    weights.truncate(length - first);
    (first, weights)
}
