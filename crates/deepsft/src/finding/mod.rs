//! Finding: where targets are in an image, by whichever finder can tell.
//!
//! A [`Target`] is an object to look for. A [`View`] is an image with everything that finders share. A [`TargetFinder`] has the
//! finders of one target: its own network, if one was trained for it, and the features of its picture, which need no training. Each
//! answers with a [`Start`](deepsft_geometry::fitting::Start), maps or a mesh, or with nothing. The fit makes a
//! [`Surface`](deepsft_geometry::Surface) of it, whose verdict tells whether the target is there.

mod camera_origin;
mod finder;
mod finder_kind;
mod picture_descriptors;
mod target;
mod target_finder;
mod target_fitter;
mod view;

pub use camera_origin::CameraOrigin;
pub use finder::{DescriptorFinder, Finder};
pub use finder_kind::FinderKind;
pub use picture_descriptors::SharedDescriptorNetwork;
pub use target::Target;
pub use target_finder::{ALIKE, Sighting, TargetFinder};
pub use view::View;
