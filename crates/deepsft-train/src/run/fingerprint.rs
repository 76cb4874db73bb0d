//! What a checkpoint belongs to.

use serde::{Deserialize, Serialize};

/// The fingerprint of a training: what must be equal for its checkpoint to be continued. It has the name of each part with the
/// SHA-256 of what it consists of, in the order in which differences are reported.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Fingerprint(Vec<(String, String)>);

impl Fingerprint {
    /// The same with the part `name`, the hash of `content` as JSON.
    #[must_use]
    pub fn with(mut self, name: &str, content: &impl Serialize) -> Self {
        self.0.push((name.to_owned(), deepsft_formats::fingerprint(content)));
        self
    }

    /// The first part in which `saved` differs; `None` when both are equal.
    pub fn difference(&self, saved: &Self) -> Option<String> {
        let parts = self.0.iter().chain(&saved.0);
        let differs = |part: &&(String, String)| !self.0.contains(part) || !saved.0.contains(part);
        parts.into_iter().find(differs).map(|(name, _)| name.clone())
    }

    /// Whether `saved` has the same part `name`.
    pub fn agrees_in(&self, saved: &Self, name: &str) -> bool {
        self.0.iter().any(|part| part.0 == name && saved.0.contains(part))
    }
}
