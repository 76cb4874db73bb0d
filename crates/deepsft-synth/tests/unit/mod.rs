//! The pieces of the crate, one by one.

use crate::deform::EdgeLengthChange;
use deepsft_geometry::TriangleMesh;
use deepsft_geometry::glam::DVec3;

mod alignment;
pub(crate) mod capsule;
mod control_points;
mod dataset_folder;
mod deformation;
mod depth_camera;
mod in_order;
mod motion;
mod paper_protocol;
mod part;
mod pose;
mod print_response;
mod projected_mesh;
mod random;
mod sensor;
mod unfinished;
mod value_noise;

/// The change of the edge lengths of `mesh` when its vertices move to `deformed`.
fn edge_length_change(mesh: &TriangleMesh, deformed: &[DVec3]) -> EdgeLengthChange {
    EdgeLengthChange::between(mesh.vertices(), &mesh.edges(), deformed)
}
