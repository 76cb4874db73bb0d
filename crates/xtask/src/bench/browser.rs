//! Inference in Chromium, on its CPU and by WebGPU: `www/bench/browser.mjs` measures, this starts it and prints the table.

use super::rivals::{self, Rivals};
use crate::{manifest::Manifest, tools};
use anyhow::{Context, Result, ensure};
use serde::Deserialize;
use serde_json::Value;
use std::{path::Path, process::Command};

/// Most by which two programs that run the same network on the same image may differ: where they round differently, a
/// pixel at the mask's edge may change sides, and depths in a few places where two bins are equally likely.
const MAX_MASK_SHARE: f64 = 1e-3;
const MAX_MEDIAN_DEPTH_MM: f64 = 0.05;

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
    webgpu: OnGpu,
}

/// The same by WebGPU.
#[derive(Deserialize)]
struct OnGpu {
    adapter: String,
    runs: u32,
    network: Times,
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
/// When there is no Chromium, no built package, the page fails, or onnxruntime-web computes something else.
pub fn measure(
    root: &Path,
    manifest: &Manifest,
    model: &Path,
    exported: &Path,
    rivals: Option<&Rivals>,
    runs: u32,
) -> Result<Value> {
    let mut command = script(root, manifest, "browser.mjs")?;
    command.arg(model).arg(exported);
    match rivals.and_then(|rivals| Some((rivals.network(), rivals.web()?))) {
        Some((network, web)) => command.arg(network).arg(web),
        None => command.args(["-", "-"]),
    };
    let printed = rivals::printed_by(command.arg(runs.to_string())).context("measuring in the browser")?;
    let figures: Value = serde_json::from_str(&printed).context("reading what browser.mjs printed")?;
    check(&Figures::deserialize(&figures)?)?;
    Ok(figures)
}

/// A script of `www/bench` that drives Chromium.
///
/// # Errors
/// When there is no Chromium.
pub fn script(root: &Path, manifest: &Manifest, name: &str) -> Result<Command> {
    let mut command = Command::new("node");
    command
        .arg(root.join("www/bench").join(name))
        .env("DEEPSFT_CHROMIUM", tools::chromium()?)
        .env(
            "DEEPSFT_CHROMIUM_FLAGS",
            serde_json::to_string(&manifest.browser_tests.chromium_flags)?,
        );
    Ok(command)
}

/// Times of programs that do not compute the same are not worth comparing.
fn check(figures: &Figures) -> Result<()> {
    for Rival { name, difference, .. } in figures.rival.iter().chain(&figures.webgpu.rival) {
        let depth_mm = difference.depth_mm.unwrap_or(0.0);
        ensure!(
            difference.mask_share <= MAX_MASK_SHARE && depth_mm <= MAX_MEDIAN_DEPTH_MM,
            "{name} and DeepSfT do not compute the same: masks differ on {:.2} % of the pixels, depths by {depth_mm} mm (median)",
            100.0 * difference.mask_share,
        );
    }
    Ok(())
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
        webgpu,
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
    println!();
    let OnGpu { adapter, runs, .. } = &webgpu;
    row(&format!("by WebGPU ({adapter}), medians of {runs}"), "ms".to_owned());
    row(
        "network, with packing and reading the maps",
        format!("{:.1}", webgpu.network.median_ms),
    );
    if let Some(Rival {
        name, network, ratio, ..
    }) = &webgpu.rival
    {
        row(&format!("the same, {name}"), format!("{:.1}", network.median_ms));
        row("  ratio, DeepSfT : onnxruntime-web", format!("{ratio:.3}"));
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::json;

    #[test]
    fn a_rival_that_computes_something_else_is_no_comparison() {
        let figures = |mask_share: f64, depth_mm: Option<f64>| {
            let times = json!({"median_ms": 10.0});
            let rival = json!({
                "name": "other", "load_ms": 1.0, "network": times, "ratio": 1.0,
                "difference": {"mask_share": mask_share, "depth_mm": depth_mm},
            });
            let figures = json!({
                "runs": 5, "load_ms": 1.0, "canonical_warp": times, "network": times, "confidence": times,
                "frame": times, "rival": rival,
                "webgpu": {"adapter": "a", "runs": 5, "network": times, "rival": null},
            });
            Figures::deserialize(figures).unwrap()
        };
        assert!(check(&figures(1e-4, Some(1e-3))).is_ok());
        assert!(check(&figures(0.0, None)).is_ok());
        // As measured with the weights of two different trainings.
        assert!(
            check(&figures(2e-3, Some(2.5)))
                .unwrap_err()
                .to_string()
                .contains("0.20 %")
        );
        assert!(check(&figures(0.0, Some(2.5))).is_err());
    }
}
