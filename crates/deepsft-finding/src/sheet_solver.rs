//! The mesh of a sheet from matches: first flat, then bent under isometry (Shape-from-Template from correspondences, Bartoli et
//! al. 2015).

use crate::matching::Match;
use deepsft_geometry::fitting::{FitOptions, GridInterpolation, IsometricMesh};
use deepsft_geometry::glam::{DMat2, DMat3, DVec2, DVec3};
use deepsft_geometry::solver::{ImagePoint, Reprojection, Robust};
use deepsft_geometry::{Camera, GeometryError, Template};

/// How much larger the cells are than those of the template's own mesh.
const COARSE_CELLS: usize = 3;

/// How many independent measurements the matches of a frame are worth together.
const INDEPENDENT: f64 = 100.0;

/// Accepted steps per stiffness.
const STEPS: usize = 10;

/// About what a wrong match counts that was found near a wrong mesh: without it the mesh that covers most of the image wins.
/// Chosen on synthetic frames.
const BY_CHANCE: f64 = 0.25;

/// Robust steps of the affine fit.
const AFFINE_STEPS: usize = 8;

/// The coarse mesh of a sheet.
#[derive(Debug)]
pub(crate) struct SheetSolver {
    pub sheet: IsometricMesh,
    /// From vertices of the mesh to those of the template's own.
    pub to_template: GridInterpolation,
    size_mm: DVec2,
}

impl SheetSolver {
    pub fn new(template: &Template) -> Result<Self, GeometryError> {
        let coarse = template.coarser(COARSE_CELLS)?;
        let FitOptions { isometry, bending, .. } = FitOptions::default();
        Ok(Self {
            sheet: IsometricMesh::new(coarse.mesh().clone(), template.mesh(), isometry, bending)?,
            to_template: GridInterpolation::cubic(&coarse, template.mesh())?,
            size_mm: template.size_mm(),
        })
    }

    /// The mesh bent until `matches` project to their pixels. `deviation_px`: their standard deviation. `soft`: it may stretch
    /// at first.
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
            let point = self.sheet.locator.locate(self.uv(m))?;
            let pixel = m.pixel.as_dvec2();
            Some(ImagePoint { point, pixel, weight })
        };
        let points: Vec<ImagePoint> = matches.iter().filter_map(image_point).collect();
        let data = Reprojection::new(&self.sheet.mesh, camera, &points, Robust::Cauchy(1.5 * deviation_px))?;
        Ok(match soft {
            true => self.sheet.solve_by_continuation(&[&data], start.to_vec(), STEPS)?,
            false => self.sheet.solve(&[&data], start, STEPS, false)?.vertices,
        })
    }

    /// How many of `matches` the mesh at `vertices` explains beyond chance: each counts 1 / (1 + (error / scale)^2) less about what a
    /// wrong one counts.
    pub fn explained(&self, camera: &Camera, matches: &[Match], vertices: &[DVec3], scale_px: f64) -> f64 {
        let one = |m: &Match| {
            let point = self.sheet.locator.locate(self.uv(m))?;
            let projected = camera.project(point.position(self.sheet.mesh.faces(), vertices))?;
            Some(1.0 / (1.0 + (projected - m.pixel.as_dvec2()).length_squared() / (scale_px * scale_px)) - BY_CHANCE)
        };
        matches.iter().filter_map(one).sum()
    }

    fn uv(&self, m: &Match) -> DVec2 {
        (m.place.as_dvec2() / self.size_mm).clamp(DVec2::ZERO, DVec2::ONE)
    }

    /// The flat mesh in the two poses that a weak perspective allows: tilted to either side.
    /// A pose with a match behind the camera is left out.
    pub fn flat_starts(&self, camera: &Camera, matches: &[Match]) -> Vec<Vec<DVec3>> {
        let Some(affine) = Affine::fit(matches, self.size_mm) else {
            return Vec::new();
        };
        let focal = camera.focal().x;
        // Singular values of the affine map: focal / depth, and the same shortened by the tilt.
        let m = affine.matrix;
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
        let centre = camera.unproject(affine.centre_px, depth);
        let start = |side: f64| {
            let (a, b) = (x.extend(side * zx), y.extend(side * sign * zy));
            let rotation = DMat3::from_cols(a, b, a.cross(b));
            let at = |p: DVec3| rotation * (p - affine.centre_template.extend(0.0)) + centre;
            let before = |m: &Match| at((m.place.as_dvec2() - self.size_mm / 2.0).extend(0.0)).z > 0.0;
            let vertices = || self.sheet.mesh.vertices().iter().map(|&p| at(p)).collect::<Vec<_>>();
            matches.iter().all(before).then(vertices)
        };
        [1.0, -1.0].into_iter().filter_map(start).collect()
    }
}

/// A robust affine map from the sheet (mm, its centre the origin) to the image (pixels).
struct Affine {
    matrix: DMat2,
    centre_template: DVec2,
    centre_px: DVec2,
}

impl Affine {
    fn fit(matches: &[Match], size_mm: DVec2) -> Option<Self> {
        let place = |m: &Match| m.place.as_dvec2() - size_mm / 2.0;
        let pixel = |m: &Match| m.pixel.as_dvec2();
        let mut weights = vec![1.0; matches.len()];
        let mut fitted = None;
        for _ in 0..AFFINE_STEPS {
            let total: f64 = weights.iter().sum();
            let mean = |f: &dyn Fn(&Match) -> DVec2| {
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
            let error = |m: &Match| (matrix * (place(m) - centre_template) + centre_px - pixel(m)).length();
            let errors: Vec<f64> = matches.iter().map(error).collect();
            let mut sorted = errors.clone();
            sorted.sort_by(f64::total_cmp);
            let scale = (2.0 * sorted[sorted.len() / 2]).max(2.0);
            weights = errors.iter().map(|e| 1.0 / (1.0 + (e / scale).powi(2))).collect();
            fitted = Some(Self {
                matrix,
                centre_template,
                centre_px,
            });
        }
        fitted
    }
}
