//! The demo page before a visitor without a GPU: `www/bench/demo.mjs` measures, this starts it and prints the table.

use super::{browser, rivals};
use crate::manifest::Manifest;
use anyhow::{Context, Result};
use serde::Deserialize;
use serde_json::Value;
use std::{collections::BTreeMap, path::Path};

/// So long the page is watched.
const SECONDS: u32 = 10;

#[derive(Deserialize)]
struct Figures {
    window: Window,
    first_mesh_ms: First,
    found_per_second: f64,
    answers_per_second: f64,
    /// By what it was spent on, and `all`; without any where the system does not tell.
    processor_ms_per_frame: BTreeMap<String, f64>,
}

#[derive(Deserialize)]
struct Window {
    width: u32,
    height: u32,
}

#[derive(Deserialize)]
struct First {
    cold: f64,
    warm: f64,
}

/// Measures the page of the site as it is built.
///
/// # Errors
/// When there is no Chromium or the page fails.
pub fn measure(root: &Path, manifest: &Manifest) -> Result<Value> {
    let mut command = browser::script(root, manifest, "demo.mjs")?;
    let printed = rivals::printed_by(command.arg(SECONDS.to_string())).context("measuring the demo page")?;
    serde_json::from_str(&printed).context("reading what demo.mjs printed")
}

/// Prints what [`measure`] gave.
///
/// # Errors
/// When figures are missing.
pub fn print(figures: &Value) -> Result<()> {
    println!();
    for (title, cell) in rows(&Figures::deserialize(figures)?) {
        println!("{title:<46}{cell:>14}");
    }
    Ok(())
}

fn rows(figures: &Figures) -> Vec<(String, String)> {
    let Figures {
        window: Window { width, height },
        first_mesh_ms,
        found_per_second,
        answers_per_second,
        processor_ms_per_frame,
    } = figures;
    let mut rows = vec![
        (
            format!("the demo page without a GPU, {width} x {height}"),
            "clip of 30 fps".to_owned(),
        ),
        (
            "frames followed per second".to_owned(),
            format!("{found_per_second:.1}"),
        ),
        (
            "network answers per second".to_owned(),
            format!("{answers_per_second:.1}"),
        ),
        (
            "click to first mesh, ms, first visit".to_owned(),
            format!("{:.0}", first_mesh_ms.cold),
        ),
        ("  from a warm cache".to_owned(), format!("{:.0}", first_mesh_ms.warm)),
    ];
    let mut spent: Vec<_> = processor_ms_per_frame.iter().collect();
    spent.sort_by(|a, b| b.1.total_cmp(a.1));
    rows.extend(spent.into_iter().map(|(on, ms)| {
        let title = if on == "all" {
            "processor time per frame, ms".to_owned()
        } else {
            format!("  {on}")
        };
        (title, format!("{ms:.1}"))
    }));
    rows
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::json;

    fn titles(processor: &Value) -> Vec<String> {
        let figures = json!({
            "window": {"width": 1280, "height": 720}, "first_mesh_ms": {"cold": 1500.0, "warm": 900.0},
            "found_per_second": 29.0, "answers_per_second": 5.0, "processor_ms_per_frame": processor,
        });
        let rows = rows(&Figures::deserialize(figures).unwrap());
        rows.into_iter().skip(5).map(|(title, _)| title).collect()
    }

    #[test]
    fn what_takes_the_processor_longest_comes_first_and_nothing_where_nobody_tells() {
        assert_eq!(
            titles(&json!({"drawing": 12.0, "all": 50.0, "page": 38.0})),
            ["processor time per frame, ms", "  page", "  drawing"]
        );
        assert!(titles(&json!({})).is_empty());
    }
}
