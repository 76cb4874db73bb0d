//! Matches looked for where a mesh has them.

use crate::descriptor::BITS;
use crate::features::Features;
use crate::matching::{ELSEWHERE_PX, Match};
use crate::target::PictureTarget;
use deepsft_geometry::glam::{DVec2, DVec3, Vec2};
use deepsft_geometry::raster::VisibleSurface;
use deepsft_geometry::{Camera, GeometryError, ImageSize, TriangleMesh};
use std::f32::consts::{PI, TAU};

/// Such matches may differ in this fraction of their bits.
const MAX_DIFFERENT: f32 = 0.25;

/// The best match must be this much nearer than the best one elsewhere on the target: fine texture has a similar corner near every place.
const MAX_RATIO: f32 = 0.9;

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
    let most = (MAX_DIFFERENT * BITS as f32) as u16;
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
            !is_rival || f32::from(least + 1) <= MAX_RATIO * f32::from(distance + 1)
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

/// A mesh as the camera sees it.
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
        let index = self.coarse.region().index(at.x as usize, at.y as usize)?;
        let triangle = self.coarse.triangles()[self.coarse.centres().triangle(index)?].as_ref()?;
        let point = triangle.front.then(|| triangle.seen_point(at.x, at.y))?;
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
