//! What is varied in synthetic samples, and how far.

use crate::deform::DeformationConfig;
use crate::error::SynthError;
use crate::render::{EffectsConfig, LightingConfig};
use crate::scene::occluder::OccluderKind;
use crate::scene::pose::PoseConfig;
use deepsft_formats::CameraFile;
use deepsft_geometry::{Camera, Lens, training_camera};
use serde::{Serialize, Serializer};

/// Settings of a [`crate::Synthesizer`]. Ranges are `[lowest, highest]`, drawn uniformly.
///
/// The defaults are the training distribution of the shipped models. They are our choice: light and camera effects vary
/// more than in the paper's section 5.1, because our models never see real training images.
#[derive(Clone, Debug, Serialize)]
pub struct SynthConfig {
    /// How the sheet bends.
    pub deformation: DeformationConfig,
    /// How it is held before the camera.
    pub pose: PoseConfig,
    /// The camera that takes the picture; without lens distortion. Default: the training camera (480 x 270).
    #[serde(serialize_with = "as_camera_file")]
    pub camera: Camera,
    /// Probability of a sample without the template. Default 0.1.
    pub empty_probability: f64,
    /// Probability that another printed sheet lies behind or beside the template. Default 0.3.
    pub distractor_probability: f64,
    /// Probability that a sample without the template shows another printed sheet in its place. So a network does not learn to
    /// find just any printed sheet. Default 0.7.
    pub empty_distractor_probability: f64,
    /// Probability that the background shows one of the user's photographs, if there are any. All other backgrounds are
    /// drawn. Default 0.5.
    pub photograph_probability: f64,
    /// How such a photograph is shown. Default varied; drawn backgrounds always are.
    pub photographs: PhotographUse,
    /// Probability that something is held or lies before the sheet. Default 0.5.
    pub occluder_probability: f64,
    /// What that is. Default hands and things.
    pub occluders: OccluderKind,
    /// Largest fraction of the visible sheet that occluders cover together. Default 0.35.
    pub max_occluded: f64,
    /// Fewest pixels of the front in view (before occluders) for a sample to have the template. Poses and shapes are drawn
    /// again until there are as many. Default 1500 (1.2 % of the frame).
    pub min_visible_px: usize,
    /// Light and paper.
    pub lighting: LightingConfig,
    /// Camera effects.
    pub effects: EffectsConfig,
}

/// How the user's photographs are shown as backgrounds.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[non_exhaustive]
pub enum PhotographUse {
    /// Cut out, turned, mirrored and recoloured at random, seldom with things strewn over it: no two samples share one.
    Varied,
    /// As it is, its middle as large as fills the image (the paper's section 5.1).
    Plain,
}

impl Default for SynthConfig {
    fn default() -> Self {
        Self {
            deformation: DeformationConfig::default(),
            pose: PoseConfig::default(),
            camera: training_camera(),
            empty_probability: 0.1,
            distractor_probability: 0.3,
            empty_distractor_probability: 0.7,
            photograph_probability: 0.5,
            photographs: PhotographUse::Varied,
            occluder_probability: 0.5,
            occluders: OccluderKind::HandsAndThings,
            max_occluded: 0.35,
            min_visible_px: 1500,
            lighting: LightingConfig::default(),
            effects: EffectsConfig::default(),
        }
    }
}

/// A camera as its file has it.
fn as_camera_file<S: Serializer>(camera: &Camera, serializer: S) -> Result<S::Ok, S::Error> {
    CameraFile::new(camera).serialize(serializer)
}

impl SynthConfig {
    /// Every setting as JSON, as `dataset.json` records it.
    pub fn description(&self) -> serde_json::Value {
        // Numbers and fixed keys: there is nothing in it that JSON could not say.
        serde_json::to_value(self).unwrap_or_default()
    }

    /// Checks probabilities, ranges and the camera.
    ///
    /// # Errors
    /// [`SynthError::Setting`] names the field; [`SynthError::Refused`] for a camera with lens distortion, as the renderer draws straight edges.
    pub(crate) fn check(&self) -> Result<(), SynthError> {
        if self.camera.lens() != Lens::Pinhole {
            let lens = self.camera.lens();
            let reason = format!("the synthesis camera has lens distortion {lens:?}, expected none");
            return Err(SynthError::Refused(reason));
        }
        let (light, effects) = (&self.lighting, &self.effects);
        for (parameter, value) in [
            ("empty_probability", self.empty_probability),
            ("distractor_probability", self.distractor_probability),
            ("empty_distractor_probability", self.empty_distractor_probability),
            ("photograph_probability", self.photograph_probability),
            ("occluder_probability", self.occluder_probability),
            ("max_occluded", self.max_occluded),
            ("lighting.shadow_probability", light.shadow_probability),
            ("effects.motion_probability", effects.motion_probability),
            ("effects.sharpening_probability", effects.sharpening_probability),
            ("effects.jpeg_probability", effects.jpeg_probability),
            ("effects.bars_probability", effects.bars_probability),
        ] {
            if !(0.0..=1.0).contains(&value) {
                return Err(SynthError::setting(parameter, value, "0 to 1"));
            }
        }
        for (parameter, [low, high], most) in [
            ("lighting.max_angle_deg", [0.0, light.max_angle_deg], 180.0),
            ("lighting.ambient_fraction", light.ambient_fraction, 1.0),
            ("lighting.white_level", light.white_level, 100.0),
            ("lighting.tint", [0.0, light.tint], 0.9),
            ("lighting.roughness", light.roughness, 1.0),
            ("lighting.specular", light.specular, 100.0),
            ("lighting.translucency", light.translucency, 1.0),
            ("lighting.paper_white", light.paper_white, 1.0),
            ("effects.gain", effects.gain, 100.0),
            ("effects.white_balance", [0.0, effects.white_balance], 0.9),
            ("effects.gamma", effects.gamma, 10.0),
            ("effects.contrast", effects.contrast, 10.0),
            ("effects.saturation", effects.saturation, 10.0),
            ("effects.defocus_px", effects.defocus_px, 20.0),
            ("effects.motion_px", effects.motion_px, 100.0),
            ("effects.noise_levels", effects.noise_levels, 255.0),
            ("effects.vignetting", effects.vignetting, 1.0),
            ("effects.jpeg_quality", effects.jpeg_quality, 100.0),
        ] {
            if !(0.0 <= low && low <= high && high <= most) {
                let actual = format!("[{low}, {high}]");
                let expected = "0 <= lowest <= highest <= the field's limit";
                return Err(SynthError::setting(parameter, actual, expected));
            }
        }
        Ok(())
    }
}
