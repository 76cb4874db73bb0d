//! `deepsft-baselines compare`: methods on the same synthetic frames.

use crate::dof::Dof;
use crate::figure::{self, Panel};
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
and camera effects; optical flow has no video there. The camera is the training camera, 480 x 270 pixels.

Methods:
  ch17-gtr    Chhatkuli et al. 2017: closed form and surface integration, from the true registration
  ch17r-gtr   the same, refined by Levenberg-Marquardt (Brunet et al. 2014)
  ch17-dof, ch17r-dof   the same, from the registration of dense optical flow (Brox et al. 2004), frame to frame
  dof         that registration itself
  ngo15       Ngo, Ostlund, Fua 2015: Laplacian mesh from matches of our features
  features    ours, without training
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
    /// Methods, separated by commas [default: all that frames and --model allow]
    #[arg(long, value_name = "NAMES", value_enum, value_delimiter = ',')]
    methods: Vec<Method>,
    /// Model bundle of the same template, for the rows of the network
    #[arg(long, value_name = "BUNDLE")]
    model: Option<PathBuf>,
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
        let stills = if self.stills { " --stills" } else { "" };
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
    let mut comparison = Comparison {
        runner: Methods::new(&template, arguments.model.as_deref())?,
        rows: methods
            .iter()
            .map(|&method| Row {
                method,
                frames: Vec::new(),
            })
            .collect(),
        panels: Vec::new(),
        drawn_each: (arguments.frames as usize).div_ceil(DRAWN),
        template,
    };
    if arguments.stills {
        comparison.stills(arguments.frames, arguments.seed)?;
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
    runner: Methods,
    rows: Vec<Row>,
    panels: Vec<Vec<Panel>>,
    /// Each how many frames one is drawn.
    drawn_each: usize,
}

impl Comparison {
    fn measured(&self) -> usize {
        self.rows.first().map_or(0, |row| row.frames.len())
    }

    fn needs_video(&self) -> bool {
        self.rows.iter().any(|row| row.method.needs_video())
    }

    /// Single images of `seed`.
    fn stills(&mut self, frames: u64, seed: u64) -> Result<()> {
        let config = SynthConfig {
            empty_probability: 0.0,
            ..SynthConfig::default()
        };
        let synthesizer = Synthesizer::new(&self.template, config)?;
        for index in 0..2 * frames {
            if self.measured() < frames as usize {
                let sample = synthesizer.sample(seed, index);
                if sample.has_template {
                    self.measure(&sample, &Followed::default())?;
                }
            }
        }
        Ok(())
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
            for frame in 0..CLIP_FRAMES {
                if self.measured() == frames {
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
        let is_drawn = self.measured().is_multiple_of(self.drawn_each);
        let mut panels = vec![figure::image(sample)];
        for row in &mut self.rows {
            let began = Stopwatch::start();
            let answer = self.runner.answer(row.method, sample, flow.registration.as_ref())?;
            let seconds = match row.method {
                Method::Dof => flow.seconds,
                _ => began.seconds(),
            };
            let errors = FrameErrors::of(row.method, answer.as_ref(), sample, &self.template, seconds)?;
            if row.method.has_depth() {
                let (label, rmse) = (row.method.label(), errors.depth_rmse_mm);
                panels.push(figure::depth_error(label, answer.as_ref(), &sample.truth, rmse));
            }
            row.frames.push(errors);
        }
        if is_drawn {
            self.panels.push(panels);
        }
        eprintln!("{} frames", self.measured());
        Ok(())
    }
}
