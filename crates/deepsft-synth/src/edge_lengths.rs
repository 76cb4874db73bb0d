//! How the lengths of a mesh's edges change over a data set: how far its deformations are from isometries.

use serde::{Deserialize, Serialize};

/// Bins of an [`EdgeLengthHistogram`] for each doubling of the change.
const BINS_AN_OCTAVE: f64 = 16.0;

/// Changes below this are counted as this: a thousandth of what matters.
const MIN_CHANGE: f64 = 1e-6;

/// Relative change |l / l0 - 1| of a mesh's edge lengths under a deformation.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct EdgeLengthChange {
    /// Median over the edges, each counted once.
    pub median: f64,
    /// 95th percentile over the edges.
    pub p95: f64,
}

impl EdgeLengthChange {
    /// Median and 95th percentile (nearest rank) of the given changes; zeros when there are none.
    pub fn of(mut changes: Vec<f64>) -> Self {
        Self {
            median: percentile(&mut changes, 0.5),
            p95: percentile(&mut changes, 0.95),
        }
    }
}

/// Relative change |l / l0 - 1| of the lengths of the mesh's edges in a data set, over all edges of all samples that
/// show the object.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct EdgeLengthSummary {
    /// Median.
    pub median: f64,
    /// 95th percentile.
    pub p95: f64,
    /// All changes, from which sets can be added up.
    pub histogram: EdgeLengthHistogram,
}

impl EdgeLengthSummary {
    /// Adds the counts of other samples.
    pub(crate) fn add(&mut self, other: &EdgeLengthHistogram) {
        self.histogram.add(other);
        let EdgeLengthChange { median, p95 } = self.histogram.change();
        (self.median, self.p95) = (median, p95);
    }
}

/// How often edge lengths changed how much, over any number of samples: what is made in parts can be added up. Bins are
/// even in the logarithm, 16 a doubling, so that a percentile is found to about 1 % of itself.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct EdgeLengthHistogram {
    /// Samples that were counted: those that show the object.
    pub samples: u64,
    /// Edges in each bin; bin k holds changes from 1e-6 * 2^(k / 16) on, the first all smaller ones too.
    pub bins: Vec<u64>,
}

impl EdgeLengthHistogram {
    /// Counts the edges of a sample.
    pub fn count(&mut self, changes: impl IntoIterator<Item = f64>) {
        self.samples += 1;
        for change in changes {
            let bin = (BINS_AN_OCTAVE * (change.max(MIN_CHANGE) / MIN_CHANGE).log2()) as usize;
            if self.bins.len() <= bin {
                self.bins.resize(bin + 1, 0);
            }
            self.bins[bin] += 1;
        }
    }

    /// Adds the counts of other samples. What is too large stays the largest number there is.
    pub fn add(&mut self, other: &Self) {
        self.samples = self.samples.saturating_add(other.samples);
        if self.bins.len() < other.bins.len() {
            self.bins.resize(other.bins.len(), 0);
        }
        for (sum, count) in self.bins.iter_mut().zip(&other.bins) {
            *sum = sum.saturating_add(*count);
        }
    }

    /// Median and 95th percentile over all edges of all samples; zeros when there are none.
    pub fn change(&self) -> EdgeLengthChange {
        EdgeLengthChange {
            median: self.percentile(0.5),
            p95: self.percentile(0.95),
        }
    }

    fn percentile(&self, fraction: f64) -> f64 {
        let wanted = fraction * self.bins.iter().map(|&count| count as f64).sum::<f64>();
        let mut below = 0.0;
        for (bin, &count) in self.bins.iter().enumerate() {
            if count > 0 && below + count as f64 >= wanted {
                let within = (wanted - below) / count as f64;
                return MIN_CHANGE * ((bin as f64 + within) / BINS_AN_OCTAVE).exp2();
            }
            below += count as f64;
        }
        0.0
    }
}

fn percentile(values: &mut [f64], fraction: f64) -> f64 {
    if values.is_empty() {
        return 0.0;
    }
    let rank = ((values.len() as f64 * fraction).ceil() as usize).clamp(1, values.len()) - 1;
    *values.select_nth_unstable_by(rank, f64::total_cmp).1
}
