//! A bent printed sheet in the image: its exact maps, and its picture with antialiased edges.

use crate::render::frame::Frame;
use crate::render::shading::{Lighting, Paper};
use crate::render::texture::Texture;
use deepsft_geometry::glam::{DVec2, DVec3, Vec3};
use deepsft_geometry::raster::{ImageTriangle, Visibility, VisibleSurface};
use deepsft_geometry::{Camera, Maps, TriangleMesh};

/// Sample positions of antialiasing: the rotated grid, in which no two share a row or a column.
const SUBSAMPLES: [DVec2; 4] = [
    DVec2::new(0.375, 0.125),
    DVec2::new(0.875, 0.375),
    DVec2::new(0.125, 0.625),
    DVec2::new(0.625, 0.875),
];

/// Depths of two samples of a pixel that differ by less than this fraction from one plane are one surface.
const SAME_SURFACE: f64 = 0.004;

/// A mesh as the camera sees it.
pub(crate) struct ProjectedMesh(VisibleSurface);

impl ProjectedMesh {
    /// Projects `mesh` with its vertices at `vertices_camera` (mm) and finds what each pixel centre sees.
    pub(crate) fn new(mesh: &TriangleMesh, vertices_camera: &[DVec3], camera: &Camera) -> Self {
        Self(VisibleSurface::new(mesh, vertices_camera, camera))
    }

    /// Exact depth and registration of the front at the pixel centres.
    pub(crate) fn maps(&self) -> Maps {
        self.0.maps()
    }

    /// Calls `each(row-major pixel, depth in mm, cosine of the angle of incidence)` for every pixel whose centre sees the
    /// sheet, front or back.
    pub(crate) fn each_seen(&self, mut each: impl FnMut(usize, f64, f64)) {
        let width = self.0.camera().size().width;
        for (index, (column, row)) in self.0.region().pixels().enumerate() {
            let triangle = self
                .0
                .centres()
                .triangle(index)
                .and_then(|face| self.0.triangles()[face].as_ref());
            let Some(triangle) = triangle else { continue };
            let at = self.0.centres().position(column, row);
            let ray = self.0.camera().ray_from_pixel(at).extend(1.0).normalize();
            let cosine = -triangle.normal(at.x, at.y).as_dvec3().dot(ray);
            each(row * width + column, triangle.depth_mm(at.x, at.y), cosine);
        }
    }

    /// Number of pixels whose centre sees the front and for which `counts(column, row)` holds.
    pub(crate) fn front_area(&self, counts: impl Fn(usize, usize) -> bool) -> usize {
        self.0.front().filter(|&(column, row, ..)| counts(column, row)).count()
    }

    /// Paints the sheet over `frame`: the texture on the front, blank paper on the back. Pixels inside a surface are
    /// shaded once with a filtered texture, pixels on an outline once a subsample.
    pub(crate) fn paint(&self, frame: &mut Frame, texture: &Texture, paper: &Paper, light: &Lighting) {
        let subsamples = SUBSAMPLES.map(|offset| Visibility::new(self.0.triangles(), self.0.region(), offset));
        let shade = |index: usize, at: DVec2| match &self.0.triangles()[index] {
            Some(triangle) => self.shade(triangle, at, texture, paper, light),
            None => Vec3::ZERO,
        };
        for (index, (column, row)) in self.0.region().pixels().enumerate() {
            let seen = [0, 1, 2, 3].map(|k| subsamples[k].triangle(index));
            if seen.iter().all(Option::is_none) {
                continue;
            }
            let pixel = row * frame.width + column;
            let at = |k: usize| subsamples[k].position(column, row);
            let color = match self.0.centres().triangle(index) {
                Some(centre) if self.one_surface(centre, seen, at) => {
                    shade(centre, self.0.centres().position(column, row))
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
    fn one_surface(&self, centre: usize, seen: [Option<usize>; 4], at: impl Fn(usize) -> DVec2) -> bool {
        seen.iter().enumerate().all(|(k, &index)| {
            let Some(index) = index else { return false };
            if index == centre {
                return true;
            }
            let (Some(here), Some(there)) = (&self.0.triangles()[centre], &self.0.triangles()[index]) else {
                return false;
            };
            let at = at(k);
            let (a, b) = (here.depth_mm(at.x, at.y), there.depth_mm(at.x, at.y));
            here.front == there.front && (a - b).abs() < SAME_SURFACE * b
        })
    }

    fn shade(&self, triangle: &ImageTriangle, at: DVec2, texture: &Texture, paper: &Paper, light: &Lighting) -> Vec3 {
        let albedo = if triangle.front {
            let point = triangle.seen_point(at.x, at.y);
            let (duv_dx, duv_dy) = (point.duv_dx.as_vec2(), point.duv_dy.as_vec2());
            texture.anisotropic(point.uv.as_vec2(), duv_dx, duv_dy) * paper.white
        } else {
            paper.back
        };
        light.paper(
            paper,
            albedo,
            triangle.normal(at.x, at.y),
            self.0.camera().ray_from_pixel(at).as_vec2(),
        )
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use deepsft_geometry::{Picture, Template, training_camera};

    fn sheet(texture: Picture) -> Template {
        Template::thin_shell(texture, 297.0, 210.0).unwrap()
    }

    fn paint(template: &Template, vertices: &[DVec3]) -> (Frame, Maps) {
        let sheet = ProjectedMesh::new(template.mesh(), vertices, &training_camera());
        let mut frame = Frame::filled(480, 270, Vec3::ZERO);
        sheet.paint(
            &mut frame,
            &Texture::new(template.texture()),
            &Paper::matt(),
            &Lighting::frontal(),
        );
        (frame, sheet.maps())
    }

    #[test]
    fn the_back_is_blank_occludes_and_is_outside_the_object() {
        let template = sheet(Picture::from_fn(1, 1, |_, _| [255, 0, 0]));
        // Turned about the vertical axis: only the back is seen.
        let turned: Vec<DVec3> = template
            .mesh()
            .vertices()
            .iter()
            .map(|p| DVec3::new(-p.x, p.y, -p.z + 500.0))
            .collect();
        let (frame, maps) = paint(&template, &turned);
        assert_eq!(maps.area(), 0);
        assert!((frame.color(135 * 480 + 240) - Vec3::splat(0.75)).length() < 1e-5);
        // Folded over: the right half lies before the left half with its back to the camera.
        let folded: Vec<DVec3> = template
            .mesh()
            .vertices()
            .iter()
            .map(|p| DVec3::new(-p.x.abs(), p.y, 500.0 - if p.x > 0.0 { 10.0 } else { 0.0 }))
            .collect();
        let (frame, maps) = paint(&template, &folded);
        assert!(!maps.inside(135 * 480 + 180));
        assert!((frame.color(135 * 480 + 180) - Vec3::splat(0.75)).length() < 1e-5);
    }

    #[test]
    fn an_edge_through_a_pixel_is_blended_by_its_coverage() {
        let template = sheet(Picture::from_fn(1, 1, |_, _| [255; 3]));
        // At z = 380 a mm is a pixel: the left edge lies at 240 - 148.5 = 91.5, half of pixel 91 is covered.
        let vertices: Vec<DVec3> = template
            .mesh()
            .vertices()
            .iter()
            .map(|p| *p + DVec3::Z * 380.0)
            .collect();
        let (frame, _) = paint(&template, &vertices);
        assert!((frame.color(135 * 480 + 91).x - 0.5).abs() < 1e-6);
        assert!(frame.color(135 * 480 + 90).x == 0.0 && (frame.color(135 * 480 + 92).x - 1.0).abs() < 1e-6);
    }
}
