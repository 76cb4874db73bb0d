//! What the study of the fit varies, one thing at a time.

use super::disturbance::faded;
use anyhow::Result;
use deepsft_geometry::{Camera, Template};
use deepsft_synth::{SynthConfig, Synthesizer};
use serde::Serialize;

/// How far a careless mask reaches into what covers the sheet, pixels.
pub const LEAK_PX: usize = 5;

/// Registration error of the disturbed truth in the series that vary something else, pixels.
const TYPICAL_ERROR_PX: f64 = 4.0;

/// Where a fit starts.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Start {
    /// The truth, disturbed: [`super::disturbance::disturbed_maps`].
    DisturbedTruth,
    /// The network's own maps.
    Network,
}

/// Which pixels the maps keep when something covers the sheet.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Mask {
    /// The network sees what covers the sheet, and answers.
    Network,
    /// The network's maps of the sheet without the cover; the cover is cut out of them exactly.
    Exact,
    /// As `Exact`, but a rim of the cover's pixels stays.
    Careless,
}

/// One level of one series: everything that differs from ordinary frames.
#[derive(Clone, Copy, Debug)]
pub struct Condition {
    /// The level, in the series' unit.
    pub level: f64,
    pub start: Start,
    /// Registration error of a disturbed truth, pixels.
    pub error_px: f64,
    /// Fraction of the visible sheet that is covered, and what the maps keep.
    pub hidden: Option<(f64, Mask)>,
    /// Standard deviation of the lens blur, pixels; `None` leaves the blur of ordinary frames.
    blur_px: Option<f64>,
    /// Contrast of what is printed, 1 in ordinary frames.
    contrast: f64,
    /// By how much the believed focal length is too long, relative.
    focal_error: f64,
    /// Whether the frames show a mesh of twice the resolution.
    pub finer: bool,
}

/// One thing that is varied.
pub struct Plan {
    pub name: &'static str,
    pub unit: &'static str,
    pub start: Start,
    pub conditions: Vec<Condition>,
}

impl Plan {
    fn new(
        name: &'static str,
        unit: &'static str,
        start: Start,
        levels: &[f64],
        vary: impl Fn(&mut Condition, f64),
    ) -> Self {
        let conditions = levels.iter().map(|&level| {
            let mut condition = Condition {
                level,
                start,
                error_px: TYPICAL_ERROR_PX,
                hidden: None,
                blur_px: None,
                contrast: 1.0,
                focal_error: 0.0,
                finer: true,
            };
            vary(&mut condition, level);
            condition
        });
        Self {
            name,
            unit,
            start,
            conditions: conditions.collect(),
        }
    }
}

/// All series of the study.
pub fn plans() -> Vec<Plan> {
    let (truth, network) = (Start::DisturbedTruth, Start::Network);
    let mut plans = vec![Plan::new(
        "initial registration error",
        "px",
        truth,
        &[2.0, 4.0, 8.0, 12.0, 16.0],
        |condition, level| condition.error_px = level,
    )];
    for (name, mask) in [
        ("hidden fraction, network's mask", Mask::Network),
        ("hidden fraction, exact mask", Mask::Exact),
        ("hidden fraction, careless mask", Mask::Careless),
    ] {
        let vary = |condition: &mut Condition, level: f64| condition.hidden = Some((level / 100.0, mask));
        plans.push(Plan::new(name, "%", network, &[0.0, 15.0, 30.0, 45.0, 60.0], vary));
    }
    for (name, start) in [("blur", network), ("blur, disturbed truth", truth)] {
        let vary = |condition: &mut Condition, level: f64| condition.blur_px = Some(level);
        plans.push(Plan::new(name, "px", start, &[0.0, 1.0, 2.0, 4.0], vary));
    }
    for (name, start) in [
        ("texture contrast", network),
        ("texture contrast, disturbed truth", truth),
    ] {
        let vary = |condition: &mut Condition, level: f64| condition.contrast = level / 100.0;
        plans.push(Plan::new(name, "%", start, &[100.0, 50.0, 25.0, 10.0], vary));
    }
    plans.push(Plan::new(
        "focal length believed too long",
        "%",
        network,
        &[0.0, 2.0, 5.0, 10.0],
        |condition, level| condition.focal_error = level / 100.0,
    ));
    plans.push(Plan::new(
        "mesh the frames are rendered from",
        "x resolution",
        network,
        &[1.0, 2.0],
        |condition, level| condition.finer = level > 1.0,
    ));
    plans
}

impl Condition {
    /// The synthesiser of this condition's frames for a network that works with the camera `canonical`.
    pub fn synthesizer(&self, template: &Template, canonical: &Camera) -> Result<Synthesizer> {
        let mut shown = if self.finer {
            template.finer()?
        } else {
            template.clone()
        };
        if self.contrast < 1.0 {
            shown = shown.with_texture(faded(template.texture(), self.contrast));
        }
        let (focal, principal) = (
            canonical.focal() / (1.0 + self.focal_error),
            canonical.principal_point(),
        );
        let mut config = SynthConfig {
            empty_probability: 0.0,
            camera: Camera::pinhole(canonical.size(), focal, principal)?,
            ..SynthConfig::default()
        };
        if let Some(blur) = self.blur_px {
            config.effects.defocus_px = [blur; 2];
            config.effects.motion_probability = 0.0;
        }
        if self.hidden.is_some() {
            config.occluder_probability = 0.0;
        }
        Ok(Synthesizer::new(&shown, config)?)
    }
}
