//! Images as trackers take them.

use crate::image::{GreyImage, Picture};
use std::sync::Arc;

/// An image at two sizes.
#[derive(Debug)]
pub(super) struct HalvedPair {
    pub whole: GreyImage,
    /// For the rounds that blur so much that it shows as much.
    pub half: GreyImage,
}

/// A canonical image as trackers take it. Made once, it serves the trackers of all targets in a video: each remembers the last
/// [`memory`](super::TrackingOptions::memory) images.
#[derive(Clone, Debug)]
pub struct TrackerImage(pub(super) Arc<HalvedPair>);

impl TrackerImage {
    /// Of a canonical image.
    pub fn of(image: &Picture) -> Self {
        Self::of_into(image, None)
    }

    /// As [`TrackerImage::of`], in the buffers of a `spare` one ([`Tracker::spare_image`](super::Tracker::spare_image)), unless it is still
    /// held elsewhere.
    pub fn of_into(image: &Picture, spare: Option<Self>) -> Self {
        let (whole, half) = match spare.and_then(|spare| Arc::into_inner(spare.0)) {
            Some(HalvedPair { whole, half }) => (whole.values, half.values),
            None => Default::default(),
        };
        let whole = GreyImage::of_into(image, whole);
        Self(Arc::new(HalvedPair {
            half: whole.halved_into(half),
            whole,
        }))
    }
}
