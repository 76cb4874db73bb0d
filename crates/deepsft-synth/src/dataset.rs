//! The description of a data set of ours.

use crate::SynthConfig;
use deepsft_formats::DatasetDescription;
use deepsft_geometry::Template;

/// The description of `samples` samples of `template`, made with `config` and `seed`, in `shards`.
pub fn describe_dataset(
    template: &Template,
    config: &SynthConfig,
    seed: u64,
    samples: u64,
    shards: Vec<String>,
) -> DatasetDescription {
    DatasetDescription::new(template, config.description().into(), seed, samples, shards)
}
