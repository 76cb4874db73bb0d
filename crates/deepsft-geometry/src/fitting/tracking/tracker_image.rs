//! Images as trackers take them.

use crate::image::{GreyImage, Picture};
use std::sync::Arc;

/// An image at two sizes.
pub(super) struct Sizes {
    pub whole: GreyImage,
    /// For the rounds that blur so much that it shows as much.
    pub half: GreyImage,
}

/// A canonical image as trackers take it. Made once, it serves the trackers of all targets in a video: each remembers the last
/// [`memory`](super::TrackingOptions::memory) images.
#[derive(Clone)]
pub struct TrackerImage(pub(super) Arc<Sizes>);

impl std::fmt::Debug for TrackerImage {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("TrackerImage").finish_non_exhaustive()
    }
}

impl TrackerImage {
    /// Of a canonical image.
    pub fn of(image: &Picture) -> Self {
        Self::of_into(image, None)
    }

    /// As [`TrackerImage::of`], in the memory of a `spare` one ([`Tracker::spare_image`](super::Tracker::spare_image)), unless it is still
    /// held elsewhere.
    pub fn of_into(image: &Picture, spare: Option<Self>) -> Self {
        let (whole, half) = match spare.and_then(|spare| Arc::into_inner(spare.0)) {
            Some(Sizes { whole, half }) => (whole.values, half.values),
            None => Default::default(),
        };
        let whole = GreyImage::of_into(image, whole);
        Self(Arc::new(Sizes {
            half: whole.halved_into(half),
            whole,
        }))
    }
}
