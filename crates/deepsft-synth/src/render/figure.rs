//! Plane figures with a signed distance, for painting backgrounds, artworks and occluders.

use deepsft_geometry::glam::{Vec2, Vec3};

/// A figure in the image; lengths in pixels.
#[derive(Clone, Debug)]
pub(crate) enum Figure {
    /// The points within a radius of the segment between two ends; the radius grows linearly from the first end's to the
    /// second's.
    Capsule([Vec2; 2], [f32; 2]),
    /// An ellipse: centre, unit vector along the first axis, radii.
    Ellipse(Vec2, Vec2, Vec2),
    /// A rectangle: centre, unit vector along the first side, half the sides.
    Rectangle(Vec2, Vec2, Vec2),
    /// A closed polygon, not self-intersecting.
    Polygon(Vec<Vec2>),
}

impl Figure {
    pub(crate) fn disc(centre: Vec2, radius: f32) -> Self {
        Self::Ellipse(centre, Vec2::X, Vec2::splat(radius))
    }

    /// A rectangle along the image's axes.
    pub(crate) fn upright(low: Vec2, high: Vec2) -> Self {
        Self::Rectangle((low + high) / 2.0, Vec2::X, (high - low) / 2.0)
    }

    /// Distance to the outline, negative inside. For ellipses it is a first-order approximation, exact on
    /// the outline.
    pub(crate) fn distance(&self, p: Vec2) -> f32 {
        match self {
            Self::Capsule([a, b], radii) => {
                let t = segment_parameter(*a, *b, p);
                (p - a.lerp(*b, t)).length() - (radii[0] + t * (radii[1] - radii[0]))
            }
            Self::Ellipse(centre, axis, radii) => {
                let q = to_axes(p - *centre, *axis);
                let scaled = q / *radii;
                let k = scaled.length();
                let gradient = (scaled / *radii).length();
                if gradient < 1e-6 {
                    -radii.min_element()
                } else {
                    k * (k - 1.0) / gradient
                }
            }
            Self::Rectangle(centre, axis, half) => {
                let q = to_axes(p - *centre, *axis).abs() - *half;
                q.max(Vec2::ZERO).length() + q.max_element().min(0.0)
            }
            Self::Polygon(corners) => polygon_distance(corners, p),
        }
    }

    /// Unit normal (camera frame: z points away from the viewer) of the rounded body whose outline the figure
    /// is; flat figures face the viewer.
    pub(crate) fn normal(&self, p: Vec2) -> Vec3 {
        let slope = match self {
            Self::Capsule([a, b], radii) => {
                let t = segment_parameter(*a, *b, p);
                (p - a.lerp(*b, t)) / (radii[0] + t * (radii[1] - radii[0])).max(1e-3)
            }
            Self::Ellipse(centre, axis, radii) => {
                let q = to_axes(p - *centre, *axis) / *radii;
                *axis * q.x + axis.perp() * q.y
            }
            Self::Rectangle(..) | Self::Polygon(_) => Vec2::ZERO,
        };
        slope
            .extend(-(1.0 - slope.length_squared()).max(0.02).sqrt())
            .normalize()
    }

    /// The figure turned so that x points along the unit vector `along`, scaled, and moved to `origin`.
    pub(crate) fn moved(&self, origin: Vec2, along: Vec2, scale: f32) -> Self {
        let point = |p: &Vec2| origin + along.rotate(*p) * scale;
        match self {
            Self::Capsule(ends, radii) => Self::Capsule(ends.each_ref().map(point), radii.map(|r| r * scale)),
            Self::Ellipse(centre, axis, radii) => Self::Ellipse(point(centre), along.rotate(*axis), *radii * scale),
            Self::Rectangle(centre, axis, half) => Self::Rectangle(point(centre), along.rotate(*axis), *half * scale),
            Self::Polygon(corners) => Self::Polygon(corners.iter().map(point).collect()),
        }
    }

    /// Corners (low, high) of a rectangle that holds the figure.
    pub(crate) fn bounds(&self) -> (Vec2, Vec2) {
        match self {
            Self::Capsule([a, b], radii) => {
                let (ra, rb) = (Vec2::splat(radii[0]), Vec2::splat(radii[1]));
                ((*a - ra).min(*b - rb), (*a + ra).max(*b + rb))
            }
            Self::Ellipse(centre, axis, half) | Self::Rectangle(centre, axis, half) => {
                let reach = axis.abs() * half.x + axis.perp().abs() * half.y;
                (*centre - reach, *centre + reach)
            }
            Self::Polygon(corners) => corners
                .iter()
                .fold((Vec2::INFINITY, Vec2::NEG_INFINITY), |(low, high), &p| {
                    (low.min(p), high.max(p))
                }),
        }
    }
}

/// The coordinates of `v` along the unit vector `axis` and across it.
fn to_axes(v: Vec2, axis: Vec2) -> Vec2 {
    Vec2::new(v.dot(axis), v.dot(axis.perp()))
}

/// Where on the segment from `a` (0) to `b` (1) the point nearest to `p` lies.
fn segment_parameter(a: Vec2, b: Vec2, p: Vec2) -> f32 {
    ((p - a).dot(b - a) / (b - a).length_squared().max(1e-12)).clamp(0.0, 1.0)
}

fn polygon_distance(corners: &[Vec2], p: Vec2) -> f32 {
    let mut nearest = f32::INFINITY;
    let mut inside = false;
    for (i, &b) in corners.iter().enumerate() {
        let a = corners[(i + corners.len() - 1) % corners.len()];
        nearest = nearest.min((p - a.lerp(b, segment_parameter(a, b, p))).length_squared());
        if (a.y > p.y) != (b.y > p.y) && p.x < (b.x - a.x) * (p.y - a.y) / (b.y - a.y) + a.x {
            inside = !inside;
        }
    }
    if inside { -nearest.sqrt() } else { nearest.sqrt() }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn distances_of_a_capsule_a_rectangle_and_a_polygon_are_those_of_a_ruler() {
        let capsule = Figure::Capsule([Vec2::ZERO, Vec2::new(10.0, 0.0)], [2.0, 2.0]);
        assert_eq!(capsule.distance(Vec2::new(5.0, 5.0)), 3.0);
        assert_eq!(capsule.distance(Vec2::new(13.0, 4.0)), 3.0);
        let rectangle = Figure::upright(Vec2::ZERO, Vec2::new(4.0, 2.0));
        assert_eq!(rectangle.distance(Vec2::new(2.0, 1.0)), -1.0);
        assert_eq!(rectangle.distance(Vec2::new(7.0, 6.0)), 5.0);
        let triangle = Figure::Polygon(vec![Vec2::ZERO, Vec2::new(4.0, 0.0), Vec2::new(0.0, 4.0)]);
        assert_eq!(triangle.distance(Vec2::new(1.0, 0.5)), -0.5);
        assert_eq!(triangle.distance(Vec2::new(2.0, -3.0)), 3.0);
    }

    #[test]
    fn an_ellipse_is_exact_on_its_outline_and_a_disc_everywhere() {
        let axis = Vec2::from_angle(0.4);
        let ellipse = Figure::Ellipse(Vec2::new(3.0, 1.0), axis, Vec2::new(6.0, 2.0));
        for angle in [0.0_f32, 0.7, 2.0, 4.0] {
            let p = Vec2::new(3.0, 1.0) + axis * 6.0 * angle.cos() + axis.perp() * 2.0 * angle.sin();
            assert!(ellipse.distance(p).abs() < 1e-4);
        }
        let disc = Figure::disc(Vec2::ZERO, 3.0);
        assert!((disc.distance(Vec2::new(0.0, 8.0)) - 5.0).abs() < 1e-5);
        assert!((disc.distance(Vec2::new(1.0, 0.0)) + 2.0).abs() < 1e-5);
    }

    #[test]
    fn a_finger_is_round_and_its_middle_faces_the_viewer() {
        let capsule = Figure::Capsule([Vec2::ZERO, Vec2::new(10.0, 0.0)], [2.0, 2.0]);
        assert_eq!(capsule.normal(Vec2::new(5.0, 0.0)), Vec3::NEG_Z);
        assert!(capsule.normal(Vec2::new(5.0, 1.9)).y > 0.9);
    }
}
