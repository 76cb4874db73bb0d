//! Exactly isometric bends of a flat sheet: the sheet rolled along straight rulings.

use deepsft_geometry::glam::{DAffine3, DQuat, DVec2, DVec3};

/// The straight lines of the rest sheet that stay straight when it bends, numbered by a coordinate
/// that grows across them.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Rulings {
    /// Parallel lines (a cylinder): the coordinate is the distance in mm from the line through
    /// `origin`, along the unit vector `across`.
    Parallel { origin: DVec2, across: DVec2 },
    /// Lines through an apex off the sheet (a cone): the coordinate is the angle in radians from the
    /// unit vector `ray`, counted in the direction `turn` (+1 from x to y, -1 the other way).
    Conical { apex: DVec2, ray: DVec2, turn: f64 },
}

impl Rulings {
    pub(crate) fn coordinate(&self, point: DVec2) -> f64 {
        match *self {
            Self::Parallel { origin, across } => across.dot(point - origin),
            Self::Conical { apex, ray, turn } => turn * ray.perp_dot(point - apex).atan2(ray.dot(point - apex)),
        }
    }

    /// Unit vector across the ruling with coordinate 0, and a point of that ruling.
    fn across(&self) -> (DVec2, DVec2) {
        match *self {
            Self::Parallel { origin, across } => (across, origin),
            Self::Conical { apex, ray, turn } => (ray.perp() * turn, apex),
        }
    }

    /// The half-plane (n, c) with n . p >= c of the rest points beyond the ruling at `coordinate`.
    fn beyond(&self, coordinate: f64) -> (DVec2, f64) {
        let frame = self.rest_frame(coordinate);
        let (across, at) = self.across();
        let (normal, point) = match self {
            Self::Parallel { .. } => (across, frame.translation.truncate()),
            Self::Conical { .. } => (frame.transform_vector3(across.extend(0.0)).truncate(), at),
        };
        (normal, normal.dot(point))
    }

    /// Frame that travels with the rulings in the flat sheet.
    fn rest_frame(&self, coordinate: f64) -> DAffine3 {
        match *self {
            Self::Parallel { origin, across } => DAffine3::from_translation((origin + across * coordinate).extend(0.0)),
            Self::Conical { apex, turn, .. } => {
                DAffine3::from_rotation_translation(DQuat::from_rotation_z(turn * coordinate), apex.extend(0.0))
            }
        }
    }

    /// Motion of that frame, in its own coordinates, over a step of constant curvature: an arc of a
    /// circle, or of a circle on the sphere around the apex.
    fn advance(&self, curvature: f64, step: f64) -> DAffine3 {
        let across = self.across().0.extend(0.0);
        let axis = across.cross(DVec3::Z);
        match *self {
            Self::Parallel { .. } => {
                let half = curvature * step / 2.0;
                let chord = step * sinc(half);
                let translation = (across * half.cos() + DVec3::Z * half.sin()) * chord;
                DAffine3::from_rotation_translation(DQuat::from_axis_angle(axis, curvature * step), translation)
            }
            Self::Conical { turn, .. } => {
                DAffine3::from_quat(DQuat::from_scaled_axis((DVec3::Z * turn + axis * curvature) * step))
            }
        }
    }
}

fn sinc(angle: f64) -> f64 {
    if angle.abs() < 1e-5 {
        1.0 - angle * angle / 6.0
    } else {
        angle.sin() / angle
    }
}

/// A bend: a curvature that is constant between neighbouring knots of the rulings' coordinate and
/// zero outside them. Positive curvature bends the sheet towards +z, away from its printed front.
/// The ruling with coordinate 0 stays where it is.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Bend {
    rulings: Rulings,
    knots: Vec<f64>,
    curvatures: Vec<f64>,
}

impl Bend {
    /// A bend over the coordinates `start..start + width` in `angles.len()` equal steps; the sheet
    /// turns by `angles[i]` radians in step i.
    pub(crate) fn new(rulings: Rulings, start: f64, width: f64, angles: &[f64]) -> Self {
        let step = width / angles.len() as f64;
        let knots = (0..=angles.len()).map(|i| start + i as f64 * step).collect();
        Self {
            rulings,
            knots,
            curvatures: angles.iter().map(|angle| angle / step).collect(),
        }
    }

    pub(crate) fn scale(&mut self, factor: f64) {
        for curvature in &mut self.curvatures {
            *curvature *= factor;
        }
    }

    /// Unsigned angle in radians between the bent sheet at a rest point and at the ruling that stays.
    pub(crate) fn turned(&self, point: DVec2) -> f64 {
        (self.angle(self.rulings.coordinate(point)) - self.angle(0.0)).abs()
    }

    fn angle(&self, coordinate: f64) -> f64 {
        let pieces = self.knots.iter().zip(self.knots.iter().skip(1)).zip(&self.curvatures);
        pieces
            .map(|((from, to), curvature)| curvature * (coordinate.clamp(*from, *to) - from))
            .sum()
    }

    /// Whether the bend moves a rest point.
    pub(crate) fn moves(&self, point: DVec2) -> bool {
        let start = self.knots.first().copied().unwrap_or(0.0);
        start < 0.0 || self.rulings.coordinate(point) > start
    }

    /// Moves each vertex by the rigid motion of the ruling through its rest position. The vertex then
    /// lies exactly on the bent sheet, if it was in the rest plane before or is beyond the last knot.
    pub(crate) fn apply(&self, rest: &[DVec3], vertices: &mut [DVec3]) {
        let (Some(&first), Some(&last)) = (self.knots.first(), self.knots.last()) else {
            return;
        };
        let mut frames = vec![self.rulings.rest_frame(first)];
        for ((from, to), curvature) in self.knots.iter().zip(self.knots.iter().skip(1)).zip(&self.curvatures) {
            let frame = frames[frames.len() - 1];
            frames.push(frame * self.rulings.advance(*curvature, to - from));
        }
        let motion = |coordinate: f64| {
            let at = coordinate.clamp(first, last);
            let piece = self
                .knots
                .partition_point(|&knot| knot <= at)
                .clamp(1, self.curvatures.len())
                - 1;
            let frame = frames[piece] * self.rulings.advance(self.curvatures[piece], at - self.knots[piece]);
            frame * self.rulings.rest_frame(at).inverse()
        };
        let back = motion(0.0).inverse();
        let (before, after) = (back * motion(first), back * motion(last));
        for (vertex, point) in vertices.iter_mut().zip(rest) {
            let coordinate = self.rulings.coordinate(point.truncate());
            let motion = match coordinate {
                c if c <= first => before,
                c if c >= last => after,
                c => back * motion(c),
            };
            *vertex = motion.transform_point3(*vertex);
        }
    }

    /// Whether the curved strips of two bends stay apart inside the rectangle with corners +-`half`.
    /// Such bends compose exactly.
    pub(crate) fn apart(&self, other: &Self, half: DVec2) -> bool {
        let strip = other.strip(half);
        let [(n0, c0), (n1, c1)] = self.sides();
        strip.iter().all(|p| n0.dot(*p) <= c0) || strip.iter().all(|p| n1.dot(*p) >= c1)
    }

    fn sides(&self) -> [(DVec2, f64); 2] {
        let (first, last) = (self.knots.first().copied(), self.knots.last().copied());
        [first, last].map(|knot| self.rulings.beyond(knot.unwrap_or(0.0)))
    }

    /// Corners of the part of the rectangle with corners +-`half` that the bend curves.
    fn strip(&self, half: DVec2) -> Vec<DVec2> {
        let [(n0, c0), (n1, c1)] = self.sides();
        clip(&clip(&corners(half), n0, c0), -n1, -c1)
    }
}

/// The corners of a rectangle around the origin.
pub(crate) fn corners(half: DVec2) -> [DVec2; 4] {
    [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)].map(|(x, y)| half * DVec2::new(x, y))
}

/// The part of a convex polygon with n . p >= c (Sutherland and Hodgman).
fn clip(polygon: &[DVec2], normal: DVec2, offset: f64) -> Vec<DVec2> {
    let mut kept = Vec::with_capacity(polygon.len() + 1);
    for (&a, &b) in polygon.iter().zip(polygon.iter().cycle().skip(1)) {
        let (height_a, height_b) = (normal.dot(a) - offset, normal.dot(b) - offset);
        if height_a >= 0.0 {
            kept.push(a);
        }
        if (height_a >= 0.0) != (height_b >= 0.0) {
            kept.push(a.lerp(b, height_a / (height_a - height_b)));
        }
    }
    kept
}

#[cfg(test)]
mod tests {
    use super::*;

    const TOLERANCE_MM: f64 = 1e-9;

    fn grid() -> Vec<DVec3> {
        (0..21 * 15)
            .map(|k| DVec3::new(f64::from(k % 21) * 10.0 - 100.0, f64::from(k / 21) * 10.0 - 70.0, 0.0))
            .collect()
    }

    fn bent(bend: &Bend) -> Vec<DVec3> {
        let mut vertices = grid();
        bend.apply(&grid(), &mut vertices);
        vertices
    }

    #[test]
    fn a_constant_bend_is_the_closed_form_of_a_cylinder() {
        // Rest distance s beyond the line x = 20: flat up to it, then an arc of radius w / angle,
        // then a plane tangent to the arc's end.
        let (width, angle) = (50.0, 1.2);
        let radius = width / angle;
        let rulings = Rulings::Parallel {
            origin: DVec2::new(20.0, 0.0),
            across: DVec2::X,
        };
        let whole = bent(&Bend::new(rulings, 0.0, width, &[angle]));
        let in_steps = bent(&Bend::new(rulings, 0.0, width, &[angle / 7.0; 7]));
        for (k, rest) in grid().into_iter().enumerate() {
            let s = rest.x - 20.0;
            let phi = (s / width).clamp(0.0, 1.0) * angle;
            let tail = (s - width).max(0.0);
            let x = 20.0 + s.min(0.0) + radius * phi.sin() + tail * angle.cos();
            let z = radius * (1.0 - phi.cos()) + tail * angle.sin();
            let expected = DVec3::new(x, rest.y, z);
            assert!(
                whole[k].distance(expected) < TOLERANCE_MM,
                "{} is not {expected}",
                whole[k]
            );
            assert!(
                in_steps[k].distance(expected) < TOLERANCE_MM,
                "{} is not {expected}",
                in_steps[k]
            );
        }
    }

    #[test]
    fn a_constant_conical_bend_is_the_closed_form_of_a_circular_cone() {
        // A cone of half-angle beta unrolls to a sector: rest polar angle a becomes the azimuth
        // a / sin(beta), and its rulings curve with geodesic curvature cot(beta).
        let beta = 1.1_f64;
        let apex = DVec2::new(-150.0, 0.0);
        let rulings = Rulings::Conical {
            apex,
            ray: DVec2::X,
            turn: 1.0,
        };
        let width = 2.0;
        let vertices = bent(&Bend::new(rulings, -1.0, width, &[width / beta.tan()]));
        // Axis of the cone: beta away from the ruling at coordinate 0, on the +z side.
        let (toward, axis) = (DVec3::X, DVec3::new(beta.cos(), 0.0, beta.sin()));
        let radial = (toward - axis * beta.cos()) / beta.sin();
        for (rest, vertex) in grid().into_iter().zip(vertices) {
            let from_apex = rest.truncate() - apex;
            let azimuth = from_apex.y.atan2(from_apex.x) / beta.sin();
            let around = radial * azimuth.cos() + axis.cross(radial) * azimuth.sin();
            let expected = apex.extend(0.0) + (axis * beta.cos() + around * beta.sin()) * from_apex.length();
            assert!(vertex.distance(expected) < TOLERANCE_MM, "{vertex} is not {expected}");
        }
    }

    #[test]
    fn strips_that_cross_inside_the_sheet_are_not_apart() {
        let strip = |across: DVec2, distance: f64| {
            let origin = across * distance;
            Bend::new(Rulings::Parallel { origin, across }, 0.0, 10.0, &[1.0])
        };
        let half = DVec2::new(100.0, 70.0);
        let (vertical, horizontal) = (strip(DVec2::X, 30.0), strip(DVec2::Y, 20.0));
        assert!(!vertical.apart(&horizontal, half) && !horizontal.apart(&vertical, half));
        assert!(vertical.apart(&strip(DVec2::X, 40.5), half) && !vertical.apart(&strip(DVec2::X, 39.5), half));
        // These lines meet at x = 30, y = 98 / 0.8 - 30 * 0.6 / 0.8 = 100, beyond the upper edge.
        let oblique = strip(DVec2::new(-0.6, 0.8), 0.8 * 100.0 - 0.6 * 30.0);
        assert!(oblique.apart(&vertical, half));
    }
}
