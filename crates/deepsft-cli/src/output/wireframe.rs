//! A sheet's mesh drawn over the picture it was found in.

use super::canvas::Canvas;
use deepsft_geometry::glam::{DVec2, DVec3};
use deepsft_geometry::{Camera, Picture, Template};

/// Colours of lines that the image does not confirm, and that it confirms fully.
const DOUBTFUL: [f64; 3] = [235.0, 40.0, 60.0];
const CERTAIN: [f64; 3] = [60.0, 245.0, 110.0];

/// Lines that reach farther outside the picture than this many of its sides are left out.
const FARTHEST: f64 = 4.0;

/// `picture` (of `camera`) with the lines of the template's grid (of a mesh: its edges) at `vertices_camera` (mm), from red to
/// green with their `confidence` (0 to 1, one per vertex; all 1 when there are none).
pub fn wireframe(
    picture: &Picture,
    camera: &Camera,
    template: &Template,
    vertices_camera: &[DVec3],
    confidence: &[f32],
) -> Picture {
    let mut canvas = Canvas::of(picture);
    let size = picture.size().as_dvec2();
    let pixels: Vec<Option<DVec2>> = vertices_camera
        .iter()
        .map(|p| {
            let near = |pixel: &DVec2| (pixel.abs() / size).max_element() < FARTHEST;
            camera.project(*p).filter(near)
        })
        .collect();
    let mut line = |a: usize, b: usize| {
        let (Some(Some(from)), Some(Some(to))) = (pixels.get(a), pixels.get(b)) else {
            return;
        };
        let sure = |vertex: usize| confidence.get(vertex).map_or(1.0, |c| f64::from(*c));
        let certainty = f64::midpoint(sure(a), sure(b)).clamp(0.0, 1.0);
        let color = std::array::from_fn(|k| (DOUBTFUL[k] + certainty * (CERTAIN[k] - DOUBTFUL[k])) as u8);
        canvas.line(&[(from.x, from.y), (to.x, to.y)], 1.0, color);
    };
    let Some((columns, rows)) = template.grid() else {
        template.mesh().edges().into_iter().for_each(|[a, b]| line(a, b));
        return canvas.into_picture();
    };
    for j in 0..rows {
        for i in 0..columns {
            let vertex = j * columns + i;
            if i + 1 < columns {
                line(vertex, vertex + 1);
            }
            if j + 1 < rows {
                line(vertex, vertex + columns);
            }
        }
    }
    canvas.into_picture()
}
