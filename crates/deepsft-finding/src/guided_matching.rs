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
        let column = (feature.position.x as usize).min(maps.width() - 1);
        let row = (feature.position.y as usize).min(maps.height() - 1);
        let index = row * maps.width() + column;
        let Some(turn) = turn(maps, index, size) else {
            continue;
        };
        let mm_per_pixel = maps.depth()[index] / camera.focal().x as f32;
        let expected = Vec2::from(maps.registration()[index]) * size;
        let fits = |&other: &usize| {
            let off = others[other].angle - feature.angle - turn;
            let scaling = target.scale_mm(other) / (feature.scale * mm_per_pixel);
            ((off + PI).rem_euclid(TAU) - PI).abs() < TURN && (SCALING.recip()..SCALING).contains(&scaling)
        };
        let near = target.near(expected, search_px as f32 * mm_per_pixel).filter(fits);
        let compared = near.map(|other| (feature.descriptor.distance(&others[other].descriptor), other));
        if let Some((_, other)) = compared.min().filter(|(distance, _)| *distance <= most) {
            found.push(Match::of(features, image, target, other));
        }
    }
    found
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
