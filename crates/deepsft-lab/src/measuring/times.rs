//! Times of repeated work: median, least, most.

use serde::Serialize;
use std::time::Instant;

/// Milliseconds over the measured frames.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Times {
    pub median_ms: f64,
    pub least_ms: f64,
    pub most_ms: f64,
}

impl Times {
    /// `None` without any time.
    pub fn of(mut times: Vec<f64>) -> Option<Self> {
        times.sort_by(f64::total_cmp);
        let (&least_ms, &most_ms) = (times.first()?, times.last()?);
        let (low, high) = (times[(times.len() - 1) / 2], times[times.len() / 2]);
        Some(Self {
            median_ms: (low + high) / 2.0,
            least_ms,
            most_ms,
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_median_is_the_middle_or_between_the_two_in_the_middle() {
        let times = |times: &[f64]| Times::of(times.to_vec());
        assert_eq!(
            times(&[9.0, 1.0, 4.0]),
            Some(Times {
                median_ms: 4.0,
                least_ms: 1.0,
                most_ms: 9.0
            })
        );
        assert_eq!(times(&[9.0, 1.0, 4.0, 6.0]).map(|t| t.median_ms), Some(5.0));
        assert_eq!(times(&[]), None);
    }
}
