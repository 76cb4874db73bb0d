//! `deepsft train`: a model bundle for a template.

use crate::failure::usage;
use crate::output::{atomic, curve_plot, model_card};
use crate::synthesis::SynthesisOptions;
use crate::{input, progress, synthesis};
use anyhow::{Context, Result, bail};
use clap::{ArgGroup, Args};
use deepsft::{DeviceKind, MODEL_FILE, NetworkConfig, encode_png, start_device};
use deepsft_train::{Budget, CurvePoint, Progress, TrainConfig, export_bundle, train};
use indicatif::ProgressBar;
use std::collections::BTreeMap;
use std::ffi::OsString;
use std::fs;
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// File of the template inside a bundle: a folder with it may become a bundle.
const TEMPLATE_IN_BUNDLE: &str = "template/template.json";

#[derive(Args)]
#[command(
    group = ArgGroup::new("budget").args(["minutes", "samples"]),
    after_help = "\
Training is on synthetic images made on the fly; it needs nothing but the template. Ten minutes on two cores
show that it works, an hour or more makes a model that is worth using. Every two minutes the model is
measured on held-out images and a checkpoint is saved to BUNDLE.checkpoint, beside the bundle; the bundle is
written at the end. A training that was stopped, in whatever way, goes on with --resume; one that has ended
goes on with --resume and a larger budget. Files and folders of other kinds in BUNDLE (a poster to print) are
kept.

Examples:
  deepsft train --template cover --out cover-model --minutes 60
  deepsft train --template cover --out cover-model --minutes 180 --resume"
)]
pub struct TrainArguments {
    /// Folder of the template
    #[arg(long, value_name = "DIR")]
    template: PathBuf,
    /// Folder of the model bundle to write
    #[arg(long, value_name = "BUNDLE")]
    out: PathBuf,
    /// Minutes of training in all, resumed ones included [default: 60]
    #[arg(long, value_name = "M", value_parser = positive)]
    minutes: Option<f64>,
    /// Training samples in all, instead of minutes; repeatable on the CPU
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u64).range(1..))]
    samples: Option<u64>,
    /// Seconds of training between two measurements, each of which saves a checkpoint
    #[arg(long, value_name = "SECONDS", default_value_t = TrainConfig::default().evaluate_every, value_parser = positive)]
    evaluate_every: f64,
    /// Go on from the checkpoint beside the bundle
    #[arg(long)]
    resume: bool,
    /// Seed of the weights and of the training images
    #[arg(long, value_name = "S", default_value_t = 1)]
    seed: u64,
    /// What computes: cpu, or vulkan if the program was built with it
    #[arg(long, value_name = "DEVICE", default_value_t = DeviceKind::Cpu)]
    device: DeviceKind,
    /// What is varied in the synthetic images, and how far
    #[arg(long = "images", value_name = "NAME", value_enum, default_value_t)]
    image_preset: synthesis::Preset,
    #[command(flatten)]
    images: SynthesisOptions,
    /// Name of the model for people [default: the name of BUNDLE]
    #[arg(long, value_name = "NAME")]
    name: Option<String>,
}

fn positive(text: &str) -> Result<f64, String> {
    text.parse()
        .ok()
        .filter(|&value: &f64| value.is_finite() && value > 0.0)
        .ok_or("expected a positive number".into())
}

pub fn run(arguments: &TrainArguments) -> Result<()> {
    let config = config(arguments)?;
    let markers = [MODEL_FILE, TEMPLATE_IN_BUNDLE];
    atomic::check_folder(&arguments.out, &markers)?;
    if !arguments.resume && config.checkpoint.exists() {
        bail!(
            "there is a checkpoint of an earlier training: add --resume to go on with it, or remove it: {}",
            config.checkpoint.display()
        );
    }
    let template = input::template(&arguments.template)?;
    let (device, description) = pollster::block_on(start_device(arguments.device))?;
    let synthesizer = Arc::new(synthesis::synthesizer(
        &template,
        &arguments.images.with_preset(arguments.image_preset),
    )?);
    let network = NetworkConfig::compact(template.size_mm().to_array(), &synthesizer.config().camera);
    println!("training on {} ({})", description.kind, description.adapter_name);

    let bar = progress::share();
    let trained = train(&synthesizer, &network, &config, &device, |told| tell(&bar, told))?;
    bar.finish_and_clear();
    println!("measuring on held-out images");
    let curve = trained.state.curve.clone();
    let name = arguments
        .name
        .clone()
        .or_else(|| file_name(&arguments.out))
        .unwrap_or_default();
    let bundle = export_bundle(trained, &synthesizer, &config, &name, &command_line())?;
    let mut extra = companions(&arguments.out)?;
    extra.insert(
        model_card::CARD_FILE.to_owned(),
        model_card::card(&bundle, &description, &curve).into_bytes(),
    );
    extra.insert(
        model_card::CURVE_FILE.to_owned(),
        model_card::curve_csv(&curve).into_bytes(),
    );
    if let Some(plot) = curve_plot::curve_plot(&curve) {
        extra.insert(curve_plot::PLOT_FILE.to_owned(), encode_png(&plot)?);
    }
    extra.extend(bundle.to_files()?);
    atomic::write_folder(&arguments.out, &markers, &extra)?;
    println!("model bundle: {}", arguments.out.display());
    Ok(())
}

fn config(arguments: &TrainArguments) -> Result<TrainConfig> {
    let defaults = TrainConfig::default();
    if arguments.seed == defaults.held_out_seed {
        return Err(usage(format!(
            "--seed {} is that of the held-out images: choose another one",
            arguments.seed
        )));
    }
    let budget = match (arguments.samples, arguments.minutes) {
        (Some(samples), _) => Budget::Samples(samples),
        (None, minutes) => Budget::Seconds(60.0 * minutes.unwrap_or(60.0)),
    };
    let Some(name) = arguments.out.file_name() else {
        return Err(usage(format!(
            "--out {} is not the name of a folder",
            arguments.out.display()
        )));
    };
    let mut checkpoint = OsString::from(name);
    checkpoint.push(".checkpoint");
    let checkpoint = arguments.out.with_file_name(checkpoint);
    Ok(TrainConfig {
        budget,
        seed: arguments.seed,
        resume: arguments.resume,
        evaluate_every: arguments.evaluate_every,
        checkpoint,
        ..defaults
    })
}

/// Shows what the training tells: steps in the bar, measurements as lines that stay.
fn tell(bar: &ProgressBar, told: Progress) {
    match told {
        Progress::Resumed { samples, seconds } => {
            bar.suspend(|| println!("going on after {samples} samples and {:.1} minutes", seconds / 60.0));
        }
        Progress::Step {
            share,
            samples,
            seconds,
            loss,
        } => {
            bar.set_position((share * progress::SHARE_LENGTH as f64) as u64);
            bar.set_message(format!(
                "{samples} samples, {:.1} a second, loss {loss:.3}",
                samples as f64 / seconds
            ));
        }
        Progress::Evaluated(point) => bar.suspend(|| println!("{}", line(&point))),
        _ => {}
    }
}

fn line(point: &CurvePoint) -> String {
    let figure =
        |value: Option<f64>, digits: usize| value.map_or_else(|| "-".to_owned(), |value| format!("{value:.digits$}"));
    format!(
        "{:7.1} min {:9} samples  loss {:.3}  registration {} px  depth {} mm  mask IoU {}",
        point.seconds / 60.0,
        point.samples,
        point.loss,
        figure(point.registration_rmse_px, 2),
        figure(point.depth_rmse_mm, 2),
        figure(point.mask_iou, 3),
    )
}

/// Files that a bundle's folder holds and that are not made by a training, by their paths in it.
fn companions(folder: &Path) -> Result<BTreeMap<String, Vec<u8>>> {
    let made = [
        MODEL_FILE,
        "weights.bpk",
        "template",
        model_card::CARD_FILE,
        model_card::CURVE_FILE,
        curve_plot::PLOT_FILE,
    ];
    let mut files = BTreeMap::new();
    if folder.is_dir() {
        collect(folder, "", &made, &mut files)?;
    }
    Ok(files)
}

/// Adds the files below `folder` but for those of the names `left_out`, their paths after `prefix`.
fn collect(folder: &Path, prefix: &str, left_out: &[&str], files: &mut BTreeMap<String, Vec<u8>>) -> Result<()> {
    let unreadable = |path: &Path| format!("could not read {}", path.display());
    for entry in fs::read_dir(folder).with_context(|| unreadable(folder))? {
        let path = entry.with_context(|| unreadable(folder))?.path();
        let Some(name) = file_name(&path).filter(|name| !left_out.contains(&name.as_str())) else {
            continue;
        };
        if path.is_dir() {
            collect(&path, &format!("{prefix}{name}/"), &[], files)?;
        } else {
            let bytes = fs::read(&path).with_context(|| unreadable(&path))?;
            files.insert(format!("{prefix}{name}"), bytes);
        }
    }
    Ok(())
}

fn file_name(path: &Path) -> Option<String> {
    path.file_name().map(|name| name.to_string_lossy().into_owned())
}

/// The command as it was typed, for the record.
fn command_line() -> String {
    let words = std::env::args()
        .skip(1)
        .map(|word| if word.contains(' ') { format!("'{word}'") } else { word });
    std::iter::once("deepsft".to_owned())
        .chain(words)
        .collect::<Vec<_>>()
        .join(" ")
}

#[cfg(test)]
mod tests {
    use super::*;

    fn arguments(out: &str) -> TrainArguments {
        TrainArguments {
            template: "t".into(),
            out: out.into(),
            minutes: None,
            samples: None,
            evaluate_every: 120.0,
            resume: false,
            seed: 1,
            device: DeviceKind::Cpu,
            image_preset: synthesis::Preset::default(),
            images: SynthesisOptions::default(),
            name: None,
        }
    }

    #[test]
    fn the_checkpoint_lies_beside_the_bundle() {
        for out in ["models/cover", "models/cover/"] {
            let config = config(&arguments(out)).unwrap();
            assert_eq!(config.checkpoint, Path::new("models/cover.checkpoint"));
            assert_eq!(config.budget, Budget::Seconds(3600.0));
        }
        assert!(config(&arguments("..")).is_err());
    }

    #[test]
    fn the_seed_of_the_held_out_images_is_refused() {
        let held_out = TrainArguments {
            seed: TrainConfig::default().held_out_seed,
            ..arguments("a")
        };
        assert!(config(&held_out).unwrap_err().to_string().contains("held-out"));
    }

    #[test]
    fn minutes_are_positive_numbers() {
        assert_eq!(positive("0.5"), Ok(0.5));
        for text in ["0", "-1", "NaN", "inf", "ten"] {
            assert!(positive(text).is_err(), "{text}");
        }
    }

    #[test]
    fn what_else_is_in_the_bundles_folder_is_kept_and_old_weights_are_not() {
        let folder = tempfile::tempdir().unwrap();
        for name in ["template", "figures/old"] {
            fs::create_dir_all(folder.path().join(name)).unwrap();
        }
        for name in [
            "poster.pdf",
            "weights.bpk",
            "model.json",
            "template/template.json",
            "figures/old/template",
        ] {
            fs::write(folder.path().join(name), name).unwrap();
        }
        assert_eq!(
            companions(folder.path()).unwrap().into_keys().collect::<Vec<_>>(),
            ["figures/old/template", "poster.pdf"]
        );
        assert!(companions(&folder.path().join("none")).unwrap().is_empty());
    }
}
