//! Shapes: quasi-isometric deformations of sheets and of other meshes.

mod bend;
mod capsule;
mod cloth;
mod config;
mod control_points;
mod deformation;
mod isometry;
mod manipulation;
mod relaxation;
mod sheet_shape;
mod xpbd;

pub(crate) use bend::{Bend, Rulings};
pub use capsule::capsule;
pub use config::{DeformationConfig, DeformationFamily};
pub use control_points::{ControlPointConfig, ControlPointDeformation, ControlPointShape};
pub use deformation::deform;
pub(crate) use deformation::face_front;
pub use isometry::edge_length_change;
pub(crate) use isometry::edge_length_changes;
pub use manipulation::ClothConfig;
