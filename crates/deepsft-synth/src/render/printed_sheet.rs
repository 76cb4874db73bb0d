//! A bent printed sheet in the image: its picture with antialiased edges, and what a depth camera sees of it.

use crate::render::frame::Frame;
use crate::render::shading::{Lighting, Paper};
use crate::render::texture::Texture;
use deepsft_geometry::glam::{DVec2, Vec3};
use deepsft_geometry::raster::{Visibility, VisibleSurface};

/// Sample positions of antialiasing: the rotated grid, in which no two share a row or a column.
const SUBSAMPLES: [DVec2; 4] = [
    DVec2::new(0.375, 0.125),
    DVec2::new(0.875, 0.375),
    DVec2::new(0.125, 0.625),
    DVec2::new(0.625, 0.875),
];

/// Depths of two samples of a pixel that differ by less than this fraction from one plane are one surface.
const SAME_SURFACE: f64 = 0.004;

/// Calls `each(row-major pixel, depth in mm, cosine of the angle of incidence)` for every pixel whose centre sees `sheet`,
/// front or back.
pub(crate) fn each_seen(sheet: &VisibleSurface, mut each: impl FnMut(usize, f64, f64)) {
    let (width, centres) = (sheet.camera().size().width, sheet.centres());
    for (index, (column, row)) in sheet.region().pixels().enumerate() {
        let triangle = centres
            .triangle(index)
            .and_then(|face| sheet.triangles()[face].as_ref());
        let Some(triangle) = triangle else { continue };
        let at = centres.position(column, row);
        let ray = sheet.camera().ray_from_pixel(at).extend(1.0).normalize();
        let cosine = -triangle.normal(at.x, at.y).as_dvec3().dot(ray);
        each(row * width + column, triangle.depth_mm(at.x, at.y), cosine);
    }
}

/// Paints `sheet` over `frame`: the texture on the front, blank paper on the back. Pixels inside a surface are
/// shaded once with a filtered texture, pixels on an outline once a subsample.
pub(crate) fn paint_sheet(
    sheet: &VisibleSurface,
    frame: &mut Frame,
    texture: &Texture,
    paper: &Paper,
    light: &Lighting,
) {
    let subsamples = SUBSAMPLES.map(|offset| Visibility::new(sheet.triangles(), sheet.region(), offset));
    let shade = |index: usize, at: DVec2| match &sheet.triangles()[index] {
        Some(triangle) => {
            let albedo = if triangle.front {
                let point = triangle.seen_point(at.x, at.y);
                let (duv_dx, duv_dy) = (point.duv_dx.as_vec2(), point.duv_dy.as_vec2());
                texture.anisotropic(point.uv.as_vec2(), duv_dx, duv_dy) * paper.white
            } else {
                paper.back
            };
            let ray = sheet.camera().ray_from_pixel(at).as_vec2();
            light.paper(paper, albedo, triangle.normal(at.x, at.y), ray)
        }
        None => Vec3::ZERO,
    };
    for (index, (column, row)) in sheet.region().pixels().enumerate() {
        let seen = [0, 1, 2, 3].map(|k| subsamples[k].triangle(index));
        if seen.iter().all(Option::is_none) {
            continue;
        }
        let pixel = row * frame.width + column;
        let at = |k: usize| subsamples[k].position(column, row);
        let color = match sheet.centres().triangle(index) {
            Some(centre) if one_surface(sheet, centre, seen, at) => {
                shade(centre, sheet.centres().position(column, row))
            }
            _ => {
                let behind = frame.color(pixel);
                let one = |k: usize| seen[k].map_or(behind, |triangle| shade(triangle, at(k)));
                (0..4).map(one).sum::<Vec3>() / 4.0
            }
        };
        frame.set(pixel, color);
    }
}

/// Whether all subsamples see the surface that the centre sees.
fn one_surface(sheet: &VisibleSurface, centre: usize, seen: [Option<usize>; 4], at: impl Fn(usize) -> DVec2) -> bool {
    seen.iter().enumerate().all(|(k, &index)| {
        let Some(index) = index else { return false };
        if index == centre {
            return true;
        }
        let (Some(here), Some(there)) = (&sheet.triangles()[centre], &sheet.triangles()[index]) else {
            return false;
        };
        let at = at(k);
        let (a, b) = (here.depth_mm(at.x, at.y), there.depth_mm(at.x, at.y));
        here.front == there.front && (a - b).abs() < SAME_SURFACE * b
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use deepsft_geometry::glam::DVec3;
    use deepsft_geometry::{Maps, Picture, Template, training_camera};

    fn sheet(texture: Picture) -> Template {
        Template::thin_shell(texture, 297.0, 210.0).unwrap()
    }

    /// The sheet with each vertex moved.
    fn paint(template: &Template, moved: impl Fn(&DVec3) -> DVec3) -> (Frame, Maps) {
        let vertices: Vec<DVec3> = template.mesh().vertices().iter().map(moved).collect();
        let sheet = VisibleSurface::new(template.mesh(), &vertices, &training_camera());
        let mut frame = Frame::filled(480, 270, Vec3::ZERO);
        let texture = Texture::new(template.texture());
        paint_sheet(&sheet, &mut frame, &texture, &Paper::matt(), &Lighting::frontal());
        (frame, sheet.maps())
    }

    #[test]
    fn the_back_is_blank_occludes_and_is_outside_the_object() {
        let template = sheet(Picture::from_fn(1, 1, |_, _| [255, 0, 0]));
        // Turned about the vertical axis: only the back is seen.
        let (frame, maps) = paint(&template, |p| DVec3::new(-p.x, p.y, -p.z + 500.0));
        assert_eq!(maps.area(), 0);
        assert!((frame.color(135 * 480 + 240) - Vec3::splat(0.75)).length() < 1e-5);
        // Folded over: the right half lies before the left half with its back to the camera.
        let folded = |p: &DVec3| DVec3::new(-p.x.abs(), p.y, 500.0 - if p.x > 0.0 { 10.0 } else { 0.0 });
        let (frame, maps) = paint(&template, folded);
        assert!(!maps.inside(135 * 480 + 180));
        assert!((frame.color(135 * 480 + 180) - Vec3::splat(0.75)).length() < 1e-5);
    }

    #[test]
    fn an_edge_through_a_pixel_is_blended_by_its_coverage() {
        let template = sheet(Picture::from_fn(1, 1, |_, _| [255; 3]));
        // At z = 380 a mm is a pixel: the left edge lies at 240 - 148.5 = 91.5, half of pixel 91 is covered.
        let (frame, _) = paint(&template, |p| *p + DVec3::Z * 380.0);
        assert!((frame.color(135 * 480 + 91).x - 0.5).abs() < 1e-6);
        assert!(frame.color(135 * 480 + 90).x == 0.0 && (frame.color(135 * 480 + 92).x - 1.0).abs() < 1e-6);
    }
}
