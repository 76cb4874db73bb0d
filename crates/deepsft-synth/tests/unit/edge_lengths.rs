//! Percentiles of changes of edge lengths.

use crate::edge_lengths::{EdgeLengthChange, EdgeLengthHistogram};

#[test]
fn a_histogram_of_parts_finds_the_percentiles_of_the_whole() {
    let changes: Vec<f64> = (0..4000).map(|k| 1e-4 * (1.0 + 0.05 * f64::from(k))).collect();
    let (mut first, mut second) = (EdgeLengthHistogram::default(), EdgeLengthHistogram::default());
    for (k, some) in changes.chunks(500).enumerate() {
        let part = if k % 3 == 0 { &mut first } else { &mut second };
        part.count(some.iter().copied());
    }
    first.add(&second);
    assert_eq!(first.samples, 8);
    let (found, exact) = (first.change(), EdgeLengthChange::of(changes));
    assert!(
        (found.median / exact.median - 1.0).abs() < 0.01,
        "{found:?}, exact {exact:?}"
    );
    assert!((found.p95 / exact.p95 - 1.0).abs() < 0.01, "{found:?}, exact {exact:?}");
    assert_eq!(EdgeLengthHistogram::default().change().p95, 0.0);
}

#[test]
fn counts_that_are_too_large_to_add_do_not_begin_anew() {
    // As a damaged description may have them: bins of which the last holds nearly all.
    let mut huge = EdgeLengthHistogram {
        samples: u64::MAX,
        bins: vec![1, u64::MAX],
    };
    huge.add(&huge.clone());
    assert_eq!((huge.samples, huge.bins.as_slice()), (u64::MAX, &[2, u64::MAX][..]));
    // The second bin, 1e-6 * 2^(1/16) to 1e-6 * 2^(2/16).
    let median = huge.change().median;
    assert!((1.044e-6..1.091e-6).contains(&median), "{median}");
}

#[test]
fn the_95th_of_a_hundred_changes_is_the_nearest_rank() {
    let change = EdgeLengthChange::of((1..=100).rev().map(f64::from).collect());
    assert_eq!(
        change,
        EdgeLengthChange {
            median: 50.0,
            p95: 95.0
        }
    );
    assert_eq!(
        EdgeLengthChange::of(Vec::new()),
        EdgeLengthChange { median: 0.0, p95: 0.0 }
    );
}
