//! What covers parts of the sheet: hands, things, and the paper's discs; where each sits, and laid into an image.

use crate::deform::centroid;
use crate::render::ValueNoise;
use crate::scene::occluder::body::{ImageOccluder, Part};
use deepsft_geometry::Camera;
use deepsft_geometry::glam::{DVec3, Vec2};
use serde::Serialize;

/// What hides parts of the sheet.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
#[non_exhaustive]
pub enum OccluderKind {
    /// Hands that hold the sheet, things before it, and discs of 1 to 10 pixels in radius.
    HandsAndThings,
    /// Up to 4 discs of one random colour each, 1 to 10 pixels in diameter, at random places of the image (the paper's
    /// section 5.1).
    Discs,
}

/// Where an occluder sits on the sheet.
#[derive(Clone, Debug)]
pub(super) enum Anchor {
    /// On outline vertex number `fraction` of the outline; x points inwards, turned by `turn` radians.
    Outline { fraction: f32, turn: f32 },
    /// At a place of the image, fractions of its width and height.
    Image(Vec2),
    /// On any vertex, by its number's fraction of all; x points along `direction`.
    Inside { fraction: f32, direction: Vec2 },
}

/// Something in front of the sheet, with what it has behind it (the hand of a thumb). It moves with the sheet.
#[derive(Clone, Debug)]
pub(crate) struct Occluder {
    pub(super) anchor: Anchor,
    pub(super) behind: Vec<Part>,
    pub(super) front: Vec<Part>,
    pub(super) noise: ValueNoise,
    /// Displacement in mm, softness in mm and strength of its shadow.
    pub(super) shadow: (Vec2, f32, f32),
    /// Discs have their size in pixels, all else in mm.
    pub(crate) in_pixels: bool,
}

/// A sheet as occluders see it: vertices of its outline in order, all vertices, the camera.
pub(crate) struct SheetInImage<'a> {
    pub(crate) outline: &'a [usize],
    pub(crate) vertices_camera: &'a [DVec3],
    pub(crate) camera: &'a Camera,
}

impl SheetInImage<'_> {
    /// Pixel position and pixels per mm at a vertex.
    fn pixel(&self, vertex: usize) -> Option<(Vec2, f32)> {
        let p_camera = self.vertices_camera[vertex];
        let pixel = self.camera.project(p_camera)?.as_vec2();
        let scale = (self.camera.focal().x / p_camera.z) as f32;
        (pixel.abs().max_element() < 1e5 && scale < 100.0).then_some((pixel, scale))
    }

    fn centre(&self) -> Vec2 {
        let mean = self.camera.project(centroid(self.vertices_camera));
        mean.map_or(Vec2::ZERO, |p| p.as_vec2())
    }
}

impl Occluder {
    /// Lays the occluder into the image of `sheet`; `None` when its anchor is behind the camera.
    pub(crate) fn place(&self, sheet: &SheetInImage<'_>) -> Option<ImageOccluder> {
        let (origin, axis, scale) = match self.anchor {
            Anchor::Outline { fraction, turn } => {
                let number = (fraction * sheet.outline.len() as f32) as usize;
                let (origin, scale) = sheet.pixel(*sheet.outline.get(number)?)?;
                let inwards = (sheet.centre() - origin).normalize_or(Vec2::X);
                (origin, Vec2::from_angle(turn).rotate(inwards), scale)
            }
            Anchor::Image(fraction) => {
                let size = Vec2::new(sheet.camera.size().width as f32, sheet.camera.size().height as f32);
                (fraction * size, Vec2::X, 1.0)
            }
            Anchor::Inside { fraction, direction } => {
                let number = (fraction * sheet.vertices_camera.len() as f32) as usize;
                let (origin, scale) = sheet.pixel(number.min(sheet.vertices_camera.len().checked_sub(1)?))?;
                (origin, direction, scale)
            }
        };
        let scale = if self.in_pixels { 1.0 } else { scale };
        let lay = |parts: &[Part]| {
            let place = |part: &Part| Part {
                figure: part.figure.moved(origin, axis, scale),
                surface: part.surface.clone(),
            };
            parts.iter().map(place).collect()
        };
        Some(ImageOccluder {
            behind: lay(&self.behind),
            front: lay(&self.front),
            scale,
            shadow: (self.shadow.0 * scale, (self.shadow.1 * scale).max(1.0), self.shadow.2),
            noise: self.noise,
        })
    }
}
