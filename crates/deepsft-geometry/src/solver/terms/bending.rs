//! Bending of a flat sheet.

use crate::error::GeometryError;
use crate::mesh::{Side, TriangleMesh};
use crate::solver::energy::{Energy, ResidualSink, check_weight};
use glam::DVec3;

/// A face whose doubled area is below this fraction of its longest edge squared is taken as a line: its
/// cotangents would be noise.
const DEGENERATE_FACE: f64 = 1e-9;

/// Quadratic bending of a thin shell that is flat at rest (Bergou et al. 2006, *A Quadratic Bending
/// Model for Inextensible Surfaces*): weight times the sum over interior edges of
/// 3 / (A_0 + A_1) |sum c_k p_k|^2 over the edge's ends and the two opposite corners, c from the rest shape's
/// cotangents. Without unit: the integral of the squared curvature, times 1 to 3 depending on how the
/// edges lie to the bend (3 for a grid bent along its sides). It pulls towards the flat sheet: it is not for templates
/// that are curved at rest.
#[derive(Clone, Debug)]
pub struct Bending {
    /// Vertices, coefficients and factor of each interior edge.
    hinges: Vec<([usize; 4], [f64; 4], f64)>,
    weight: f64,
}

impl Bending {
    /// For the interior edges of `template`. Edges beside a face without area, and edges with more than two
    /// faces, have no bending. Too little lets noise through, too much flattens: 0.01 to 1 with point
    /// data of weight 1 in units of the edge length.
    ///
    /// # Errors
    /// [`GeometryError::Weight`] for a weight that is negative or not finite.
    pub fn new(template: &TriangleMesh, weight: f64) -> Result<Self, GeometryError> {
        check_weight("bending", weight)?;
        let sides = Side::of(template.faces());
        let hinge = |around: &[Side]| {
            let [one, other] = around else { return None };
            let ([i, j], [k, l]) = (one.edge, [one, other].map(|side| side.corners(template.faces())[2]));
            let is_hinge = k != l && i != j;
            is_hinge.then(|| hinge(template.vertices(), [i, j, k, l])).flatten()
        };
        Ok(Self {
            hinges: Side::by_edge(&sides).filter_map(hinge).collect(),
            weight,
        })
    }
}

/// Coefficients of the hinge with ends `x0`, `x1` and opposite corners `x2`, `x3`.
fn hinge(v: &[DVec3], vertices: [usize; 4]) -> Option<([usize; 4], [f64; 4], f64)> {
    let [x0, x1, x2, x3] = vertices.map(|i| v[i]);
    let ((c01, area0), (c02, area1)) = (cotangent(x0, x1, x2)?, cotangent(x0, x1, x3)?);
    let ((c03, _), (c04, _)) = (cotangent(x1, x0, x2)?, cotangent(x1, x0, x3)?);
    let coefficients = [c03 + c04, c01 + c02, -c01 - c03, -c02 - c04];
    Some((vertices, coefficients, 3.0 / (0.5 * (area0 + area1))))
}

/// Cotangent of the angle at `a` in the face with corners `a`, `b`, `c`, and twice the face's area; `None` for a face
/// without area.
pub(crate) fn cotangent(a: DVec3, b: DVec3, c: DVec3) -> Option<(f64, f64)> {
    let (e, f) = (b - a, c - a);
    let doubled = e.cross(f).length();
    let longest = e.length_squared().max(f.length_squared()).max((f - e).length_squared());
    (doubled > DEGENERATE_FACE * longest).then(|| (e.dot(f) / doubled, doubled))
}

impl Energy for Bending {
    fn name(&self) -> &'static str {
        "bending"
    }

    fn stencils(&self, visit: &mut dyn FnMut(&[usize])) {
        self.hinges.iter().for_each(|(vertices, ..)| visit(vertices));
    }

    fn energy(&self, vertices: &[DVec3]) -> f64 {
        let square = |(corners, c, factor): &([usize; 4], [f64; 4], f64)| {
            let residual: DVec3 = (0..4).map(|k| c[k] * vertices[corners[k]]).sum();
            factor * residual.length_squared()
        };
        self.weight * self.hinges.iter().map(square).sum::<f64>()
    }

    fn linearize(&self, vertices: &[DVec3], sink: &mut dyn ResidualSink) {
        for (corners, c, factor) in &self.hinges {
            // The factor is one over an area: its root makes the residual free of units.
            let root = factor.sqrt();
            let residual = (0..4).map(|k| root * c[k] * vertices[corners[k]]).sum();
            let coefficients: [_; 4] = std::array::from_fn(|k| (corners[k], root * c[k]));
            sink.vector(residual, self.weight, &coefficients);
        }
    }
}
