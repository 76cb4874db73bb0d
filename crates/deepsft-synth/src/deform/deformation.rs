//! Random quasi-isometric deformations of a thin shell: what paper does in a person's hands.
//!
//! Paper bends without stretching, so its shapes are developable: ruled by straight lines along which
//! the tangent plane is constant. We draw such shapes directly, as bends along rulings that compose
//! exactly where their strips do not cross, add what is only nearly developable (waves, bends that do
//! cross), and let a position-based relaxation restore the length of the mesh's edges. The paper took
//! its deformations from a physics engine; this construction is our choice.
//!
//! The paper's own way, position-based cloth with anchors and forces, is one more family ([`DeformationFamily::Cloth`]).

use crate::deform::config::{DeformationConfig, DeformationFamily};
use crate::deform::manipulation::Manipulation;
use crate::deform::relaxation::{EdgeLengthChange, Relaxation};
use crate::deform::sheet_shape::Shape;
use deepsft_geometry::{
    Template, TriangleMesh,
    glam::{DQuat, DVec2, DVec3},
};
use rand::Rng;

/// How often a deformation is made weaker until it is isometric enough, before the sheet is left flat.
const WEAKENING_TRIES: usize = 12;
/// 95th percentile of the relative change of edge lengths beyond which the relaxation would crumple
/// the sheet rather than bend it; such a deformation is made weaker before it is relaxed.
const MAX_CHANGE_TO_RELAX: f64 = 0.06;
/// Rounds of relaxation of a simulated sheet before its manipulation is made weaker.
const CLOTH_RELAXATIONS: usize = 4;
/// Factor on all angles and waves (ways and forces) at each such try.
const WEAKENING: f64 = 0.7;

/// Deforms `template`'s rest mesh at random, quasi-isometrically, and returns its vertices in mm. They are in the template
/// frame with the mean at the origin and the mean normal along -z, so that a pose's tilt is the tilt of the sheet as a whole.
/// Edge lengths keep the configuration's bounds: a shape that breaks them is made weaker, and the sheet stays flat when no
/// weaker shape will do. A template that is no sheet stays at rest: control points deform it.
pub(crate) fn deform<R: Rng + ?Sized>(template: &Template, config: &DeformationConfig, rng: &mut R) -> Vec<DVec3> {
    if !template.is_sheet() {
        return template.mesh().vertices().to_vec();
    }
    let relaxation = Relaxation::new(template);
    let family = config.draw_family(rng);
    if family == DeformationFamily::Cloth {
        let mut manipulation = Manipulation::sample(template.size_mm(), rng);
        return deform_cloth(template, &relaxation, config, &mut manipulation);
    }
    let rest = template.mesh().vertices();
    let mut shape = Shape::sample(family, template.size_mm(), config, rng);
    for _ in 0..WEAKENING_TRIES {
        let mut vertices = rest.to_vec();
        shape.apply(rest, &mut vertices);
        if relaxation.change(rest, &vertices).p95 < MAX_CHANGE_TO_RELAX {
            relaxation.relax(&mut vertices, config.relaxation_sweeps);
            if within(relaxation.change(rest, &vertices), config.max_edge_change) {
                face_front(template.mesh(), &mut vertices);
                return vertices;
            }
        }
        shape.scale(WEAKENING);
    }
    rest.to_vec()
}

/// The sheet after it was handled, laid on the template's mesh and relaxed until its lengths are right. Manipulation is
/// made gentler only when that does not come about, or the sheet rolls up into itself.
fn deform_cloth(
    template: &Template,
    relaxation: &Relaxation,
    config: &DeformationConfig,
    manipulation: &mut Manipulation,
) -> Vec<DVec3> {
    let mesh = template.mesh();
    let rest = mesh.vertices();
    for _ in 0..WEAKENING_TRIES {
        let cloth = manipulation.simulate();
        let mut vertices: Vec<DVec3> = mesh.texture_coordinates().iter().map(|uv| cloth.surface(*uv)).collect();
        // A sheet that passes through itself is no sheet however well it keeps its lengths.
        let relaxations = if cloth.touches_itself() { 0 } else { CLOTH_RELAXATIONS };
        for _ in 0..relaxations {
            relaxation.relax(&mut vertices, config.relaxation_sweeps);
            if within(relaxation.change(rest, &vertices), config.max_edge_change) {
                face_front(mesh, &mut vertices);
                turn_upright(rest, &mut vertices);
                return vertices;
            }
        }
        manipulation.weaken(WEAKENING);
    }
    rest.to_vec()
}

fn within(change: EdgeLengthChange, most: EdgeLengthChange) -> bool {
    change.median < most.median && change.p95 < most.p95
}

/// Turns vertices about the z axis to where they are nearest to `rest` (least squares): a sheet that swung round a hand
/// keeps its shape, and its turn is left to the pose.
fn turn_upright(rest: &[DVec3], vertices: &mut [DVec3]) {
    let turned: DVec2 = rest
        .iter()
        .zip(vertices.iter())
        .map(|(rest, vertex)| {
            let (rest, vertex) = (rest.truncate(), vertex.truncate());
            DVec2::new(rest.dot(vertex), vertex.perp_dot(rest))
        })
        .sum();
    let turn = DQuat::from_rotation_z(turned.to_angle());
    vertices.iter_mut().for_each(|vertex| *vertex = turn * *vertex);
}

/// The mean of some points; the origin of none.
pub(crate) fn centroid(points: &[DVec3]) -> DVec3 {
    points.iter().sum::<DVec3>() / points.len().max(1) as f64
}

/// Fraction of a mesh's area below which the sum of its faces' area vectors is rounding: that of a closed mesh is zero.
const NO_MEAN_NORMAL: f64 = 1e-6;

/// Moves the vertices' mean to the origin and turns the mean normal to -z, the short way; a closed mesh, which has none,
/// stays as it is turned.
pub(crate) fn face_front(mesh: &TriangleMesh, vertices: &mut [DVec3]) {
    let mean = centroid(vertices);
    let area = |&[a, b, c]: &[usize; 3]| (vertices[b] - vertices[a]).cross(vertices[c] - vertices[a]);
    let sum: DVec3 = mesh.faces().iter().map(area).sum();
    let whole: f64 = mesh.faces().iter().map(|face| area(face).length()).sum();
    let normal = if sum.length() > NO_MEAN_NORMAL * whole {
        sum.normalize()
    } else {
        DVec3::NEG_Z
    };
    let turn = DQuat::from_rotation_arc(normal, DVec3::NEG_Z);
    vertices.iter_mut().for_each(|vertex| *vertex = turn * (*vertex - mean));
}
