//! ARAP completion: the whole mesh from its visible vertices.

mod arap_completion;
mod maps_completion;
mod stiffness;
mod visible_points;
mod visible_vertices;

pub use arap_completion::{ArapCompletion, Completion, CompletionEnergy, CompletionOptions};
pub use maps_completion::MapsCompletion;
pub use visible_points::VertexPoint;
pub use visible_vertices::VisibleVertices;
