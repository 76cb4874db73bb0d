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
use crate::deform::relaxation::Relaxation;
use crate::deform::sheet_shape::Shape;
use deepsft_formats::EdgeLengthChange;
use deepsft_geometry::{
    Template, TriangleMesh,
    glam::{DQuat, DVec2, DVec3},
};
use rand::Rng;

/// How often a deformation is made weaker until it is isometric enough, before the sheet is left flat.
const WEAKENING_TRIES: usize = 12;
/// 95th percentile of the relative change of edge lengths beyond which the relaxation would crumple
/// the sheet rather than bend it; such a deformation is made weaker before it is relaxed.
const MOST_CHANGE_TO_RELAX: f64 = 0.06;
/// Rounds of relaxation of a simulated sheet before its manipulation is made weaker.
const CLOTH_RELAXATIONS: usize = 4;
/// Factor on all angles and waves (ways and forces) at each such try.
const WEAKENING: f64 = 0.7;

/// The vertices of `template`'s rest mesh after a random quasi-isometric deformation: mm, template
/// frame, mean at the origin, mean normal along -z (so that a pose's tilt is the tilt of the sheet as
/// a whole). Edge lengths keep the configuration's bounds: a shape that breaks them is made weaker, and
/// the sheet stays flat when no weaker shape will do. A template that is no sheet stays at rest: see
/// [`crate::SynthConfig::control_points`]. A pure function of its arguments.
///
/// ```
/// use deepsft_geometry::{Picture, Template};
/// use deepsft_synth::{DeformationConfig, deform, edge_length_change};
/// use rand::SeedableRng;
/// let a4 = Template::thin_shell(Picture::from_fn(1, 1, |_, _| [255; 3]), 297.0, 210.0)?;
/// let mut rng = rand_pcg::Pcg64Mcg::seed_from_u64(1);
/// let vertices = deform(&a4, &DeformationConfig::default(), &mut rng);
/// assert!(edge_length_change(a4.mesh(), &vertices).p95 < 0.03);
/// # Ok::<(), deepsft_geometry::GeometryError>(())
/// ```
pub fn deform<R: Rng + ?Sized>(template: &Template, config: &DeformationConfig, rng: &mut R) -> Vec<DVec3> {
    if !template.is_sheet() {
        return template.mesh().vertices().to_vec();
    }
    let relaxation = Relaxation::new(template);
    let family = config.draw_family(rng);
    if family == DeformationFamily::Cloth {
        let mut manipulation = Manipulation::sample(template.size_mm(), &config.cloth, rng);
        return deform_cloth(template, &relaxation, config, &mut manipulation);
    }
    let rest = template.mesh().vertices();
    let mut shape = Shape::sample(family, template.size_mm(), config, rng);
    for _ in 0..WEAKENING_TRIES {
        let mut vertices = rest.to_vec();
        shape.apply(rest, &mut vertices);
        if relaxation.change(rest, &vertices).p95 < MOST_CHANGE_TO_RELAX {
            relaxation.relax(&mut vertices, config.relaxation_sweeps);
            if within(relaxation.change(rest, &vertices), config.most_edge_change) {
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
            if within(relaxation.change(rest, &vertices), config.most_edge_change) {
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

/// Fraction of a mesh's area below which the sum of its faces' area vectors is rounding: that of a closed mesh is zero.
const NO_MEAN_NORMAL: f64 = 1e-6;

/// Moves the vertices' mean to the origin and turns the mean normal to -z, the short way; a closed mesh, which has none,
/// stays as it is turned.
pub(crate) fn face_front(mesh: &TriangleMesh, vertices: &mut [DVec3]) {
    let mean = vertices.iter().sum::<DVec3>() / vertices.len() as f64;
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::deform::edge_length_change;
    use crate::deform::isometry::edge_length_changes;
    use deepsft_geometry::Picture;
    use rand::SeedableRng;
    use rand_pcg::Pcg64Mcg;
    use std::collections::HashSet;

    fn sheet(width_mm: f64, height_mm: f64) -> Template {
        Template::thin_shell(Picture::from_fn(1, 1, |_, _| [0; 3]), width_mm, height_mm).unwrap()
    }

    fn only(family: usize) -> DeformationConfig {
        let mut config = DeformationConfig {
            family_weights: [0.0; 7],
            ..DeformationConfig::default()
        };
        config.family_weights[family] = 1.0;
        config
    }

    fn sample(template: &Template, config: &DeformationConfig, seed: u64) -> Vec<DVec3> {
        deform(template, config, &mut Pcg64Mcg::seed_from_u64(seed))
    }

    /// Median and 95th percentile over the edges of many samples together, after a check of each.
    fn change_over(template: &Template, config: &DeformationConfig, samples: u64) -> EdgeLengthChange {
        let edges = template.mesh().edges();
        let mut changes = Vec::new();
        let mut flat = 0;
        for seed in 0..samples {
            let vertices = sample(template, config, seed);
            // What cannot be bent within the bounds is left flat.
            flat += u64::from(relief(&vertices) < 1e-4 * template.size_mm().length());
            let change = edge_length_change(template.mesh(), &vertices);
            assert!(change.median < 0.01 && change.p95 < 0.03, "seed {seed}: {change:?}");
            changes.extend(edge_length_changes(template.mesh().vertices(), &edges, &vertices));
        }
        assert!(10 * flat <= samples, "{flat} of {samples} sheets are flat");
        EdgeLengthChange::of(changes)
    }

    /// Root mean square distance in mm from the plane z = 0.
    fn relief(vertices: &[DVec3]) -> f64 {
        (vertices.iter().map(|v| v.z * v.z).sum::<f64>() / vertices.len() as f64).sqrt()
    }

    #[test]
    fn every_family_keeps_edge_lengths_within_one_and_three_percent() {
        let template = sheet(297.0, 210.0);
        for (index, family) in DeformationFamily::ALL.into_iter().enumerate() {
            let change = change_over(&template, &only(index), 300);
            assert!(change.median < 0.01 && change.p95 < 0.03, "{family:?}: {change:?}");
        }
    }

    #[test]
    fn long_and_large_sheets_keep_their_edge_lengths_too() {
        for (width, height) in [(80.0, 300.0), (1000.0, 250.0), (60.0, 60.0)] {
            for (config, samples) in [(DeformationConfig::default(), 60), (only(6), 30)] {
                let change = change_over(&sheet(width, height), &config, samples);
                assert!(
                    change.median < 0.01 && change.p95 < 0.03,
                    "{width} x {height} mm: {change:?}"
                );
            }
        }
    }

    #[test]
    fn bends_that_do_not_cross_are_isometric_before_any_relaxation() {
        // A chord of an arc of angle a is shorter than the arc by a^2 / 24. A strip is at least 15 % of
        // the sheet's reach (>= 105 mm) wide; its peak curvature is twice the mean, and up to three
        // times that where a cone's rulings come nearest to their apex (3/4 of the diagonal away at
        // the strip's middle, at least 1/4 anywhere on the sheet). The longest edge, 14.1 mm, then
        // turns by at most 3 * 2 * 0.1 rad * 14.1 / 15.75: 1.2 % shorter.
        let template = sheet(297.0, 210.0);
        let config = DeformationConfig {
            strip_bend_rad: [0.1, 0.1],
            relaxation_sweeps: 0,
            ..only(2)
        };
        let longest = (297.0_f64 / 30.0).hypot(210.0 / 21.0);
        let bound = (3.0 * 2.0 * 0.1 * longest / (0.15 * 105.0)).powi(2) / 24.0;
        let edges = template.mesh().edges();
        for seed in 0..100 {
            let vertices = sample(&template, &config, seed);
            let changes = edge_length_changes(template.mesh().vertices(), &edges, &vertices);
            let most = changes.into_iter().fold(0.0, f64::max);
            assert!(most < bound, "seed {seed}: {most} of {bound}");
        }
    }

    #[test]
    fn shapes_are_centred_face_the_front_and_are_not_flat() {
        let template = sheet(297.0, 210.0);
        let mut bent = 0;
        for seed in 0..200 {
            let vertices = sample(&template, &DeformationConfig::default(), seed);
            assert!((vertices.iter().sum::<DVec3>() / vertices.len() as f64).length() < 1e-9);
            let mesh = template.mesh().with_vertices(vertices.clone()).unwrap();
            let area = |&[a, b, c]: &[usize; 3]| (vertices[b] - vertices[a]).cross(vertices[c] - vertices[a]);
            let normal: DVec3 = mesh.faces().iter().map(area).sum();
            assert!(normal.normalize().distance(DVec3::NEG_Z) < 1e-9, "{normal}");
            assert!(vertices.iter().all(|v| v.length() < 1.5 * 297.0));
            bent += usize::from(relief(&vertices) > 5.0);
        }
        // Five of the six default families bend by tens of degrees; 5 mm of relief is a bend of 15 degrees.
        assert!(bent > 100, "{bent} of 200 shapes have a relief above 5 mm");
    }

    #[test]
    fn cloth_is_bent_upright_and_the_same_on_a_finer_mesh() {
        let template = sheet(297.0, 210.0);
        let finer = template.finer().unwrap();
        let (columns, fine_columns) = (template.grid().unwrap().0, finer.grid().unwrap().0);
        let mut bent = 0;
        for seed in 0..60 {
            let vertices = sample(&template, &only(6), seed);
            let rest = template.mesh().vertices();
            let turn: f64 = rest
                .iter()
                .zip(&vertices)
                .map(|(r, v)| r.truncate().perp_dot(v.truncate()))
                .sum();
            let along: f64 = rest
                .iter()
                .zip(&vertices)
                .map(|(r, v)| r.truncate().dot(v.truncate()))
                .sum();
            assert!((turn / along).abs() < 1e-9 && along > 0.0, "seed {seed}");
            bent += usize::from(relief(&vertices) > 5.0);
            // The simulation knows nothing of the template's mesh; only the last relaxation does.
            let fine = sample(&finer, &only(6), seed);
            let off =
                (0..rest.len()).map(|k| vertices[k].distance(fine[k / columns * 2 * fine_columns + k % columns * 2]));
            let worst = off.fold(0.0, f64::max);
            assert!(worst < 15.0, "seed {seed}: {worst} mm");
        }
        assert!(bent > 40, "{bent} of 60 have a relief above 5 mm");
    }

    #[test]
    fn the_same_seed_gives_the_same_shape_and_others_do_not() {
        let template = sheet(297.0, 210.0);
        let config = DeformationConfig::default();
        let shapes: Vec<Vec<DVec3>> = (0..50).map(|seed| sample(&template, &config, seed)).collect();
        assert_eq!(shapes[7], sample(&template, &config, 7));
        let corners: HashSet<String> = shapes.iter().map(|shape| format!("{:?}", shape[0])).collect();
        assert_eq!(corners.len(), shapes.len());
    }

    #[test]
    fn a_sheet_that_cannot_be_bent_within_the_bounds_stays_flat() {
        let template = sheet(297.0, 210.0);
        let config = DeformationConfig {
            most_edge_change: EdgeLengthChange { median: 0.0, p95: 0.0 },
            ..only(5)
        };
        assert_eq!(sample(&template, &config, 3), template.mesh().vertices());
    }
}
