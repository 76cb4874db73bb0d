//! How far the canonical view is zoomed out: an object that is too near for the training camera's angle of view, but not for the
//! camera's own, is looked at by a camera with a shorter focal length.

use crate::camera::{Camera, canonical_camera};
use crate::image::ImageSize;
use crate::maps::Maps;
use glam::{DVec2, DVec3};

/// Focal lengths of the views between the training camera's and the widest, as multiples of the training camera's.
const STEPS: [f64; 2] = [0.75, 0.5];

/// The widest view: 119 degrees across. Beyond, rays are so slanted that a pinhole shows little of the middle.
const MIN_SCALE: f64 = 0.375;

/// A view that reaches less beyond the one before, as a multiple, is left out.
const MIN_GAIN: f64 = 1.1;

/// A camera that sees less than this beyond the training camera's view has no other.
const MIN_BEYOND: f64 = 1.05;

/// Pixels of the canonical image between a mesh and a view's border for which the mesh counts as held by a view that is chosen anew.
const MARGIN_PX: f64 = 8.0;

/// The same below which a view is left for a wider one, and from which it is left for a narrower one: apart, so that views do not alternate.
const MARGIN_TO_LEAVE_PX: f64 = 3.0;
const MARGIN_TO_RETURN_PX: f64 = 24.0;

/// Pixels of the canonical image along a view's border that a mask covers from which the object counts as cut off.
const CUT_PX: usize = 4;

/// The zoom levels of one camera: its [canonical camera](canonical_camera) and wider ones of the same size. The wider
/// ones have shorter focal lengths and reach as far as the camera's image does. In all of them points and depths are
/// those of the one camera frame.
#[derive(Clone, Debug, PartialEq)]
pub struct CanonicalViews {
    source: Camera,
    /// The widest last.
    views: Vec<Camera>,
}

impl CanonicalViews {
    /// Those of images that `source` takes.
    pub fn new(training: &Camera, source: &Camera) -> Self {
        let canonical = canonical_camera(training, source.size());
        let whole = whole_image_scale(&canonical, source);
        let mut views = vec![canonical];
        if whole * MIN_BEYOND < 1.0 {
            let steps = STEPS.into_iter().filter(|step| *step > MIN_GAIN * whole);
            views.extend(steps.chain([whole]).map(|scale| canonical.zoomed(scale)));
        }
        Self { source: *source, views }
    }

    /// The camera whose images they stand for.
    pub fn source(&self) -> &Camera {
        &self.source
    }

    /// All, the nearest first.
    pub fn all(&self) -> &[Camera] {
        &self.views
    }

    /// The canonical camera.
    pub fn nearest(&self) -> &Camera {
        &self.views[0]
    }

    /// The one that reaches as far as the image.
    pub fn widest(&self) -> &Camera {
        &self.views[self.views.len() - 1]
    }

    /// Chooses the view for the next frame of a video from the last mesh (mm, camera frame). It is `current` until
    /// the mesh leaves it or a nearer view holds the mesh by far.
    pub fn following(&self, current: &Camera, vertices_camera: &[DVec3]) -> &Camera {
        let Some(current) = self.views.iter().position(|view| view == current) else {
            return self.holding(0, vertices_camera, MARGIN_PX);
        };
        let nearer = self.holding(0, vertices_camera, MARGIN_TO_RETURN_PX);
        if self.views[..current].contains(nearer) {
            return nearer;
        }
        match self.holds(&self.views[current], vertices_camera, MARGIN_TO_LEAVE_PX) {
            true => &self.views[current],
            false => self.holding(current, vertices_camera, MARGIN_PX),
        }
    }

    /// The nearest view from number `first` on that holds as much of a mesh as the image does, `margin_px` away from its border; else the
    /// widest.
    fn holding(&self, first: usize, vertices_camera: &[DVec3], margin_px: f64) -> &Camera {
        let mut wider = self.views[first..].iter();
        let holding = wider.find(|view| self.holds(view, vertices_camera, margin_px));
        holding.unwrap_or(self.widest())
    }

    fn holds(&self, view: &Camera, vertices_camera: &[DVec3], margin_px: f64) -> bool {
        let source = &self.source;
        let in_image = |p: DVec3| source.project(p).is_some_and(|pixel| source.size().holds(pixel));
        let limit = view.size().as_dvec2() - margin_px;
        let inside = |pixel: DVec2| pixel.cmpge(DVec2::splat(margin_px)).all() && pixel.cmple(limit).all();
        let mut seen = vertices_camera.iter().filter(|p| in_image(**p));
        seen.all(|p| view.project(*p).is_some_and(inside))
    }

    /// Whether `maps` of `view` end at its border where the image goes on.
    pub fn cuts(&self, view: &Camera, maps: &Maps) -> bool {
        let ImageSize { width, height } = maps.size();
        let goes_on = |x: usize, y: usize| {
            let centre = DVec2::new(x as f64 + 0.5, y as f64 + 0.5);
            let outwards = DVec2::new(outwards(x, width), outwards(y, height));
            let beyond = view.ray_from_pixel(centre + MARGIN_PX * outwards);
            let at = self.source.pixel_from_ray(beyond);
            at.is_some_and(|at| self.source.size().holds(at))
        };
        let border = (0..height).flat_map(|y| {
            let is_whole_row = y == 0 || y + 1 == height;
            let step = if is_whole_row { 1 } else { width.max(2) - 1 };
            (0..width).step_by(step).map(move |x| (x, y))
        });
        let cut = border.filter(|&(x, y)| maps.inside(y * width + x) && goes_on(x, y));
        cut.count() >= CUT_PX
    }
}

/// The way out of an image of `length` pixels at pixel `at`.
fn outwards(at: usize, length: usize) -> f64 {
    match at {
        0 => -1.0,
        at if at + 1 == length => 1.0,
        _ => 0.0,
    }
}

/// The focal length with which `canonical` would hold all of the source's image, as a multiple of its own; at least [`MIN_SCALE`].
fn whole_image_scale(canonical: &Camera, source: &Camera) -> f64 {
    let centre = canonical.principal_point();
    let limit = canonical.size().as_dvec2() - centre;
    let scale_of = |ray: DVec2| {
        let offset = ray * canonical.focal();
        // To the right and down there is `limit`, to the left and up `centre`.
        let [right, left] = [offset / limit, -offset / centre].map(|fraction| fraction.max_element());
        1.0 / right.max(left)
    };
    let scales = source.border_rays().flatten().map(scale_of);
    scales.fold(1.0, f64::min).max(MIN_SCALE)
}
