//! What a fit starts from.

use crate::maps::Maps;
use glam::DVec3;

/// The start of a fit: where a finder sees the object.
#[derive(Clone, Debug)]
pub enum Start {
    /// Depth (mm) and registration in the camera's image, as a network gives them: their mask leaves out what hides the object.
    Maps(Maps),
    /// Vertices of the template's mesh, camera frame, mm: the whole object, as matches give it.
    Mesh(Vec<DVec3>),
}
