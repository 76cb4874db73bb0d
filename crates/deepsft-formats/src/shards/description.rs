//! `dataset.json`: what a data set is, beside its shards.

use super::{DEPTH_UNITS_PER_MM, EdgeLengthChange, EdgeLengthHistogram, UV_ONE};
use crate::error::FormatError;
use crate::fingerprint::{fingerprint, template_fingerprint};
use deepsft_geometry::Template;
use serde::{Deserialize, Serialize};
use serde_json::Value;

/// Version of the layout of the shards (see [`crate::write_shard`]), written into `dataset.json`.
const FORMAT_VERSION: u32 = 1;

/// What `dataset.json` says of the shards beside it.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
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
    /// How isometric the deformations are.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub edge_length_change: Option<EdgeLengthSummary>,
    /// How many shapes came out as they were drawn, where control points made them and that is known of all of them.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub handle_shapes: Option<ShapeCounts>,
}

/// How many of a data set's shapes that control points made are what was drawn, of the samples that show the object.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct ShapeCounts {
    /// All of them.
    pub shapes: u64,
    /// Those that were made weaker, to keep the bounds on edge lengths.
    pub weakened: u64,
    /// Those that could not be made at all: the object has its rest shape.
    pub at_rest: u64,
}

impl ShapeCounts {
    /// Counts a shape by its strength: 1 as drawn, 0 at rest.
    pub fn count(&mut self, strength: f64) {
        self.shapes += 1;
        self.weakened += u64::from(strength > 0.0 && strength < 1.0);
        self.at_rest += u64::from(strength == 0.0);
    }

    /// Adds the counts of other samples. What is too large stays the largest number there is.
    pub fn add(&mut self, other: &Self) {
        self.shapes = self.shapes.saturating_add(other.shapes);
        self.weakened = self.weakened.saturating_add(other.weakened);
        self.at_rest = self.at_rest.saturating_add(other.at_rest);
    }
}

/// Relative change |l / l0 - 1| of the lengths of the mesh's edges in a data set, over all edges of all samples that
/// show the object.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct EdgeLengthSummary {
    /// Median.
    pub median: f64,
    /// 95th percentile.
    pub p95: f64,
    /// All changes, from which sets can be added up.
    pub histogram: EdgeLengthHistogram,
}

impl EdgeLengthSummary {
    /// The summary of a histogram.
    pub fn new(histogram: EdgeLengthHistogram) -> Self {
        let EdgeLengthChange { median, p95 } = histogram.change();
        Self { median, p95, histogram }
    }
}

impl DatasetDescription {
    /// The description of `samples` samples of `template`, made with `seed` and the settings `configuration`, in
    /// `shards`.
    pub fn new(template: &Template, configuration: Value, seed: u64, samples: u64, shards: Vec<String>) -> Self {
        Self {
            format_version: FORMAT_VERSION,
            seed,
            first: 0,
            samples,
            part: None,
            shards,
            shard_bytes: Vec::new(),
            shard_sha256: Vec::new(),
            template_size_mm: template.size_mm().to_array(),
            template_sha256: template_fingerprint(template),
            depth_unit_mm: f64::from(1.0 / DEPTH_UNITS_PER_MM),
            uv_one: UV_ONE as u32,
            configuration_fingerprint: fingerprint(&configuration),
            configuration,
            fingerprint: String::new(),
            edge_length_change: None,
            handle_shapes: None,
        }
    }

    /// Checks that the set is of `template`: its size, its mesh and its texture.
    ///
    /// # Errors
    /// [`FormatError::OtherTemplate`].
    pub fn check_template(&self, template: &Template) -> Result<(), FormatError> {
        let [width, height] = self.template_size_mm;
        let size = template.size_mm();
        let difference = if [width, height] != size.to_array() {
            format!("{width} x {height} mm, not {} x {} mm", size.x, size.y)
        } else if template_fingerprint(template) != self.template_sha256 {
            "one of this size, with another texture or mesh".to_owned()
        } else {
            return Ok(());
        };
        Err(FormatError::OtherTemplate { difference })
    }

    /// The text of `dataset.json`.
    ///
    /// # Errors
    /// [`FormatError::Json`] when a number is not finite.
    pub fn to_json(&self) -> Result<String, FormatError> {
        serde_json::to_string_pretty(self).map_err(|source| FormatError::Json {
            name: "dataset.json".into(),
            source,
        })
    }

    /// Reads the text of `dataset.json`.
    ///
    /// # Errors
    /// [`FormatError::Json`] when it is not such a text, [`FormatError::Entry`] when its version or its units are
    /// not ours.
    pub fn from_json(text: &str) -> Result<Self, FormatError> {
        let name = || "dataset.json".to_owned();
        let description: Self =
            serde_json::from_str(text).map_err(|source| FormatError::Json { name: name(), source })?;
        let units = |d: &Self| {
            format!(
                "format version {}, depth unit {} mm, uv one {}",
                d.format_version, d.depth_unit_mm, d.uv_one
            )
        };
        let ours = Self {
            format_version: FORMAT_VERSION,
            depth_unit_mm: f64::from(1.0 / DEPTH_UNITS_PER_MM),
            uv_one: UV_ONE as u32,
            ..description.clone()
        };
        if units(&description) != units(&ours) {
            let reason = format!("is {}, expected {}", units(&description), units(&ours));
            return Err(FormatError::entry(name(), reason));
        }
        Ok(description)
    }
}
