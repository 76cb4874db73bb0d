//! Which view of a camera the frames of a video are looked at in.

use deepsft_geometry::glam::DVec3;
use deepsft_geometry::{Camera, CanonicalViews};

/// Chooses the canonical view of each frame: by the meshes while some are followed, else the nearest and the widest in turn.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct ViewChoice {
    /// The camera of the last frame, and the view that it was looked at in.
    chosen: Option<(Camera, Camera)>,
    /// Whether the finders have looked in that view since something was followed last.
    is_searched: bool,
}

impl ViewChoice {
    /// The view of the next frame, one of `views`, after one with `meshes` (vertices in mm, camera frame); `searches` says whether the
    /// finders look at it.
    pub(super) fn next<'a>(
        &self,
        views: &CanonicalViews,
        meshes: impl Iterator<Item = &'a [DVec3]>,
        searches: bool,
    ) -> Camera {
        let known = self.chosen.filter(|(source, _)| source == views.source());
        let current = known.map_or(*views.nearest(), |(_, view)| view);
        let held = meshes.map(|vertices| *views.following(&current, vertices));
        let widest = held.min_by(|a, b| a.focal().x.total_cmp(&b.focal().x));
        match widest {
            Some(view) => view,
            None if searches && self.is_searched && known.is_some() => match current == *views.nearest() {
                true => *views.widest(),
                false => *views.nearest(),
            },
            None => current,
        }
    }

    /// Takes note of the view of a frame of `source`; `follows` says whether there were meshes, `searches` whether the finders look at it.
    pub(super) fn take(&mut self, source: &Camera, view: &Camera, follows: bool, searches: bool) {
        let is_same = self.chosen.is_some_and(|(known, _)| known == *source);
        self.is_searched = !follows && (searches || (is_same && self.is_searched));
        self.chosen = Some((*source, *view));
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use deepsft_geometry::training_camera;

    fn views(size: (usize, usize)) -> CanonicalViews {
        CanonicalViews::new(&training_camera(), &Camera::typical(size).unwrap())
    }

    /// A square of 100 mm before the camera.
    fn square(depth_mm: f64) -> Vec<DVec3> {
        let corner = |(x, y)| DVec3::new(50.0 * x, 50.0 * y, depth_mm);
        [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)]
            .map(corner)
            .to_vec()
    }

    #[test]
    fn a_sheet_that_comes_near_is_followed_in_a_wider_view_until_it_is_well_inside_the_nearer_one() {
        let views = views((640, 480));
        let mut choice = ViewChoice::default();
        let mut next = |meshes: &[f64]| {
            let meshes: Vec<_> = meshes.iter().map(|depth| square(*depth)).collect();
            let view = choice.next(&views, meshes.iter().map(Vec::as_slice), false);
            choice.take(views.source(), &view, true, false);
            view == *views.nearest()
        };
        // Its corners are 50 f / z from the middle, of 135 pixels: 127, 131.9, 132.1; then 127, 111.2, 110.9.
        let depths = [150.0, 144.05, 143.8, 150.0, 170.9, 171.3];
        assert_eq!(
            depths.map(|depth| next(&[depth])),
            [true, true, false, false, false, true]
        );
        // What is beyond the image does not count: nothing could show it.
        assert!(next(&[20.0]));
        // Of two the one that needs the wider view.
        assert!(!next(&[171.3, 143.8]));
    }

    #[test]
    fn what_is_missing_is_searched_in_the_nearest_and_the_widest_view_in_turn() {
        let views = [views((640, 480)), views((1280, 720))];
        let mut choice = ViewChoice::default();
        let mut search = |of: usize, searches: bool| {
            let view = choice.next(&views[of], std::iter::empty(), searches);
            choice.take(views[of].source(), &view, false, searches);
            view == *views[of].nearest()
        };
        let looks = [true, false, false, true, false, true];
        assert_eq!(
            looks.map(|searches| search(0, searches)),
            [true, true, true, false, false, true]
        );
        // Another camera begins with its nearest view, which may be the only one.
        assert_eq!(looks.map(|searches| search(1, searches)), [true; 6]);
        assert!(search(0, true));
    }
}
