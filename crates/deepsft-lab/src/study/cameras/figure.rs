//! Mean and median over scenes.

use deepsft_geometry::metrics::Summary;

/// Mean and median; `None` without any value.
pub type Figure = Option<[f64; 2]>;

pub fn mean_and_median(values: impl Iterator<Item = Option<f64>>) -> Figure {
    Summary::of(values).map(|summary| [summary.mean, summary.median])
}

/// A figure as the tables have it.
pub fn figure(figure: Figure, decimals: usize) -> String {
    figure.map_or_else(
        || "-".to_owned(),
        |[mean, median]| format!("{mean:.decimals$} / **{median:.decimals$}**"),
    )
}
