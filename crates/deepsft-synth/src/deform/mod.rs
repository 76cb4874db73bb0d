//! Shapes: quasi-isometric deformations of sheets and of other meshes.

mod bend;
mod cloth;
pub(crate) mod config;
mod control_points;
mod deformation;
mod manipulation;
mod relaxation;
mod sheet_shape;
mod xpbd;

pub(crate) use bend::{Bend, Rulings};
pub use config::DeformationConfig;
pub(crate) use control_points::{ControlPointDeformation, MOVED, Pulls, TOY_EDGE_CHANGE};
pub(crate) use deformation::{centroid, deform, face_front};
pub(crate) use relaxation::EdgeLengthChange;
