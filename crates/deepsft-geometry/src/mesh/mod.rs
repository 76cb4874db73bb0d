//! Meshes and templates: how they hang together, their points and their rigid motions.

mod catmull_rom;
mod disjoint_sets;
mod rest_surface;
mod rigid_motion;
mod rotation;
mod side;
mod surface_locator;
mod surface_point;
mod template;
mod texture_grid;
mod topology;
mod triangle_mesh;
mod welding;

pub use catmull_rom::catmull_rom;
pub use disjoint_sets::DisjointSets;
pub use rest_surface::RestSurface;
pub(crate) use rest_surface::nearest_in_triangle;
pub use rigid_motion::RigidMotion;
pub(crate) use rotation::nearest_rotation;
pub use side::Side;
pub use surface_locator::SurfaceLocator;
pub use surface_point::SurfacePoint;
pub(crate) use surface_point::{AnchoredPoint, weighted};
pub use template::Template;
pub(crate) use texture_grid::TextureGrid;
pub use texture_grid::texture_barycentric;
pub use topology::{Topology, rows_within};
pub use triangle_mesh::TriangleMesh;
pub use welding::Welding;
