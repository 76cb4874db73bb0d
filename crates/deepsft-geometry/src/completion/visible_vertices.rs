//! From maps to the vertices they show.

use super::visible_points::VertexPoint;
use crate::camera::Camera;
use crate::error::{GeometryError, check_size};
use crate::image::ImageSize;
use crate::maps::{Maps, erode};
use crate::mesh::{TextureGrid, TriangleMesh, texture_barycentric};
use glam::{DVec2, DVec3};

/// Three neighbouring pixels whose distances on the template and in space differ by more than this factor are not
/// neighbours on the surface: they lie on both sides of a fold or of another object's edge, or are blunders.
const MAX_STRETCH: f64 = 2.0;

/// How far outside a triangle of pixels a vertex may lie, in widths of the triangle: the outermost vertices of a
/// print lie up to a pixel beyond the last pixel's centre.
const EXTRAPOLATION: f64 = 1.0;

/// A triangle of pixels that reaches over more cells than this, a sixth of the texture, is a break of the registration.
const MAX_CELLS: usize = 11;

/// Finds the vertices of a template that maps show, and where: the registration map is inverted between pixels.
///
/// A vertex is visible when three neighbouring pixels of the object enclose its texture coordinate (at the
/// object's edge: almost enclose it), show the front, and are as far apart in space as on the template,
/// up to a factor of 2. Pixels whose depth or registration is not finite count as outside. Charts of the
/// texture must not overlap. The template may be closed and have several charts; a vertex on a seam is found once per chart.
///
/// ```
/// use deepsft_geometry::glam::DVec3;
/// use deepsft_geometry::raster::VisibleSurface;
/// use deepsft_geometry::{Picture, Template, VisibleVertices, training_camera};
/// let template = Template::thin_shell(Picture::from_fn(1, 1, |_, _| [0; 3]), 297.0, 210.0)?;
/// let camera = training_camera();
/// let posed: Vec<_> = template.mesh().vertices().iter().map(|p| p + 600.0 * DVec3::Z).collect();
/// let maps = VisibleSurface::new(template.mesh(), &posed, &camera).maps();
/// let found = VisibleVertices::new(template.mesh(), 0).find(&maps, &camera)?;
/// assert_eq!(found.len(), posed.len());
/// assert!(found.iter().all(|point| point.p_camera.distance(posed[point.vertex]) < 0.01));
/// # Ok::<(), deepsft_geometry::GeometryError>(())
/// ```
#[derive(Clone, Debug)]
pub struct VisibleVertices {
    vertices: Vec<ChartVertex>,
    /// Indices into `vertices`.
    grid: TextureGrid,
    margin_px: usize,
}

#[derive(Clone, Copy, Debug)]
struct ChartVertex {
    vertex: usize,
    uv: DVec2,
    /// First fundamental form of the rest surface around it: entries uu, uv, vv.
    metric: [f64; 3],
    /// Whether the chart is a mirror image of the surface.
    mirrored: bool,
}

struct PixelTriangle {
    uv: [DVec2; 3],
    p_camera: [DVec3; 3],
    /// Twice the area in the texture, with sign.
    area: f64,
}

impl VisibleVertices {
    /// Prepares for `template` (the rest shape). Pixels within `margin_px` pixels of the outside of the object are not
    /// used: networks mix there what lies on both sides. 0 for exact maps.
    pub fn new(template: &TriangleMesh, margin_px: usize) -> Self {
        let vertices = chart_vertices(template);
        let mut grid = TextureGrid::new();
        for (index, vertex) in vertices.iter().enumerate() {
            grid.insert(vertex.uv, vertex.uv, index);
        }
        Self {
            vertices,
            grid,
            margin_px,
        }
    }

    /// The visible vertices, ascending, each once, with weight 1. None is a valid answer.
    ///
    /// # Errors
    /// [`GeometryError::MapSize`] when the maps are not of the camera's size.
    pub fn find(&self, maps: &Maps, camera: &Camera) -> Result<Vec<VertexPoint>, GeometryError> {
        check_size(maps.size(), camera.size())?;
        let ImageSize { width, height } = maps.size();
        let points = self.points(maps, camera);
        // Score and point of each chart vertex.
        let mut best: Vec<Option<(f64, DVec3)>> = vec![None; self.vertices.len()];
        let corner = |x: usize, y: usize| {
            let pixel = y * width + x;
            points[pixel].map(|p| (maps.uv(pixel), p))
        };
        for y in 0..height.saturating_sub(1) {
            for x in 0..width.saturating_sub(1) {
                // Both halves of the square, turning the same way in the image.
                let square = [corner(x, y), corner(x + 1, y), corner(x + 1, y + 1), corner(x, y + 1)];
                for halves in [[0, 1, 2], [0, 2, 3]] {
                    if let [Some(a), Some(b), Some(c)] = halves.map(|k| square[k]) {
                        self.match_triangle(&PixelTriangle::new([a, b, c]), &mut best);
                    }
                }
            }
        }
        let found = |(vertex, best): (&ChartVertex, Option<(f64, DVec3)>)| {
            Some(VertexPoint {
                vertex: vertex.vertex,
                p_camera: best?.1,
                weight: 1.0,
            })
        };
        Ok(self.vertices.iter().zip(best).filter_map(found).collect())
    }

    /// The 3D point of each pixel that can be used.
    fn points(&self, maps: &Maps, camera: &Camera) -> Vec<Option<DVec3>> {
        let usable =
            |(&depth, uv): (&f32, &[f32; 2])| depth > 0.0 && depth.is_finite() && uv.iter().all(|c| c.is_finite());
        let pixels = maps.depth().iter().zip(maps.registration());
        let mut kept: Vec<f32> = pixels.map(|pixel| f32::from(u8::from(usable(pixel)))).collect();
        erode(&mut kept, maps.size().width, self.margin_px);
        let point = |pixel: usize| {
            let (x, y) = (pixel % maps.size().width, pixel / maps.size().width);
            let centre = DVec2::new(x as f64 + 0.5, y as f64 + 0.5);
            (kept[pixel] > 0.0).then(|| camera.unproject(centre, f64::from(maps.depth()[pixel])))
        };
        (0..kept.len()).map(point).collect()
    }

    /// Offers the triangle to the vertices in it.
    fn match_triangle(&self, triangle: &PixelTriangle, best: &mut [Option<(f64, DVec3)>]) {
        let [a, b, c] = triangle.uv;
        let (low, high) = (a.min(b).min(c), a.max(b).max(c));
        let reach = EXTRAPOLATION * (high - low);
        let (columns, rows) = TextureGrid::cells(low - reach, high + reach);
        if columns.len() > MAX_CELLS || rows.len() > MAX_CELLS {
            return;
        }
        for row in rows {
            for column in columns.clone() {
                for index in self.grid.cell(column, row) {
                    let (vertex, best) = (&self.vertices[index], &mut best[index]);
                    let found = triangle.point_at(vertex);
                    if found.is_some_and(|(score, _)| best.is_none_or(|(other, _)| score > other)) {
                        *best = found;
                    }
                }
            }
        }
    }
}

impl PixelTriangle {
    fn new(corners: [(DVec2, DVec3); 3]) -> Self {
        let uv = corners.map(|c| c.0);
        Self {
            uv,
            p_camera: corners.map(|c| c.1),
            area: (uv[1] - uv[0]).perp_dot(uv[2] - uv[0]),
        }
    }

    /// The point at a vertex, and how far inside the triangle the vertex lies: its smallest barycentric
    /// coordinate. `None` when it is too far outside or the triangle is no part of the surface around it.
    fn point_at(&self, vertex: &ChartVertex) -> Option<(f64, DVec3)> {
        // The corners turn from x to y in the image; so does the texture of a front that is not mirrored.
        let area = if vertex.mirrored { -self.area } else { self.area };
        if area <= 0.0 {
            return None;
        }
        let weights = texture_barycentric(vertex.uv, self.uv);
        let score = weights.into_iter().fold(f64::INFINITY, f64::min);
        // Infinite and NaN where the triangle has no area.
        let encloses = score >= -EXTRAPOLATION && weights.iter().all(|w| w.is_finite());
        if !encloses || !self.is_isometric(vertex.metric) {
            return None;
        }
        let [p, q, r] = self.p_camera;
        Some((score, weights[0] * p + weights[1] * q + weights[2] * r))
    }

    fn is_isometric(&self, [uu, uv, vv]: [f64; 3]) -> bool {
        [(0, 1), (1, 2), (2, 0)].into_iter().all(|(i, j)| {
            let d = self.uv[i] - self.uv[j];
            let on_template = uu * d.x * d.x + 2.0 * uv * d.x * d.y + vv * d.y * d.y;
            let in_space = self.p_camera[i].distance_squared(self.p_camera[j]);
            let most = MAX_STRETCH * MAX_STRETCH;
            in_space <= most * on_template && on_template <= most * in_space
        })
    }
}

/// The vertices of faces with an area, in space and in the texture.
fn chart_vertices(template: &TriangleMesh) -> Vec<ChartVertex> {
    // Sums over the faces around each vertex: metric and area, weighted with the faces' areas in the texture.
    let mut sums = vec![([0.0; 3], 0.0_f64, 0.0_f64); template.vertices().len()];
    for &face in template.faces() {
        let derivatives = template.texture_derivatives(face);
        let Some(([du, dv], _, area)) = derivatives.filter(|(_, normal, _)| *normal != DVec3::ZERO) else {
            continue;
        };
        for vertex in face {
            let (metric, signed, total) = &mut sums[vertex];
            for (sum, entry) in metric.iter_mut().zip([du.dot(du), du.dot(dv), dv.dot(dv)]) {
                *sum += area.abs() * entry;
            }
            *signed += area;
            *total += area.abs();
        }
    }
    (sums.into_iter().enumerate())
        .filter(|(_, (_, _, total))| *total > 0.0)
        .map(|(vertex, (metric, signed, total))| ChartVertex {
            vertex,
            uv: template.texture_coordinates()[vertex],
            metric: metric.map(|entry| entry / total),
            // Faces turn counter-clockwise seen from the front, v points down.
            mirrored: signed > 0.0,
        })
        .collect()
}
