//! `cargo xtask bench`: every throughput and size in one run, beside ONNX Runtime with the same weights.

mod rivals;
mod table;

use crate::{tools, web};
use anyhow::{Context, Result, ensure};
use rivals::Rivals;
use serde_json::{Value, json};
use std::{
    env, fs,
    path::{Path, PathBuf},
    process::{Command, Stdio},
};

/// So long the demo page is watched, s.
const WATCHED_S: &str = "10";

/// Most by which two programs that run the same network on the same image may differ: where they round differently, a
/// pixel at the mask's edge may change sides, and depths in a few places where two bins are equally likely.
const MAX_MASK_SHARE: f64 = 1e-3;
const MAX_MEDIAN_DEPTH_MM: f64 = 0.05;

/// What to measure.
#[derive(clap::Args)]
pub struct Options {
    /// Folder of the model bundle
    #[arg(long, default_value = "models/poster-a4")]
    model: PathBuf,
    /// Where the figures go [default: bench/bench.json in the target folder]
    #[arg(long)]
    json: Option<PathBuf>,
    /// Frames for each median
    #[arg(long, default_value_t = 21, value_parser = clap::value_parser!(u32).range(1..))]
    runs: u32,
    /// Measure what was built last
    #[arg(long)]
    no_build: bool,
    /// Leave the browser out
    #[arg(long)]
    no_browser: bool,
    /// Leave ONNX Runtime out, which is installed below the target folder and needs Python
    #[arg(long)]
    no_onnxruntime: bool,
}

/// Measures, prints tables and writes the figures as JSON.
///
/// # Errors
/// When something that is asked for cannot be built, installed or measured, and when ONNX Runtime computes something
/// else from the same weights.
pub fn run(root: &Path, options: &Options) -> Result<()> {
    let target_folder = tools::target_folder(root)?;
    let folder = target_folder.join("bench");
    fs::create_dir_all(&folder).with_context(|| format!("making {}", folder.display()))?;
    let model = root.join(&options.model);
    let model = model
        .canonicalize()
        .with_context(|| format!("finding the model bundle {}", model.display()))?;
    let browser = !options.no_browser;
    if browser {
        tools::ensure_node_packages(root)?;
    }
    if !options.no_build {
        tools::run(tools::cargo(root).args(["build", "--release", "--package", "deepsft-lab"]))?;
        if browser {
            web::build(root)?;
        }
    }
    let rivals = (!options.no_onnxruntime)
        .then(|| Rivals::install(root, &folder, browser))
        .transpose()?;
    let rivals = rivals.as_ref();

    let lab = || {
        let name = format!("deepsft-lab{}", env::consts::EXE_SUFFIX);
        let mut command = Command::new(target_folder.join("release").join(name));
        command.arg("bench").arg("--model").arg(&model);
        command
    };
    let (exported, graph) = (folder.join("network"), folder.join("network.onnx"));
    tools::run(lab().arg("--export").arg(&exported))?;
    let agreement = rivals
        .map(|rivals| printed_by(rivals.script("write_network.py").arg(&exported).arg(&graph)))
        .transpose()
        .context("ONNX Runtime and DeepSfT do not agree")?;

    let native_json = folder.join("native.json");
    let runs = options.runs.to_string();
    let mut native = lab();
    native.args(["--runs", &runs, "--json"]).arg(&native_json);
    if let (Some(rivals), Some(agreement)) = (rivals, &agreement) {
        let version = agreement["onnxruntime"].as_str().unwrap_or_default();
        let turns = rivals.script("onnxruntime_turns.py");
        native.args(["--rival", &format!("ONNX Runtime {version}"), "--"]);
        native.arg(turns.get_program()).args(turns.get_args());
        native.arg(&exported).arg(&graph);
    }
    println!();
    tools::run(&mut native)?;
    let mut figures = json!({
        "native": tools::json(&native_json)?,
        "agreement_with_onnxruntime": agreement,
    });
    if browser {
        let none = Path::new("-");
        let web = rivals.and_then(|rivals| rivals.web.as_deref());
        let mut measure = script(root, "browser.mjs")?;
        measure.arg(&model).arg(&exported).arg(web.map_or(none, |_| &graph));
        measure.arg(web.unwrap_or(none)).arg(&runs);
        figures["browser"] = printed_by(&mut measure).context("measuring in the browser")?;
        check(&figures["browser"])?;
        figures["demo"] = printed_by(script(root, "demo.mjs")?.arg(WATCHED_S)).context("measuring the demo page")?;
    }
    figures["downloads"] = downloads(root, &model, rivals)?;
    table::print(&figures);

    let file = (options.json.as_ref()).map_or_else(|| folder.join("bench.json"), |file| root.join(file));
    web::write(&file, &serde_json::to_vec_pretty(&figures)?)?;
    println!("\nall figures: {}", file.display());
    Ok(())
}

/// A script of `www/bench` that drives Chromium.
fn script(root: &Path, name: &str) -> Result<Command> {
    let mut command = Command::new("node");
    command
        .arg(root.join("www/bench").join(name))
        .env(tools::CHROMIUM.variable, tools::CHROMIUM.find()?);
    Ok(command)
}

/// The JSON that a command prints; what it complains about is shown as it comes.
fn printed_by(command: &mut Command) -> Result<Value> {
    tools::announce(command);
    let output = command.stderr(Stdio::inherit()).output().context("starting it")?;
    ensure!(output.status.success(), "it failed ({})", output.status);
    serde_json::from_slice(&output.stdout).context("reading what it printed")
}

/// Times of programs that do not compute the same are not worth comparing.
fn check(figures: &Value) -> Result<()> {
    for rival in [&figures["rival"], &figures["webgpu"]["rival"]] {
        let difference = |what: &str| rival["difference"][what].as_f64().unwrap_or(0.0);
        let (mask_share, depth_mm) = (difference("mask_share"), difference("depth_mm"));
        ensure!(
            mask_share <= MAX_MASK_SHARE && depth_mm <= MAX_MEDIAN_DEPTH_MM,
            "{} and DeepSfT do not compute the same: masks differ on {:.2} % of the pixels, depths by {depth_mm} mm (median)",
            rival["name"],
            100.0 * mask_share,
        );
    }
    Ok(())
}

/// What a visitor of the page downloads: the engine (if it is built), the model, and onnxruntime-web (if it is installed). Each file as
/// it is stored, and compressed as a server sends it.
fn downloads(root: &Path, model: &Path, rivals: Option<&Rivals>) -> Result<Value> {
    let package = web::Manifest::load(root)?.package;
    let engine = root.join(&package.out_dir);
    let mut groups = vec![("model", model, model_files(&tools::json(&model.join("model.json"))?)?)];
    if package.files().iter().all(|file| engine.join(file).is_file()) {
        groups.push(("engine", &engine, package.files().into()));
    }
    if let Some(folder) = rivals.and_then(|rivals| rivals.web.as_ref()) {
        let files = [
            "ort-wasm-simd-threaded.wasm",
            "ort-wasm-simd-threaded.mjs",
            "ort.wasm.min.mjs",
        ];
        groups.push(("onnxruntime-web", folder, files.map(str::to_owned).into()));
    }
    let mut downloads = Vec::new();
    for (of, folder, files) in groups {
        for file in files {
            let bytes = web::read(&folder.join(&file))?;
            let gzip_bytes = web::gzip_length(&bytes)?;
            downloads.push(json!({"of": of, "file": file, "bytes": bytes.len(), "gzip_bytes": gzip_bytes}));
        }
    }
    Ok(downloads.into())
}

/// The files that a loader fetches: `model.json` and those it lists.
fn model_files(model_json: &Value) -> Result<Vec<String>> {
    let listed = model_json["files"].as_object().context("model.json lists no files")?;
    let listed = listed.keys().cloned();
    Ok(["model.json".to_owned()].into_iter().chain(listed).collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_rival_that_computes_something_else_is_no_comparison() {
        let figures = |mask_share: f64, depth_mm: Option<f64>| {
            let difference = json!({"mask_share": mask_share, "depth_mm": depth_mm});
            json!({"rival": {"name": "other", "difference": difference}, "webgpu": {"rival": null}})
        };
        assert!(check(&figures(1e-4, Some(1e-3))).is_ok());
        assert!(check(&figures(0.0, None)).is_ok());
        // As measured with the weights of two different trainings.
        let error = check(&figures(2e-3, Some(2.5))).unwrap_err().to_string();
        assert!(error.contains("0.20 %"), "{error}");
        assert!(check(&figures(0.0, Some(2.5))).is_err());
    }

    #[test]
    fn a_models_downloads_are_its_description_and_what_that_lists() {
        let listed = model_files(&json!({"files": {"weights.bpk": {"size": 4000}}, "name": "m"}));
        assert_eq!(listed.unwrap(), ["model.json", "weights.bpk"]);
        assert!(model_files(&json!({})).is_err());
        // Four thousand equal bytes.
        assert!(web::gzip_length(&[7; 4000]).unwrap() < 100);
    }
}
