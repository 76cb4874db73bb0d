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
        let width = self.0.camera().width() as usize;
        for (index, column, row) in self.0.window().pixels() {
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
        let subsamples = SUBSAMPLES.map(|offset| Visibility::new(self.0.triangles(), self.0.window(), offset));
        let shade = |index: usize, at: DVec2| match &self.0.triangles()[index] {
            Some(triangle) => self.shade(triangle, at, texture, paper, light),
            None => Vec3::ZERO,
        };
        for (index, column, row) in self.0.window().pixels() {
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
    fn a_tilted_plane_has_the_depth_and_registration_of_the_ray_plane_intersection() {
        let template = sheet(Picture::from_fn(1, 1, |_, _| [255; 3]));
        let camera = training_camera();
        let (right, down) = (DVec3::new(0.8, 0.1, 0.5).normalize(), DVec3::new(-0.3, 0.9, 0.3));
        let down = (down - right * down.dot(right)).normalize();
        let origin = DVec3::new(10.0, -5.0, 480.0);
        let vertices: Vec<DVec3> = template
            .mesh()
            .vertices()
            .iter()
            .map(|p| origin + right * p.x + down * p.y)
            .collect();
        let (_, maps) = paint(&template, &vertices);
        let normal = right.cross(down);
        let mut inside = 0;
        for pixel in 0..480 * 270 {
            let ray = camera
                .ray_from_pixel(DVec2::new((pixel % 480) as f64 + 0.5, (pixel / 480) as f64 + 0.5))
                .extend(1.0);
            let depth = origin.dot(normal) / ray.dot(normal);
            let offset = ray * depth - origin;
            let uv = DVec2::new(offset.dot(right) / 297.0 + 0.5, offset.dot(down) / 210.0 + 0.5);
            let margin = (0.5 - (uv - 0.5).abs()).min_element();
            if margin.abs() > 1e-6 {
                assert_eq!(maps.inside(pixel), margin > 0.0, "pixel {pixel}, uv {uv}");
            }
            if maps.inside(pixel) {
                inside += 1;
                // f32 maps: half a unit in the last place of 512..1024 mm is 3e-5 mm, of 0.5..1 is 3e-8.
                assert!((f64::from(maps.depth()[pixel]) - depth).abs() < 1e-4);
                let seen = maps.registration()[pixel];
                assert!((f64::from(seen[0]) - uv.x).abs() < 1e-6 && (f64::from(seen[1]) - uv.y).abs() < 1e-6);
            }
        }
        assert!(inside > 10_000);
    }

    #[test]
    fn a_cylinder_has_the_depth_and_registration_of_the_ray_cylinder_intersection() {
        let template = sheet(Picture::from_fn(1, 1, |_, _| [255; 3]));
        let (columns, _) = template.grid().unwrap();
        let camera = training_camera();
        // Bent about an upright axis at x = 0, z = 500 + R, convex towards the camera.
        let (radius, near) = (120.0, 400.0);
        let bend = |p: DVec3| {
            DVec3::new(
                radius * (p.x / radius).sin(),
                p.y,
                near + radius * (1.0 - (p.x / radius).cos()),
            )
        };
        let vertices: Vec<DVec3> = template.mesh().vertices().iter().map(|&p| bend(p)).collect();
        let (_, maps) = paint(&template, &vertices);
        // A facet of angle a lies at most R (1 - cos(a/2)) inside the cylinder; along a ray that meets the surface at
        // cosine c to the normal, the depth differs by at most that over c. The arc position of the chord differs by
        // at most (the same sagitta) tan + a cubic term.
        let facet = 297.0 / (columns - 1) as f64 / radius;
        let sagitta = radius * (1.0 - (facet / 2.0).cos());
        let mut worst = 0.0_f64;
        let mut checked = 0;
        for pixel in 0..480 * 270 {
            if !maps.inside(pixel) {
                continue;
            }
            let ray = camera.ray_from_pixel(DVec2::new((pixel % 480) as f64 + 0.5, (pixel / 480) as f64 + 0.5));
            // (x d)^2 + (d - near - R)^2 = R^2, the nearer root.
            let (a, b, c) = (
                ray.x * ray.x + 1.0,
                near + radius,
                (near + radius) * (near + radius) - radius * radius,
            );
            let root = b * b - a * c;
            if root < 0.0 {
                continue;
            }
            let depth = (b - root.sqrt()) / a;
            let angle = (ray.x * depth / radius).asin();
            let normal = DVec2::new(-angle.sin(), angle.cos());
            let cosine = normal.dot(DVec2::new(ray.x, 1.0).normalize());
            if cosine < 0.4 {
                continue; // grazing: the bound is of no use there
            }
            checked += 1;
            let bound = sagitta / cosine + 1e-3;
            let error = f64::from(maps.depth()[pixel]) - depth;
            assert!(error.abs() < bound, "depth {depth} off by {error}, bound {bound}");
            let arc = f64::from(maps.registration()[pixel][0]) - (radius * angle / 297.0 + 0.5);
            let slip = sagitta * (1.0 / (cosine * cosine) - 1.0).sqrt() + radius * facet.powi(3) / 12.0;
            assert!(
                arc.abs() * 297.0 < slip + 1e-3,
                "arc off by {} mm, bound {slip}",
                arc * 297.0
            );
            let v = ray.y * depth / 210.0 + 0.5;
            assert!((f64::from(maps.registration()[pixel][1]) - v).abs() * 210.0 < ray.y.abs() * bound + 1e-3);
            worst = worst.max(error.abs());
        }
        assert!(checked > 15_000, "{checked}");
        // The bound is met but not idle: the middle of a facet reaches the sagitta.
        assert!(worst > 0.5 * sagitta, "{worst} of {sagitta}");
    }

    #[test]
    fn the_sheet_is_not_mirrored_the_first_texel_is_at_the_top_left() {
        // Red top left, green top right, blue bottom left, white bottom right.
        let corner = |x: usize, y: usize| [[255, 0, 0], [0, 255, 0], [0, 0, 255], [255; 3]][x / 32 + 2 * (y / 32)];
        let template = sheet(Picture::from_fn(64, 64, corner));
        let vertices: Vec<DVec3> = template
            .mesh()
            .vertices()
            .iter()
            .map(|p| *p + DVec3::Z * 500.0)
            .collect();
        let (frame, maps) = paint(&template, &vertices);
        let picture = frame.to_picture();
        // f / z = 0.76 px/mm: the sheet spans 240 +- 112.9, 135 +- 79.8 px.
        assert_eq!(picture.pixel(135, 60), [255, 0, 0]);
        assert_eq!(picture.pixel(345, 60), [0, 255, 0]);
        assert_eq!(picture.pixel(135, 210), [0, 0, 255]);
        assert_eq!(picture.pixel(345, 210), [255; 3]);
        let [u, v] = maps.registration()[60 * 480 + 135];
        // ((135.5 - 240) / 0.76 / 297 + 0.5, (60.5 - 135) / 0.76 / 210 + 0.5)
        assert!((u - 0.037_037).abs() < 1e-4 && (v - 0.033_208).abs() < 1e-4, "{u} {v}");
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

    #[test]
    fn what_is_too_near_or_behind_the_camera_is_not_drawn() {
        let template = sheet(Picture::from_fn(1, 1, |_, _| [255; 3]));
        for z in [-500.0, 0.0, 5.0] {
            let vertices: Vec<DVec3> = template.mesh().vertices().iter().map(|p| *p + DVec3::Z * z).collect();
            let (frame, maps) = paint(&template, &vertices);
            assert_eq!(maps.area(), 0);
            assert!(frame.rgb.iter().all(|&v| v == 0.0));
        }
    }
}
