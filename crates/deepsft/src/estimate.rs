//! What one image shows of a target.

use crate::finding::FinderKind;
use deepsft_geometry::{Camera, Maps, Picture, Surface};

/// The judgement of an estimate; by default nothing was found.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Judgement {
    /// Whether the target is seen: of a fitted surface by [`Verdict::is_found`](deepsft_geometry::Verdict::is_found), of a network's own
    /// maps by the bounds of its model ([`FoundRule`](crate::FoundRule)).
    pub found: bool,
    /// Near 1 when the estimate explains the image, near 0 when it does not or nothing is seen: of a fitted surface the fraction of
    /// the print that the image confirms, of a network's own maps the photo-consistency of image and template.
    pub confidence: f32,
    /// Fraction of the image that the mask covers.
    pub area: f32,
    /// Whether the image determines the shape too ([`Surface::is_shape_determined`]); false of a network's own maps.
    pub shape_determined: bool,
}

impl Judgement {
    /// The judgement of a fitted surface, which `maps` are of.
    pub(crate) fn of_surface(surface: &Surface, maps: &Maps) -> Self {
        Self {
            found: surface.verdict.is_found(),
            confidence: surface.verdict.explained as f32,
            area: Self::area_of(maps),
            shape_determined: surface.is_shape_determined(),
        }
    }

    /// The fraction of the image that the mask of `maps` covers.
    pub(crate) fn area_of(maps: &Maps) -> f32 {
        (maps.area() as f64 / (maps.size().width * maps.size().height) as f64) as f32
    }
}

/// The estimate of a target in one image.
#[derive(Clone, Debug)]
pub struct Estimate {
    /// The finder that saw it.
    pub by: Option<FinderKind>,
    /// Depth (mm) and registration in the canonical image: drawn from the surface, or a network's own where there is none.
    pub maps: Maps,
    /// The canonical image that they belong to.
    pub canonical: Picture,
    /// The camera of that image, zoomed out where the target is too near for the canonical one
    /// ([`CanonicalViews`](deepsft_geometry::CanonicalViews)).
    pub canonical_camera: Camera,
    /// Whether to believe it.
    pub judgement: Judgement,
    /// The fitted surface, hidden parts included. `None` for templates that are no sheets, for a network's own maps, and where too
    /// little is seen.
    pub surface: Option<Surface>,
}

impl Estimate {
    /// The estimate of an image in which nothing is seen.
    pub(crate) fn nothing(canonical: &Picture, camera: &Camera) -> Self {
        Self {
            by: None,
            maps: Maps::empty(camera.size()),
            canonical: canonical.clone(),
            canonical_camera: *camera,
            judgement: Judgement::default(),
            surface: None,
        }
    }

    /// What speaks for it: that it is found, then the fraction of the print that the image confirms, and its size.
    pub(crate) fn worth(&self) -> (bool, f64) {
        let size = self
            .surface
            .as_ref()
            .map_or(1.0, |surface| surface.verdict.confirmed_px);
        (self.judgement.found, f64::from(self.judgement.confidence) * size)
    }
}
