//! Random shapes of a sheet.

use super::edge_length_change;
use crate::deform::config::DeformationFamily;
use crate::deform::{DeformationConfig, EdgeLengthChange, deform};
use deepsft_geometry::glam::DVec3;
use deepsft_geometry::{Picture, Template};
use rand::SeedableRng;
use rand_pcg::Pcg64Mcg;

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

/// |l / l0 - 1| of each edge.
fn edge_length_changes(template: &Template, vertices: &[DVec3]) -> impl Iterator<Item = f64> {
    let rest = template.mesh().vertices();
    let edges = template.mesh().edges().into_iter();
    edges.map(move |[a, b]| (vertices[a].distance(vertices[b]) / rest[a].distance(rest[b]) - 1.0).abs())
}

/// Median and 95th percentile over the edges of many samples together, after a check of each.
fn change_over(template: &Template, config: &DeformationConfig, samples: u64) -> EdgeLengthChange {
    let mut changes = Vec::new();
    let mut flat = 0;
    for seed in 0..samples {
        let vertices = sample(template, config, seed);
        // What cannot be bent within the bounds is left flat.
        flat += u64::from(relief(&vertices) < 1e-4 * template.size_mm().length());
        let change = edge_length_change(template.mesh(), &vertices);
        assert!(change.median < 0.01 && change.p95 < 0.03, "seed {seed}: {change:?}");
        changes.extend(edge_length_changes(template, &vertices));
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
    for (index, family) in DeformationFamily::ALL.iter().copied().enumerate() {
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
    for seed in 0..100 {
        let vertices = sample(&template, &config, seed);
        let most = edge_length_changes(&template, &vertices).fold(0.0, f64::max);
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
        let off = (0..rest.len()).map(|k| vertices[k].distance(fine[k / columns * 2 * fine_columns + k % columns * 2]));
        let worst = off.fold(0.0, f64::max);
        assert!(worst < 15.0, "seed {seed}: {worst} mm");
    }
    assert!(bent > 40, "{bent} of 60 have a relief above 5 mm");
}

#[test]
fn a_sheet_that_cannot_be_bent_within_the_bounds_stays_flat() {
    let template = sheet(297.0, 210.0);
    let config = DeformationConfig {
        max_edge_change: EdgeLengthChange { median: 0.0, p95: 0.0 },
        ..only(5)
    };
    assert_eq!(sample(&template, &config, 3), template.mesh().vertices());
}
