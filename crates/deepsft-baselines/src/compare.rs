//! `deepsft-baselines compare`: methods on the same synthetic frames.

use crate::dof::Dof;
use crate::figure::{self, Panel};
use crate::frames::{Frames, Source};
use crate::maps_file;
use crate::methods::{Followed, Method, Methods};
use crate::ours;
use crate::stopwatch::seconds;
use crate::table::{self, FrameErrors, Row};
use anyhow::{Result, bail, ensure};
use clap::{Args, ValueEnum};
use deepsft_formats::read_template;
use deepsft_geometry::{Maps, OUTSIDE, Template};
use deepsft_synth::{FIRST_CLIP_SEED, Sample};
use std::path::PathBuf;

/// Frames of the figure.
const DRAWN: usize = 4;

/// Seed of the first clip, or of the stills.
pub const SEED: u64 = FIRST_CLIP_SEED + 500;

#[derive(Args)]
#[command(after_help = "\
The frames are those of short clips by our renderer: one second at 30 frames per second, of which every fifth frame is measured. The sheet bends
as paper does and moves as in two hands. --stills takes the single images that the shipped models are trained on instead, with harder bends, light
and camera effects; optical flow has no video there. --condition makes the light, occluders or motion blur harder there, or takes the canonical
images of the paper's cameras. --recording takes the colour camera of a simulated RGB-D recording, takes of 20 frames at 5 per second; its print
is up to 5 % larger or smaller than the template, which the methods are told: depths are scaled by it. --data takes the images of a data set.
The camera is the training camera, 480 x 270 pixels.

The table has mean / median over the frames, over the pixels that are in both masks. E_pr is the paper's photometric error, not corrected for
light, over the same pixels. Frames per second are frames per second of processor time, all threads together, without what is given.

The command writes
  DIR/table.json    every figure of every frame
  DIR/table.md      the table as it is printed
  DIR/figure.png    four frames: image, and the depth error of each method, black for none to yellow for 20 mm

Examples:
  deepsft-baselines compare --template models/poster-a4/template --frames 30 --out compared
  deepsft-baselines compare --template models/poster-a4/template --model models/poster-a4 --stills --out compared
  deepsft-baselines compare --template models/soft-toy/template --model models/soft-toy --stills --out compared
  deepsft-baselines compare --template models/poster-a4/template --methods ch17-gtr,ngo15 --frames 6 --out compared")]
pub struct CompareArguments {
    #[command(flatten)]
    comparison: Comparison,
    /// Folder for the table and the figure
    #[arg(long, value_name = "DIR")]
    out: PathBuf,
}

/// What is to be compared.
#[derive(Args, Default)]
pub struct Comparison {
    /// Folder of the template
    #[arg(long, value_name = "DIR")]
    pub template: PathBuf,
    /// Frames to measure
    #[arg(long, value_name = "N", default_value_t = 30, value_parser = clap::value_parser!(u64).range(1..=100_000))]
    pub frames: u64,
    /// Seed of the first clip, or of the stills
    #[arg(long, value_name = "S", default_value_t = SEED)]
    pub seed: u64,
    #[command(flatten)]
    pub source: Source,
    /// Cut every cell of the methods' mesh into four so many times: a sheet with more vertices, for methods without a network
    #[arg(long, value_name = "N", default_value_t = 0, conflicts_with_all = ["model", "trained"], value_parser = clap::value_parser!(u8).range(0..=4))]
    pub subdivisions: u8,
    /// Methods, separated by commas [default: all that the frames allow]
    #[arg(long, value_name = "NAMES", value_enum, value_delimiter = ',')]
    pub methods: Vec<Method>,
    /// Model bundle of the same template, for the rows of the network; may be given several times
    #[arg(long, value_name = "BUNDLE")]
    pub model: Vec<PathBuf>,
    /// Folder of networks for the same template, by `train` here and by `deepsft train --out DIR/NAME`; rows without one stay empty
    #[arg(long, value_name = "DIR")]
    pub trained: Option<PathBuf>,
    /// Folder for every method's answers, in the layout that `benchmark score` reads
    #[arg(long, value_name = "DIR")]
    pub predictions: Option<PathBuf>,
}

pub fn run(arguments: &CompareArguments) -> Result<()> {
    let (rows, panels) = arguments.comparison.run()?;
    let markdown = table::markdown(&rows);
    println!("{markdown}");
    let command: Vec<String> = std::env::args().skip(1).collect();
    let json = table::json(&rows, &format!("deepsft-baselines {}", command.join(" ")));
    table::write(&arguments.out, &markdown, &json)?;
    figure::write(&arguments.out, &panels)
}

impl Comparison {
    /// Runs every method on every frame. Returns a row for each method and network, and some frames.
    /// Fails where a method lacks what it needs, and those of files and renderer.
    pub fn run(&self) -> Result<(Vec<Row>, Vec<Vec<Panel>>)> {
        let template = read_template(&self.template)?;
        let finer = (0..self.subdivisions).try_fold(template.clone(), |template, _| template.finer())?;
        let mut work = Work {
            comparison: self,
            runner: Methods::new(&finer, &self.model, self.trained.as_deref())?,
            rows: Vec::new(),
            panels: Vec::new(),
            measured: 0,
            template: finer,
        };
        work.rows = work.chosen()?;
        let each = |frames: Frames<'_>, video, scale| work.take(frames, video, scale);
        self.source.takes(&template, self.seed, self.frames as usize, each)?;
        ensure!(work.measured > 0 || !work.runs(|_| true), "no frame shows the template");
        Ok((work.rows.into_iter().map(|(.., row)| row).collect(), work.panels))
    }
}

/// A comparison at work.
struct Work<'a> {
    comparison: &'a Comparison,
    template: Template,
    runner: Methods,
    /// Methods with the number of the network.
    rows: Vec<(Method, usize, Row)>,
    panels: Vec<Vec<Panel>>,
    /// Frames so far.
    measured: usize,
}

impl Work<'_> {
    /// A row for each method that was asked for, or for all that can run.
    fn chosen(&self) -> Result<Vec<(Method, usize, Row)>> {
        let is_video = self.comparison.source.is_video();
        let networks: Vec<&str> = self.runner.networks().collect();
        let lacks = |method: &Method| match method {
            method if method.is_network() && networks.is_empty() => Some("needs --model"),
            method if method.needs_video() && !is_video => Some("needs the frames of a video"),
            _ => None,
        };
        let mut methods = self.comparison.methods.clone();
        if let Some((method, lacks)) = methods.iter().find_map(|method| Some((method, lacks(method)?))) {
            bail!("{} {lacks}", method.label());
        }
        if methods.is_empty() {
            let all = Method::value_variants().iter();
            methods.extend(all.filter(|method| lacks(method).is_none()));
        }
        let mut rows = Vec::new();
        for method in methods {
            let label = method.label();
            let labels: Vec<String> = match method.is_network() {
                true => networks.iter().map(|name| format!("{name}, {label}")).collect(),
                false => vec![label.to_owned()],
            };
            for (network, label) in labels.into_iter().enumerate() {
                let row = Row {
                    label,
                    measured: method.measured(),
                    missing: self.runner.missing(method),
                    ..Row::default()
                };
                rows.push((method, network, row));
            }
        }
        Ok(rows)
    }

    /// Whether a row that can run is of such a method.
    fn runs(&self, is: impl Fn(Method) -> bool) -> bool {
        let mut rows = self.rows.iter();
        rows.any(|(method, _, row)| row.missing.is_none() && is(*method))
    }

    /// Runs the methods on frames of a `video` of that rate, or on single ones, in which the sheet is larger than the template by `scale`.
    fn take(&mut self, frames: Frames<'_>, video: Option<f64>, scale: f64) -> Result<()> {
        let each = self.comparison.source.measured_each();
        let with_tracker = video.is_some() && self.runs(|method| method == Method::Tracked);
        let with_flow = video.is_some() && self.runs(|method| method.needs_video() && method != Method::Tracked);
        let mut finder = with_tracker.then(|| ours::features(&self.template)).transpose()?;
        let mut follower = finder.as_mut().map(ours::follower).transpose()?;
        let mut dof: Option<Dof> = None;
        self.runner.begin_take();
        for (number, sample) in frames.enumerate() {
            let is_measured = number % each == each - 1;
            if !is_measured && !with_flow && !with_tracker {
                continue;
            }
            let sample = sample?;
            let mut followed = Followed::default();
            let began = seconds();
            if let Some(dof) = &mut dof {
                followed.registration = dof.next(&sample.image, &sample.camera).ok().cloned();
            } else if with_flow {
                dof = Some(Dof::new(&self.template, sample.truth.clone()));
            }
            followed.flow_s = seconds() - began;
            let began = seconds();
            if let (Some(follower), Some(rate)) = (&mut follower, video) {
                followed.tracked = ours::followed(follower, number as f64 / rate, &sample, self.template.mesh())?;
            }
            followed.tracker_s = seconds() - began;
            if video.is_none() {
                self.runner.begin_take();
            }
            if is_measured && sample.has_template {
                self.measure(&sample, &followed, scale)?;
            }
        }
        Ok(())
    }

    /// Runs every method on a frame whose sheet is larger than the template by `scale`.
    fn measure(&mut self, sample: &Sample, followed: &Followed, scale: f64) -> Result<()> {
        let drawn_each = (self.comparison.frames as usize).div_ceil(DRAWN);
        let mut panels = vec![figure::image(sample)];
        for (method, network, row) in self.rows.iter_mut().filter(|(.., row)| row.missing.is_none()) {
            let began = seconds();
            let mut answer = self.runner.answer(*method, *network, sample, followed)?;
            let took_s = match method {
                Method::Dof => followed.flow_s,
                Method::Tracked => followed.tracker_s,
                _ => seconds() - began,
            };
            if scale != 1.0 {
                answer.iter_mut().for_each(|answer| scale_depths(answer, scale));
            }
            let errors = FrameErrors::of(row.measured, answer.as_ref(), sample, &self.template, Some(took_s))?;
            if row.measured.depth {
                let (label, rmse) = (row.label.as_str(), errors.depth_rmse_mm);
                panels.push(figure::depth_error(label, answer.as_ref(), &sample.truth, rmse));
            }
            row.frames.push(errors);
            if let Some(folder) = &self.comparison.predictions {
                // A width is written as a fraction.
                let (folder, size) = (folder.join(row.label.replace('/', "-")), sample.truth.size());
                maps_file::write(&folder, self.measured, answer.as_ref(), size, row.measured.registration)?;
            }
        }
        if self.measured.is_multiple_of(drawn_each) {
            self.panels.push(panels);
        }
        self.measured += 1;
        eprintln!("{} frames", self.measured);
        Ok(())
    }
}

/// Makes `maps` those of an object that is larger by `scale` and as much further away: its image is the same.
fn scale_depths(maps: &mut Maps, scale: f64) {
    let (depths, _) = maps.parts_mut();
    for depth in depths.iter_mut().filter(|depth| **depth > OUTSIDE) {
        *depth = (f64::from(*depth) * scale) as f32;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn compared(model: &str, source: Source, methods: &[Method]) -> Vec<Row> {
        let model = PathBuf::from(env!("CARGO_MANIFEST_DIR"))
            .join("../../models")
            .join(model);
        let comparison = Comparison {
            template: model.join("template"),
            source,
            frames: 1,
            seed: 9,
            methods: methods.to_vec(),
            model: vec![model],
            ..Comparison::default()
        };
        comparison.run().unwrap().0
    }

    #[test]
    fn a_print_of_another_size_is_told_and_its_video_is_tracked() {
        let methods = [Method::Ch17Gtr, Method::Tracked, Method::NetworkFit];
        let recording = Source {
            recording: true,
            ..Source::default()
        };
        let rows = compared("poster-a4", recording, &methods);
        let depths = rows.iter().map(|row| row.frames[0].depth_rmse_mm);
        let depths: Vec<f64> = depths.map(|depth| depth.unwrap()).collect();
        assert!(depths[0] < 0.2 && depths[1] < 20.0 && depths[2] < 5.0, "{depths:?}");
        assert_eq!(rows[2].label, "ours, network and fit");
    }

    #[test]
    fn closed_forms_are_for_what_can_be_flattened_and_a_rolled_sheet_can() {
        let stills = Source {
            stills: true,
            ..Source::default()
        };
        let methods = [Method::Ch17Gtr, Method::Ngo15];
        let tube = compared("paper-tube", stills.clone(), &methods);
        assert!(tube[0].frames[0].depth_rmse_mm.unwrap() < 8.0 && tube[1].frames.is_empty());
        let toy = compared("soft-toy", stills, &methods);
        assert!(toy.iter().all(|row| row.missing.is_some()));
    }
}
