//! Samples a second on one core: `cargo run --release --example throughput -p deepsft-synth [COUNT]`.

use deepsft_geometry::{Picture, Template};
use deepsft_synth::{SynthConfig, Synthesizer};
use std::error::Error;
use std::time::Instant;

fn main() -> Result<(), Box<dyn Error>> {
    let count: u64 = std::env::args().nth(1).map_or(Ok(200), |count| count.parse())?;
    let texture = Picture::from_fn(1600, 1131, |x, y| {
        [(x / 3) as u8, (y / 3) as u8, ((x / 40 + y / 40) % 2 * 200) as u8]
    });
    let template = Template::thin_shell(texture, 297.0, 210.0)?;
    let start = Instant::now();
    let synthesizer = Synthesizer::new(&template, SynthConfig::default())?;
    println!("start-up {:.0} ms", start.elapsed().as_secs_f64() * 1e3);
    let start = Instant::now();
    let mut visible = 0;
    for index in 0..count {
        visible += synthesizer.sample(1, index).truth.area();
    }
    let seconds = start.elapsed().as_secs_f64();
    println!(
        "{:.2} ms a sample, {:.0} samples/s on one core",
        1e3 * seconds / count as f64,
        count as f64 / seconds
    );
    println!(
        "the sheet covers {:.1} % of the frame",
        100.0 * visible as f64 / (count as f64 * 480.0 * 270.0)
    );
    Ok(())
}
