//! What a fit starts from and compares with: a finder's start, registered points with depth, depth from derivatives, the image.

use crate::camera::Camera;
use crate::error::{Result, check_size};
use crate::image::GreyImage;
use crate::maps::Maps;
use crate::mesh::{Template, TriangleMesh};
use glam::{DMat2, DVec2, DVec3};

/// A grey image and the camera that took it; both are of one size.
#[derive(Clone, Copy)]
pub(crate) struct Observation<'a> {
    pub(super) grey: &'a GreyImage,
    pub(super) camera: &'a Camera,
    /// Maps of the image whose mask says which pixels are compared; without them all are.
    pub(super) mask: Option<&'a Maps>,
}

impl<'a> Observation<'a> {
    /// Checks the sizes.
    pub(crate) fn new(grey: &'a GreyImage, camera: &'a Camera) -> Result<Self> {
        check_size(grey.size, camera.size())?;
        let mask = None;
        Ok(Self { grey, camera, mask })
    }
}

/// The start of a fit: where a finder sees the object.
#[derive(Clone, Debug)]
pub enum Start {
    /// Depth (mm) and registration in the camera's image, as a network gives them: their mask leaves out what hides the object.
    Maps(Maps),
    /// Vertices of the template's mesh, camera frame, mm: the whole object, as matches give it.
    Mesh(Vec<DVec3>),
}

/// Pixels of the canonical image between two measurements.
const STEP: usize = 6;

/// Pixels of the canonical image around a measurement that must be inside the mask: at the edge of the object the maps mix
/// what lies on both sides.
const MARGIN: usize = 4;

/// How far, in mm, a registration may lie from the middle of its neighbours on both sides: further is a fold or
/// a blunder.
const LARGEST_KINK_MM: f64 = 8.0;

/// A pixel with what the maps say of it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Measurement {
    /// Image position, pixels.
    pub pixel: DVec2,
    /// Texture position.
    pub uv: DVec2,
    /// Camera-frame z, mm.
    pub depth_mm: f64,
}

/// Measurements on a grid of pixels, away from the mask's edge and from breaks of the registration.
pub fn measurements(maps: &Maps, template: &Template) -> Vec<Measurement> {
    let (width, height) = (maps.size().width, maps.size().height);
    let at = |x: usize, y: usize| template.point_template(maps.uv(y * width + x));
    let inside = |x: usize, y: usize| maps.inside(y * width + x);
    let mut found = Vec::new();
    for y in (STEP..height.saturating_sub(STEP)).step_by(STEP) {
        for x in (STEP..width.saturating_sub(STEP)).step_by(STEP) {
            let (left, right, up, down) = (x - MARGIN, x + MARGIN, y - MARGIN, y + MARGIN);
            let around = [(left, up), (right, up), (left, down), (right, down), (x, y)];
            let sides = [(left, y), (right, y), (x, up), (x, down)];
            if !around.iter().chain(&sides).all(|&(x, y)| inside(x, y)) {
                continue;
            }
            let kink = |a: DVec3, b: DVec3, centre: DVec3| ((a + b) / 2.0 - centre).length();
            let [Some(l), Some(r), Some(u), Some(d)] = sides.map(|(x, y)| at(x, y)) else {
                continue;
            };
            let Some(centre) = at(x, y) else { continue };
            if kink(l, r, centre).max(kink(u, d, centre)) > LARGEST_KINK_MM {
                continue;
            }
            let pixel = y * width + x;
            found.push(Measurement {
                pixel: DVec2::new(x as f64 + 0.5, y as f64 + 0.5),
                uv: maps.uv(pixel),
                depth_mm: f64::from(maps.depth()[pixel]),
            });
        }
    }
    found
}

/// About how many faces of a mesh are measured at most: a sheet has fewer, a scan many times as many.
const FACES: usize = 2000;

/// Measurements of a mesh that `camera` sees: the middles of its faces.
pub(crate) fn measurements_of_mesh(
    mesh: &TriangleMesh,
    vertices_camera: &[DVec3],
    camera: &Camera,
) -> Vec<Measurement> {
    let middle = |face: &[usize; 3]| {
        let p_camera = face.iter().map(|&v| vertices_camera[v]).sum::<DVec3>() / 3.0;
        let pixel = camera.project(p_camera)?;
        camera.size().holds(pixel).then(|| Measurement {
            pixel,
            uv: face.iter().map(|&v| mesh.texture_coordinates()[v]).sum::<DVec2>() / 3.0,
            depth_mm: p_camera.z,
        })
    };
    let step = (mesh.faces().len() / FACES).max(1);
    mesh.faces().iter().step_by(step).filter_map(middle).collect()
}

/// Measured depths of the vertices of `sheet`, flat at rest, from where `camera` sees them and from nothing else: differential
/// Shape-from-Template (Bartoli et al. 2015). `None` for a vertex that the camera does not see.
///
/// A point lies at a distance r along its unit ray u, both functions of its place p on the sheet. Isometry leaves I - r^2 (du/dp)^T (du/dp)
/// a matrix of rank one at most, so r is one over the largest singular value of du/dp: the direction in which the sheet is not
/// foreshortened tells the distance. No bend has to be guessed, so no wrong one can be.
pub(super) fn differential_depths(
    sheet: &TriangleMesh,
    vertices_camera: &[DVec3],
    camera: &Camera,
) -> Vec<Option<Measurement>> {
    let rest = sheet.vertices();
    let rays: Vec<DVec3> = vertices_camera.iter().map(|p| p.normalize_or_zero()).collect();
    // The derivative is the mean of those of the faces around a vertex, by area: errors of single vertices hurt the largest
    // singular value less.
    let mut derivatives = vec![([DVec3::ZERO; 2], 0.0); rest.len()];
    for &[a, b, c] in sheet.faces() {
        let sides = DMat2::from_cols((rest[b] - rest[a]).truncate(), (rest[c] - rest[a]).truncate());
        let doubled_area = sides.determinant();
        let to_sides = sides.inverse();
        let [ab, ac] = [rays[b] - rays[a], rays[c] - rays[a]];
        let of = |axis: DVec2| ab * axis.x + ac * axis.y;
        let of_face = [of(to_sides.x_axis), of(to_sides.y_axis)];
        for vertex in [a, b, c] {
            let (sum, area) = &mut derivatives[vertex];
            for (sum, derivative) in sum.iter_mut().zip(of_face) {
                *sum += doubled_area.abs() * derivative;
            }
            *area += doubled_area.abs();
        }
    }
    let measured = |vertex: usize| {
        let (sum, area) = derivatives[vertex];
        let [x, y] = sum.map(|sum| sum / area);
        let (mean, half) = (
            (x.length_squared() + y.length_squared()) / 2.0,
            ((x.length_squared() - y.length_squared()) / 2.0).hypot(x.dot(y)),
        );
        let distance = (mean + half).sqrt().recip();
        let p_camera = vertices_camera[vertex];
        Some(Measurement {
            pixel: camera.project(p_camera)?,
            uv: sheet.texture_coordinates()[vertex],
            depth_mm: distance * rays[vertex].z,
        })
        .filter(|m| m.depth_mm.is_finite())
    };
    (0..rest.len()).map(measured).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::camera::training_camera;
    use crate::image::Picture;
    use crate::mesh::Template;

    #[test]
    fn the_projection_of_a_bent_sheet_tells_its_depths() {
        let blank = Picture::from_fn(30, 20, |_, _| [200; 3]);
        let template = Template::thin_shell(blank, 300.0, 200.0).unwrap();
        let sheet = template.mesh();
        let bent = |p: &DVec3| {
            let angle = p.x / 130.0;
            let (sin, cos) = 0.4_f64.sin_cos();
            let (x, z) = (130.0 * angle.sin(), 130.0 * (1.0 - angle.cos()));
            DVec3::new(cos * x + sin * z, p.y, 500.0 - sin * x + cos * z)
        };
        let truth: Vec<DVec3> = sheet.vertices().iter().map(bent).collect();
        // Other depths at the same pixels: they must not matter.
        let moved = |(k, p): (usize, &DVec3)| *p * (1.0 + 0.1 * (k as f64).sin());
        let seen: Vec<DVec3> = truth.iter().enumerate().map(moved).collect();
        let depths = differential_depths(sheet, &seen, &training_camera());
        let errors = depths.iter().zip(&truth);
        let errors: Vec<f64> = errors.map(|(m, p)| (m.unwrap().depth_mm - p.z).abs()).collect();
        let worst = errors.iter().copied().fold(0.0, f64::max);
        let mean = errors.iter().sum::<f64>() / errors.len() as f64;
        // At the border derivatives are one-sided.
        assert!(worst < 8.0 && mean < 0.6, "{worst} mm, {mean} mm");
    }
}
