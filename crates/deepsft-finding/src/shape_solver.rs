//! The mesh of a template from matches. A sheet is first flat, then bent under isometry (Shape-from-Template from correspondences,
//! Bartoli et al. 2015). A solid stays rigid: it bends little, and the fit to the image bends it.

use crate::matching::Match;
use deepsft_geometry::fitting::{GridInterpolation, IsometricMesh, Stiffness, SurfaceLocator};
use deepsft_geometry::glam::{DMat2, DMat3, DVec2, DVec3};
use deepsft_geometry::solver::{ImagePoint, Reprojection, Robust, SurfacePoint};
use deepsft_geometry::{Camera, GeometryError, RigidMotion, Template, TriangleMesh};

/// How much larger the cells are than those of the template's own mesh.
const COARSE_CELLS: usize = 3;

/// How many independent measurements the matches of a frame are worth together.
const INDEPENDENT: f64 = 100.0;

/// Accepted steps per stiffness.
const STEPS: usize = 10;

/// Robust steps of the affine fit, and of the pose of a solid.
const AFFINE_STEPS: usize = 8;
const POSE_STEPS: usize = 40;

#[derive(Debug)]
pub(crate) struct ShapeSolver {
    shape: Shape,
    size_mm: DVec2,
}

#[derive(Debug)]
enum Shape {
    /// The coarse mesh, and the way from its vertices to those of the template's own.
    Sheet(Box<IsometricMesh>, GridInterpolation),
    Solid(TriangleMesh, SurfaceLocator),
}

impl ShapeSolver {
    pub fn new(template: &Template) -> Result<Self, GeometryError> {
        let mesh = template.mesh();
        let shape = if template.is_sheet() {
            let coarse = template.coarser(COARSE_CELLS)?;
            let sheet = IsometricMesh::new(coarse.mesh().clone(), mesh)?;
            Shape::Sheet(Box::new(sheet), GridInterpolation::cubic(&coarse, mesh)?)
        } else {
            Shape::Solid(mesh.clone(), SurfaceLocator::new(mesh))
        };
        Ok(Self {
            shape,
            size_mm: template.size_mm(),
        })
    }

    /// The mesh at rest.
    pub fn mesh(&self) -> &TriangleMesh {
        match &self.shape {
            Shape::Sheet(sheet, _) => &sheet.mesh,
            Shape::Solid(mesh, _) => mesh,
        }
    }

    /// Vertices of the mesh as those of the template's own.
    pub fn template_vertices(&self, vertices: Vec<DVec3>) -> Vec<DVec3> {
        match &self.shape {
            Shape::Sheet(_, to_template) => to_template.apply(&vertices),
            Shape::Solid(..) => vertices,
        }
    }

    /// The point of the mesh at a match's place; `None` where the texture of a solid belongs to no face.
    fn point(&self, m: &Match) -> Option<SurfacePoint> {
        let uv = (m.place.as_dvec2() / self.size_mm).clamp(DVec2::ZERO, DVec2::ONE);
        match &self.shape {
            Shape::Sheet(sheet, _) => sheet.locator.locate(uv),
            Shape::Solid(_, locator) => locator.locate(uv),
        }
    }

    /// The mesh bent, or a solid moved, until `matches` project to their pixels. `deviation_px`: their standard deviation. `soft`: a
    /// sheet may stretch at first.
    pub fn bend(
        &mut self,
        camera: &Camera,
        matches: &[Match],
        start: &[DVec3],
        deviation_px: f64,
        soft: bool,
    ) -> Result<Vec<DVec3>, GeometryError> {
        let weight = INDEPENDENT / matches.len().max(1) as f64 / (deviation_px * deviation_px);
        let image_point = |m: &Match| {
            let (point, pixel) = (self.point(m)?, m.pixel.as_dvec2());
            Some(ImagePoint { point, pixel, weight })
        };
        let points: Vec<ImagePoint> = matches.iter().filter_map(image_point).collect();
        let robust = Robust::Cauchy(1.5 * deviation_px);
        match &mut self.shape {
            Shape::Sheet(sheet, _) => {
                let data = Reprojection::new(&sheet.mesh, camera, &points, robust)?;
                Ok(match soft {
                    true => sheet.solve_by_continuation(&[&data], start.to_vec(), STEPS)?,
                    false => sheet.solve(Stiffness::WHOLE, &[&data], start, STEPS, false)?.vertices,
                })
            }
            Shape::Solid(mesh, _) => {
                let pose = pose(mesh, camera, &points, start, robust);
                Ok(mesh.vertices().iter().map(|&p| pose.apply(p)).collect())
            }
        }
    }

    /// How many of `matches` lie where the mesh at `vertices` has them: each counts 1 / (1 + (error / scale)^2).
    pub fn agreement(&self, camera: &Camera, matches: &[Match], vertices: &[DVec3], scale_px: f64) -> f64 {
        let one = |m: &Match| {
            let projected = camera.project(self.point(m)?.position(self.mesh().faces(), vertices))?;
            Some(1.0 / (1.0 + (projected - m.pixel.as_dvec2()).length_squared() / (scale_px * scale_px)))
        };
        matches.iter().filter_map(one).sum()
    }

    /// The plane of `matches`, a sheet's own, else that of the part of the surface on which they are: a point of it, two axes in it and the
    /// one away from who sees it, and the places of matches in it, mm, with their pixels.
    fn plane(&self, matches: &[Match]) -> (DVec3, DMat3, Vec<(DVec2, DVec2)>) {
        let Shape::Solid(mesh, _) = &self.shape else {
            let seen = |m: &Match| (m.place.as_dvec2() - self.size_mm / 2.0, m.pixel.as_dvec2());
            return (DVec3::ZERO, DMat3::IDENTITY, matches.iter().map(seen).collect());
        };
        let located = matches
            .iter()
            .filter_map(|m| Some((self.point(m)?, m.pixel.as_dvec2())));
        let located: Vec<(SurfacePoint, DVec2)> = located.collect();
        let position = |(point, _): &(SurfacePoint, DVec2)| point.position(mesh.faces(), mesh.vertices());
        let origin = located.iter().map(position).sum::<DVec3>() / located.len().max(1) as f64;
        let normal = |(point, _): &(SurfacePoint, DVec2)| {
            let [a, b, c] = mesh.faces()[point.face].map(|v| mesh.vertices()[v]);
            (b - a).cross(c - a).normalize_or_zero()
        };
        // As of a sheet: x to the right, y down, z away from who sees it.
        let outwards = located.iter().map(normal).sum::<DVec3>().try_normalize();
        let inwards = -outwards.unwrap_or(DVec3::NEG_Z);
        let x = inwards.any_orthonormal_vector();
        let axes = DMat3::from_cols(x, inwards.cross(x), inwards);
        let place = |at: &(SurfacePoint, DVec2)| ((axes.transpose() * (position(at) - origin)).truncate(), at.1);
        (origin, axes, located.iter().map(place).collect())
    }

    /// The flat mesh, or the solid whose matches are taken for a plane, in the two poses that a weak perspective allows: tilted to either
    /// side. A pose with a match behind the camera is left out.
    pub fn flat_starts(&self, camera: &Camera, matches: &[Match]) -> Vec<Vec<DVec3>> {
        let (origin, axes, seen) = self.plane(matches);
        let Some((m, centre_template, centre_px)) = affine(&seen) else {
            return Vec::new();
        };
        let focal = camera.focal().x;
        // Singular values of the affine map: focal / depth, and the same shortened by the tilt.
        let squares = m.transpose() * m;
        let (mean, half) = (
            (squares.x_axis.x + squares.y_axis.y) / 2.0,
            ((squares.x_axis.x - squares.y_axis.y) / 2.0).hypot(squares.x_axis.y),
        );
        let largest = (mean + half).sqrt();
        if !(largest > 0.0 && m.determinant() > 0.0) {
            return Vec::new();
        }
        let depth = focal / largest;
        let (x, y) = (m.x_axis / largest, m.y_axis / largest);
        let out = |v: DVec2| (1.0 - v.length_squared()).max(0.0).sqrt();
        let (zx, zy) = (out(x), out(y));
        // Columns of a rotation are at right angles.
        let sign = if x.dot(y) > 0.0 { -1.0 } else { 1.0 };
        let centre = camera.unproject(centre_px, depth);
        let start = |side: f64| {
            let (a, b) = (x.extend(side * zx), y.extend(side * sign * zy));
            let rotation = DMat3::from_cols(a, b, a.cross(b));
            let at = |p: DVec3| rotation * (p - centre_template.extend(0.0)) + centre;
            let before = |(place, _): &(DVec2, DVec2)| at(place.extend(0.0)).z > 0.0;
            let in_plane = |p: &DVec3| axes.transpose() * (*p - origin);
            let vertices = self.mesh().vertices().iter().map(|p| at(in_plane(p)));
            seen.iter().all(before).then(|| vertices.collect())
        };
        [1.0, -1.0].into_iter().filter_map(start).collect()
    }
}

/// The rigid motion of `mesh`, begun where it has its vertices at `start`, that brings its `points` to their pixels: by orthogonal
/// iteration, robustly.
fn pose(mesh: &TriangleMesh, camera: &Camera, points: &[ImagePoint], start: &[DVec3], robust: Robust) -> RigidMotion {
    let pairs = mesh.vertices().iter().zip(start).map(|(&p, &q)| (p, q, 1.0));
    let mut pose = RigidMotion::align(pairs, RigidMotion::IDENTITY);
    for _ in 0..POSE_STEPS {
        let seen = |point: &ImagePoint| {
            let rest = point.point.position(mesh.faces(), mesh.vertices());
            let off = (camera.project(pose.apply(rest))? - point.pixel).length_squared();
            Some((rest, camera.unproject(point.pixel, 1.0), robust.weight(off)))
        };
        let seen: Vec<_> = points.iter().filter_map(seen).collect();
        pose = pose.towards_rays(seen.into_iter());
    }
    pose
}

/// A robust affine map from places in a plane (mm) to their pixels: its matrix, and the centres of both. `None` of fewer than three, or of those
/// on one line.
fn affine(matches: &[(DVec2, DVec2)]) -> Option<(DMat2, DVec2, DVec2)> {
    let place = |m: &(DVec2, DVec2)| m.0;
    let pixel = |m: &(DVec2, DVec2)| m.1;
    let mut weights = vec![1.0; matches.len()];
    let mut fitted = None;
    for _ in 0..AFFINE_STEPS {
        let total: f64 = weights.iter().sum();
        let mean = |f: &dyn Fn(&(DVec2, DVec2)) -> DVec2| {
            matches.iter().zip(&weights).map(|(m, w)| *w * f(m)).sum::<DVec2>() / total
        };
        let (centre_template, centre_px) = (mean(&place), mean(&pixel));
        let (mut moments, mut cross) = (DMat2::ZERO, DMat2::ZERO);
        for (m, &w) in matches.iter().zip(&weights) {
            let (p, q) = (place(m) - centre_template, pixel(m) - centre_px);
            moments += DMat2::from_cols(p * p.x, p * p.y) * w;
            cross += DMat2::from_cols(q * p.x, q * p.y) * w;
        }
        if moments.determinant().abs() < 1e-9 {
            return None;
        }
        let matrix = cross * moments.inverse();
        let error = |m: &(DVec2, DVec2)| (matrix * (place(m) - centre_template) + centre_px - pixel(m)).length();
        let errors: Vec<f64> = matches.iter().map(error).collect();
        let mut sorted = errors.clone();
        sorted.sort_by(f64::total_cmp);
        let scale = (2.0 * sorted[sorted.len() / 2]).max(2.0);
        weights = errors.iter().map(|e| 1.0 / (1.0 + (e / scale).powi(2))).collect();
        fitted = Some((matrix, centre_template, centre_px));
    }
    fitted
}

#[cfg(test)]
#[path = "../../deepsft-geometry/tests/common/printed_box.rs"]
mod printed_box;

#[cfg(test)]
mod tests {
    use super::printed_box::{blocks, on_side, printed_box};
    use super::*;
    use deepsft_geometry::glam::DQuat;
    use deepsft_geometry::training_camera;

    #[test]
    fn matches_on_a_side_of_a_box_give_its_pose_and_those_beside_all_charts_none() {
        let template = printed_box(4, blocks());
        let camera = training_camera();
        let mut solver = ShapeSolver::new(&template).unwrap();
        let truth = RigidMotion {
            rotation: DQuat::from_rotation_x(-0.4) * DQuat::from_rotation_y(0.5),
            translation: DVec3::new(20.0, -15.0, 300.0),
        };
        let seen = |uv: DVec2, pixel: DVec2| Match {
            pixel: pixel.as_vec2(),
            place: (uv * template.size_mm()).as_vec2(),
            angle: 0.0,
            scale: 1.0,
        };
        let on_front = |i: usize| {
            let (_, uv) = on_side(4, DVec2::new((i % 5) as f64, (i / 5) as f64) / 4.5 + 0.05);
            let p = truth.apply(template.point_template(uv).unwrap());
            seen(uv, camera.project(p).unwrap())
        };
        let matches: Vec<Match> = (0..25).map(on_front).collect();
        let starts = solver.flat_starts(&camera, &matches);
        let mut farthest = |start: &Vec<DVec3>| {
            let posed = solver.bend(&camera, &matches, start, 3.0, true).unwrap();
            let pairs = posed.iter().zip(template.mesh().vertices());
            pairs.map(|(a, &p)| a.distance(truth.apply(p))).fold(0.0, f64::max)
        };
        let nearest = starts.iter().map(&mut farthest).fold(f64::INFINITY, f64::min);
        assert!(nearest < 3.0, "the farthest corner is {nearest} mm off");
        let nowhere = vec![seen(DVec2::splat(0.001), DVec2::new(100.0, 100.0)); 9];
        assert!(solver.flat_starts(&camera, &nowhere).is_empty());
    }
}
