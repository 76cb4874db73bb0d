//! `deepsft-baselines compare`: methods on the same synthetic frames.

use crate::dof::Dof;
use crate::figure::{self, Panel};
use crate::frames::{Condition, Source, Take};
use crate::maps_file;
use crate::methods::{Followed, Method, Methods};
use crate::ours::{self, Follower};
use crate::stopwatch::Stopwatch;
use crate::table::{self, FrameErrors, Row};
use anyhow::{Context, Result, bail, ensure};
use clap::{Args, ValueEnum};
use deepsft::encode_png;
use deepsft_formats::{read_template, write_file};
use deepsft_geometry::{Maps, Template};
use deepsft_synth::{FIRST_CLIP_SEED, Sample};
use std::path::{Path, PathBuf};

/// Frames of the figure.
const DRAWN: usize = 4;

#[derive(Args)]
#[command(after_help = "\
The frames are those of short clips by our renderer: one second at 30 frames per second, of which every fifth frame is measured. The sheet bends
as paper does and moves as in two hands. --stills takes the single images that the shipped models are trained on instead, with harder bends, light
and camera effects; optical flow has no video there. --condition makes the light, occluders or motion blur harder there, or takes the canonical
images of the paper's cameras. --recording takes the colour camera of a simulated RGB-D recording, takes of 20 frames at 5 per second; its print
is up to 5 % larger or smaller than the template, which the methods are told: depths are scaled by it. --data takes the images of a data set.
The camera is the training camera, 480 x 270 pixels.

Methods:
  ch17-gtr    Chhatkuli et al. 2017: closed form and surface integration, from the true registration
  ch17r-gtr   the same, refined by Levenberg-Marquardt (Brunet et al. 2014)
  ch17-dof, ch17r-dof   the same, from the registration of dense optical flow (Brox et al. 2004), frame to frame
  dof         that registration itself
  ngo15       Ngo, Ostlund, Fua 2015: Laplacian mesh from matches of our features
  robusft     Shetab-Bushehri et al. 2023: particles on the sightlines of such matches; in videos from the last measured shape
  features    ours, without training
  tracked     the same in a video: found once, then tracked
  hdm-net, ismo-gan      Golyanik et al. 2018, Shimada et al. 2019: the grid of a sheet by a network, trained by `train`
  dense-depth, bts       Alhashim and Wonka 2018, Lee et al. 2019: depth of any scene, with their authors' weights; those are not read here, the rows stay empty
  dense-depth-ft, bts-ft the same, trained by `train` on our samples alone; depth inside the true mask, no registration
  network, network-fit   the bundles of --model and of folders in --trained, alone and with the fit of the mesh

The table has mean / median over the frames, over the pixels that are in both masks. E_pr is the paper's photometric error, not corrected for
light, over the same pixels. Frames per second are frames per
second of processor time, all threads together, without what is given.

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
    /// Folder of the template
    #[arg(long, value_name = "DIR")]
    template: PathBuf,
    /// Frames to measure
    #[arg(long, value_name = "N", default_value_t = 30, value_parser = clap::value_parser!(u64).range(1..=100_000))]
    frames: u64,
    /// Seed of the first clip, or of the stills
    #[arg(long, value_name = "S", default_value_t = FIRST_CLIP_SEED + 500)]
    seed: u64,
    /// Single images as of training, instead of the frames of clips
    #[arg(long, conflicts_with_all = ["recording", "data"])]
    stills: bool,
    /// The colour pictures of a simulated recording, instead of the frames of clips
    #[arg(long, conflicts_with = "data")]
    recording: bool,
    /// The images of a data set, as `deepsft synth` and Blender's script write it, instead of the frames of clips
    #[arg(long, value_name = "DIR")]
    data: Option<PathBuf>,
    /// What is harder in the stills
    #[arg(
        long,
        value_name = "NAME",
        value_enum,
        default_value = "trained",
        requires = "stills"
    )]
    condition: Condition,
    /// Cut every cell of the methods' mesh into four so many times: a sheet with more vertices, for methods without a network
    #[arg(long, value_name = "N", default_value_t = 0, conflicts_with_all = ["model", "trained"], value_parser = clap::value_parser!(u8).range(0..=4))]
    subdivisions: u8,
    /// Methods, separated by commas [default: all that the frames allow]
    #[arg(long, value_name = "NAMES", value_enum, value_delimiter = ',')]
    methods: Vec<Method>,
    /// Model bundle of the same template, for the rows of the network; may be given several times
    #[arg(long, value_name = "BUNDLE")]
    model: Vec<PathBuf>,
    /// Folder of networks for the same template, by `train` here and by `deepsft train --out DIR/NAME`; rows without one stay empty
    #[arg(long, value_name = "DIR")]
    trained: Option<PathBuf>,
    /// Folder for every method's answers, in the layout that `benchmark score` reads
    #[arg(long, value_name = "DIR")]
    predictions: Option<PathBuf>,
    /// Folder for the table and the figure
    #[arg(long, value_name = "DIR")]
    out: PathBuf,
}

impl CompareArguments {
    fn source(&self) -> Source {
        match &self.data {
            Some(folder) => Source::DataSet(folder.clone()),
            None if self.recording => Source::Recording,
            None if self.stills => Source::Stills(self.condition),
            None => Source::Clips,
        }
    }
}

/// What is to be compared.
pub struct Comparison<'a> {
    /// The template.
    pub template: &'a Path,
    /// Where the frames come from.
    pub source: Source,
    /// How many are measured, and their seed.
    pub frames: usize,
    pub seed: u64,
    /// The methods; none for all that the frames allow.
    pub methods: Vec<Method>,
    /// Bundles, and a folder of trained networks.
    pub models: &'a [PathBuf],
    pub trained: Option<&'a Path>,
    /// Folder for every method's answers.
    pub predictions: Option<&'a Path>,
    /// How many times the methods' mesh is finer than that of the frames.
    pub subdivisions: u8,
}

/// What came out.
pub struct Compared {
    /// A row for each method and network.
    pub rows: Vec<Row>,
    /// Some frames.
    pub panels: Vec<Vec<Panel>>,
}

pub fn run(arguments: &CompareArguments) -> Result<()> {
    let comparison = Comparison {
        template: &arguments.template,
        source: arguments.source(),
        frames: arguments.frames as usize,
        seed: arguments.seed,
        methods: arguments.methods.clone(),
        models: &arguments.model,
        trained: arguments.trained.as_deref(),
        predictions: arguments.predictions.as_deref(),
        subdivisions: arguments.subdivisions,
    };
    let compared = comparison.run()?;
    let markdown = table::markdown(&compared.rows);
    println!("{markdown}");
    let command: Vec<String> = std::env::args().skip(1).collect();
    let json = table::json(&compared.rows, &format!("deepsft-baselines {}", command.join(" ")));
    write_tables(&arguments.out, &markdown, &json, &compared.panels)
}

/// Writes table and figure into `folder`.
///
/// # Errors
/// When a file cannot be written.
pub fn write_tables(folder: &Path, markdown: &str, json: &serde_json::Value, panels: &[Vec<Panel>]) -> Result<()> {
    std::fs::create_dir_all(folder).with_context(|| folder.display().to_string())?;
    write_file(&folder.join("table.md"), format!("{markdown}\n").as_bytes())?;
    write_file(&folder.join("table.json"), &serde_json::to_vec_pretty(json)?)?;
    Ok(write_file(
        &folder.join("figure.png"),
        &encode_png(&figure::sheet(panels)?)?,
    )?)
}

impl Comparison<'_> {
    /// Runs every method on every frame.
    ///
    /// # Errors
    /// Where a method lacks what it needs, and those of files and renderer.
    pub fn run(&self) -> Result<Compared> {
        let template = read_template(self.template)?;
        let finer = (0..self.subdivisions).try_fold(template.clone(), |template, _| template.finer())?;
        let mut work = Work {
            comparison: self,
            runner: Methods::new(&finer, self.models, self.trained)?,
            rows: Vec::new(),
            panels: Vec::new(),
            measured: 0,
            template: finer,
        };
        work.rows = work.chosen()?;
        self.source
            .takes(&template, self.seed, self.frames, |take| work.take(take))?;
        ensure!(work.measured > 0 || !work.runs(|_| true), "no frame shows the template");
        Ok(Compared {
            rows: work.rows.into_iter().map(|(.., row)| row).collect(),
            panels: work.panels,
        })
    }
}

/// A comparison at work.
struct Work<'a> {
    comparison: &'a Comparison<'a>,
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
        let asked = &self.comparison.methods;
        if let Some((method, lacks)) = asked.iter().find_map(|method| Some((method, lacks(method)?))) {
            bail!("{} {lacks}", method.label());
        }
        let all = Method::value_variants().iter().filter(|method| lacks(method).is_none());
        let methods: Vec<Method> = if asked.is_empty() {
            all.copied().collect()
        } else {
            asked.clone()
        };
        let row = |method: Method, label: String| Row {
            label,
            measured: method.measured(),
            stated: None,
            missing: self.runner.missing(method),
            frames: Vec::new(),
            paper: None,
        };
        let rows = methods.into_iter().flat_map(|method| -> Vec<_> {
            let named = |(k, name): (usize, &&str)| (method, k, row(method, format!("{name}, {}", method.label())));
            match method.is_network() {
                true => networks.iter().enumerate().map(named).collect(),
                false => vec![(method, 0, row(method, method.label().to_owned()))],
            }
        });
        Ok(rows.collect())
    }

    /// Whether a row that can run is of such a method.
    fn runs(&self, is: impl Fn(Method) -> bool) -> bool {
        self.rows
            .iter()
            .any(|(method, _, row)| row.missing.is_none() && is(*method))
    }

    /// Runs the methods on the frames of a take.
    fn take(&mut self, take: Take<'_>) -> Result<()> {
        let each = self.comparison.source.measured_each();
        let (with_flow, with_tracker) = match take.video {
            Some(_) => (
                self.runs(|method| method.needs_video() && method != Method::Tracked),
                self.runs(|method| method == Method::Tracked),
            ),
            None => (false, false),
        };
        let (mut dof, mut finder) = (None, None);
        if with_tracker {
            finder = Some(ours::features(&self.template)?);
        }
        let mut follower = finder.as_mut().map(Follower::new).transpose()?;
        self.runner.begin_take();
        for (number, sample) in take.frames.enumerate() {
            let is_measured = number % each == each - 1;
            if !is_measured && !with_flow && !with_tracker {
                continue;
            }
            let sample = sample?;
            let mut followed = Followed::default();
            let began = Stopwatch::start();
            if with_flow {
                let flow = dof.get_or_insert_with(|| Dof::new(&self.template, sample.truth.clone()));
                if number > 0 {
                    followed.registration = flow.next(&sample.image, &sample.camera).ok().cloned();
                }
            }
            let flow_s = began.seconds();
            let began = Stopwatch::start();
            if let (Some(follower), Some(rate)) = (&mut follower, take.video) {
                followed.tracked = follower.follow(number as f64 / rate, &sample, self.template.mesh())?;
            }
            let tracker_s = began.seconds();
            if take.video.is_none() {
                self.runner.begin_take();
            }
            if is_measured && sample.has_template {
                self.measure(&sample, &followed, [flow_s, tracker_s], take.scale)?;
            }
        }
        Ok(())
    }

    /// Runs every method on a frame whose sheet is larger than the template by `scale`.
    fn measure(
        &mut self,
        sample: &Sample,
        followed: &Followed,
        [flow_s, tracker_s]: [f64; 2],
        scale: f64,
    ) -> Result<()> {
        let drawn_each = self.comparison.frames.div_ceil(DRAWN);
        let mut panels = vec![figure::image(sample)];
        for (method, network, row) in self.rows.iter_mut().filter(|(.., row)| row.missing.is_none()) {
            let began = Stopwatch::start();
            let mut answer = self.runner.answer(*method, *network, sample, followed)?;
            let seconds = match method {
                Method::Dof => flow_s,
                Method::Tracked => tracker_s,
                _ => began.seconds(),
            };
            if let Some(answer) = answer.as_mut().filter(|_| scale != 1.0) {
                *answer = scaled(answer, scale);
            }
            let errors = FrameErrors::of(row.measured, answer.as_ref(), sample, &self.template, Some(seconds))?;
            if row.measured.depth {
                let (label, rmse) = (row.label.as_str(), errors.depth_rmse_mm);
                panels.push(figure::depth_error(label, answer.as_ref(), &sample.truth, rmse));
            }
            row.frames.push(errors);
            if let Some(folder) = self.comparison.predictions {
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

/// The maps of an object that is larger by `scale` and as much further away: its image is the same.
fn scaled(maps: &Maps, scale: f64) -> Maps {
    let mut scaled = maps.clone();
    for pixel in (0..maps.depth().len()).filter(|&pixel| maps.inside(pixel)) {
        let depth = f64::from(maps.depth()[pixel]) * scale;
        scaled.set(pixel, depth as f32, maps.registration()[pixel]);
    }
    scaled
}

#[cfg(test)]
mod tests {
    use super::*;

    fn compared(model: &str, source: Source, methods: &[Method]) -> Vec<Row> {
        let model = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../models").join(model);
        let comparison = Comparison {
            template: &model.join("template"),
            source,
            frames: 1,
            seed: 9,
            methods: methods.to_vec(),
            models: std::slice::from_ref(&model),
            trained: None,
            predictions: None,
            subdivisions: 0,
        };
        comparison.run().unwrap().rows
    }

    #[test]
    fn a_print_of_another_size_is_told_and_its_video_is_tracked() {
        let methods = [Method::Ch17Gtr, Method::Tracked, Method::NetworkFit];
        let rows = compared("poster-a4", Source::Recording, &methods);
        let depths = rows.iter().map(|row| row.frames[0].depth_rmse_mm);
        let depths: Vec<f64> = depths.map(|depth| depth.unwrap()).collect();
        assert!(depths[0] < 0.2 && depths[1] < 20.0 && depths[2] < 5.0, "{depths:?}");
        assert_eq!(rows[2].label, "ours, network and fit");
    }

    #[test]
    fn closed_forms_are_for_what_can_be_flattened_and_a_rolled_sheet_can() {
        let stills = || Source::Stills(Condition::Trained);
        let methods = [Method::Ch17Gtr, Method::Ngo15];
        let tube = compared("paper-tube", stills(), &methods);
        assert!(tube[0].frames[0].depth_rmse_mm.unwrap() < 8.0 && tube[1].frames.is_empty());
        let toy = compared("soft-toy", stills(), &methods);
        assert!(toy.iter().all(|row| row.missing.is_some()));
    }
}
