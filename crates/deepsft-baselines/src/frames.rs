//! The single frames that methods are measured on, and what is harder in some of them.

use anyhow::{Result, bail};
use clap::ValueEnum;
use deepsft_geometry::{Camera, CanonicalWarp, Template, training_camera};
use deepsft_synth::{Sample, SynthConfig, Synthesizer, canonical_truth};

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

impl Condition {
    fn config(self) -> SynthConfig {
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
        let camera = Camera::preset(self.to_possible_value()?.get_name())?;
        // Half their pixels: twice those of the canonical image.
        camera
            .resized((CAMERA_WIDTH, CAMERA_WIDTH * camera.size().height / camera.size().width))
            .ok()
    }
}

/// Calls `each` with the first `frames` samples of `seed` that show the template, as the training camera sees them.
///
/// # Errors
/// Those of `each`, and where hardly any sample shows the template.
pub fn stills(
    template: &Template,
    condition: Condition,
    seed: u64,
    frames: u64,
    mut each: impl FnMut(&Sample) -> Result<()>,
) -> Result<()> {
    let (mut config, camera) = (condition.config(), condition.camera());
    if let Some(camera) = &camera {
        config.camera = *camera;
    }
    let synthesizer = Synthesizer::new(template, config)?;
    let mut shown = 0;
    for index in 0.. {
        if shown == frames {
            break;
        }
        if index > 2 * frames + 10 {
            bail!("hardly any sample shows the template");
        }
        let mut sample = synthesizer.sample(seed, index);
        if camera.is_some() {
            sample = canonical(sample, template)?;
        }
        if sample.has_template {
            shown += 1;
            each(&sample)?;
        }
    }
    Ok(())
}

/// The sample as the training camera would have seen it.
fn canonical(sample: Sample, template: &Template) -> Result<Sample> {
    let camera = training_camera();
    let truth = canonical_truth(&sample, template.mesh(), &camera);
    let image = CanonicalWarp::new(&sample.camera, &camera).apply(&sample.image)?;
    Ok(Sample::new(
        image,
        truth,
        sample.vertices_camera,
        camera,
        sample.towards_light,
    ))
}

#[cfg(test)]
mod tests {
    use super::*;
    use deepsft_geometry::{Maps, photo_consistency_error};

    #[test]
    fn the_image_of_another_camera_shows_the_template_where_its_truth_says() {
        let folder = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("../../models/poster-a4/template");
        let template = deepsft_formats::read_template(&folder).unwrap();
        let mut errors = Vec::new();
        stills(&template, Condition::KinectV2, 1, 1, |sample| {
            assert_eq!(sample.image.size(), training_camera().size());
            let error = |truth: &Maps| photo_consistency_error(&sample.image, template.texture(), truth).unwrap();
            let mut moved = sample.truth.clone();
            for pixel in (0..moved.depth().len()).filter(|&pixel| sample.truth.inside(pixel)) {
                let [u, v] = sample.truth.registration()[pixel];
                moved.set(pixel, sample.truth.depth()[pixel], [(u + 0.05).min(1.0), v]);
            }
            errors.push([error(&sample.truth), error(&moved)]);
            Ok(())
        })
        .unwrap();
        assert!(errors.len() == 1 && errors[0][0] < 0.8 * errors[0][1], "{errors:?}");
    }
}
