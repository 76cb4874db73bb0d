//! Options of the commands that make synthetic images, and the synthesiser that they ask for.

use crate::numbers::within;
use crate::{interruption, progress};
use anyhow::Result;
use clap::{Args, ValueEnum};
use deepsft_formats::StagedFolder;
use deepsft_geometry::Template;
use deepsft_synth::{EffectsConfig, Sample, SynthConfig, Synthesizer, TRUTH_FOLDER, write_dataset};
use serde_json::Value;
use std::path::PathBuf;

/// What is varied in synthetic images, and how far.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, ValueEnum)]
pub enum Preset {
    /// What the shipped models are trained on: paper in hands, wide ranges of light and camera
    #[default]
    Default,
    /// The ranges of the paper, section 5.1: simulated cloth, light near the camera's axis, discs for occluders, an ideal
    /// camera
    Paper,
}

/// Options of the commands that make synthetic images.
#[derive(Args, Clone, Debug, Default)]
pub struct SynthesisOptions {
    /// What is varied in the images, and how far
    #[arg(id = "images", long = "images", value_name = "PRESET", value_enum, default_value_t)]
    pub images: Preset,
    /// Add the default preset's camera effects (blur, noise, white balance, JPEG, ...) to a preset without; its gain stays
    #[arg(long)]
    pub camera_effects: bool,
    /// Folder of photographs (PNG, JPEG, WebP, ...) to show as backgrounds beside the drawn ones; the paper's preset shows only
    /// them, unchanged
    #[arg(long, value_name = "DIR")]
    pub backgrounds: Option<PathBuf>,
    /// Largest in-plane rotation to either side, degrees: 45 for an object that stays upright, which a short training learns
    /// sooner; the network sees upright photographs turned by a quarter, so for those it takes 135 [default: 180, any way up; with the paper's preset its own range]
    #[arg(long, value_name = "DEG", value_parser = |angle: &str| within(0.0..=180.0, "an angle of 0 to 180 degrees", angle), conflicts_with = "images")]
    pub max_roll: Option<f64>,
}

impl SynthesisOptions {
    /// What is not the default, for the name of a set of images.
    pub fn note(&self) -> String {
        self.not_default().into_iter().map(|(phrase, _)| phrase).collect()
    }

    /// What is not the default, as it is typed, each option after a space.
    pub fn options(&self) -> String {
        self.not_default().into_iter().map(|(_, option)| option).collect()
    }

    /// What is not the default: in words after a comma, and as it is typed after a space.
    fn not_default(&self) -> Vec<(String, String)> {
        let paper = self.images == Preset::Paper;
        let parts = [
            paper.then(|| (", the paper's ranges".into(), " --images paper".into())),
            (self.camera_effects).then(|| (", with camera effects".into(), " --camera-effects".into())),
            self.backgrounds.as_ref().map(|folder| {
                let folder = folder.display().to_string();
                let phrase = format!(", before photographs of {folder}");
                (phrase, format!(" --backgrounds {}", quoted(folder)))
            }),
            self.max_roll.map(|angle| {
                let phrase = format!(", turned by at most {angle} degrees");
                (phrase, format!(" --max-roll {angle}"))
            }),
        ];
        parts.into_iter().flatten().collect()
    }
}

/// A word of a command line, in quotation marks where it needs them.
pub fn quoted(word: String) -> String {
    if word.contains(' ') { format!("'{word}'") } else { word }
}

/// The synthesiser of a template for the training camera, with the photographs of a folder among its backgrounds.
pub fn synthesizer(template: &Template, options: &SynthesisOptions) -> Result<Synthesizer> {
    let mut config = match options.images {
        Preset::Default => SynthConfig::default(),
        Preset::Paper => SynthConfig::paper(),
    };
    if options.camera_effects {
        config.effects = EffectsConfig {
            gain: config.effects.gain,
            ..EffectsConfig::default()
        };
    }
    if let Some(angle) = options.max_roll {
        config.pose.max_roll_deg = angle;
    }
    let synthesizer = Synthesizer::new(template, config)?;
    Ok(match &options.backgrounds {
        Some(folder) => synthesizer.with_photographs(deepsft_formats::pictures_in(folder, "folder of photographs")?)?,
        None => synthesizer,
    })
}

/// Writes simulated `frames` of `template`, which were `made` with a configuration and a seed: the files of each by `write`, which gives its
/// truth, and the truths as a data set beside them in `folder`.
pub fn write_with_truth<F, E: Into<anyhow::Error>>(
    folder: &StagedFolder,
    template: &Template,
    made: (Value, u64),
    count: usize,
    frames: impl Iterator<Item = Result<F, E>>,
    mut write: impl FnMut(usize, F) -> Result<Sample>,
) -> Result<()> {
    interruption::watch()?;
    let bar = progress::counting(count as u64, "frames");
    let samples = frames.enumerate().map(|(index, frame)| -> Result<Sample> {
        interruption::check()?;
        let sample = write(index, frame.map_err(Into::<anyhow::Error>::into)?)?;
        bar.inc(1);
        Ok(sample)
    });
    write_dataset(&folder.path().join(TRUTH_FOLDER), template, made.0, made.1, samples)?;
    bar.finish_and_clear();
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_largest_roll_is_an_angle_of_at_most_half_a_turn() {
        let accepts = |angle: &str| {
            let command = SynthesisOptions::augment_args(clap::Command::new("synth"));
            command
                .try_get_matches_from(["synth", &format!("--max-roll={angle}")])
                .is_ok()
        };
        assert_eq!(["0", "180", "181", "-1"].map(accepts), [true, true, false, false]);
    }
}
