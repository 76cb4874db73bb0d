//! Samples: synthetic pictures with their exact truth.

use deepsft_geometry::glam::DVec3;
use deepsft_geometry::{Camera, Maps, Picture};

/// One synthetic picture with its ground truth.
#[derive(Clone, Debug, PartialEq)]
pub struct Sample {
    /// The picture, as large as the camera's image.
    pub image: Picture,
    /// Exact depth (mm) and registration at the pixel centres of the front of the sheet where it is visible. The blank
    /// back, occluders and black bars are outside the object. Read from a data set, depth is rounded to 0.1 mm and
    /// registration to 1 / 65535.
    pub truth: Maps,
    /// Vertices of the template's mesh, mm, camera frame; none when the template is not in the scene.
    pub vertices_camera: Vec<DVec3>,
    /// The camera that took the picture.
    pub camera: Camera,
    /// Whether the template's front is seen in at least one pixel.
    pub has_template: bool,
    /// Unit vector towards the distant light, camera frame.
    pub towards_light: DVec3,
}

impl Sample {
    /// A sample that has the template when `truth` is not empty.
    pub fn new(image: Picture, truth: Maps, vertices_camera: Vec<DVec3>, camera: Camera, towards_light: DVec3) -> Self {
        Self {
            image,
            has_template: truth.area() > 0,
            truth,
            vertices_camera,
            camera,
            towards_light,
        }
    }
}
