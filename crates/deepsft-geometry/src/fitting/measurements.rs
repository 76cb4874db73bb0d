//! From what a finder says to measurements: registered points with depth.

use crate::camera::Camera;
use crate::maps::Maps;
use crate::mesh::{Template, TriangleMesh};
use glam::{DVec2, DVec3};

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
