//! Matches between the features of an image and those of a target: anywhere, and where a mesh has them.

use crate::descriptor::{BITS, distances};
use crate::features::Features;
use crate::target::PictureTarget;
use deepsft_geometry::glam::{DVec2, DVec3, Vec2};
use deepsft_geometry::raster::VisibleSurface;
use deepsft_geometry::{Camera, GeometryError, ImageSize, TriangleMesh};
use std::f32::consts::{PI, TAU};

/// Matches whose descriptors differ in more than this fraction of their bits are none.
const MAX_DIFFERENT: f32 = 0.33;

/// The best match must be this much nearer than the best one elsewhere on the target.
const MAX_RATIO: f32 = 0.95;

/// Elsewhere: farther than this, pixels of the target's picture (6 mm on an A4 sheet). Several corners of one spot must not
/// reject one another.
pub(crate) const ELSEWHERE_PX: f32 = 13.0;

/// A match: a point of the image and one of the sheet that look alike.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Match {
    /// Position in the image, pixels.
    pub pixel: Vec2,
    /// Place on the sheet, mm from its upper left corner.
    pub place: Vec2,
    /// Angle by which directions of the image turn into those of the sheet, radians.
    pub angle: f32,
    /// Length on the sheet per length in the image, mm per pixel.
    pub scale: f32,
}

impl Match {
    pub(crate) fn of(features: &Features, image: usize, target: &PictureTarget, other: usize) -> Self {
        let feature = &features.all[image];
        Self {
            pixel: feature.position,
            place: target.places[other],
            angle: target.features.all[other].angle - feature.angle,
            scale: target.scale_mm(other) / feature.scale,
        }
    }
}

/// For each feature of the image the most similar of the target, where it stands out; the clearest first.
pub(crate) fn matches(features: &Features, target: &PictureTarget) -> Vec<Match> {
    let elsewhere_mm = ELSEWHERE_PX * target.mm_per_pixel;
    let most = (MAX_DIFFERENT * BITS as f32) as u16;
    let (mut of_one, mut found) = (Vec::new(), Vec::new());
    for (image, descriptor) in features.descriptors.iter().enumerate() {
        let (best, least) = distances(descriptor, &target.features.descriptors, &mut of_one);
        if least > most {
            continue;
        }
        let place = target.places[best];
        // One bit more for all: two exact copies are rivals too. A rival at the limit is far enough.
        let limit = (f32::from(least + 1) / MAX_RATIO) as u16 + 1;
        let rivals = of_one.iter().zip(&target.places);
        let rivals = rivals.filter(|(distance, other)| **distance < limit && other.distance(place) > elsewhere_mm);
        let rival = rivals.map(|(distance, _)| *distance).min().unwrap_or(limit);
        let ratio = f32::from(least + 1) / f32::from(rival + 1);
        if ratio <= MAX_RATIO {
            found.push((ratio, Match::of(features, image, target, best)));
        }
    }
    found.sort_unstable_by(|a, b| a.0.total_cmp(&b.0));
    found.into_iter().map(|(_, found)| found).collect()
}

/// Matches that a mesh guides may differ in this fraction of their bits.
const GUIDED_DIFFERENT: f32 = 0.25;

/// The best of them must be this much nearer than the best one elsewhere on the target: fine texture has a similar corner near every place.
const GUIDED_RATIO: f32 = 0.9;

/// Largest angle between a match and the mesh, radians.
const TURN: f32 = 0.5;

/// Largest ratio of the sizes of a match on the sheet and in the image, either way.
const SCALING: f32 = 2.2;

/// How much coarser than the image the surface is drawn: it only has to name the face that a feature lies on.
const COARSER: usize = 4;

/// For each feature of the image on the surface of `mesh` with its vertices at `vertices`: the most similar feature of the target
/// whose place is within `search_px` pixels, where it stands out. Without features: those of `candidates` that lie so near.
pub(crate) fn guided_matches(
    seen: &ImageEvidence<'_>,
    target: &PictureTarget,
    (mesh, vertices): (&TriangleMesh, &[DVec3]),
    search_px: f64,
) -> Result<Vec<Match>, GeometryError> {
    let surface = ProjectedMesh::new(mesh, vertices, seen.camera, target.template.size_mm())?;
    let (features, others) = (seen.features, &target.features);
    let most = (GUIDED_DIFFERENT * BITS as f32) as u16;
    let elsewhere_mm = ELSEWHERE_PX * target.mm_per_pixel;
    let (mut compared, mut found) = (Vec::new(), Vec::new());
    for (image, (feature, descriptor)) in features.all.iter().zip(&features.descriptors).enumerate() {
        let Some(expected) = surface.at(feature.position) else {
            continue;
        };
        let fits = |&other: &usize| {
            let angle = others.all[other].angle - feature.angle;
            expected.fits(angle, target.scale_mm(other) / feature.scale)
        };
        let reach = search_px as f32 * expected.mm_per_pixel;
        let near = target.near(expected.place, reach).filter(fits);
        compared.clear();
        compared.extend(near.map(|other| (descriptor.distance(&others.descriptors[other]), other)));
        let Some(&(least, best)) = compared.iter().min().filter(|(least, _)| *least <= most) else {
            continue;
        };
        let is_clear = |&(distance, other): &(u16, usize)| {
            let is_rival = target.places[other].distance(target.places[best]) > elsewhere_mm;
            !is_rival || f32::from(least + 1) <= GUIDED_RATIO * f32::from(distance + 1)
        };
        if compared.iter().all(is_clear) {
            found.push(Match::of(features, image, target, best));
        }
    }
    if features.is_empty() {
        found.extend(seen.candidates.iter().filter(|m| {
            surface.at(m.pixel).is_some_and(|expected| {
                let reach = search_px as f32 * expected.mm_per_pixel;
                expected.place.distance(m.place) <= reach && expected.fits(m.angle, m.scale)
            })
        }));
    }
    Ok(found)
}

/// What an image shows: its features, and matches from elsewhere.
pub(crate) struct ImageEvidence<'a> {
    pub candidates: &'a [Match],
    pub features: &'a Features,
    pub camera: &'a Camera,
}

struct ProjectedMesh {
    coarse: VisibleSurface,
    /// Pixels of the coarse image per pixel.
    scale: DVec2,
    size_mm: DVec2,
    focal: f64,
}

impl ProjectedMesh {
    fn new(mesh: &TriangleMesh, vertices: &[DVec3], camera: &Camera, size_mm: DVec2) -> Result<Self, GeometryError> {
        let ImageSize { width, height } = camera.size();
        let coarse = camera.resized((width.div_ceil(COARSER), height.div_ceil(COARSER)))?;
        Ok(Self {
            coarse: VisibleSurface::new(mesh, vertices, &coarse),
            scale: coarse.size().as_dvec2() / camera.size().as_dvec2(),
            size_mm,
            focal: camera.focal().x,
        })
    }

    /// What the surface says of a match at `pixel`. `None` where its front is not seen.
    fn at(&self, pixel: Vec2) -> Option<Expected> {
        let at = pixel.as_dvec2() * self.scale;
        let triangle = self.coarse.triangle_at(at).filter(|triangle| triangle.front)?;
        let point = triangle.seen_point(at.x, at.y);
        // Change of the place for a step in the image: the rotation nearest to the matrix with these columns.
        let [x, y] = [point.duv_dx * self.scale.x, point.duv_dy * self.scale.y].map(|step| step * self.size_mm);
        Some(Expected {
            place: (point.uv * self.size_mm).as_vec2(),
            turn: (x.y - y.x).atan2(x.x + y.y) as f32,
            mm_per_pixel: (point.depth_mm / self.focal) as f32,
        })
    }
}

/// What a surface says of a match.
struct Expected {
    place: Vec2,
    turn: f32,
    mm_per_pixel: f32,
}

impl Expected {
    /// Whether a match with this angle and scale, see [`Match`], may be right.
    fn fits(&self, angle: f32, scale: f32) -> bool {
        let off = (angle - self.turn + PI).rem_euclid(TAU) - PI;
        off.abs() < TURN && (SCALING.recip()..SCALING).contains(&(scale / self.mm_per_pixel))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::descriptor::xorshift;
    use crate::features::{FeatureOptions, IMAGE};
    use deepsft_geometry::{Picture, Template};

    /// Rectangles of random grey on random grey: many corners, none like the other.
    fn print() -> Picture {
        let mut random = xorshift(0x9e37_79b9_7f4a_7c15);
        let mut random = move |below: u64| (random() >> 33) % below;
        let mut grey = vec![120_u8; 400 * 300];
        for _ in 0..250 {
            let (left, top) = (random(400) as usize, random(300) as usize);
            let (right, bottom) = (left + 6 + random(50) as usize, top + 6 + random(50) as usize);
            let value = random(256) as u8;
            for y in top..bottom.min(300) {
                grey[400 * y + left..400 * y + right.min(400)].fill(value);
            }
        }
        Picture::from_fn(400, 300, |x, y| [grey[400 * y + x]; 3])
    }

    fn target(width_mm: f64, picture: Picture) -> PictureTarget {
        PictureTarget::new(Template::thin_shell(picture, width_mm, 0.75 * width_mm).unwrap()).unwrap()
    }

    #[test]
    fn a_print_turned_by_a_quarter_is_matched_with_angle_scale_and_place() {
        let print = print();
        let target = target(400.0, print.clone());
        let found = matches(&Features::search(&print.turned_clockwise(), IMAGE), &target);
        assert!(found.len() > 300, "{}", found.len());
        let right = found.iter().filter(|m| {
            let expected = Vec2::new(m.pixel.y, 300.0 - m.pixel.x);
            let turn = (m.angle + std::f32::consts::FRAC_PI_2).rem_euclid(TAU);
            m.place.distance(expected) < 3.0 && turn.min(TAU - turn) < 0.2 && (0.75..1.34).contains(&m.scale)
        });
        let right = right.count();
        // Most of the others are corners of coarse levels, whose pixels are larger than 3 mm.
        assert!(right * 5 > found.len() * 4, "{right} of {}", found.len());
    }

    #[test]
    fn the_size_of_the_sheet_changes_nothing_but_lengths() {
        let print = print();
        // A tenth smaller, so that corners look alike and not equal.
        let shown = Picture::from_fn(360, 270, |x, y| {
            let color = print.sample((x as f64 + 0.5) / 0.9, (y as f64 + 0.5) / 0.9);
            color.map(|c| c as u8)
        });
        let features = Features::search(&shown, IMAGE);
        let found = [30.0, 300.0, 5000.0].map(|width_mm| {
            let target = target(width_mm, print.clone());
            let relative = |m: &Match| (m.pixel, m.place / width_mm as f32);
            matches(&features, &target).iter().map(relative).collect::<Vec<_>>()
        });
        assert!(found[0].len() > 300 && found[0].len() == found[1].len() && found[1].len() == found[2].len());
        for (a, others) in found[0].iter().zip(found[1].iter().zip(&found[2])) {
            for b in [others.0, others.1] {
                assert!(a.0 == b.0 && a.1.distance(b.1) < 1e-5);
            }
        }
    }

    #[test]
    fn a_print_of_equal_motifs_gives_no_match_inside() {
        let motif = print();
        let print = Picture::from_fn(400, 300, |x, y| motif.pixel(100 + x % 100, 100 + y % 100));
        let target = target(400.0, print.clone());
        let features = Features::search(&print, FeatureOptions { levels: 1, ..IMAGE });
        let found = matches(&features, &target);
        // Only the border and what a level of the pyramid makes of it is like nothing else.
        let inside =
            |m: &&Match| m.place.cmpge(Vec2::splat(40.0)).all() && m.place.cmple(Vec2::new(360.0, 260.0)).all();
        let (inside, all) = (found.iter().filter(inside).count(), features.all.len());
        assert!(all > 500 && inside * 50 < all, "{inside} of {all}");
    }
}
