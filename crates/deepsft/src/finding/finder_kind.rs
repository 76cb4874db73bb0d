//! The kinds of finders.

use serde::Serialize;

/// The ways of finding; of unsure sightings those of the first are right most often.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize)]
#[serde(rename_all = "lowercase")]
#[non_exhaustive]
pub enum FinderKind {
    /// Corners and binary descriptors of the target's picture.
    Features,
    /// The network that was trained for the target.
    Network,
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

    /// Whether a negative answer is trustworthy: a network's is; matches miss many frames that show the target.
    pub(super) fn can_deny(self) -> bool {
        self == Self::Network
    }
}
