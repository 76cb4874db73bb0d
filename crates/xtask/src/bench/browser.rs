//! Inference in Chromium on its CPU: `www/bench/browser.mjs` measures, this starts it and prints the table.

use super::rivals::{self, Rivals};
use crate::{manifest::Manifest, tools};
use anyhow::{Context, Result};
use serde::Deserialize;
use serde_json::Value;
use std::{path::Path, process::Command};

#[derive(Deserialize)]
struct Times {
    median_ms: f64,
}

#[derive(Deserialize)]
struct Figures {
    runs: u32,
    load_ms: f64,
    canonical_warp: Times,
    network: Times,
    confidence: Times,
    frame: Times,
    rival: Option<Rival>,
}

#[derive(Deserialize)]
struct Rival {
    name: String,
    load_ms: f64,
    network: Times,
    ratio: f64,
    difference: Difference,
}

#[derive(Deserialize)]
struct Difference {
    mask_share: f64,
    depth_mm: Option<f64>,
}

/// Measures in the browser.
///
/// # Errors
/// When there is no Chromium, no built package, or the page fails.
pub fn measure(
    root: &Path,
    manifest: &Manifest,
    model: &Path,
    exported: &Path,
    rivals: Option<&Rivals>,
    runs: u32,
) -> Result<Value> {
    let flags = serde_json::to_string(&manifest.browser_tests.chromium_flags)?;
    let mut command = Command::new("node");
    command
        .arg(root.join("www/bench/browser.mjs"))
        .arg(model)
        .arg(exported)
        .env("DEEPSFT_CHROMIUM", tools::chromium()?)
        .env("DEEPSFT_CHROMIUM_FLAGS", flags);
    match rivals.and_then(|rivals| Some((rivals.network(), rivals.web()?))) {
        Some((network, web)) => command.arg(network).arg(web),
        None => command.args(["-", "-"]),
    };
    let printed = rivals::printed_by(command.arg(runs.to_string())).context("measuring in the browser")?;
    serde_json::from_str(&printed).context("reading what browser.mjs printed")
}

/// Prints what [`measure`] gave.
///
/// # Errors
/// When figures are missing.
pub fn print(figures: &Value) -> Result<()> {
    let Figures {
        runs,
        load_ms,
        canonical_warp,
        network,
        confidence,
        frame,
        rival,
    } = Figures::deserialize(figures)?;
    let row = |title: &str, cell: String| println!("{title:<46}{cell:>14}");
    println!();
    row(
        &format!("inference in the browser, ms, medians of {runs}"),
        "1 thread".to_owned(),
    );
    for (title, times) in [
        ("  canonical warp of 1280 x 720", canonical_warp),
        ("  network, with packing and reading the maps", network),
        ("  confidence", confidence),
        ("camera frame to maps", frame),
    ] {
        row(title, format!("{:.2}", times.median_ms));
    }
    row("loading engine and model from this machine", format!("{load_ms:.0}"));
    if let Some(Rival {
        name,
        load_ms,
        network,
        ratio,
        difference,
    }) = rival
    {
        row(
            &format!("the same network stage, {name}"),
            format!("{:.2}", network.median_ms),
        );
        row("  ratio, DeepSfT : onnxruntime-web", format!("{ratio:.2}"));
        row("loading onnxruntime-web and the network", format!("{load_ms:.0}"));
        let depth = difference
            .depth_mm
            .map_or_else(String::new, |mm| format!(", depths differ by {mm:.2e} mm (median)"));
        println!(
            "the two masks differ on {:.4} % of the pixels{depth}",
            100.0 * difference.mask_share
        );
    }
    Ok(())
}
