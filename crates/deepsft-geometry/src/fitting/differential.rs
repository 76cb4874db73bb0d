//! Depth from the derivatives of a registration.

use super::measurements::Measurement;
use crate::camera::Camera;
use crate::mesh::TriangleMesh;
use glam::{DMat2, DVec2, DVec3};

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
