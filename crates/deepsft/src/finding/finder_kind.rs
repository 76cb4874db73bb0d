//! The kinds of finders.

use serde::Serialize;

/// The ways of finding.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
#[non_exhaustive]
pub enum FinderKind {
    /// The network that was trained for the target.
    Network,
    /// Corners and binary descriptors of the target's picture.
    Features,
    /// The network that describes any picture; its matches gather those of the features.
    Descriptors,
}

impl FinderKind {
    /// `network`, `features` or `descriptors`.
    pub fn name(self) -> &'static str {
        match self {
            Self::Network => "network",
            Self::Features => "features",
            Self::Descriptors => "descriptors",
        }
    }
}
