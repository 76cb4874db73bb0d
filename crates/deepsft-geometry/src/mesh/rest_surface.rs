//! Rest positions: points of a template's rest shape in the unit cube, which do not jump at seams as (u, v) does.

use super::surface_point::{SurfacePoint, weighted};
use super::template::Template;
use glam::{DVec2, DVec3};
use rstar::{AABB, PointDistance, RTree, RTreeObject};

/// How far a point on a face's border is drawn inside, in barycentric coordinates: rounded texture coordinates must stay in
/// the chart.
const INSIDE: f64 = 1e-4;

/// Converts between registrations and rest positions of a template.
///
/// A rest position is the point (x, y, z) of the rest shape in the unit cube: 0 to 1 along the longest side of the shape's
/// bounding box, with its middle at (1/2, 1/2, 1/2). Neighbours on the surface have neighbouring rest positions, on whichever
/// charts of the texture they are (Wang et al. 2019, "Normalized Object Coordinate Space").
#[derive(Clone, Debug)]
pub struct RestSurface {
    template: Template,
    middle: DVec3,
    side_mm: f64,
    faces: RTree<Face>,
}

#[derive(Clone, Debug)]
struct Face {
    index: usize,
    corners: [DVec3; 3],
}

impl RTreeObject for Face {
    type Envelope = AABB<[f64; 3]>;

    fn envelope(&self) -> Self::Envelope {
        let [a, b, c] = self.corners;
        AABB::from_corners(a.min(b).min(c).to_array(), a.max(b).max(c).to_array())
    }
}

impl PointDistance for Face {
    fn distance_2(&self, point: &[f64; 3]) -> f64 {
        let nearest = nearest_in_triangle((*point).into(), self.corners);
        weighted(nearest, self.corners).distance_squared((*point).into())
    }
}

impl RestSurface {
    /// Sorts the faces of `template` by their places.
    pub fn new(template: &Template) -> Self {
        let mesh = template.mesh();
        let corners = |face: &[usize; 3]| face.map(|v| mesh.vertices()[v]);
        let faces = mesh.faces().iter().map(corners).enumerate();
        let faces = faces.map(|(index, corners)| Face { index, corners }).collect();
        let [low, high] = template.bounds();
        Self {
            middle: low.midpoint(high),
            side_mm: Self::side_mm(template),
            faces: RTree::bulk_load(faces),
            template: template.clone(),
        }
    }

    /// Returns the length of the sides of a template's cube, mm.
    pub fn side_mm(template: &Template) -> f64 {
        template.extent_mm().max_element()
    }

    /// Returns the rest position of the point at texture position `uv`, see [`Template::point_template`].
    pub fn position(&self, uv: DVec2) -> Option<DVec3> {
        let point = self.template.point_template(uv)?;
        Some((point - self.middle) / self.side_mm + 0.5)
    }

    /// Returns the registration (u, v) of the point of the surface that is nearest to a rest position.
    pub fn registration(&self, position: DVec3) -> Option<DVec2> {
        let mesh = self.template.mesh();
        let SurfacePoint { face, barycentric } = self.nearest(position)?;
        let corners = mesh.faces()[face].map(|v| mesh.texture_coordinates()[v]).into_iter();
        Some(corners.zip(barycentric).map(|(uv, w)| uv * w).sum())
    }

    /// Returns how u and v change with a rest position that moves along the surface: the gradients of both where the surface
    /// is nearest to `position`. `None` where the face has no area in the texture.
    pub fn registration_gradients(&self, position: DVec3) -> Option<[DVec3; 2]> {
        let mesh = self.template.mesh();
        let face = mesh.faces()[self.nearest(position)?.face];
        let ([by_u, by_v], ..) = mesh.texture_derivatives(face)?;
        // The pseudo-inverse of the 3 x 2 matrix (by_u, by_v).
        let (a, b, c) = (by_u.length_squared(), by_u.dot(by_v), by_v.length_squared());
        let determinant = a * c - b * b;
        let gradients = [by_u * c - by_v * b, by_v * a - by_u * b];
        (determinant > 0.0).then(|| gradients.map(|gradient| gradient * (self.side_mm / determinant)))
    }

    /// The point of the surface that is nearest to a rest position.
    fn nearest(&self, position: DVec3) -> Option<SurfacePoint> {
        let point = (position - 0.5) * self.side_mm + self.middle;
        if !point.is_finite() {
            return None;
        }
        let &Face { index: face, corners } = self.faces.nearest_neighbor(point.to_array())?;
        let barycentric = nearest_in_triangle(point, corners).map(|w| (w + INSIDE) / (1.0 + 3.0 * INSIDE));
        Some(SurfacePoint { face, barycentric })
    }
}

/// Barycentric coordinates of the point of a triangle that is nearest to `p` (Ericson 2005, "Real-Time Collision Detection",
/// section 5.1.5).
pub(crate) fn nearest_in_triangle(p: DVec3, [a, b, c]: [DVec3; 3]) -> [f64; 3] {
    let (ab, ac) = (b - a, c - a);
    let along = |corner: DVec3| [ab.dot(p - corner), ac.dot(p - corner)];
    let ([b_a, c_a], [b_b, c_b], [b_c, c_c]) = (along(a), along(b), along(c));
    // The corners' regions, then the edges', then the inside.
    if b_a <= 0.0 && c_a <= 0.0 {
        return [1.0, 0.0, 0.0];
    }
    if b_b >= 0.0 && c_b <= b_b {
        return [0.0, 1.0, 0.0];
    }
    if c_c >= 0.0 && b_c <= c_c {
        return [0.0, 0.0, 1.0];
    }
    let areas = [b_b * c_c - b_c * c_b, b_c * c_a - b_a * c_c, b_a * c_b - b_b * c_a];
    if areas[2] <= 0.0 && b_a >= 0.0 && b_b <= 0.0 {
        let t = b_a / (b_a - b_b);
        return [1.0 - t, t, 0.0];
    }
    if areas[1] <= 0.0 && c_a >= 0.0 && c_c <= 0.0 {
        let t = c_a / (c_a - c_c);
        return [1.0 - t, 0.0, t];
    }
    let (from, to) = (c_b - b_b, b_c - c_c);
    if areas[0] <= 0.0 && from >= 0.0 && to >= 0.0 {
        let t = from / (from + to);
        return [0.0, 1.0 - t, t];
    }
    areas.map(|area| area / (areas[0] + areas[1] + areas[2]))
}
