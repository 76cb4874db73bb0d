//! Canonical warp: from any camera's image to the one imaging geometry the network was trained with
//! (the paper's adaptation A = K_train K_test^-1, after lens distortion is removed).

use crate::{Camera, GeometryError, Picture};
use glam::DVec2;

/// Columns of every map and of the network's input.
pub const CANONICAL_WIDTH: usize = 480;
/// Rows of every map and of the network's input.
pub const CANONICAL_HEIGHT: usize = 270;

/// Focal length of the training camera, pixels of the canonical image: 0.79 of its long side, what a
/// typical phone has (our choice; the paper used its Kinect's).
const TRAINING_FOCAL: f64 = 380.0;

/// Value of canonical pixels that lie outside the camera's image.
const OUTSIDE_IMAGE: u8 = 0;

/// Most taps a side that average the source pixels under one canonical pixel.
const MOST_TAPS: usize = 16;

/// The camera K_train that synthetic data is rendered with: 480 x 270 pixels, f = 380, centred.
pub fn training_camera() -> Camera {
    #[expect(clippy::expect_used, reason = "constants, checked by a test")]
    Camera::pinhole(
        CANONICAL_WIDTH as u32,
        CANONICAL_HEIGHT as u32,
        TRAINING_FOCAL,
        TRAINING_FOCAL,
        240.0,
        135.0,
    )
    .expect("constant intrinsics are valid")
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
            taps: (scale.ceil() as usize).clamp(1, MOST_TAPS),
        }
    }

    /// The source camera.
    pub fn source(&self) -> &Camera {
        &self.source
    }

    /// The canonical camera.
    pub fn canonical(&self) -> &Camera {
        &self.canonical
    }

    /// Source image position in pixels of a canonical image position in pixels.
    pub fn source_from_canonical(&self, pixel: DVec2) -> DVec2 {
        self.source.pixel_from_ray(self.canonical.ray_from_pixel(pixel))
    }

    /// Canonical image position in pixels of a source image position in pixels.
    pub fn canonical_from_source(&self, pixel: DVec2) -> DVec2 {
        self.canonical.pixel_from_ray(self.source.ray_from_pixel(pixel))
    }

    /// The canonical image of `picture`: each pixel the mean of a grid of bilinear samples over the
    /// source area it covers (one when the source is not finer), black outside the source image.
    ///
    /// # Errors
    /// [`GeometryError::MapSize`] when the picture is not of the source camera's size.
    pub fn apply(&self, picture: &Picture) -> Result<Picture, GeometryError> {
        let expected = (self.source.width() as usize, self.source.height() as usize);
        let actual = (picture.width(), picture.height());
        if actual != expected {
            return Err(GeometryError::MapSize { actual, expected });
        }
        let limit = DVec2::new(expected.0 as f64, expected.1 as f64);
        let step = 1.0 / self.taps as f64;
        Ok(Picture::from_fn(
            self.canonical.width() as usize,
            self.canonical.height() as usize,
            |x, y| {
                let mut sum = [0.0_f32; 3];
                for tap in 0..self.taps * self.taps {
                    let offset = DVec2::new((tap % self.taps) as f64 + 0.5, (tap / self.taps) as f64 + 0.5) * step;
                    let at = self.source_from_canonical(DVec2::new(x as f64, y as f64) + offset);
                    let inside = at.cmpge(DVec2::ZERO).all() && at.cmple(limit).all();
                    let color = if inside {
                        picture.sample(at.x, at.y)
                    } else {
                        [f32::from(OUTSIDE_IMAGE); 3]
                    };
                    for (s, c) in sum.iter_mut().zip(color) {
                        *s += c;
                    }
                }
                let taps = (self.taps * self.taps) as f32;
                sum.map(|s| (s / taps + 0.5) as u8)
            },
        ))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn noise(width: usize, height: usize) -> Picture {
        let mut state = 7_u32;
        Picture::from_fn(width, height, |_, _| {
            std::array::from_fn(|_| {
                state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
                (state >> 24) as u8
            })
        })
    }

    #[test]
    fn the_training_camera_itself_copies_every_pixel() {
        let camera = training_camera();
        let picture = noise(480, 270);
        assert_eq!(CanonicalWarp::new(&camera, &camera).apply(&picture).unwrap(), picture);
    }

    #[test]
    fn a_camera_twice_as_fine_gives_the_mean_of_two_by_two_pixels() {
        let camera = training_camera();
        let source = camera.resized(960, 540).unwrap();
        let picture = noise(960, 540);
        let warped = CanonicalWarp::new(&source, &camera).apply(&picture).unwrap();
        for (x, y) in [(0, 0), (479, 269), (17, 200)] {
            for k in 0..3 {
                let sum: u32 = [(0, 0), (1, 0), (0, 1), (1, 1)]
                    .iter()
                    .map(|(i, j)| u32::from(picture.pixel(2 * x + i, 2 * y + j)[k]))
                    .sum();
                assert_eq!(u32::from(warped.pixel(x, y)[k]), (sum + 2) / 4, "pixel ({x}, {y})");
            }
        }
    }

    #[test]
    fn a_cropped_image_is_padded_and_keeps_its_pixels() {
        let camera = training_camera();
        let source = Camera::pinhole(300, 200, 380.0, 380.0, 240.0 - 100.0, 135.0 - 30.0).unwrap();
        let picture = noise(300, 200);
        let warped = CanonicalWarp::new(&source, &camera).apply(&picture).unwrap();
        assert_eq!(warped.pixel(100, 30), picture.pixel(0, 0));
        assert_eq!(warped.pixel(399, 229), picture.pixel(299, 199));
        assert_eq!(warped.pixel(99, 30), [0; 3]);
        assert_eq!(warped.pixel(400, 100), [0; 3]);
    }

    #[test]
    fn warping_there_and_back_is_the_identity() {
        let source = Camera::pinhole(1280, 720, 1010.0, 1000.0, 650.0, 355.0)
            .unwrap()
            .with_distortion([-0.1, 0.02, 1e-3, -1e-3, 0.0])
            .unwrap();
        let warp = CanonicalWarp::new(&source, &training_camera());
        let p = DVec2::new(101.5, 44.5);
        assert!((warp.canonical_from_source(warp.source_from_canonical(p)) - p).length() < 1e-8);
    }
}
