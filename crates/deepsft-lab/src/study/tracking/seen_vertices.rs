//! Which vertices of a mesh a camera sees.

use deepsft_geometry::glam::{DVec2, DVec3};
use deepsft_geometry::{Camera, Maps, Template};

/// The vertices that are seen: inside the image, where `truth` has the vertex's own texture coordinates.
pub fn seen_vertices(template: &Template, vertices_camera: &[DVec3], truth: &Maps, camera: &Camera) -> Vec<bool> {
    // About half the way to the next vertex.
    let near = match template.grid() {
        Some((columns, rows)) => DVec2::new(0.5 / (columns - 1) as f64, 0.5 / (rows - 1) as f64),
        None => DVec2::splat(0.5 / (template.mesh().vertices().len() as f64).sqrt()),
    };
    vertices_camera
        .iter()
        .zip(template.mesh().texture_coordinates())
        .map(|(p, uv)| {
            let Some(pixel) = camera.project(*p).map(DVec2::floor) else {
                return false;
            };
            let inside = pixel.cmpge(DVec2::ZERO).all()
                && pixel.x < camera.size().width as f64
                && pixel.y < camera.size().height as f64;
            if !inside {
                return false;
            }
            let at = pixel.y as usize * truth.size().width + pixel.x as usize;
            let [u, v] = truth.registration()[at].map(f64::from);
            truth.inside(at) && ((DVec2::new(u, v) - *uv).abs() / near).max_element() < 1.0
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use deepsft_geometry::{Picture, training_camera};
    use deepsft_synth::{SynthConfig, Synthesizer};

    #[test]
    fn of_a_flat_sheet_all_vertices_are_seen_and_half_of_them_where_half_of_it_is() {
        let texture = Picture::from_fn(30, 20, |x, y| [(8 * x) as u8, (12 * y) as u8, 90]);
        let template = Template::thin_shell(texture, 300.0, 200.0).unwrap();
        let vertices: Vec<DVec3> = template
            .mesh()
            .vertices()
            .iter()
            .map(|p| *p + DVec3::Z * 500.0)
            .collect();
        let synthesizer = Synthesizer::new(&template, SynthConfig::default()).unwrap();
        let whole = synthesizer.render_clean(vertices.clone()).unwrap().truth;
        let mut half = whole.clone();
        (0..480 * 270)
            .filter(|pixel| pixel % 480 >= 240)
            .for_each(|pixel| half.clear(pixel));
        let seen = |truth: &Maps| {
            let seen = seen_vertices(&template, &vertices, truth, &training_camera());
            seen.iter().filter(|seen| **seen).count() as f64 / vertices.len() as f64
        };
        // Vertices on the outline may fall on the pixel beside it.
        assert!(seen(&whole) > 0.85, "{}", seen(&whole));
        assert!((0.4..0.55).contains(&seen(&half)), "{}", seen(&half));
    }
}
