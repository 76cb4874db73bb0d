//! ARAP completion: the whole mesh from its visible vertices.

mod arap_completion;
mod components;
mod maps_completion;
mod options;
mod quasi_newton;
mod report;
mod rotation_extension;
mod stiffness;
mod visible_points;
mod visible_vertices;

pub use arap_completion::ArapCompletion;
pub use maps_completion::MapsCompletion;
pub use options::CompletionOptions;
pub use report::{Completion, CompletionEnergy};
pub use visible_points::VertexPoint;
pub use visible_vertices::VisibleVertices;
