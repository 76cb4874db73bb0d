//! Meshes and templates: how they hang together, their points and their rigid motions.

mod rest_surface;
mod rigid_motion;
mod surface_point;
mod template;
mod topology;
mod triangle_mesh;
mod welding;

pub use rest_surface::RestSurface;
pub(crate) use rest_surface::nearest_in_triangle;
pub use rigid_motion::RigidMotion;
pub(crate) use rigid_motion::nearest_rotation;
pub(crate) use surface_point::{AnchoredPoint, TextureGrid, weighted};
pub use surface_point::{SurfaceLocator, SurfacePoint, texture_barycentric};
pub use template::Template;
pub use topology::{DisjointSets, Topology, rows_within};
pub use triangle_mesh::{Side, TriangleMesh};
pub use welding::Welding;
