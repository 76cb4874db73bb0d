//! `cargo xtask bench`: every throughput and size in one run, beside ONNX Runtime with the same weights; ARAP completion
//! beside libigl with `--only completion`.

mod browser;
mod completion;
mod demo;
mod download;
mod rivals;

use crate::{manifest::Manifest, tools, web};
use anyhow::{Context, Result, ensure};
use rivals::Rivals;
use serde_json::{Value, json};
use std::{
    env, fs,
    path::{Path, PathBuf},
    process::Command,
};

/// What to measure.
#[derive(Debug, PartialEq, Eq)]
pub struct Options {
    /// Folder of the model bundle, relative to the workspace's root.
    pub model: PathBuf,
    /// Where the figures go; by default below the target folder.
    pub json: Option<PathBuf>,
    /// Whether to build what is measured.
    pub build: bool,
    /// Whether to measure in the browser too.
    pub browser: bool,
    /// Whether to install ONNX Runtime (for completion libigl) and measure it too.
    pub rivals: bool,
    /// Measure this, and nothing else.
    pub only: Option<Only>,
    /// Frames for each median.
    pub runs: u32,
}

/// What can be measured alone.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Only {
    /// ARAP completion beside libigl.
    Completion,
    /// The paper's network and R50F beside ONNX Runtime.
    Architectures,
}

impl Default for Options {
    fn default() -> Self {
        Self {
            model: PathBuf::from("models/poster-a4"),
            json: None,
            build: true,
            browser: true,
            rivals: true,
            only: None,
            runs: 21,
        }
    }
}

impl Options {
    /// Reads the task's command line.
    ///
    /// # Errors
    /// For an unknown option or a missing or unfit value.
    pub fn parse(arguments: &[String]) -> Result<Self> {
        let mut options = Self::default();
        let mut arguments = arguments.iter();
        while let Some(argument) = arguments.next() {
            let mut value = || arguments.next().with_context(|| format!("{argument} wants a value"));
            match argument.as_str() {
                "--model" => options.model = value()?.into(),
                "--json" => options.json = Some(value()?.into()),
                "--runs" => {
                    let runs = value()?;
                    options.runs = runs.parse().with_context(|| format!("--runs {runs}: not a number"))?;
                    ensure!(options.runs > 0, "--runs 0 would measure nothing");
                }
                "--no-build" => options.build = false,
                "--no-browser" => options.browser = false,
                "--no-onnxruntime" | "--no-libigl" => options.rivals = false,
                "--only" => match value()?.as_str() {
                    "completion" => options.only = Some(Only::Completion),
                    "architectures" => options.only = Some(Only::Architectures),
                    other => anyhow::bail!("--only {other}: there are `completion` and `architectures`"),
                },
                other => anyhow::bail!("cargo xtask bench does not know {other:?}"),
            }
        }
        Ok(options)
    }
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
    match options.only {
        Some(Only::Completion) => return completion::run(root, &target_folder, &folder, options),
        Some(Only::Architectures) => {
            if options.build {
                build_program(root)?;
            }
            let rivals = Rivals::install(root, &folder, false)?;
            let figures = architectures(&rivals, &target_folder, &folder, options.runs)?;
            return write(root, options, &folder, &figures);
        }
        None => {}
    }
    let model = root.join(&options.model);
    let model = model
        .canonicalize()
        .with_context(|| format!("finding the model bundle {}", model.display()))?;
    let manifest = Manifest::load(root)?;
    if options.browser {
        tools::ensure_node_packages(root, &manifest.tools)?;
    }
    if options.build {
        build_program(root)?;
        if options.browser {
            web::build(root)?;
        }
    }
    let rivals = if options.rivals {
        Some(Rivals::install(root, &folder, options.browser)?)
    } else {
        None
    };

    let lab = || {
        let mut command = program(&target_folder);
        command.arg("bench").arg("--model").arg(&model);
        command
    };
    let exported = folder.join("network");
    tools::run(lab().arg("--export").arg(&exported))?;
    let agreement = rivals
        .as_ref()
        .map(|rivals| rivals.write_network(&exported, rivals.network(), false))
        .transpose()?;

    let native_json = folder.join("native.json");
    let mut native = lab();
    native
        .args(["--runs", &options.runs.to_string(), "--json"])
        .arg(&native_json);
    if let (Some(rivals), Some(agreement)) = (&rivals, &agreement) {
        rivals.compete(&mut native, agreement, &exported, rivals.network());
    }
    println!();
    tools::run(&mut native)?;
    let native: Value = serde_json::from_slice(&web::read(&native_json)?)?;
    if let Some(agreement) = &agreement {
        print_agreement(agreement)?;
    }

    let in_browser = if options.browser {
        let figures = browser::measure(root, &manifest, &model, &exported, rivals.as_ref(), options.runs)?;
        browser::print(&figures)?;
        Some(figures)
    } else {
        None
    };
    let demo = if options.browser {
        let figures = demo::measure(root, &manifest)?;
        demo::print(&figures)?;
        Some(figures)
    } else {
        None
    };
    if let Some(figures) = &in_browser {
        print_mesh(&native, figures)?;
    }
    let downloads = download::sizes(root, &manifest, &model, rivals.as_ref())?;
    download::print(&downloads);

    let rivals = rivals.as_ref();
    let architectures = rivals.map(|rivals| architectures(rivals, &target_folder, &folder, options.runs));

    let figures = json!({
        "native": native,
        "agreement_with_onnxruntime": agreement,
        "architectures": architectures.transpose()?,
        "browser": in_browser,
        "demo": demo,
        "downloads": downloads,
    });
    write(root, options, &folder, &figures)
}

fn write(root: &Path, options: &Options, folder: &Path, figures: &Value) -> Result<()> {
    let file = match &options.json {
        Some(file) => root.join(file),
        None => folder.join("bench.json"),
    };
    fs::write(&file, serde_json::to_vec_pretty(figures)?).with_context(|| format!("writing {}", file.display()))?;
    println!("\nall figures: {}", file.display());
    Ok(())
}

/// The paper's main block, its network and R50F, untrained, in turns with ONNX Runtime on the same weights.
fn architectures(rivals: &Rivals, target_folder: &Path, folder: &Path, runs: u32) -> Result<Value> {
    let measure = |name: &str, main_only: bool| -> Result<Value> {
        let lab = || {
            let mut command = program(target_folder);
            command.args(["network-time", name]).args(main_only.then_some("--main"));
            command
        };
        let part = if main_only { ".main" } else { "" };
        let [exported, graph, json] =
            ["network", "onnx", "json"].map(|kind| folder.join(format!("{name}{part}.{kind}")));
        println!();
        tools::run(lab().arg("--export").arg(&exported))?;
        let agreement = rivals.write_network(&exported, &graph, main_only)?;
        let mut turns = lab();
        turns.args(["--passes", &runs.to_string(), "--json"]).arg(&json);
        rivals.compete(&mut turns, &agreement, &exported, &graph);
        tools::run(&mut turns)?;
        let turns: Value = serde_json::from_slice(&web::read(&json)?)?;
        Ok(json!({ "agreement_with_onnxruntime": agreement, "turns": turns }))
    };
    Ok(json!({
        "paper_main_block": measure("paper", true)?,
        "paper": measure("paper", false)?,
        "r50f": measure("r50f", false)?,
    }))
}

/// What follows the network, natively and in the browser, both on one thread.
fn print_mesh(native: &Value, in_browser: &Value) -> Result<()> {
    println!(
        "\n{:<46}{:>10}{:>10}{:>8}",
        "the mesh, ms, medians, 1 thread", "native", "browser", "ratio"
    );
    for (title, stage) in [
        ("mesh fitted to one frame", "fit"),
        ("ARAP completion of one frame", "completion"),
        ("start of a track", "track_start"),
        ("one frame followed", "track"),
    ] {
        let median = |figures: &Value| {
            let value = figures
                .pointer(&format!("/mesh/{stage}/median_ms"))
                .and_then(Value::as_f64);
            value.with_context(|| format!("nothing was measured of {stage:?}"))
        };
        let (native, in_browser) = (median(native)?, median(in_browser)?);
        println!(
            "{title:<46}{native:>10.2}{in_browser:>10.2}{:>8.2}",
            in_browser / native
        );
    }
    Ok(())
}

/// Builds the program `deepsft-lab`.
fn build_program(root: &Path) -> Result<()> {
    tools::run(tools::cargo(root).args(["build", "--release", "--package", "deepsft-lab"]))
}

/// The program `deepsft-lab` as it was built.
fn program(target_folder: &Path) -> Command {
    let name = format!("deepsft-lab{}", env::consts::EXE_SUFFIX);
    Command::new(target_folder.join("release").join(name))
}

/// How far ONNX Runtime's answer is from ours.
fn print_agreement(agreement: &Value) -> Result<()> {
    let figure = |pointer: &str| {
        let value = agreement.pointer(pointer).and_then(Value::as_f64);
        value.with_context(|| format!("write_network.py reports nothing for {pointer}"))
    };
    println!(
        "\nSame weights, same image: ONNX Runtime's mask logits differ by at most {:.1e}, bin logits by {:.1e}; coordinates\n\
         by {:.1e} (median) and, where two bins are equally likely, visibly in {:.3} % of the pixels.",
        figure("/largest_difference/mask")?,
        figure("/largest_difference/bins.0")?
            .max(figure("/largest_difference/bins.1")?)
            .max(figure("/largest_difference/bins.2")?),
        figure("/median_difference")?,
        100.0 * figure("/differing_pixel_share")?,
    );
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn parse(line: &str) -> Result<Options> {
        Options::parse(&line.split_whitespace().map(str::to_owned).collect::<Vec<_>>())
    }

    #[test]
    fn without_arguments_everything_is_measured_with_the_shipped_model() {
        let options = parse("").unwrap();
        assert_eq!(options, Options::default());
        assert!(options.build && options.browser && options.rivals);
    }

    #[test]
    fn parts_can_be_left_out_and_what_is_not_known_is_refused() {
        let options = parse("--no-browser --model m --runs 5 --no-onnxruntime").unwrap();
        assert_eq!((options.browser, options.rivals, options.runs), (false, false, 5));
        assert_eq!(options.model, Path::new("m"));
        for (line, named) in [
            ("--fast", "--fast"),
            ("--model", "--model"),
            ("--runs many", "many"),
            ("--runs 0", "0"),
            ("--only synthesis", "synthesis"),
        ] {
            let error = format!("{:#}", parse(line).unwrap_err());
            assert!(error.contains(named), "{line}: {error}");
        }
    }

    #[test]
    fn completion_can_be_measured_alone_with_and_without_libigl() {
        let options = parse("--only completion --no-libigl").unwrap();
        assert!(options.only == Some(Only::Completion) && !options.rivals);
        assert!(parse("--only completion").unwrap().rivals);
        let root = crate::workspace_root().unwrap();
        let pinned = rivals::pinned_python(&root, completion::REQUIREMENTS, "libigl").unwrap();
        assert!(pinned.starts_with(char::is_numeric), "{pinned}");
    }

    #[test]
    fn both_onnx_runtimes_are_of_one_version() {
        let root = crate::workspace_root().unwrap();
        assert_eq!(
            rivals::pinned_python(&root, rivals::REQUIREMENTS, "onnxruntime").unwrap(),
            rivals::pinned_npm(&root, "onnxruntime-web").unwrap()
        );
    }
}
