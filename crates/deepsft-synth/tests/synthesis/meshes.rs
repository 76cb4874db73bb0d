//! Rendering of templates that are no sheets, against closed forms.

use deepsft_geometry::glam::{DQuat, DVec2, DVec3};
use deepsft_geometry::{Picture, Template, TriangleMesh};
use deepsft_synth::{Sample, SynthConfig, Synthesizer};
use std::f64::consts::{PI, TAU};

#[path = "../common/capsule.rs"]
mod fixture;
use fixture::capsule;

const RADIUS: f64 = 100.0;

/// Rings from pole to pole and faces around a ring of the ball.
const RINGS: usize = 97;
const AROUND: usize = 192;

fn art() -> Picture {
    Picture::from_fn(256, 256, |x, y| [x as u8, y as u8, ((x ^ y) & 255) as u8])
}

/// A capsule as long as it is thick.
fn ball() -> Template {
    Template::of_mesh(capsule(2.0 * RADIUS, RADIUS, RINGS, AROUND), art()).unwrap()
}

/// The point of the ball with these texture coordinates: v goes evenly from pole to pole along x; each half around the
/// axis is a chart, u from 0 to 0.49 and from 0.51 to 1.
fn on_ball(u: f64, v: f64) -> DVec3 {
    let around = if u < 0.5 {
        u / 0.49 * PI
    } else {
        PI + (u - 0.51) / 0.49 * PI
    };
    let (along, across) = (-RADIUS * (PI * v).cos(), RADIUS * (PI * v).sin());
    DVec3::new(along, across * around.cos(), across * around.sin())
}

fn clean(template: &Template, vertices: Vec<DVec3>) -> Sample {
    let synthesizer = Synthesizer::new(template, SynthConfig::default()).unwrap();
    synthesizer.render_clean(vertices).unwrap()
}

#[test]
fn a_ball_has_the_depth_of_the_ray_and_the_registration_of_the_point_in_both_charts() {
    let ball = ball();
    // A seam looks at the camera.
    let turn = DQuat::from_rotation_z(0.4) * DQuat::from_rotation_x(PI / 2.0 + 0.2);
    let centre = DVec3::new(20.0, -10.0, 420.0);
    let place = |p: DVec3| centre + turn * p;
    let sample = clean(&ball, ball.mesh().vertices().iter().map(|p| place(*p)).collect());
    // A facet of angle a lies at most R (1 - cos(a / sqrt 2)) inside the ball: half its diagonal from a vertex.
    let facet = TAU / AROUND as f64;
    let sagitta = RADIUS * (1.0 - (facet / 2.0_f64.sqrt()).cos());
    let (mut of_chart, mut hit, mut seen) = ([0, 0], 0, 0);
    for pixel in 0..480 * 270 {
        let at = DVec2::new((pixel % 480) as f64 + 0.5, (pixel / 480) as f64 + 0.5);
        let ray = sample.camera.ray_from_pixel(at).extend(1.0);
        // |t ray - centre| = R, the nearer root; depth is t because the ray's z is 1.
        let (a, b, c) = (
            ray.length_squared(),
            ray.dot(centre),
            centre.length_squared() - RADIUS * RADIUS,
        );
        let root = b * b - a * c;
        let inside = sample.truth.inside(pixel);
        seen += usize::from(inside);
        if root < 0.0 {
            assert!(!inside, "pixel {pixel} sees the ball beside the ball");
            continue;
        }
        hit += 1;
        let depth = (b - root.sqrt()) / a;
        let p = ray * depth;
        let cosine = (centre - p).dot(ray) / (RADIUS * ray.length());
        if cosine < 0.3 {
            continue; // the bounds are of no use where the ball is grazed
        }
        assert!(inside, "pixel {pixel}");
        let error = (f64::from(sample.truth.depth()[pixel]) - depth).abs();
        // Along the ray, whose length a depth of 1 is; f32 maps hold 3e-5 mm.
        assert!(error < sagitta / cosine + 1e-4, "pixel {pixel}: depth off by {error}");
        let [u, v] = sample.truth.registration()[pixel].map(f64::from);
        of_chart[usize::from(u > 0.5)] += 1;
        if (PI * v).sin() < 0.3 {
            continue; // faces around a pole are wedges
        }
        // The point of the facet and that of the ball under the same (u, v): the sagitta and, along the surface, what
        // the ray slips over it, and the chord's uneven speed (a cubic term below both).
        let distance = place(on_ball(u, v)).distance(p);
        let bound = sagitta * (1.0 + 2.0 / cosine) + 1e-3;
        assert!(
            distance < bound,
            "pixel {pixel}: registration off by {distance} mm, bound {bound}"
        );
    }
    assert!(of_chart[0] > 4000 && of_chart[1] > 4000, "{of_chart:?}");
    // At the outline the polyhedron is smaller than the ball by the sagitta, a fortieth of a pixel.
    assert!(hit - seen < hit / 100, "{seen} of {hit} pixels");
}

/// Two square plates of 100 mm that face the camera, each a chart, the first 50 mm up and to the left of the other; depths
/// 400 and 500 mm or the other way round.
fn plates(first_is_near: bool) -> (Template, Vec<DVec3>) {
    let (mut vertices, mut uv, mut faces) = (vec![], vec![], vec![]);
    for k in 0..2 {
        let (offset, z) = (
            50.0 * k as f64 - 75.0,
            if (k == 0) == first_is_near { 400.0 } else { 500.0 },
        );
        for (x, y) in [(0.0, 0.0), (0.0, 1.0), (1.0, 1.0), (1.0, 0.0)] {
            vertices.push(DVec3::new(offset + 100.0 * x, offset + 100.0 * y, z));
            uv.push(DVec2::new(0.5 * k as f64 + 0.45 * x, y));
        }
        faces.extend([[4 * k, 4 * k + 1, 4 * k + 2], [4 * k, 4 * k + 2, 4 * k + 3]]);
    }
    let mesh = TriangleMesh::new(vertices.clone(), uv, faces).unwrap();
    (Template::of_mesh(mesh, art()).unwrap(), vertices)
}

#[test]
fn what_is_nearer_hides_what_is_behind_it_and_the_registration_jumps_between() {
    for first_is_near in [true, false] {
        let (template, vertices) = plates(first_is_near);
        let sample = clean(&template, vertices);
        let (mut counts, order) = ([0, 0], if first_is_near { [0, 1] } else { [1, 0] });
        for pixel in 0..480 * 270 {
            let at = DVec2::new((pixel % 480) as f64 + 0.5, (pixel / 480) as f64 + 0.5);
            let ray = sample.camera.ray_from_pixel(at);
            // The first plate, in the order of depth, that the ray meets.
            let met = order.into_iter().zip([400.0, 500.0]).find_map(|(k, z)| {
                let fraction = (ray * z - (50.0 * k as f64 - 75.0)) / 100.0;
                let inside = fraction.min_element() >= 0.0 && fraction.max_element() <= 1.0;
                inside.then_some((k, z, fraction))
            });
            assert_eq!(sample.truth.inside(pixel), met.is_some(), "pixel {pixel}");
            let Some((k, z, fraction)) = met else { continue };
            counts[k] += 1;
            assert!((f64::from(sample.truth.depth()[pixel]) - z).abs() < 1e-3);
            let [u, v] = sample.truth.registration()[pixel].map(f64::from);
            assert!((u - (0.5 * k as f64 + 0.45 * fraction.x)).abs() < 1e-6 && (v - fraction.y).abs() < 1e-6);
        }
        assert!(counts[0] > 2000 && counts[1] > 2000, "{counts:?}");
    }
}

#[test]
fn samples_of_a_mesh_are_a_function_of_template_configuration_seed_and_index() {
    let tube = Template::of_mesh(capsule(240.0, 30.0, 31, 20), art()).unwrap();
    let one = Synthesizer::new(&tube, SynthConfig::default()).unwrap();
    let other = Synthesizer::new(&tube, SynthConfig::default()).unwrap();
    let forwards: Vec<Sample> = (0..12).map(|index| one.sample(7, index)).collect();
    // In another order, and on two threads that share the solvers.
    let backwards = std::thread::scope(|scope| {
        let odd = scope.spawn(|| {
            (0..12)
                .rev()
                .filter(|i| i % 2 == 1)
                .map(|i| (i, other.sample(7, i)))
                .collect::<Vec<_>>()
        });
        let mut all: Vec<_> = (0..12)
            .rev()
            .filter(|i| i % 2 == 0)
            .map(|i| (i, other.sample(7, i)))
            .collect();
        all.extend(odd.join().unwrap());
        all.sort_by_key(|(index, _)| *index);
        all
    });
    for (sample, (index, again)) in forwards.iter().zip(&backwards) {
        assert!(sample == again, "sample {index}");
    }
    let shown: Vec<&Sample> = forwards.iter().filter(|sample| sample.has_template).collect();
    assert!(shown.len() >= 8);
    assert!(
        shown
            .windows(2)
            .all(|pair| pair[0].vertices_camera != pair[1].vertices_camera)
    );
    for sample in shown {
        assert!(sample.truth.area() > 300, "{}", sample.truth.area());
    }
}
