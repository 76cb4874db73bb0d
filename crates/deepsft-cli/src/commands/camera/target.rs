//! The flat targets of a calibration, and where a photograph shows their points.

use anyhow::Result;
use deepsft::View;
use deepsft::features::FeatureFinder;
use deepsft_calibration::{CornerDetector, Correspondence, MIN_CORRESPONDENCES, refine_print};
use deepsft_geometry::{Camera, Picture, Template};

/// Detects the points that a photograph shows. `None` where it does not show enough of the target.
type Detect = Box<dyn FnMut(&Picture) -> Result<Option<Vec<Correspondence>>>>;

/// What is looked for.
pub struct FlatTarget {
    /// What it is, for people.
    pub name: &'static str,
    /// How it is seen in a photograph.
    pub detect: Detect,
}

impl FlatTarget {
    /// A board with corners.
    pub fn board(detector: CornerDetector) -> Self {
        Self {
            name: detector.name(),
            detect: Box::new(move |picture| Ok(detector.detect(picture))),
        }
    }

    /// The print of a flat template.
    pub fn print(template: Template) -> Result<Self> {
        let mut finder = FeatureFinder::new(template)?;
        let detect = move |picture: &Picture| {
            // Only a start: the mesh that gathers the matches bends a little where the focal length is another.
            let camera = Camera::typical(picture.size())?;
            let mut view = View::new(picture, &camera);
            let (features, feature_camera) = view.features()?;
            let scale = camera.size().width as f64 / feature_camera.size().width as f64;
            let found = finder.find(features, feature_camera)?;
            let matches = found.iter().flat_map(|found| &found.matches);
            let matches: Vec<_> = matches
                .map(|m| Correspondence {
                    place_mm: m.place.as_dvec2(),
                    pixel: m.pixel.as_dvec2() * scale,
                })
                .collect();
            let points = refine_print(finder.template(), picture, &matches);
            Ok((points.len() >= MIN_CORRESPONDENCES).then_some(points))
        };
        Ok(Self {
            name: "print",
            detect: Box::new(detect),
        })
    }
}
