//! How a sheet moves in a clip.

use super::capsule::capsule;
use super::edge_length_change;
use crate::clip::motion::{ClipMotion, DISTANCE_MM, FIRST_CLIP_SEED, MAX_TILT_DEG};
use crate::deform::{ControlPointDeformation, TOY_EDGE_CHANGE};
use crate::scene::pose::fraction_in_view;
use deepsft_geometry::glam::{DAffine3, DVec3};
use deepsft_geometry::{Picture, RigidMotion, Template, training_camera};
use std::f64::consts::PI;

/// Eight seconds at twenty frames per second.
const FRAMES: usize = 160;

fn sheet() -> Template {
    Template::thin_shell(Picture::from_fn(1, 1, |_, _| [0; 3]), 297.0, 210.0).unwrap()
}

fn seeds() -> impl Iterator<Item = u64> {
    FIRST_CLIP_SEED..FIRST_CLIP_SEED + 6
}

fn frames(template: &Template, seed: u64, count: usize) -> Vec<Vec<DVec3>> {
    let motion = ClipMotion::new(template, &training_camera(), seed);
    (0..count)
        .map(|k| motion.vertices_camera(k as f64 / count as f64))
        .collect()
}

/// The longest way of a vertex from a frame to the next, the last frame's next being the first.
fn longest_step(frames: &[Vec<DVec3>]) -> f64 {
    let next = frames.iter().cycle().skip(1);
    let steps = frames
        .iter()
        .zip(next)
        .flat_map(|(a, b)| a.iter().zip(b).map(|(a, b)| a.distance(*b)));
    steps.fold(0.0, f64::max)
}

/// Unit normal of the front, the mean over the sheet's area.
fn mean_normal(template: &Template, vertices: &[DVec3]) -> DVec3 {
    let area = |&[a, b, c]: &[usize; 3]| (vertices[b] - vertices[a]).cross(vertices[c] - vertices[a]);
    template.mesh().faces().iter().map(area).sum::<DVec3>().normalize()
}

#[test]
fn edges_keep_their_length_in_every_frame() {
    let template = sheet();
    for seed in seeds() {
        for (k, vertices) in frames(&template, seed, FRAMES / 4).iter().enumerate() {
            let change = edge_length_change(template.mesh(), vertices);
            assert!(
                change.median < 0.01 && change.p95 < 0.03,
                "seed {seed}, frame {k}: {change:?}"
            );
        }
    }
}

#[test]
fn nothing_jumps_also_not_where_the_clip_begins_again() {
    // A hand in no hurry moves at up to 0.6 m/s, which is 30 mm in a twentieth of a second. Where a motion is
    // smooth, half the time makes half the step; a jump would stay as long as it is.
    let template = sheet();
    for seed in seeds() {
        let step = longest_step(&frames(&template, seed, FRAMES));
        assert!(step < 30.0, "seed {seed}: {step} mm a frame");
        let half = longest_step(&frames(&template, seed, 2 * FRAMES));
        assert!(half < 0.55 * step, "seed {seed}: {half} of {step} mm");
    }
}

#[test]
fn the_sheet_stays_in_view_at_its_distance_and_turns_its_front_to_the_camera() {
    let (template, camera) = (sheet(), training_camera());
    let [near, far] = DISTANCE_MM;
    for seed in seeds() {
        let mut in_view = 0.0;
        for vertices in frames(&template, seed, FRAMES / 4) {
            let centroid = vertices.iter().sum::<DVec3>() / vertices.len() as f64;
            assert!(
                (near - 1e-9..far + 1e-9).contains(&centroid.z),
                "seed {seed}: {centroid}"
            );
            let fraction = fraction_in_view(&camera, &vertices, &DAffine3::IDENTITY);
            assert!(fraction > 0.75, "seed {seed}: {fraction}");
            in_view += fraction / (FRAMES / 4) as f64;
            let tilt = mean_normal(&template, &vertices).dot(DVec3::NEG_Z).acos().to_degrees();
            assert!(tilt < MAX_TILT_DEG + 1e-6, "seed {seed}: {tilt}");
        }
        assert!(in_view > 0.95, "seed {seed}: {in_view}");
    }
}

#[test]
fn the_sheet_bends_both_ways_and_passes_through_flat_seldom() {
    // How far the sheet's middle column lies behind its outer ones, along the mean normal, tells the side of the bend;
    // 5 mm of relief is a bend of some 15 degrees.
    let template = sheet();
    let (columns, rows) = template.grid().unwrap();
    for seed in seeds() {
        let relief = |vertices: &Vec<DVec3>| {
            let mean = |i: usize| (0..rows).map(|j| vertices[j * columns + i]).sum::<DVec3>() / rows as f64;
            let middle_from_sides = mean(columns / 2) - (mean(0) + mean(columns - 1)) / 2.0;
            -middle_from_sides.dot(mean_normal(&template, vertices))
        };
        let reliefs: Vec<f64> = frames(&template, seed, FRAMES / 4).iter().map(relief).collect();
        let bent = reliefs.iter().filter(|relief| relief.abs() > 5.0).count();
        assert!(bent > 24, "seed {seed}: bent in {bent} of 40 frames: {reliefs:.1?}");
        assert!(
            reliefs.iter().any(|r| *r > 5.0) && reliefs.iter().any(|r| *r < -5.0),
            "seed {seed}: {reliefs:.1?}"
        );
    }
}

#[test]
fn a_solid_bends_smoothly_within_its_bounds_and_turns_its_back_to_the_camera() {
    let limb = Template::of_mesh(capsule(200.0, 20.0, 31, 16), Picture::from_fn(1, 1, |_, _| [0; 3])).unwrap();
    let control_points = ControlPointDeformation::new(limb.mesh()).unwrap();
    let rest = limb.mesh().vertices();
    let mut greatest = Vec::new();
    for seed in seeds() {
        let motion = ClipMotion::new(&limb, &training_camera(), seed).bent_by((&control_points, TOY_EDGE_CHANGE), seed);
        let frames: Vec<Vec<DVec3>> = (0..FRAMES)
            .map(|k| motion.vertices_camera(k as f64 / FRAMES as f64))
            .collect();
        // How far the shape is from the rest shape, as a rigid motion brings the two together, mm RMS.
        let bend = |vertices: &Vec<DVec3>| {
            let pairs = || rest.iter().zip(vertices);
            let motion = RigidMotion::align(pairs().map(|(&p, &q)| (p, q, 1.0)), RigidMotion::IDENTITY);
            (pairs().map(|(&p, &q)| motion.apply(p).distance_squared(q)).sum::<f64>() / rest.len() as f64).sqrt()
        };
        let bends: Vec<f64> = frames.iter().map(bend).collect();
        greatest.push(bends.into_iter().fold(0.0, f64::max));
        for vertices in &frames {
            let change = edge_length_change(limb.mesh(), vertices);
            // Between its shapes lengths differ a little more.
            assert!(change.median < 0.021 && change.p95 < 0.105, "seed {seed}: {change:?}");
        }
        let step = longest_step(&frames);
        assert!(step < 40.0, "seed {seed}: {step} mm a frame");
        let between = motion.vertices_camera(1.5 / FRAMES as f64);
        let off = (0..rest.len()).map(|i| between[i].distance((frames[1][i] + frames[2][i]) / 2.0));
        assert!(off.fold(0.0, f64::max) < 1.0, "seed {seed}");
        let turned = motion.turned_vertices_camera(0.0, PI);
        let is_before = |vertices: &[DVec3], i: usize| {
            let depths = vertices.iter().map(|p| p.z);
            vertices[i].z < depths.sum::<f64>() / rest.len() as f64
        };
        let changed = (0..rest.len()).filter(|&i| is_before(&turned, i) != is_before(&frames[0], i));
        assert!(changed.count() > rest.len() * 3 / 4, "seed {seed}");
    }
    let much = greatest.iter().filter(|bend| **bend > 1.0).count();
    assert!(much >= 3 && greatest.iter().all(|bend| *bend > 0.3), "{greatest:.1?}");
}
