//! How the lab measures: times of repeated work, where figures lie, and the files that they are written to.

use anyhow::Result;
use deepsft_formats::write_file;
use deepsft_geometry::metrics::Summary;
use serde::Serialize;
use std::fs;
use std::path::Path;
use std::time::Instant;

/// Milliseconds over the measured frames.
#[derive(Serialize)]
pub struct Times {
    pub median_ms: f64,
    pub min_ms: f64,
    pub max_ms: f64,
}

impl Times {
    /// `None` without any time.
    pub fn of(times: &[f64]) -> Option<Self> {
        Some(Self {
            median_ms: median(times.iter().copied())?,
            min_ms: times.iter().copied().fold(f64::INFINITY, f64::min),
            max_ms: times.iter().copied().fold(0.0, f64::max),
        })
    }
}

/// Where a figure lies.
#[derive(Clone, Copy, Serialize)]
pub struct Spread {
    pub median: f64,
    pub mean: f64,
    pub p95: f64,
    pub most: f64,
}

impl Spread {
    /// The spread of values; `None` when there are none.
    pub fn of(values: impl IntoIterator<Item = f64>) -> Option<Self> {
        let mut values: Vec<f64> = values.into_iter().collect();
        values.sort_unstable_by(f64::total_cmp);
        let at = |fraction: f64| values[((values.len() - 1) as f64 * fraction).round() as usize];
        let most = *values.last()?;
        Some(Self {
            median: at(0.5),
            mean: values.iter().sum::<f64>() / values.len() as f64,
            p95: at(0.95),
            most,
        })
    }
}

/// The median; `None` of nothing.
pub fn median(values: impl IntoIterator<Item = f64>) -> Option<f64> {
    Summary::of(values.into_iter().map(Some)).map(|summary| summary.median)
}

/// Writes figures to the file that was asked for, if any.
pub fn write_json(path: Option<&Path>, figures: &impl Serialize) -> Result<()> {
    match path {
        Some(path) => Ok(write_file(path, &serde_json::to_vec_pretty(figures)?)?),
        None => Ok(()),
    }
}

/// What `work` gives, and its milliseconds.
pub fn timed<T, E>(work: impl FnOnce() -> Result<T, E>) -> Result<(T, f64), E> {
    let started = Instant::now();
    let result = work()?;
    Ok((result, started.elapsed().as_secs_f64() * 1e3))
}

/// Time that this thread spends on a processor, where the system has it in a file (Linux; exact to a few ms); elsewhere the
/// time that passes. Other programs on the machine hardly change it.
pub struct Stopwatch {
    started: Instant,
    spent: Option<f64>,
}

impl Stopwatch {
    pub fn start() -> Self {
        Self {
            started: Instant::now(),
            spent: spent_ms(),
        }
    }

    pub fn ms(&self) -> f64 {
        match (self.spent, spent_ms()) {
            (Some(before), Some(now)) => now - before,
            _ => self.started.elapsed().as_secs_f64() * 1e3,
        }
    }
}

fn spent_ms() -> Option<f64> {
    let text = fs::read_to_string("/proc/thread-self/schedstat").ok()?;
    let nanoseconds: f64 = text.split_whitespace().next()?.parse().ok()?;
    Some(nanoseconds / 1e6)
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::hint::black_box;
    use std::thread::sleep;
    use std::time::Duration;

    #[test]
    #[cfg(target_os = "linux")]
    fn a_stopwatch_counts_work_and_not_waiting() {
        let (wall, waiting) = (Instant::now(), Stopwatch::start());
        sleep(Duration::from_millis(60));
        let (waited, working) = (waiting.ms(), Stopwatch::start());
        let mut sum = 0_u64;
        while working.ms() < 30.0 {
            sum = (0..100_000).fold(sum, |sum, k| black_box(sum ^ k));
        }
        assert!(
            waited < 30.0 && wall.elapsed() >= Duration::from_millis(90),
            "{waited}, {sum}"
        );
    }
}
