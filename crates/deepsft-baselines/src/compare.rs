//! `deepsft-baselines compare`: methods on the same synthetic frames.

use crate::dof::Dof;
use crate::figure::{self, Panel};
use crate::frames::{Condition, stills};
use crate::maps_file;
use crate::methods::{Method, Methods};
use crate::stopwatch::Stopwatch;
use crate::table::{self, FrameErrors, Row};
use anyhow::{Context, Result, bail};
use clap::{Args, ValueEnum};
use deepsft::encode_png;
use deepsft_formats::{read_template, write_file};
use deepsft_geometry::{Maps, Template, training_camera};
use deepsft_synth::{ClipEvent, ClipLength, ClipStory, FIRST_CLIP_SEED, Sample, SynthConfig, Synthesizer};
use std::path::PathBuf;

/// Frames of a clip, and each how many of them one is measured.
const CLIP_FRAMES: usize = 30;
const MEASURED_EACH: usize = 5;

/// Frames of the figure.
const DRAWN: usize = 4;

#[derive(Args)]
#[command(after_help = "\
The frames are those of short clips by our renderer: one second at 30 frames per second, of which every fifth frame is measured. The sheet bends
as paper does and moves as in two hands. --stills takes the single images that the shipped models are trained on instead, with harder bends, light
and camera effects; optical flow has no video there. --condition makes the light, occluders or motion blur harder there, or takes the canonical
images of the paper's cameras. The camera is the training camera, 480 x 270 pixels.

Methods:
  ch17-gtr    Chhatkuli et al. 2017: closed form and surface integration, from the true registration
  ch17r-gtr   the same, refined by Levenberg-Marquardt (Brunet et al. 2014)
  ch17-dof, ch17r-dof   the same, from the registration of dense optical flow (Brox et al. 2004), frame to frame
  dof         that registration itself
  ngo15       Ngo, Ostlund, Fua 2015: Laplacian mesh from matches of our features
  robusft     Shetab-Bushehri et al. 2023: particles on the sightlines of such matches; in clips from the last measured shape
  features    ours, without training
  hdm-net, ismo-gan      Golyanik et al. 2018, Shimada et al. 2019: the grid of a sheet by a network, trained by `train`
  dense-depth, bts       Alhashim and Wonka 2018, Lee et al. 2019: depth of any scene, with their authors' weights; those are not read here, the rows stay empty
  dense-depth-ft, bts-ft the same, trained by `train` on our samples alone; depth inside the true mask, no registration
  network, network-fit   ours, with the bundle of --model

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
  deepsft-baselines compare --template models/poster-a4/template --methods ch17-gtr,ngo15 --frames 6 --out compared")]
pub struct CompareArguments {
    /// Folder of the template, a flat sheet
    #[arg(long, value_name = "DIR")]
    template: PathBuf,
    /// Frames to measure
    #[arg(long, value_name = "N", default_value_t = 30, value_parser = clap::value_parser!(u64).range(1..=100_000))]
    frames: u64,
    /// Seed of the first clip, or of the stills
    #[arg(long, value_name = "S", default_value_t = FIRST_CLIP_SEED + 500)]
    seed: u64,
    /// Single images as of training, instead of the frames of clips
    #[arg(long)]
    stills: bool,
    /// What is harder in the stills
    #[arg(
        long,
        value_name = "NAME",
        value_enum,
        default_value = "trained",
        requires = "stills"
    )]
    condition: Condition,
    /// Methods, separated by commas [default: all that frames and --model allow]
    #[arg(long, value_name = "NAMES", value_enum, value_delimiter = ',')]
    methods: Vec<Method>,
    /// Model bundle of the same template, for the rows of the network
    #[arg(long, value_name = "BUNDLE")]
    model: Option<PathBuf>,
    /// Folder of networks that `train` has trained for the same template; rows without one stay empty
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
    /// The methods that were asked for, or all that can run.
    fn chosen(&self) -> Result<Vec<Method>> {
        let can_run =
            |method: &Method| (self.model.is_some() || !method.needs_model()) && !(self.stills && method.needs_video());
        if let Some(method) = self.methods.iter().find(|method| !can_run(method)) {
            let lacks = if method.needs_model() {
                "needs --model"
            } else {
                "needs the frames of clips, without --stills"
            };
            bail!("{} {lacks}", method.label());
        }
        let all = || Method::value_variants().iter().copied().filter(can_run).collect();
        Ok(if self.methods.is_empty() {
            all()
        } else {
            self.methods.clone()
        })
    }

    /// The command line that makes the same table.
    fn command(&self, methods: &[Method]) -> String {
        let names: Vec<String> = methods
            .iter()
            .filter_map(|m| Some(m.to_possible_value()?.get_name().to_owned()))
            .collect();
        let condition = self.condition.to_possible_value();
        let condition = condition.map_or_else(String::new, |value| {
            format!(" --stills --condition {}", value.get_name())
        });
        let stills = if self.stills { condition } else { String::new() };
        format!(
            "deepsft-baselines compare --frames {} --seed {}{stills} --methods {}",
            self.frames,
            self.seed,
            names.join(",")
        )
    }
}

pub fn run(arguments: &CompareArguments) -> Result<()> {
    let methods = arguments.chosen()?;
    let template = read_template(&arguments.template)?;
    if !template.is_sheet() {
        bail!(
            "{}: the template is no flat sheet, which these methods are for",
            arguments.template.display()
        );
    }
    let runner = Methods::new(&template, arguments.model.as_deref(), arguments.trained.as_deref())?;
    let row = |&method: &Method| Row {
        label: method.label().to_owned(),
        measured: method.measured(),
        stated: None,
        missing: runner.missing(method),
        frames: Vec::new(),
    };
    let mut comparison = Comparison {
        measured: 0,
        methods: methods.clone(),
        predictions: arguments.predictions.clone(),
        rows: methods.iter().map(row).collect(),
        runner,
        panels: Vec::new(),
        drawn_each: (arguments.frames as usize).div_ceil(DRAWN),
        template,
    };
    if arguments.stills {
        let (template, condition) = (comparison.template.clone(), arguments.condition);
        let each = |sample: &Sample| {
            comparison.runner.begin_clip();
            comparison.measure(sample, &Followed::default())
        };
        stills(&template, condition, arguments.seed, arguments.frames, each)?;
    } else {
        comparison.clips(arguments.frames as usize, arguments.seed)?;
    }
    let markdown = table::markdown(&comparison.rows);
    println!("{markdown}");
    let command = arguments.command(&methods);
    std::fs::create_dir_all(&arguments.out).with_context(|| arguments.out.display().to_string())?;
    write_file(&arguments.out.join("table.md"), format!("{markdown}\n").as_bytes())?;
    write_file(
        &arguments.out.join("table.json"),
        &table::json_bytes(&comparison.rows, &command)?,
    )?;
    write_file(
        &arguments.out.join("figure.png"),
        &encode_png(&figure::sheet(&comparison.panels)?)?,
    )?;
    Ok(())
}

/// A video that optical flow follows.
#[derive(Default)]
struct Followed {
    dof: Option<Dof>,
    /// That of the last frame; none before the second, and when the template was lost.
    registration: Option<Maps>,
    /// What the last frame took.
    seconds: f64,
}

impl Followed {
    /// Takes the next frame: the first with its truth, the others as the flow has them.
    fn follow(&mut self, sample: &Sample, template: &Template) {
        let began = Stopwatch::start();
        match &mut self.dof {
            None => self.dof = Some(Dof::new(template, sample.truth.clone())),
            Some(dof) => self.registration = dof.next(&sample.image, &sample.camera).ok().cloned(),
        }
        self.seconds = began.seconds();
    }
}

/// Methods at work on frames.
struct Comparison {
    template: Template,
    /// Frames so far.
    measured: usize,
    methods: Vec<Method>,
    predictions: Option<PathBuf>,
    runner: Methods,
    rows: Vec<Row>,
    panels: Vec<Vec<Panel>>,
    /// Each how many frames one is drawn.
    drawn_each: usize,
}

impl Comparison {
    fn needs_video(&self) -> bool {
        self.methods.iter().any(|method| method.needs_video())
    }

    /// Frames of clips from `seed` on.
    fn clips(&mut self, frames: usize, seed: u64) -> Result<()> {
        let synthesizer = Synthesizer::new(&self.template, SynthConfig::for_clip_stories(training_camera()))?;
        let length = ClipLength {
            frames: CLIP_FRAMES,
            ..ClipLength::default()
        };
        for clip in 0.. {
            let story = ClipStory::new(&synthesizer, length.clone(), ClipEvent::Motion, seed + clip)?;
            let mut flow = Followed::default();
            self.runner.begin_clip();
            for frame in 0..CLIP_FRAMES {
                if self.measured == frames {
                    return Ok(());
                }
                let is_measured = frame % MEASURED_EACH == MEASURED_EACH - 1;
                if !is_measured && !self.needs_video() {
                    continue;
                }
                let sample = story.render(frame)?;
                if self.needs_video() {
                    flow.follow(&sample, &self.template);
                }
                if is_measured {
                    self.measure(&sample, &flow)?;
                }
            }
        }
        Ok(())
    }

    /// Runs every method on a frame.
    fn measure(&mut self, sample: &Sample, flow: &Followed) -> Result<()> {
        let is_drawn = self.measured.is_multiple_of(self.drawn_each);
        let mut panels = vec![figure::image(sample)];
        let rows = self.methods.iter().zip(&mut self.rows);
        for (&method, row) in rows.filter(|(_, row)| row.missing.is_none()) {
            let began = Stopwatch::start();
            let answer = self.runner.answer(method, sample, flow.registration.as_ref())?;
            let seconds = match method {
                Method::Dof => flow.seconds,
                _ => began.seconds(),
            };
            let errors = FrameErrors::of(row.measured, answer.as_ref(), sample, &self.template, Some(seconds))?;
            if row.measured.depth {
                let (label, rmse) = (row.label.as_str(), errors.depth_rmse_mm);
                panels.push(figure::depth_error(label, answer.as_ref(), &sample.truth, rmse));
            }
            row.frames.push(errors);
            if let (Some(folder), Some(value)) = (&self.predictions, method.to_possible_value()) {
                let folder = folder.join(value.get_name());
                maps_file::write(
                    &folder,
                    self.measured,
                    answer.as_ref(),
                    sample.truth.size(),
                    row.measured.registration,
                )?;
            }
        }
        if is_drawn {
            self.panels.push(panels);
        }
        self.measured += 1;
        eprintln!("{} frames", self.measured);
        Ok(())
    }
}
