//! The flat targets of a calibration, and where a photograph shows their points.

use anyhow::Result;
use deepsft::View;
use deepsft::features::FeatureFinder;
use deepsft_calibration::{CornerDetector, Correspondence, MIN_CORRESPONDENCES, refine_print};
use deepsft_geometry::{Camera, Picture, Template};

/// What is looked for.
pub enum FlatTarget {
    /// A board with corners.
    Board(CornerDetector),
    /// A flat print.
    Print(Box<FeatureFinder>),
}

impl FlatTarget {
    /// The print of a flat template.
    pub fn print(template: Template) -> Result<Self> {
        let finder = FeatureFinder::new(template)?;
        Ok(Self::Print(Box::new(finder)))
    }

    /// What it is, for people.
    pub fn name(&self) -> &'static str {
        match self {
            Self::Board(detector) => detector.name(),
            Self::Print(_) => "print",
        }
    }

    /// The points that `picture` shows. `None` where it does not show enough of the target.
    pub fn detect(&mut self, picture: &Picture) -> Result<Option<Vec<Correspondence>>> {
        let finder = match self {
            Self::Board(detector) => return Ok(detector.detect(picture)),
            Self::Print(finder) => finder,
        };
        // Only a start: the mesh that gathers the matches bends a little where the focal length is another.
        let camera = Camera::typical(picture.size())?;
        let mut view = View::new(picture, &camera);
        let (features, feature_camera) = view.features()?;
        let scale = camera.width() as f64 / feature_camera.width() as f64;
        let found = finder.find(features, feature_camera)?;
        let matches: Vec<_> = (found.iter().flat_map(|found| &found.matches))
            .map(|m| Correspondence {
                place_mm: m.place.as_dvec2(),
                pixel: m.pixel.as_dvec2() * scale,
            })
            .collect();
        let points = refine_print(finder.template(), picture, &matches);
        Ok((points.len() >= MIN_CORRESPONDENCES).then_some(points))
    }
}
