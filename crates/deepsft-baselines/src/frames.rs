//! The frames that methods are measured on, and what is harder in some of them.

use anyhow::{Context, Result, bail};
use clap::{Args, ValueEnum};
use deepsft_geometry::{Camera, CanonicalWarp, Template, training_camera};
use deepsft_synth::{
    ClipEvent, ClipLength, ClipStory, DatasetFolder, RecordingSimulator, Sample, SynthConfig, Synthesizer,
    canonical_truth,
};
use std::path::PathBuf;

/// Frames of a clip, and each how many of a video's one is measured.
const CLIP_FRAMES: usize = 30;
const MEASURED_EACH: usize = 5;

/// Columns of other cameras' images.
const CAMERA_WIDTH: usize = 960;

/// What is special about the frames.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, ValueEnum)]
pub enum Condition {
    /// As in training
    #[default]
    Trained,
    /// Ambient light of a tenth at most, the lamp up to 75 degrees aside, shadows, glossy paper
    Light,
    /// Hands and things before every sheet
    Occlusion,
    /// Motion blur of 7 to 12 pixels in every frame
    Blur,
    /// The canonical images of the paper's Kinect V2
    KinectV2,
    /// Of its RealSense D435
    RealsenseD435,
    /// Of its GoPro Hero 3
    GoproHero3,
}

/// The name of a value on command lines.
pub fn name(value: impl ValueEnum) -> String {
    let value = value.to_possible_value();
    value.map(|value| value.get_name().to_owned()).unwrap_or_default()
}

impl Condition {
    /// The settings of such samples, all of which show the template.
    pub fn config(self) -> SynthConfig {
        let mut config = SynthConfig {
            empty_probability: 0.0,
            ..SynthConfig::default()
        };
        match self {
            Self::Trained | Self::KinectV2 | Self::RealsenseD435 | Self::GoproHero3 => {}
            Self::Light => {
                config.lighting.ambient_fraction = [0.0, 0.1];
                config.lighting.shadow_probability = 1.0;
                config.lighting.roughness = [0.28, 0.4];
                config.lighting.specular = [0.7, 1.0];
            }
            Self::Occlusion => config.occluder_probability = 1.0,
            Self::Blur => {
                config.effects.motion_probability = 1.0;
                config.effects.motion_px = [7.0, 12.0];
            }
        }
        config
    }

    /// Another camera than the one for training.
    fn camera(self) -> Option<Camera> {
        let camera = Camera::preset(&name(self))?;
        // Half their pixels: twice those of the canonical image.
        let height = CAMERA_WIDTH * camera.size().height / camera.size().width;
        camera.resized((CAMERA_WIDTH, height)).ok()
    }
}

/// Frames that belong together, in order: those that show the template, as the training camera sees them.
pub type Frames<'a> = &'a mut dyn Iterator<Item = Result<Sample>>;

/// Where frames come from: short clips, or what is asked for instead.
#[derive(Args, Clone, Debug, Default)]
pub struct Source {
    /// Single images as of training, instead of the frames of clips
    #[arg(long, conflicts_with_all = ["recording", "data"])]
    pub stills: bool,
    /// The colour pictures of a simulated recording, instead of the frames of clips
    #[arg(long, conflicts_with = "data")]
    pub recording: bool,
    /// The images of a data set, as `deepsft synth` and Blender's script write it, instead of the frames of clips
    #[arg(long, value_name = "DIR")]
    pub data: Option<PathBuf>,
    /// What is harder in the stills
    #[arg(
        long,
        value_name = "NAME",
        value_enum,
        default_value = "trained",
        requires = "stills"
    )]
    pub condition: Condition,
}

impl Source {
    /// Whether its takes are videos.
    pub fn is_video(&self) -> bool {
        !self.stills && self.data.is_none()
    }

    /// How many frames of a take lie between two that are measured, with the second of them.
    pub fn measured_each(&self) -> usize {
        if self.is_video() { MEASURED_EACH } else { 1 }
    }

    /// Calls `each` with takes, as many as hold `measured` frames to measure; the frames per second of a video; and how much larger the sheet
    /// in the frames is than the template.
    /// Errors are those of `each`, of the renderer and of the data set's files; where hardly any image shows the template.
    pub fn takes(
        &self,
        template: &Template,
        seed: u64,
        measured: usize,
        mut each: impl FnMut(Frames<'_>, Option<f64>, f64) -> Result<()>,
    ) -> Result<()> {
        if let Some(folder) = &self.data {
            let set = DatasetFolder::open(folder)?;
            let checked = set.description().check_template(template);
            checked.with_context(|| folder.display().to_string())?;
            let samples = set.samples(training_camera())?.map(|sample| Ok(sample?));
            return each(&mut shown(samples).take(measured), None, 1.0);
        }
        if self.stills {
            return each(&mut stills(template, self.condition, seed, measured)?, None, 1.0);
        }
        let simulator = self.recording.then(|| RecordingSimulator::new(template, false, seed));
        let simulator = simulator.transpose()?;
        let per_take = if self.recording {
            RecordingSimulator::FRAMES_PER_TAKE
        } else {
            CLIP_FRAMES
        };
        let all = measured * MEASURED_EACH;
        for (number, first) in (0..all).step_by(per_take).enumerate() {
            let frames = 0..per_take.min(all - first);
            if let Some(simulator) = &simulator {
                let (take, rate) = (simulator.take(number), RecordingSimulator::FRAMES_PER_S);
                let mut frames = frames.map(|frame| Ok(take.frame(frame)?.truth));
                each(&mut frames, Some(rate), simulator.print().scale)?;
                continue;
            }
            let synthesizer = Synthesizer::new(template, SynthConfig::for_clip_stories(training_camera()))?;
            let length = ClipLength {
                frames: CLIP_FRAMES,
                ..ClipLength::default()
            };
            let rate = length.frames_per_s;
            let story = ClipStory::new(&synthesizer, length, ClipEvent::Motion, seed + number as u64)?;
            each(&mut frames.map(|frame| Ok(story.render(frame)?)), Some(rate), 1.0)?;
        }
        Ok(())
    }
}

/// The first `count` samples of `seed` that show the template, as the training camera sees them.
/// Fails where the renderer refuses the template; an item where hardly any sample shows it.
pub fn stills(
    template: &Template,
    condition: Condition,
    seed: u64,
    count: usize,
) -> Result<impl Iterator<Item = Result<Sample>> + use<>> {
    let (mut config, camera) = (condition.config(), condition.camera());
    config.camera = camera.unwrap_or(config.camera);
    let synthesizer = Synthesizer::new(template, config)?;
    let template = template.clone();
    let samples = (0..2 * count as u64 + 10).map(move |index| {
        let sample = synthesizer.sample(seed, index);
        match camera {
            Some(_) => canonical(sample, &template),
            None => Ok(sample),
        }
    });
    let too_few = std::iter::once_with(|| bail!("hardly any sample shows the template"));
    Ok(shown(samples).chain(too_few).take(count))
}

/// The samples that show the template, and errors.
fn shown(samples: impl Iterator<Item = Result<Sample>>) -> impl Iterator<Item = Result<Sample>> {
    samples.filter(|sample| sample.as_ref().map_or(true, |sample| sample.has_template))
}

/// The sample as the training camera would have seen it.
fn canonical(sample: Sample, template: &Template) -> Result<Sample> {
    let camera = training_camera();
    let truth = canonical_truth(&sample, template.mesh(), &camera);
    let image = CanonicalWarp::new(&sample.camera, &camera).apply(&sample.image)?;
    let Sample {
        vertices_camera,
        towards_light,
        ..
    } = sample;
    Ok(Sample::new(image, truth, vertices_camera, camera, towards_light))
}

#[cfg(test)]
mod tests {
    use super::*;
    use deepsft_geometry::{Maps, photo_consistency_error};

    #[test]
    fn the_image_of_another_camera_shows_the_template_where_its_truth_says() {
        let folder = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("../../models/poster-a4/template");
        let template = deepsft_formats::read_template(&folder).unwrap();
        let mut samples = stills(&template, Condition::KinectV2, 1, 1).unwrap();
        let sample = samples.next().unwrap().unwrap();
        assert!(samples.next().is_none() && sample.image.size() == training_camera().size());
        let error = |truth: &Maps| photo_consistency_error(&sample.image, template.texture(), truth).unwrap();
        let mut moved = sample.truth.clone();
        for pixel in (0..moved.depth().len()).filter(|&pixel| sample.truth.inside(pixel)) {
            let [u, v] = sample.truth.registration()[pixel];
            moved.set(pixel, sample.truth.depth()[pixel], [(u + 0.05).min(1.0), v]);
        }
        let errors = [error(&sample.truth), error(&moved)];
        assert!(errors[0] < 0.8 * errors[1], "{errors:?}");
    }
}
