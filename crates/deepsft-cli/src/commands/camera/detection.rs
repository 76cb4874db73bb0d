//! Where a photograph shows the points of a flat target.

use super::board::Squares;
use super::refinement::refined;
use crate::failure::usage;
use anyhow::Result;
use calib_targets_charuco::{CharucoDetector, CharucoParams};
use calib_targets_chessboard::{ChessboardDetector, ChessboardParams, detect_corner_frame};
use calib_targets_core::{GrayImageView, default_chess_config};
use deepsft::View;
use deepsft::features::{FeatureFinder, PictureTarget};
use deepsft_geometry::glam::DVec2;
use deepsft_geometry::planar_calibration::PlanarView;
use deepsft_geometry::{Camera, ImageSize, Picture, Template};

/// Side of a square where none is given, mm: the camera does not depend on it.
const ANY_SQUARE_MM: f64 = 30.0;

/// Photographs are halved until their longer side is shorter than this if their corners are too blurred to be seen, pixels.
const SMALLEST_SIDE: usize = 1000;

/// Fewest points of a view that is any good.
const MIN_POINTS: usize = 8;

/// What is looked for.
pub enum Detector {
    /// A ChArUco board.
    Charuco(Box<CharucoDetector>),
    /// A checkerboard, or any part of one.
    Checkerboard(Box<ChessboardDetector>),
    /// A flat print.
    Print(Box<FeatureFinder>),
}

impl Detector {
    /// Of a ChArUco board.
    pub fn charuco(squares: Squares) -> Result<Self> {
        let parameters = CharucoParams::for_board(squares.charuco(ANY_SQUARE_MM)?);
        let detector = CharucoDetector::new(parameters).map_err(|error| usage(error.to_string()))?;
        Ok(Self::Charuco(Box::new(detector)))
    }

    /// Of a checkerboard.
    pub fn checkerboard() -> Result<Self> {
        Ok(Self::Checkerboard(Box::new(ChessboardDetector::new(
            ChessboardParams::default(),
        )?)))
    }

    /// Of the print of a flat template.
    pub fn print(template: Template) -> Result<Self> {
        Ok(Self::Print(Box::new(FeatureFinder::new(
            PictureTarget::from_template(template)?,
        )?)))
    }

    /// What it looks for.
    pub fn name(&self) -> &'static str {
        match self {
            Self::Charuco(_) => "ChArUco board",
            Self::Checkerboard(_) => "checkerboard",
            Self::Print(_) => "print",
        }
    }

    /// The points that `picture` shows: places in mm, positions in pixels. `None` where it does not show enough of the target.
    pub fn detect(&mut self, picture: &Picture) -> Result<Option<PlanarView>> {
        let points = match self {
            Self::Print(finder) => print_points(finder, picture)?,
            _ => self.corners(picture),
        };
        Ok((points.len() >= MIN_POINTS).then_some(PlanarView { points }))
    }

    /// The corners in the photograph, or in the first half, quarter... of its size that shows enough.
    fn corners(&self, picture: &Picture) -> Vec<(DVec2, DVec2)> {
        let mut grey: Vec<u8> = picture
            .rgb()
            .chunks_exact(3)
            .map(|c| deepsft_geometry::luma([c[0], c[1], c[2]]) as u8)
            .collect();
        let ImageSize { mut width, mut height } = picture.size();
        let mut pixel = 1.0;
        loop {
            // These detectors have the centre of the first pixel at (0, 0).
            let at = |x: f32, y: f32| (DVec2::new(f64::from(x), f64::from(y)) + 0.5) * pixel;
            let view = GrayImageView {
                width,
                height,
                data: &grey,
            };
            let found: Vec<_> = match self {
                Self::Charuco(detector) => detector.detect(&view).map_or(Vec::new(), |found| {
                    let corners = found.corners.iter();
                    corners
                        .map(|c| {
                            let place = DVec2::new(f64::from(c.target_position.x), f64::from(c.target_position.y));
                            (place, at(c.position.x, c.position.y))
                        })
                        .collect()
                }),
                Self::Checkerboard(detector) => {
                    let frame = detect_corner_frame(&view, &default_chess_config());
                    let found = detector.detect(&frame.corners);
                    let corners = found.iter().flat_map(|found| &found.corners);
                    corners
                        .map(|c| {
                            let place = DVec2::new(f64::from(c.grid.u), f64::from(c.grid.v)) * ANY_SQUARE_MM;
                            (place, at(c.position.x, c.position.y))
                        })
                        .collect()
                }
                Self::Print(_) => Vec::new(),
            };
            if found.len() >= MIN_POINTS || width.max(height) / 2 < SMALLEST_SIDE {
                return found;
            }
            grey = halved(&grey, width, height);
            (width, height) = (width / 2, height / 2);
            pixel *= 2.0;
        }
    }
}

/// Each pixel the mean of four.
fn halved(grey: &[u8], width: usize, height: usize) -> Vec<u8> {
    let at = |x: usize, y: usize| u32::from(grey[y * width + x]);
    let mean = |x: usize, y: usize| (at(x, y) + at(x + 1, y) + at(x, y + 1) + at(x + 1, y + 1) + 2) / 4;
    (0..height / 2)
        .flat_map(|y| (0..width / 2).map(move |x| (2 * x, 2 * y)))
        .map(|(x, y)| mean(x, y) as u8)
        .collect()
}

/// The places of the print that the photograph shows.
fn print_points(finder: &mut FeatureFinder, picture: &Picture) -> Result<Vec<(DVec2, DVec2)>> {
    // Only a start: the mesh that gathers the matches bends a little where the focal length is another.
    let camera = Camera::typical(picture.size())?;
    let mut view = View::new(picture, &camera);
    let (features, feature_camera) = view.features()?;
    let scale = camera.width() as f64 / feature_camera.width() as f64;
    let found = finder.find(features, feature_camera)?;
    let matches: Vec<_> = found
        .iter()
        .flat_map(|found| &found.matches)
        .map(|m| (m.place.as_dvec2(), m.pixel.as_dvec2() * scale))
        .collect();
    Ok(refined(finder.target().template(), picture, &matches))
}
