//! The synthetic data of the paper, section 5.1, as a configuration.

use crate::deform::DeformationConfig;
use crate::render::{EffectsConfig, LightingConfig};
use crate::scene::config::{PhotographUse, SynthConfig};
use crate::scene::occluder::OccluderKind;
use crate::scene::pose::PoseConfig;

impl SynthConfig {
    /// The paper's ranges for thin shells (section 5.1), made for sheets of about A4 as all of the paper's are:
    ///
    /// | | paper | here |
    /// |---|---|---|
    /// | shape | position-based cloth, high stiffness, random anchors and forces | the same, our ranges |
    /// | rotation | within 45 degrees about the camera's axes | about each of the three, uniform |
    /// | translation | t_x, t_y within 150 mm, t_z 100 to 600 mm | uniform; t_z from 300 mm on (our choice) |
    /// | light | distant, within 10 degrees of the optical axis | uniform angle, no ambient light |
    /// | reflectance | Lambert, and Blender's Cook-Torrance | the same; roughness and strength are our choice |
    /// | gain | 0.9 to 1.1 | the same; white paper is at 0.9 before it |
    /// | background | photographs of rooms (NYU depth) | the user's photographs, as they are; if there are none drawn pictures, varied ([`PhotographUse::Varied`]) |
    /// | occluders | up to 4 discs of one colour, 1 to 10 px in diameter | the same, anywhere in the image |
    /// | frames without the object, camera effects | none | none; effects can be switched on |
    ///
    /// As in every configuration, a pose that shows less of the sheet than [`PoseConfig`] and
    /// [`SynthConfig::min_visible_px`] ask for is drawn again.
    pub fn paper() -> Self {
        Self {
            deformation: DeformationConfig {
                family_weights: [0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0],
                ..DeformationConfig::default()
            },
            pose: PoseConfig {
                uniform: true,
                ..PoseConfig::default()
            },
            empty_probability: 0.0,
            distractor_probability: 0.0,
            photograph_probability: 1.0,
            photographs: PhotographUse::Plain,
            occluder_probability: 1.0,
            occluders: OccluderKind::Discs,
            lighting: LightingConfig {
                max_angle_deg: 10.0,
                ambient_fraction: [0.0, 0.0],
                white_level: [0.9, 0.9],
                tint: 0.0,
                shadow_probability: 0.0,
                roughness: [0.4, 0.7],
                specular: [0.0, 0.5],
                translucency: [0.0, 0.0],
                paper_white: [1.0, 1.0],
                paper_warmth: [0.0, 0.0],
            },
            effects: EffectsConfig {
                gain: [0.9, 1.1],
                ..EffectsConfig::none()
            },
            ..Self::default()
        }
    }
}
