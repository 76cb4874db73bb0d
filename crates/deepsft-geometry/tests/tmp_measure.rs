#![allow(clippy::unwrap_used, dead_code)]
mod shapes;
use deepsft_geometry::glam::DVec3;
use deepsft_geometry::solver::VertexPoint;
use deepsft_geometry::{ArapCompletion, CompletionOptions};
use shapes::*;

#[test]
fn measure() {
    let mesh = sheet();
    let v = mesh.vertices().to_vec();
    println!("{} vertices", v.len());
    let tube = closed_tube();
    let cases: Vec<(
        &str,
        &deepsft_geometry::TriangleMesh,
        Vec<DVec3>,
        Box<dyn Fn(usize) -> bool>,
    )> = vec![
        ("disc", &mesh, bent(&mesh, |s| 1.2 * s), {
            let v = v.clone();
            Box::new(move |i| v[i].length() > 82.0)
        }),
        ("lower", &mesh, bent(&mesh, |s| 1.2 * s), {
            let v = v.clone();
            Box::new(move |i| v[i].y < 20.0)
        }),
        ("lower strong", &mesh, bent(&mesh, |s| 2.0 * s), {
            let v = v.clone();
            Box::new(move |i| v[i].y < 20.0)
        }),
        ("half x", &mesh, bent(&mesh, |s| 1.5 * s), {
            let v = v.clone();
            Box::new(move |i| v[i].x < 0.0)
        }),
        ("frame", &mesh, bent(&mesh, |s| 2.0 * s), {
            let v = v.clone();
            Box::new(move |i| v[i].x.abs() > 128.0 || v[i].y.abs() > 88.0)
        }),
        ("corner", &mesh, bent(&mesh, |s| 2.0 * s), {
            let v = v.clone();
            Box::new(move |i| v[i].x < 40.0 && v[i].y < 20.0)
        }),
        ("tube", &tube, bent_tube(&tube, 0.8), {
            let v = tube.vertices().to_vec();
            Box::new(move |i| v[i].z < 0.0)
        }),
    ];
    for (name, mesh, truth, visible) in &cases {
        let seen: Vec<_> = (0..truth.len())
            .filter(|&i| visible(i))
            .map(|vertex| VertexPoint {
                vertex,
                p_camera: truth[vertex],
                weight: 1.0,
            })
            .collect();
        for max_iterations in [0, 4, 9, 20, 400] {
            let options = CompletionOptions {
                max_iterations,
                step_tolerance: 1e-7,
                ..Default::default()
            };
            let mut c = ArapCompletion::new(mesh, options).unwrap();
            let t = std::time::Instant::now();
            let r = c.complete(&seen, None).unwrap();
            let e = r.report.final_energy;
            println!(
                "{name} {:4} it {:8.3} ms: hidden {:.3} visible {:.3} E {:.4} (arap {:.3}) converged {}",
                r.report.iterations,
                t.elapsed().as_secs_f64() * 1e3,
                rmse(&r.vertices, truth, |i| !visible(i)),
                rmse(&r.vertices, truth, |i| visible(i)),
                e.data + 20.0 * e.arap + 0.005 * e.smoothness,
                e.arap,
                r.report.converged
            );
        }
        // energy of the truth
        let options = CompletionOptions {
            max_iterations: 0,
            ..Default::default()
        };
        let mut c = ArapCompletion::new(mesh, options).unwrap();
        let r = c.complete(&seen, Some(truth)).unwrap();
        println!("{name} truth arap {:.4}", r.report.initial_energy.arap);
    }
}
