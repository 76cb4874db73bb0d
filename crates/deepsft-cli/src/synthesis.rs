//! Options of the commands that make synthetic images, and the synthesiser that they ask for.

use crate::failure::BlameInput;
use crate::input;
use anyhow::{Result, bail};
use clap::{Args, ValueEnum};
use deepsft_geometry::Template;
use deepsft_synth::{EffectsConfig, SynthConfig, Synthesizer};
use std::fs;
use std::path::{Path, PathBuf};

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

impl Preset {
    /// The configuration.
    pub fn config(self) -> SynthConfig {
        match self {
            Self::Default => SynthConfig::default(),
            Self::Paper => SynthConfig::paper(),
        }
    }
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
    /// Folder of photographs (PNG or JPEG) to show as backgrounds beside the drawn ones; the paper's preset shows only
    /// them, unchanged
    #[arg(long, value_name = "DIR")]
    pub backgrounds: Option<PathBuf>,
    /// Largest in-plane rotation to either side, degrees: 45 for an object that stays upright, which a short training learns
    /// sooner [default: 180, any way up; with the paper's preset its own range]
    #[arg(long, value_name = "DEG", value_parser = roll, conflicts_with = "images")]
    pub max_roll: Option<f64>,
}

fn roll(text: &str) -> Result<f64, String> {
    text.parse()
        .ok()
        .filter(|angle: &f64| (0.0..=180.0).contains(angle))
        .ok_or("expected an angle of 0 to 180 degrees".into())
}

impl SynthesisOptions {
    /// What is not the default, for the name of a set of images.
    pub fn note(&self) -> String {
        let mut note = String::new();
        if self.images == Preset::Paper {
            note.push_str(", the paper's ranges");
        }
        if self.camera_effects {
            note.push_str(", with camera effects");
        }
        if let Some(folder) = &self.backgrounds {
            note.push_str(&format!(", before photographs of {}", folder.display()));
        }
        if let Some(angle) = self.max_roll {
            note.push_str(&format!(", turned by at most {angle} degrees"));
        }
        note
    }

    /// What is not the default, as it is typed, each option after a space.
    pub fn options(&self) -> String {
        let mut options = String::new();
        if self.images == Preset::Paper {
            options.push_str(" --images paper");
        }
        if self.camera_effects {
            options.push_str(" --camera-effects");
        }
        if let Some(folder) = &self.backgrounds {
            options.push_str(&format!(" --backgrounds {}", quoted(folder.display().to_string())));
        }
        if let Some(angle) = self.max_roll {
            options.push_str(&format!(" --max-roll {angle}"));
        }
        options
    }
}

/// A word of a command line, in quotation marks where it needs them.
pub fn quoted(word: String) -> String {
    if word.contains(' ') { format!("'{word}'") } else { word }
}

/// The synthesiser of a template for the training camera, with the photographs of a folder among its backgrounds.
pub fn synthesizer(template: &Template, options: &SynthesisOptions) -> Result<Synthesizer> {
    let mut config = options.images.config();
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
        Some(folder) => synthesizer.with_photographs(photographs(folder)?)?,
        None => synthesizer,
    })
}

/// The PNG and JPEG files of a folder, by name.
fn photographs(folder: &Path) -> Result<Vec<PathBuf>> {
    let list = || -> Result<Vec<PathBuf>> {
        let paths = fs::read_dir(folder)?
            .map(|entry| Ok(entry?.path()))
            .collect::<Result<Vec<_>>>()?;
        let mut paths: Vec<_> = paths.into_iter().filter(|path| input::is_image(path)).collect();
        paths.sort();
        if paths.is_empty() {
            bail!("there is no PNG or JPEG file in it");
        }
        Ok(paths)
    };
    list().blame("folder of photographs", folder)
}

#[cfg(test)]
mod tests {
    use super::*;
    use deepsft_geometry::Picture;

    #[test]
    fn the_name_of_a_set_says_what_is_not_the_default() {
        assert_eq!(SynthesisOptions::default().note(), "");
        assert_eq!(SynthesisOptions::default().options(), "");
        let options = SynthesisOptions {
            images: Preset::Paper,
            camera_effects: true,
            backgrounds: Some("rooms".into()),
            max_roll: None,
        };
        assert_eq!(
            options.note(),
            ", the paper's ranges, with camera effects, before photographs of rooms"
        );
        assert_eq!(
            options.options(),
            " --images paper --camera-effects --backgrounds rooms"
        );
    }

    #[test]
    fn the_greatest_roll_is_that_of_the_poses() {
        let template = Template::thin_shell(Picture::from_fn(4, 3, |_, _| [9; 3]), 200.0, 150.0).unwrap();
        let greatest = |max_roll| {
            let options = SynthesisOptions {
                max_roll,
                ..SynthesisOptions::default()
            };
            synthesizer(&template, &options).unwrap().config().pose.max_roll_deg
        };
        assert_eq!((greatest(None), greatest(Some(45.0))), (180.0, 45.0));
        assert_eq!((roll("0"), roll("180")), (Ok(0.0), Ok(180.0)));
        assert!(["-1", "181", "NaN", "half"].iter().all(|text| roll(text).is_err()));
    }

    #[test]
    fn camera_effects_leave_a_preset_its_gain() {
        let texture = Picture::from_fn(40, 30, |x, y| [6 * x as u8, 8 * y as u8, 90]);
        let template = Template::thin_shell(texture, 200.0, 150.0).unwrap();
        let effects = |images: Preset| {
            let options = SynthesisOptions {
                images,
                camera_effects: true,
                ..SynthesisOptions::default()
            };
            synthesizer(&template, &options).unwrap().config().effects.clone()
        };
        let (paper, default) = (effects(Preset::Paper), EffectsConfig::default());
        assert_eq!(
            (paper.gain, paper.jpeg_probability),
            ([0.9, 1.1], default.jpeg_probability)
        );
        assert_eq!(effects(Preset::Default).gain, default.gain);
    }

    #[test]
    fn a_folder_without_photographs_is_refused() {
        let folder = tempfile::tempdir().unwrap();
        fs::write(folder.path().join("notes.txt"), "").unwrap();
        assert!(photographs(folder.path()).is_err());
        let png = deepsft::encode_png(&Picture::from_fn(3, 2, |_, _| [9; 3])).unwrap();
        fs::write(folder.path().join("a.PNG"), png).unwrap();
        assert_eq!(photographs(folder.path()).unwrap().len(), 1);
    }
}
