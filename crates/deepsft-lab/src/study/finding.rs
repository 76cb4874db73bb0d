//! `deepsft-lab study finding`: how often features find a print that nothing was trained for.

use anyhow::{Result, ensure};
use clap::Args;
use deepsft_cli::{input, progress};
use deepsft_finding::{FeatureFinder, FeatureOptions, Features, PictureTarget, feature_image};
use deepsft_formats::write_file;
use deepsft_geometry::fitting::{FitOptions, FrameFitter};
use deepsft_geometry::{Camera, CanonicalWarp, Maps, Picture, Template, training_camera};
use deepsft_synth::painting::artwork;
use deepsft_synth::random::{Stream, generator};
use deepsft_synth::{SynthConfig, Synthesizer};
use serde::Serialize;
use std::path::PathBuf;
use std::time::Instant;

/// Longer side of every print, mm.
const LONG_SIDE_MM: f64 = 297.0;

/// Agreement of fit and image from which a print counts as found.
const FOUND: f64 = 0.6;

/// Bars of the table: median registration errors, pixels of the canonical image.
const START_PX: f64 = 8.0;
const FITTED_PX: f64 = 2.0;

#[derive(Args)]
#[command(after_help = "\
Every print is painted by a program or is one of your photographs. It is rendered on a sheet 297 mm long, 250 to 900 mm
away, tilted by up to 65 degrees, any way up, bent, partly hidden, into images of 960 x 540 pixels. The same number of
frames shows another print in its place. Errors are medians over the visible sheet in pixels of the canonical image.

Example, about five minutes on one core:
  deepsft-lab study finding --prints 100 --frames 5 --seed 424242 --json finding.json")]
pub struct FindingStudyArguments {
    /// Painted prints: collages, mosaics, geometric posters, rings, text, triangles, scribbles, landscapes, noise
    #[arg(long, value_name = "N", default_value_t = 100)]
    prints: usize,
    /// Folder of photographs (PNG or JPEG); each is a print too
    #[arg(long, value_name = "DIR")]
    photographs: Option<PathBuf>,
    /// Frames per print
    #[arg(long, value_name = "N", default_value_t = 5, value_parser = clap::value_parser!(u64).range(1..))]
    frames: u64,
    /// Seed of prints and frames
    #[arg(long, value_name = "S")]
    seed: u64,
    /// Write the figures to this file
    #[arg(long, value_name = "FILE")]
    json: Option<PathBuf>,
}

/// One frame.
#[derive(Serialize)]
struct FrameResult {
    print: usize,
    kind: &'static str,
    index: u64,
    /// Whether the features gave a sheet.
    found: bool,
    /// Median registration error of the features' mesh and of the fitted one. `None` where less than half of the visible sheet
    /// has a registration.
    start_px: Option<f64>,
    fitted_px: Option<f64>,
    /// Agreement of the fit with the image.
    agreement: f64,
    /// The same of a frame that shows another print.
    agreement_without: f64,
    features_ms: f64,
    find_ms: f64,
}

/// The content of the JSON file.
#[derive(Serialize)]
struct Report<'a> {
    prints: usize,
    seed: u64,
    frames: &'a [FrameResult],
    deepsft_version: &'static str,
}

pub fn run(arguments: &FindingStudyArguments) -> Result<()> {
    let prints = prints(arguments)?;
    ensure!(
        prints.len() > 1,
        "at least two prints are needed: one is shown in the other's place"
    );
    let templates = prints
        .iter()
        .map(|(_, picture)| template(picture))
        .collect::<Result<Vec<_>>>()?;
    let bar = progress::counting(prints.len() as u64, "prints");
    let mut results = Vec::new();
    for (number, (kind, _)) in prints.iter().enumerate() {
        let other = &templates[(number + 1) % templates.len()];
        let mut studied = Studied::new(&templates[number], other)?;
        for index in 0..arguments.frames {
            let seed = arguments.seed.wrapping_add(number as u64);
            results.push(studied.frame((number, kind), seed, index)?);
        }
        bar.inc(1);
    }
    bar.finish_and_clear();
    print_table(&results);
    if let Some(path) = &arguments.json {
        let report = Report {
            prints: prints.len(),
            seed: arguments.seed,
            frames: &results,
            deepsft_version: env!("CARGO_PKG_VERSION"),
        };
        write_file(path, &serde_json::to_vec_pretty(&report)?)?;
    }
    Ok(())
}

/// The prints and what they are.
fn prints(arguments: &FindingStudyArguments) -> Result<Vec<(&'static str, Picture)>> {
    let paint = |number: usize| {
        let mut rng = generator(arguments.seed, number as u64, Stream::Pool);
        artwork(number, &mut rng)
    };
    let mut prints: Vec<_> = (0..arguments.prints).map(paint).collect();
    if let Some(folder) = &arguments.photographs {
        for file in input::images(folder, "folder of photographs")? {
            prints.push(("photograph", input::picture(&file)?));
        }
    }
    Ok(prints)
}

fn template(picture: &Picture) -> Result<Template> {
    let (width, height) = (picture.width() as f64, picture.height() as f64);
    let scale = LONG_SIDE_MM / width.max(height);
    Ok(Template::thin_shell(picture.clone(), width * scale, height * scale)?)
}

/// A print with everything that looks for it.
struct Studied<'a> {
    template: &'a Template,
    shown: Synthesizer,
    another: Synthesizer,
    camera: Camera,
    canonical: Camera,
    finder: FeatureFinder,
    fitter: FrameFitter,
}

impl<'a> Studied<'a> {
    fn new(template: &'a Template, other: &Template) -> Result<Self> {
        let canonical = training_camera();
        let camera = canonical.resized(2 * canonical.width(), 2 * canonical.height())?;
        let default = SynthConfig::default();
        let config = SynthConfig {
            camera,
            empty_probability: 0.0,
            least_visible_px: 4 * default.least_visible_px,
            ..default
        };
        Ok(Self {
            template,
            shown: Synthesizer::new(template, config.clone())?,
            another: Synthesizer::new(other, config)?,
            camera,
            canonical,
            finder: FeatureFinder::new(PictureTarget::new(template.clone())?)?,
            fitter: FrameFitter::new(template, FitOptions::default())?,
        })
    }

    fn frame(&mut self, (print, kind): (usize, &'static str), seed: u64, index: u64) -> Result<FrameResult> {
        let sample = self.shown.sample(seed, index);
        let truth = halved(&sample.truth);
        let search = self.search(&sample.image)?;
        let without = self.search(&self.another.sample(seed, index).image)?;
        let error = |maps: &Maps| error_px(&truth, maps, self.template, &self.canonical);
        Ok(FrameResult {
            print,
            kind,
            index,
            found: search.sheet.is_some(),
            start_px: search.sheet.as_ref().and_then(|sheet| error(&sheet.start)),
            fitted_px: search.sheet.as_ref().and_then(|sheet| error(&sheet.fitted)),
            agreement: search.agreement(),
            agreement_without: without.agreement(),
            features_ms: search.features_ms,
            find_ms: search.find_ms,
        })
    }

    fn search(&mut self, image: &Picture) -> Result<Search> {
        let start = Instant::now();
        let (small, camera) = feature_image(image, &self.camera)?;
        let features = Features::of(&small, &FeatureOptions::default());
        let features_ms = start.elapsed().as_secs_f64() * 1e3;
        let start = Instant::now();
        let found = self.finder.find(&features, &camera, &self.canonical)?;
        let find_ms = start.elapsed().as_secs_f64() * 1e3;
        let mut sheet = None;
        if let Some(found) = found {
            let canonical = CanonicalWarp::new(&self.camera, &self.canonical).apply(image)?;
            let fit = self.fitter.fit(&canonical, &self.canonical, &found.maps, None)?;
            let (fitted, agreement) = fit.map_or_else(|| (found.maps.clone(), 0.0), |fit| (fit.maps, fit.agreement));
            sheet = Some(FittedSheet {
                start: found.maps,
                fitted,
                agreement,
            });
        }
        Ok(Search {
            sheet,
            features_ms,
            find_ms,
        })
    }
}

/// What became of one image.
struct Search {
    sheet: Option<FittedSheet>,
    features_ms: f64,
    find_ms: f64,
}

/// Maps before and after the fit, and its agreement with the image.
struct FittedSheet {
    start: Maps,
    fitted: Maps,
    agreement: f64,
}

impl Search {
    fn agreement(&self) -> f64 {
        self.sheet.as_ref().map_or(0.0, |sheet| sheet.agreement)
    }
}

/// Every second pixel of every second row.
fn halved(maps: &Maps) -> Maps {
    let (width, height) = (maps.width() / 2, maps.height() / 2);
    let mut half = Maps::empty(width, height);
    for pixel in 0..width * height {
        let at = 2 * (pixel / width) * maps.width() + 2 * (pixel % width);
        if maps.inside(at) {
            half.set(pixel, maps.depth()[at], maps.registration()[at]);
        }
    }
    half
}

/// Median distance between two registrations over the visible sheet, pixels; `None` when most of it has none.
fn error_px(truth: &Maps, found: &Maps, template: &Template, camera: &Camera) -> Option<f64> {
    let error = |pixel: usize| {
        if !found.inside(pixel) {
            return f64::INFINITY;
        }
        let off = ((truth.uv(pixel) - found.uv(pixel)) * template.size_mm()).length();
        off * camera.focal().x / f64::from(truth.depth()[pixel])
    };
    let pixels = (0..truth.depth().len()).filter(|&pixel| truth.inside(pixel));
    median(pixels.map(error)).filter(|error| error.is_finite())
}

fn median(values: impl Iterator<Item = f64>) -> Option<f64> {
    let mut values: Vec<f64> = values.collect();
    values.sort_by(f64::total_cmp);
    values.get(values.len() / 2).copied()
}

fn print_table(results: &[FrameResult]) {
    let mut kinds: Vec<&str> = results.iter().map(|r| r.kind).collect();
    kinds.sort_unstable();
    kinds.dedup();
    println!("prints      frames  within 8 px  within 2 px  found  found and   another print");
    println!("                        (start)     (fitted)         off by 2 px  found");
    for kind in kinds.into_iter().map(Some).chain([None]) {
        let of = || results.iter().filter(|r| kind.is_none_or(|kind| r.kind == kind));
        let count = of().count();
        let percent = |holds: &dyn Fn(&FrameResult) -> bool| {
            let part = of().filter(|r| holds(r)).count();
            format!("{:.1} %", 100.0 * part as f64 / count as f64)
        };
        let within = |error: Option<f64>, bar: f64| error.is_some_and(|error| error < bar);
        println!(
            "{:11} {count:6} {:>12} {:>12} {:>6} {:>11} {:>14}",
            kind.unwrap_or("all"),
            percent(&|r| within(r.start_px, START_PX)),
            percent(&|r| within(r.fitted_px, FITTED_PX)),
            percent(&|r| r.agreement >= FOUND),
            percent(&|r| r.agreement >= FOUND && !within(r.fitted_px, FITTED_PX)),
            percent(&|r| r.agreement_without >= FOUND),
        );
    }
    let time = |of: &dyn Fn(&FrameResult) -> f64| median(results.iter().map(of)).unwrap_or_default();
    println!(
        "medians: features {:.0} ms, find {:.0} ms",
        time(&|r| r.features_ms),
        time(&|r| r.find_ms)
    );
}
