//! Images as trackers take them.

use crate::image::{GreyImage, Picture};
use std::sync::Arc;

#[derive(Debug)]
pub(super) struct HalvedPair {
    pub whole: GreyImage,
    /// For the rounds that blur so much that it shows as much.
    pub half: GreyImage,
}

/// A canonical image as trackers take it. Made once, it serves the trackers of all targets in a video: each remembers the last
/// [`MEMORY`](super::MEMORY) images.
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
        let spare = spare.and_then(|spare| Arc::into_inner(spare.0));
        let (whole, half) = spare.map_or_else(Default::default, |spare| (spare.whole.values, spare.half.values));
        let whole = GreyImage::of_into(image, whole);
        Self(Arc::new(HalvedPair {
            half: whole.halved_into(half),
            whole,
        }))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_spare_image_gives_its_buffers_unless_it_is_held_elsewhere() {
        let picture = |(width, height)| Picture::from_fn(width, height, |x, y| [(x * y % 251) as u8; 3]);
        let buffers = |image: &TrackerImage| [&image.0.whole, &image.0.half].map(|image| image.values.as_ptr());
        let mut image = TrackerImage::of(&picture((480, 270)));
        let first = buffers(&image);
        // That of a turned camera, and a smaller one.
        for size in [(270, 480), (96, 54)] {
            image = TrackerImage::of_into(&picture(size), Some(image));
            assert_eq!(buffers(&image), first, "{size:?}");
        }
        let held = image.clone();
        let other = TrackerImage::of_into(&picture((96, 54)), Some(image));
        assert!(buffers(&other) != first && buffers(&held) == first);
    }
}
