//! Finding: where targets are in an image, by whichever finder can tell.
//!
//! A [`Target`] is an object to look for. A [`View`] is an image with everything that finders share. A [`TargetFinder`] has
//! the finders of one target: its own network, if one was trained for it, and the features of its picture, which need no
//! training. Each gives depth and registration, or nothing ([`Sighting`]). The mesh fit starts from any of them, and its
//! agreement with the image tells whether the target is there: found or not means the same for all finders.

mod finder;
mod picture_descriptors;
mod target;
mod target_finder;
mod view;

pub use finder::{DescriptorFinder, Finder, FinderKind, Sighting};
pub use picture_descriptors::SharedDescriptorNetwork;
pub use target::Target;
pub use target_finder::{TargetEstimate, TargetFinder, is_found};
pub use view::View;
