//! How long a piece of work takes.

use std::fs;
use std::sync::LazyLock;
use std::time::Instant;

/// Ticks of the processor's time per second, in files of Linux.
const TICKS_PER_S: f64 = 100.0;

/// Processor time of all threads of this process so far, s, where the system tells it, as Linux does; else the time of the clock from the first
/// call on. Other programs on the machine do not count. It ticks every 10 ms: sums over frames are exact enough.
pub fn seconds() -> f64 {
    static FIRST: LazyLock<Instant> = LazyLock::new(Instant::now);
    let clock_s = FIRST.elapsed().as_secs_f64();
    processor_s().unwrap_or(clock_s)
}

fn processor_s() -> Option<f64> {
    let stat = fs::read_to_string("/proc/self/stat").ok()?;
    // The name of the program, in brackets, may hold blanks. After it user and system time are the 12th and 13th word.
    let mut words = stat.rsplit_once(')')?.1.split_whitespace().skip(11);
    let mut ticks = || words.next()?.parse::<f64>().ok();
    Some((ticks()? + ticks()?) / TICKS_PER_S)
}

/// The processor that times are taken on, as Linux names it.
pub fn hardware() -> String {
    let cpuinfo = fs::read_to_string("/proc/cpuinfo").unwrap_or_default();
    let named = cpuinfo.lines().find(|line| line.starts_with("model name"));
    let name = named.and_then(|line| Some(line.split_once(':')?.1.trim().to_owned()));
    name.unwrap_or_else(|| format!("a processor of {}", std::env::consts::ARCH))
}
