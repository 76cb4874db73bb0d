//! `dataset.json`: what a data set is, beside its shards.

use crate::dataset::{DEPTH_UNITS_PER_MM, UV_ONE};
use crate::fingerprint::template_fingerprint;
use crate::{EdgeLengthChange, EdgeLengthHistogram, SynthConfig, SynthError};
use deepsft_geometry::Template;
use serde::{Deserialize, Serialize};

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
    /// Width and height of the template, mm.
    pub template_size_mm: [f64; 2],
    /// Differs when the template's mesh or texture does, in hexadecimal; empty in sets of earlier versions.
    #[serde(default, skip_serializing_if = "String::is_empty")]
    pub template_fingerprint: String,
    /// Unit of the depth files, mm.
    pub depth_unit_mm: f64,
    /// What 1 of u and v is in the registration files.
    pub uv_one: u32,
    /// [`SynthConfig::fingerprint`] in hexadecimal.
    pub configuration_fingerprint: String,
    /// [`SynthConfig::description`]: every setting as text.
    pub configuration: String,
    /// [`crate::Synthesizer::fingerprint`] in hexadecimal: template, configuration and photographs.
    #[serde(default)]
    pub fingerprint: String,
    /// How isometric the deformations are.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub edge_length_change: Option<EdgeLengthSummary>,
    /// How many shapes came out as they were drawn, where handles made them and that is known of all of them.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub handle_shapes: Option<HandleShapeCounts>,
}

/// How many of a data set's shapes that handles made ([`crate::HandleDeformation`]) are what was drawn, of the
/// samples that show the object.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct HandleShapeCounts {
    /// All of them.
    pub shapes: u64,
    /// Those that were made weaker, to keep the bounds on edge lengths.
    pub weakened: u64,
    /// Those that could not be made at all: the object has its rest shape.
    pub at_rest: u64,
}

impl HandleShapeCounts {
    /// Counts a shape by its [`crate::HandleShape::strength`].
    pub fn count(&mut self, strength: f64) {
        self.shapes += 1;
        self.weakened += u64::from(strength > 0.0 && strength < 1.0);
        self.at_rest += u64::from(strength == 0.0);
    }

    /// Adds the counts of other samples.
    pub fn add(&mut self, other: &Self) {
        self.shapes += other.shapes;
        self.weakened += other.weakened;
        self.at_rest += other.at_rest;
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

/// See [`DatasetDescription::template_fingerprint`].
fn template_fingerprint_text(template: &Template) -> String {
    format!("{:016x}", template_fingerprint(0, template))
}

impl DatasetDescription {
    /// The description of `samples` samples of `template`, made with `config` and `seed`, in `shards`.
    pub fn new(template: &Template, config: &SynthConfig, seed: u64, samples: u64, shards: Vec<String>) -> Self {
        Self {
            format_version: FORMAT_VERSION,
            seed,
            first: 0,
            samples,
            part: None,
            shards,
            shard_bytes: Vec::new(),
            template_size_mm: template.size_mm().to_array(),
            template_fingerprint: template_fingerprint_text(template),
            depth_unit_mm: f64::from(1.0 / DEPTH_UNITS_PER_MM),
            uv_one: UV_ONE as u32,
            configuration_fingerprint: format!("{:016x}", config.fingerprint()),
            configuration: config.description(),
            fingerprint: String::new(),
            edge_length_change: None,
            handle_shapes: None,
        }
    }

    /// Whether the set is of `template`, as far as it says: its size, and its mesh and texture unless an earlier version
    /// wrote it.
    pub fn is_of(&self, template: &Template) -> bool {
        let known = [String::new(), template_fingerprint_text(template)];
        self.template_size_mm == template.size_mm().to_array() && known.contains(&self.template_fingerprint)
    }

    /// The text of `dataset.json`.
    ///
    /// # Errors
    /// [`SynthError::Json`] when a number is not finite.
    pub fn to_json(&self) -> Result<String, SynthError> {
        serde_json::to_string_pretty(self).map_err(|source| SynthError::Json {
            name: "dataset.json".into(),
            source,
        })
    }

    /// Reads the text of `dataset.json`.
    ///
    /// # Errors
    /// [`SynthError::Json`] when it is not such a text, [`SynthError::EntryContent`] when its version or its units are
    /// not ours.
    pub fn from_json(text: &str) -> Result<Self, SynthError> {
        let name = || "dataset.json".to_owned();
        let description: Self =
            serde_json::from_str(text).map_err(|source| SynthError::Json { name: name(), source })?;
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
            return Err(SynthError::EntryContent {
                name: name(),
                actual: units(&description),
                expected: units(&ours),
            });
        }
        Ok(description)
    }
}
