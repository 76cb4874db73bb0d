//! Where the time of the soft toy's samples goes, on one core:
//! `cargo run --release --example toy_throughput -p deepsft-synth [COUNT]`.

use deepsft_synth::{HandleConfig, HandleDeformation, SynthConfig, Synthesizer, edge_length_change, toy_template};
use rand::SeedableRng;
use std::error::Error;
use std::time::Instant;

fn main() -> Result<(), Box<dyn Error>> {
    let count: u64 = std::env::args().nth(1).map_or(Ok(100), |count| count.parse())?;
    let timed = |what: &str, start: Instant| {
        println!("{what}: {:.2} ms", start.elapsed().as_secs_f64() * 1e3 / count as f64);
    };
    let start = Instant::now();
    let toy = toy_template()?;
    println!(
        "toy of {} faces: {:.0} ms",
        toy.mesh().faces().len(),
        start.elapsed().as_secs_f64() * 1e3
    );
    let start = Instant::now();
    let deformation = HandleDeformation::new(toy.mesh())?;
    println!("handles: {:.0} ms", start.elapsed().as_secs_f64() * 1e3);
    let start = Instant::now();
    let shapes: Vec<_> = (0..count)
        .map(|seed| deformation.deform(&HandleConfig::default(), &mut rand_pcg::Pcg64Mcg::seed_from_u64(seed)))
        .collect();
    timed("a deformation", start);
    let mut changes: Vec<_> = shapes
        .iter()
        .map(|shape| edge_length_change(toy.mesh(), shape))
        .collect();
    for (name, of) in [
        ("median", (|c| c.median) as fn(&deepsft_synth::EdgeLengthChange) -> f64),
        ("95th percentile", |c| c.p95),
    ] {
        changes.sort_unstable_by(|a, b| of(a).total_cmp(&of(b)));
        let at = |share: f64| 100.0 * of(&changes[(share * (changes.len() - 1) as f64) as usize]);
        println!(
            "edge change, {name}: {:.2} % (median sample), {:.2} % (worst)",
            at(0.5),
            at(1.0)
        );
    }
    let still = shapes
        .iter()
        .filter(|shape| shape.as_slice() == toy.mesh().vertices())
        .count();
    println!("{still} of {count} stayed at rest");
    let synthesizer = Synthesizer::new(&toy, SynthConfig::default())?;
    let start = Instant::now();
    for (seed, shape) in (0..).zip(shapes) {
        let away = shape
            .iter()
            .map(|p| *p + 450.0 * deepsft_geometry::glam::DVec3::Z)
            .collect();
        synthesizer.scene(1, seed).render(away, 0)?;
    }
    timed("a scene rendered", start);
    let start = Instant::now();
    let visible: usize = (0..count).map(|index| synthesizer.sample(1, index).truth.area()).sum();
    timed("a sample", start);
    println!(
        "{:.1} samples a second on one core",
        count as f64 / start.elapsed().as_secs_f64()
    );
    println!(
        "the toy covers {:.1} % of the frame",
        100.0 * visible as f64 / (count as f64 * 480.0 * 270.0)
    );
    Ok(())
}
