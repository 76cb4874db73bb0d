//! Matches looked for where a mesh has them.

use crate::descriptor::BITS;
use crate::features::Features;
use crate::matching::Match;
use crate::target::PictureTarget;
use deepsft_geometry::glam::Vec2;
use deepsft_geometry::{Camera, Maps};
use std::f32::consts::{PI, TAU};

/// Such matches may differ in this fraction of their bits.
const MOST_DIFFERENT: f32 = 0.25;

/// Largest angle between a match and the mesh, radians.
const TURN: f32 = 0.5;

/// Largest ratio of the sizes of a match on the sheet and in the image, either way.
const SCALING: f32 = 2.2;

/// For each feature of the image on the surface of `maps` (drawn from a mesh for the image's `camera`): the most similar
/// feature of the target whose place is within `search_px` pixels.
pub(crate) fn guided_matches(
    features: &Features,
    target: &PictureTarget,
    camera: &Camera,
    maps: &Maps,
    search_px: f64,
) -> Vec<Match> {
    let size = target.template().size_mm().as_vec2();
    let others = &target.features().all;
    let most = (MOST_DIFFERENT * BITS as f32) as u32;
    let mut found = Vec::new();
    for (image, feature) in features.all.iter().enumerate() {
        let Some(expected) = Expected::at(feature.position, size, camera, maps) else {
            continue;
        };
        let fits = |&other: &usize| {
            let angle = others[other].angle - feature.angle;
            expected.fits(angle, target.scale_mm(other) / feature.scale)
        };
        let reach = search_px as f32 * expected.mm_per_pixel;
        let near = target.near(expected.place, reach).filter(fits);
        let compared = near.map(|other| (feature.descriptor.distance(&others[other].descriptor), other));
        if let Some((_, other)) = compared.min().filter(|(distance, _)| *distance <= most) {
            found.push(Match::of(features, image, target, other));
        }
    }
    found
}

/// Those of `candidates` that lie within `search_px` pixels of where the surface of `maps` has them. `size`: of the sheet, mm.
pub(crate) fn candidates_near(
    candidates: &[Match],
    size: Vec2,
    camera: &Camera,
    maps: &Maps,
    search_px: f64,
) -> impl Iterator<Item = Match> {
    candidates.iter().copied().filter(move |m| {
        Expected::at(m.pixel, size, camera, maps).is_some_and(|expected| {
            let reach = search_px as f32 * expected.mm_per_pixel;
            expected.place.distance(m.place) <= reach && expected.fits(m.angle, m.scale)
        })
    })
}

/// What a surface says of a match at a pixel.
struct Expected {
    place: Vec2,
    turn: f32,
    mm_per_pixel: f32,
}

impl Expected {
    /// `None` where the surface is not seen.
    fn at(pixel: Vec2, size: Vec2, camera: &Camera, maps: &Maps) -> Option<Self> {
        let column = (pixel.x as usize).min(maps.width() - 1);
        let row = (pixel.y as usize).min(maps.height() - 1);
        let index = row * maps.width() + column;
        Some(Self {
            turn: turn(maps, index, size)?,
            place: Vec2::from(maps.registration()[index]) * size,
            mm_per_pixel: maps.depth()[index] / camera.focal().x as f32,
        })
    }

    /// Whether a match with this angle and scale, see [`Match`], may be right.
    fn fits(&self, angle: f32, scale: f32) -> bool {
        let off = (angle - self.turn + PI).rem_euclid(TAU) - PI;
        off.abs() < TURN && (SCALING.recip()..SCALING).contains(&(scale / self.mm_per_pixel))
    }
}

/// The angle by which the registration turns directions of the image around a pixel into directions on the sheet, radians.
fn turn(maps: &Maps, index: usize, size_mm: Vec2) -> Option<f32> {
    let (right, below) = (index + 1, index + maps.width());
    if right % maps.width() == 0
        || below >= maps.depth().len()
        || ![index, right, below].iter().all(|&p| maps.inside(p))
    {
        return None;
    }
    let place = |p: usize| Vec2::from(maps.registration()[p]) * size_mm;
    let (x, y) = (place(right) - place(index), place(below) - place(index));
    // The rotation nearest to the matrix with these columns.
    Some((x.y - y.x).atan2(x.x + y.y))
}
