//! Times of repeated work: median, least, most.

use serde::Serialize;
use std::fs;
use std::time::Instant;

/// Milliseconds over the measured frames.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Times {
    pub median_ms: f64,
    pub min_ms: f64,
    pub max_ms: f64,
}

impl Times {
    /// `None` without any time.
    pub fn of(mut times: Vec<f64>) -> Option<Self> {
        times.sort_by(f64::total_cmp);
        let (&min_ms, &max_ms) = (times.first()?, times.last()?);
        let (low, high) = (times[(times.len() - 1) / 2], times[times.len() / 2]);
        Some(Self {
            median_ms: (low + high) / 2.0,
            min_ms,
            max_ms,
        })
    }
}

/// Runs `work` and writes its milliseconds.
pub fn timed<T>(ms: &mut f64, work: impl FnOnce() -> T) -> T {
    let started = Instant::now();
    let result = work();
    *ms = started.elapsed().as_secs_f64() * 1e3;
    result
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

    #[test]
    fn a_median_is_the_middle_or_between_the_two_in_the_middle() {
        let times = |times: &[f64]| Times::of(times.to_vec());
        assert_eq!(
            times(&[9.0, 1.0, 4.0]),
            Some(Times {
                median_ms: 4.0,
                min_ms: 1.0,
                max_ms: 9.0
            })
        );
        assert_eq!(times(&[9.0, 1.0, 4.0, 6.0]).map(|t| t.median_ms), Some(5.0));
        assert_eq!(times(&[]), None);
    }
}
