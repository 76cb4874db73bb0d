//! `dataset.json`: what a data set is, beside its shards.

use super::Reason;
use super::entries::{DEPTH_UNITS_PER_MM, UV_ONE};
use crate::error::SynthError;
use deepsft_formats::{fingerprint, json_reason, template_fingerprint};
use deepsft_geometry::Template;
use deepsft_geometry::glam::DVec2;
use serde::{Deserialize, Serialize};
use serde_json::Value;

/// Name of the description in a data set's folder.
pub const DATASET_FILE: &str = "dataset.json";

/// Version of the layout of the shards, written into `dataset.json`.
const FORMAT_VERSION: u32 = 1;

/// Relative difference by which a size may change when it is written as text and read again.
const ROUNDING: f64 = 1e-9;

/// What `dataset.json` says of the shards beside it.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct DatasetDescription {
    /// Version of the shards' layout.
    pub format_version: u32,
    /// Seed of all samples.
    pub seed: u64,
    /// Index of the first sample; the others follow.
    #[serde(default)]
    pub first: u64,
    /// Number of samples in all shards.
    pub samples: u64,
    /// (i, n) when this is part i of n (from 1) of a larger set: it speaks for its own samples only.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub part: Option<(u64, u64)>,
    /// File names of the shards, in order.
    pub shards: Vec<String>,
    /// Bytes of each shard, in the same order; empty where they are not known.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub shard_bytes: Vec<u64>,
    /// SHA-256 of each shard in hexadecimal, in the same order; empty where they are not known.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub shard_sha256: Vec<String>,
    /// Width and height of the template, mm.
    pub template_size_mm: [f64; 2],
    /// [`template_fingerprint`] of the template.
    pub template_sha256: String,
    /// Unit of the depth files, mm.
    pub depth_unit_mm: f64,
    /// What 1 of u and v is in the registration files.
    pub uv_one: u32,
    /// Differs when a setting of the synthesis does.
    pub configuration_fingerprint: String,
    /// Every setting of the synthesis.
    pub configuration: Value,
    /// Differs when template, configuration or photographs do: with seed and index it determines a sample.
    #[serde(default)]
    pub fingerprint: String,
}

impl DatasetDescription {
    /// The description of a data set of `template` without samples yet, made with `seed` and the settings `configuration`.
    pub(super) fn new(template: &Template, configuration: Value, seed: u64) -> Self {
        Self {
            format_version: FORMAT_VERSION,
            seed,
            template_size_mm: template.size_mm().to_array(),
            template_sha256: template_fingerprint(template),
            depth_unit_mm: f64::from(1.0 / DEPTH_UNITS_PER_MM),
            uv_one: UV_ONE as u32,
            configuration_fingerprint: fingerprint(&configuration),
            configuration,
            ..Self::default()
        }
    }

    /// Adds the part `next` of the same data set, which follows those before.
    pub(super) fn append(&mut self, mut next: Self) -> Result<(), Reason> {
        let follows = Some(next.first) == self.first.checked_add(self.samples);
        let samples = self.samples.checked_add(next.samples);
        let samples = samples.ok_or("its parts say that they have more samples than can be counted")?;
        if (&next.fingerprint, next.seed) != (&self.fingerprint, self.seed) || !follows {
            return Err("it is part of another data set than those before it".into());
        }
        self.samples = samples;
        self.shards.append(&mut next.shards);
        self.shard_bytes.append(&mut next.shard_bytes);
        self.shard_sha256.append(&mut next.shard_sha256);
        Ok(())
    }

    /// Checks that the set is of `template`: its size, its mesh and its texture.
    ///
    /// # Errors
    /// [`SynthError::Refused`] says in what they differ.
    pub fn check_template(&self, template: &Template) -> Result<(), SynthError> {
        // The fingerprint decides: a size that was written as text may come back in another last bit.
        if template_fingerprint(template) == self.template_sha256 {
            return Ok(());
        }
        let ([width, height], size) = (self.template_size_mm, template.size_mm());
        let is_as_large = (DVec2::new(width, height) - size).abs().max_element() < ROUNDING * size.max_element();
        let difference = match is_as_large {
            true => "one of this size, with another texture or mesh".to_owned(),
            false => format!("{width} x {height} mm, not {} x {} mm", size.x, size.y),
        };
        Err(SynthError::Refused(format!(
            "it is of another template: {difference}; choose a set of this one"
        )))
    }

    /// The text of `dataset.json`.
    pub fn to_json(&self) -> String {
        // Numbers, texts and fixed keys: there is nothing in it that JSON could not say.
        serde_json::to_string_pretty(self).unwrap_or_default()
    }

    /// Reads the text of `dataset.json`, whose version and units must be ours.
    pub(super) fn from_json(text: &[u8]) -> Result<Self, Reason> {
        let description: Self = serde_json::from_slice(text).map_err(|error| json_reason(&error))?;
        let units = |version: u32, depth_unit_mm: f64, uv_one: u32| {
            format!("format version {version}, depth unit {depth_unit_mm} mm, uv one {uv_one}")
        };
        let theirs = units(
            description.format_version,
            description.depth_unit_mm,
            description.uv_one,
        );
        let ours = units(FORMAT_VERSION, f64::from(1.0 / DEPTH_UNITS_PER_MM), UV_ONE as u32);
        if theirs != ours {
            return Err(format!("it is of {theirs}, expected {ours}: make it anew with this version").into());
        }
        if let Some(name) = description.shards.iter().find(|name| name.contains(['/', '\\'])) {
            return Err(format!("it names a shard outside of its folder: {name:?}").into());
        }
        Ok(description)
    }
}
