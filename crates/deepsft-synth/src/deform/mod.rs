//! Shapes: quasi-isometric deformations of sheets and of other meshes.

mod bend;
mod cloth;
mod config;
mod control_points;
mod deformation;
mod isometry;
mod manipulation;
mod relaxation;
mod sheet_shape;
mod volumic;
mod xpbd;

pub(crate) use bend::{Bend, Rulings};
pub use config::{DeformationConfig, DeformationFamily};
pub use control_points::{HandleConfig, HandleDeformation, HandleShape};
pub use deformation::deform;
pub(crate) use deformation::face_front;
pub(crate) use isometry::edge_length_changes;
pub use isometry::{EdgeLengthChange, EdgeLengthHistogram, edge_length_change};
pub use manipulation::ClothConfig;
pub use volumic::{RodBend, capsule};
