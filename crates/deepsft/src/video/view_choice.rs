//! Which view of a camera the frames of a video are looked at in.

use crate::finding::Target;
use deepsft_geometry::tracking::Tracked;
use deepsft_geometry::{Camera, CanonicalViews};

/// Chooses the canonical view of each frame: by the mesh while one is followed, else the nearest and the widest in turn.
#[derive(Default)]
pub(super) struct ViewChoice {
    chosen: Option<(CanonicalViews, Camera)>,
    /// Whether the finders have looked for a missing target in the view that is chosen.
    searched: bool,
}

impl ViewChoice {
    /// The view of the next frame, which `source` took, after one in which the target was `tracked`; `searches` says whether finders
    /// start on the frame.
    pub(super) fn next(&mut self, target: &Target, source: &Camera, tracked: &Tracked, searches: bool) -> Camera {
        let known = self.chosen.take().filter(|(views, _)| views.source() == source);
        let (views, mut view) = known.unwrap_or_else(|| {
            let views = target.canonical_views(source);
            let nearest = *views.nearest();
            (views, nearest)
        });
        if tracked.found {
            view = *views.following(&view, &tracked.vertices_camera);
            self.searched = false;
        } else if searches {
            if self.searched {
                view = match view == *views.nearest() {
                    true => *views.widest(),
                    false => *views.nearest(),
                };
            }
            self.searched = true;
        }
        self.chosen = Some((views, view));
        view
    }
}
