//! Z-buffered rasterisation of a triangle mesh: which triangle is seen at each sample position, and the
//! perspective-correct depth and texture coordinates there.

use super::depth_and_registration::Maps;
use crate::camera::Camera;
use crate::image::{ImageSize, Region};
use crate::mesh::TriangleMesh;
use glam::{DVec2, DVec3, Vec3};
use std::ops::Range;

/// Triangles with a corner nearer than this are not drawn, mm: closer than any camera focuses.
const NEAR_MM: f64 = 20.0;

/// A sample this far outside an edge (as a barycentric coordinate) still counts as covered, so that rounding
/// leaves no gap between two triangles. 1e-9 of a triangle is far below the accuracy of any map.
const EDGE_TOLERANCE: f64 = 1e-9;

/// An affine function of the image position in pixels: its changes to the right and down, and its value at the origin.
type Plane = DVec3;

fn at(plane: Plane, x: f64, y: f64) -> f64 {
    plane.x * x + plane.y * y + plane.z
}

/// A triangle in the image. Over a flat triangle 1/z, u/z and v/z are affine in the image position.
#[derive(Clone, Copy, Debug)]
pub struct ImageTriangle {
    corners: [DVec2; 3],
    barycentric: [Plane; 3],
    corner_depths: [f64; 3],
    inverse_depth: Plane,
    u_over_depth: Plane,
    v_over_depth: Plane,
    /// Corner normals divided by the corner's depth.
    normal_over_depth: [Vec3; 3],
    /// The printed side looks at the camera.
    pub front: bool,
}

/// What is seen at one image position of a triangle.
#[derive(Clone, Copy, Debug)]
pub struct SeenPoint {
    /// Camera-frame z, mm.
    pub depth_mm: f64,
    /// Texture coordinates, clamped to the unit square against rounding.
    pub uv: DVec2,
    /// Change of (u, v) for one pixel to the right.
    pub duv_dx: DVec2,
    /// Change of (u, v) for one pixel down.
    pub duv_dy: DVec2,
}

impl ImageTriangle {
    /// Depth in mm at an image position.
    pub fn depth_mm(&self, x: f64, y: f64) -> f64 {
        1.0 / at(self.inverse_depth, x, y)
    }

    /// Depth, texture coordinates and their change per pixel at an image position.
    pub fn seen_point(&self, x: f64, y: f64) -> SeenPoint {
        let depth_mm = self.depth_mm(x, y);
        let uv = DVec2::new(at(self.u_over_depth, x, y), at(self.v_over_depth, x, y)) * depth_mm;
        // d(u) = d(u/z z) = (d(u/z) - u d(1/z)) z
        let (u, v, w) = (self.u_over_depth, self.v_over_depth, self.inverse_depth);
        let change = |axis: usize| (DVec2::new(u[axis], v[axis]) - uv * w[axis]) * depth_mm;
        SeenPoint {
            depth_mm,
            uv: uv.clamp(DVec2::ZERO, DVec2::ONE),
            duv_dx: change(0),
            duv_dy: change(1),
        }
    }

    /// Weights of the face's corners for the point of the triangle at an image position; they sum to 1.
    pub fn barycentric(&self, x: f64, y: f64) -> [f64; 3] {
        let depth = self.depth_mm(x, y);
        [0, 1, 2].map(|k| at(self.barycentric[k], x, y) / self.corner_depths[k] * depth)
    }

    /// Interpolates the unit normal at an image position, turned to the camera's side when the back is seen.
    pub fn normal(&self, x: f64, y: f64) -> Vec3 {
        let mut normal = Vec3::ZERO;
        for (plane, corner) in self.barycentric.into_iter().zip(self.normal_over_depth) {
            normal += corner * at(plane, x, y) as f32;
        }
        let normal = normal.normalize_or(Vec3::NEG_Z);
        if self.front { normal } else { -normal }
    }
}

/// The triangles of `mesh`'s topology with its vertices at `vertices_camera` (mm), as the camera sees them,
/// with smooth normals. Index k belongs to face k; `None` where a face is too near, seen edge-on or
/// beyond what the lens sees.
fn project_mesh(mesh: &TriangleMesh, vertices_camera: &[DVec3], camera: &Camera) -> Vec<Option<ImageTriangle>> {
    let normals = mesh.normals_at(vertices_camera);
    let pixels: Vec<Option<DVec2>> = vertices_camera.iter().map(|&p| camera.project(p)).collect();
    let project = |face: &[usize; 3]| {
        let depth = face.map(|v| vertices_camera[v].z);
        let corners @ [a, b, c] = [pixels[face[0]]?, pixels[face[1]]?, pixels[face[2]]?];
        let area = (b - a).perp_dot(c - a);
        if area.abs() < 1e-9 || depth.iter().any(|&z| z < NEAR_MM) {
            return None;
        }
        let barycentric = [0, 1, 2].map(|k| {
            let (p, q) = (corners[(k + 1) % 3], corners[(k + 2) % 3]);
            DVec3::new(p.y - q.y, q.x - p.x, p.perp_dot(q)) / area
        });
        let interpolate = |value: [f64; 3]| -> Plane { (0..3).map(|k| barycentric[k] * value[k] / depth[k]).sum() };
        let uv = face.map(|v| mesh.texture_coordinates()[v]);
        Some(ImageTriangle {
            corners,
            barycentric,
            corner_depths: depth,
            inverse_depth: interpolate([1.0; 3]),
            u_over_depth: interpolate(uv.map(|t| t.x)),
            v_over_depth: interpolate(uv.map(|t| t.y)),
            normal_over_depth: [0, 1, 2].map(|k| (normals[face[k]] / depth[k]).as_vec3()),
            // Counter-clockwise from the front is a negative area where y points down.
            front: area < 0.0,
        })
    };
    mesh.faces().iter().map(project).collect()
}

/// The region of an image of `size` that some triangles can touch.
fn region_of(triangles: &[Option<ImageTriangle>], size: ImageSize) -> Region {
    let (mut low, mut high) = (DVec2::INFINITY, DVec2::NEG_INFINITY);
    for corner in triangles.iter().flatten().flat_map(|triangle| triangle.corners) {
        (low, high) = (low.min(corner), high.max(corner));
    }
    let range = |low: f64, high: f64, side: usize| {
        let end = high.ceil().clamp(0.0, side as f64) as usize;
        (low.floor().max(0.0) as usize).min(end)..end
    };
    Region::new(range(low.x, high.x, size.width), range(low.y, high.y, size.height))
}

/// The nearest triangle at one sample position in every pixel of a region.
#[derive(Debug)]
pub struct Visibility {
    region: Region,
    offset: DVec2,
    /// Triangle index of each pixel of the region, [`Visibility::NONE`] where nothing is seen.
    triangle: Vec<u32>,
    inverse_depth: Vec<f32>,
}

impl Visibility {
    /// No triangle.
    const NONE: u32 = u32::MAX;

    /// Rasterises at position `offset` in every pixel ((0.5, 0.5) is the centre).
    pub fn new(triangles: &[Option<ImageTriangle>], region: &Region, offset: DVec2) -> Self {
        let pixels = region.area();
        let mut visibility = Self {
            region: *region,
            offset,
            triangle: vec![Self::NONE; pixels],
            inverse_depth: vec![0.0; pixels],
        };
        for (index, triangle) in triangles.iter().enumerate() {
            if let Some(triangle) = triangle {
                visibility.draw(index as u32, triangle);
            }
        }
        visibility
    }

    fn draw(&mut self, index: u32, triangle: &ImageTriangle) {
        let [a, b, c] = triangle.corners;
        let low = a.min(b).min(c).y - self.offset.y;
        let high = a.max(b).max(c).y - self.offset.y;
        for row in whole_numbers(low, high, &self.region.rows()) {
            let y = row as f64 + self.offset.y;
            // The columns in which all three barycentric coordinates are positive.
            let (mut first, mut last) = (f64::NEG_INFINITY, f64::INFINITY);
            for plane in &triangle.barycentric {
                let at_left = plane.y * y + plane.z + EDGE_TOLERANCE;
                if plane.x > 0.0 {
                    first = first.max(-at_left / plane.x);
                } else if plane.x < 0.0 {
                    last = last.min(-at_left / plane.x);
                } else if at_left < 0.0 {
                    last = f64::NEG_INFINITY;
                }
            }
            let start = (row - self.region.top) * self.region.width;
            for column in whole_numbers(first - self.offset.x, last - self.offset.x, &self.region.columns()) {
                let inverse_depth = at(triangle.inverse_depth, column as f64 + self.offset.x, y) as f32;
                let pixel = start + column - self.region.left;
                if inverse_depth > self.inverse_depth[pixel] {
                    self.inverse_depth[pixel] = inverse_depth;
                    self.triangle[pixel] = index;
                }
            }
        }
    }

    /// Index of the triangle seen at the sample of the region's pixel `index`.
    pub fn triangle(&self, index: usize) -> Option<usize> {
        let triangle = self.triangle[index];
        (triangle != Self::NONE).then_some(triangle as usize)
    }

    /// Image position of the sample of a pixel.
    pub fn position(&self, column: usize, row: usize) -> DVec2 {
        DVec2::new(column as f64, row as f64) + self.offset
    }
}

/// The surface of a mesh that a camera sees at its pixel centres.
#[derive(Debug)]
pub struct VisibleSurface {
    triangles: Vec<Option<ImageTriangle>>,
    centres: Visibility,
    camera: Camera,
}

impl VisibleSurface {
    /// Projects `mesh` with its vertices at `vertices_camera` (mm) and finds what each pixel centre sees.
    pub fn new(mesh: &TriangleMesh, vertices_camera: &[DVec3], camera: &Camera) -> Self {
        let triangles = project_mesh(mesh, vertices_camera, camera);
        let region = region_of(&triangles, camera.size());
        Self {
            centres: Visibility::new(&triangles, &region, DVec2::splat(0.5)),
            triangles,
            camera: *camera,
        }
    }

    /// The camera.
    pub fn camera(&self) -> &Camera {
        &self.camera
    }

    /// The triangles, one per face; `None` where a face is too near, seen edge-on or
    /// beyond what the lens sees.
    pub fn triangles(&self) -> &[Option<ImageTriangle>] {
        &self.triangles
    }

    /// The part of the image that the mesh can touch.
    pub fn region(&self) -> &Region {
        &self.centres.region
    }

    /// What the pixel centres of the region see.
    pub fn centres(&self) -> &Visibility {
        &self.centres
    }

    /// The triangle seen at the centre of the pixel that holds an image position.
    pub fn triangle_at(&self, position: DVec2) -> Option<&ImageTriangle> {
        let index = self.region().index(position.x as usize, position.y as usize)?;
        self.triangles[self.centres.triangle(index)?].as_ref()
    }

    /// The pixels (column, row) whose centre sees the front, with the face they see and its triangle. Where the back
    /// is nearer nothing is seen.
    pub fn front(&self) -> impl Iterator<Item = (usize, usize, usize, &ImageTriangle)> {
        self.region().pixels().enumerate().filter_map(|(index, (column, row))| {
            let face = self.centres.triangle(index)?;
            let triangle = self.triangles[face].as_ref()?;
            triangle.front.then_some((column, row, face, triangle))
        })
    }

    /// Exact depth and registration of the front at the pixel centres.
    pub fn maps(&self) -> Maps {
        let width = self.camera.size().width;
        let mut maps = Maps::empty(self.camera.size());
        for (column, row, _, triangle) in self.front() {
            let (pixel, at) = (row * width + column, self.centres.position(column, row));
            let point = triangle.seen_point(at.x, at.y);
            maps.set(pixel, point.depth_mm as f32, point.uv.as_vec2().to_array());
        }
        maps
    }
}

/// The whole numbers from `low` to `high`, both included, that lie in `range`.
fn whole_numbers(low: f64, high: f64, range: &Range<usize>) -> Range<usize> {
    // Through i32: rounding and conversions to usize are calls on plain x86-64.
    let floor = low.max(0.0) as i32;
    let start = floor.saturating_add((f64::from(floor) < low).into());
    let end = if high < 0.0 { 0 } else { (high as i32).saturating_add(1) };
    (start as usize).max(range.start)..(end as usize).min(range.end)
}
