//! Where a photograph shows the corners of a board.

use crate::board::Board;
use crate::correspondence::{Correspondence, MIN_CORRESPONDENCES};
use crate::error::CalibrationError;
use calib_targets_charuco::{CharucoDetector, CharucoParams};
use calib_targets_chessboard::{ChessboardDetector, ChessboardParams, detect_corner_frame};
use calib_targets_core::{GrayImageView, default_chess_config};
use deepsft_geometry::glam::DVec2;
use deepsft_geometry::{ImageSize, Picture, luma};
use std::fmt;

/// Side of a checkerboard's square, mm: the camera does not depend on it.
const ANY_SQUARE_MM: f64 = 30.0;

/// Photographs are halved until their longer side is shorter than this if their corners are too blurred to be seen, pixels.
const SMALLEST_SIDE: usize = 1000;

/// A detector of the corners of one kind of board.
pub struct CornerDetector(Kind);

enum Kind {
    Charuco(Box<CharucoDetector>),
    Checkerboard(Box<ChessboardDetector>),
}

impl fmt::Debug for CornerDetector {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "CornerDetector({})", self.name())
    }
}

impl CornerDetector {
    /// The detector of a ChArUco board, which may be partly hidden or cut off.
    ///
    /// # Errors
    /// [`CalibrationError::Board`] for a board that cannot be detected.
    pub fn charuco(board: &Board) -> Result<Self, CalibrationError> {
        let detector = CharucoDetector::new(CharucoParams::for_board(board.spec));
        let detector = detector.map_err(|error| CalibrationError::Board(error.to_string()))?;
        Ok(Self(Kind::Charuco(Box::new(detector))))
    }

    /// The detector of a checkerboard, or of any part of one.
    ///
    /// # Errors
    /// [`CalibrationError::Board`] when the detector refuses its own settings.
    pub fn checkerboard() -> Result<Self, CalibrationError> {
        let detector = ChessboardDetector::new(ChessboardParams::default());
        let detector = detector.map_err(|error| CalibrationError::Board(error.to_string()))?;
        Ok(Self(Kind::Checkerboard(Box::new(detector))))
    }

    /// What it looks for.
    pub fn name(&self) -> &'static str {
        match self.0 {
            Kind::Charuco(_) => "ChArUco board",
            Kind::Checkerboard(_) => "checkerboard",
        }
    }

    /// Detects corners in the photograph, or in the first half, quarter... of its size that shows enough. `None` where none does. A ChArUco
    /// board may be printed in white on black.
    pub fn detect(&self, photograph: &Picture) -> Option<Vec<Correspondence>> {
        let colors = photograph.rgb().as_chunks::<3>().0;
        let grey: Vec<u8> = colors.iter().map(|color| luma(*color) as u8).collect();
        let negative = || match self.0 {
            Kind::Charuco(_) => self.detect_in(grey.iter().map(|level| 255 - level).collect(), photograph.size()),
            Kind::Checkerboard(_) => None,
        };
        self.detect_in(grey.clone(), photograph.size()).or_else(negative)
    }

    fn detect_in(
        &self,
        mut grey: Vec<u8>,
        ImageSize { mut width, mut height }: ImageSize,
    ) -> Option<Vec<Correspondence>> {
        let mut scale = 1.0;
        loop {
            let view = GrayImageView {
                width,
                height,
                data: &grey,
            };
            let vector = |x: f32, y: f32| DVec2::new(f64::from(x), f64::from(y));
            let found: Vec<_> = match &self.0 {
                Kind::Charuco(detector) => (detector.detect(&view).iter())
                    .flat_map(|found| &found.corners)
                    .map(|c| (vector(c.target_position.x, c.target_position.y), c.position))
                    .collect(),
                Kind::Checkerboard(detector) => {
                    let corners = detect_corner_frame(&view, &default_chess_config()).corners;
                    (detector.detect(&corners).iter())
                        .flat_map(|found| &found.corners)
                        .map(|c| (DVec2::new(c.grid.u.into(), c.grid.v.into()) * ANY_SQUARE_MM, c.position))
                        .collect()
                }
            };
            if found.len() >= MIN_CORRESPONDENCES {
                // These detectors have the centre of the first pixel at (0, 0).
                let pixel = |x: f32, y: f32| (vector(x, y) + 0.5) * scale;
                let points = found.into_iter().map(|(place_mm, at)| Correspondence {
                    place_mm,
                    pixel: pixel(at.x, at.y),
                });
                return Some(points.collect());
            }
            if width.max(height) / 2 < SMALLEST_SIDE {
                return None;
            }
            grey = halved(&grey, width, height);
            (width, height) = (width / 2, height / 2);
            scale *= 2.0;
        }
    }
}

fn halved(grey: &[u8], width: usize, height: usize) -> Vec<u8> {
    let at = |x: usize, y: usize| u32::from(grey[y * width + x]);
    let mean = |x: usize, y: usize| (at(x, y) + at(x + 1, y) + at(x, y + 1) + at(x + 1, y + 1) + 2) / 4;
    let places = (0..height / 2).flat_map(|y| (0..width / 2).map(move |x| (2 * x, 2 * y)));
    places.map(|(x, y)| mean(x, y) as u8).collect()
}
