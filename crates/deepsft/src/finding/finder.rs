//! What can find a target.

use super::view::View;
use crate::error::DeepSftError;
use crate::estimator::Estimator;
use deepsft_finding::{FeatureFinder, FoundSheet};
use deepsft_geometry::{Camera, Maps};
use serde::Serialize;

/// The ways of finding.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum FinderKind {
    /// The network that was trained for the target.
    Network,
    /// Corners and binary descriptors of the target's picture.
    Features,
}

impl FinderKind {
    /// `network` or `features`.
    pub fn name(self) -> &'static str {
        match self {
            Self::Network => "network",
            Self::Features => "features",
        }
    }
}

/// Where a finder sees a target: what a mesh fit starts from.
#[derive(Clone, Debug)]
pub struct Sighting {
    /// Who says so.
    pub by: FinderKind,
    /// Depth (mm) and registration in the canonical image. Features give the whole surface, as if nothing hid it.
    pub maps: Maps,
    /// Whether the finder believes it before any fit: no other need be asked.
    pub is_sure: bool,
}

/// One way to find one target.
pub enum Finder {
    /// The target's own network.
    Network(Estimator),
    /// The features of its picture.
    Features(Box<FeatureFinder>),
}

impl Finder {
    /// Its kind.
    pub fn kind(&self) -> FinderKind {
        match self {
            Self::Network(_) => FinderKind::Network,
            Self::Features(_) => FinderKind::Features,
        }
    }

    /// Where it sees the target in `view`, as `canonical` sees it. `None` where it sees nothing that a fit could start from;
    /// something else may look like the target, and only the fit tells.
    ///
    /// # Errors
    /// [`DeepSftError::Geometry`] when the image is not of its camera's size, [`DeepSftError::Execution`] when the device
    /// fails.
    pub async fn find(&mut self, view: &mut View<'_>, canonical: &Camera) -> Result<Option<Sighting>, DeepSftError> {
        let by = self.kind();
        match self {
            Self::Network(network) => {
                let image = view.canonical(canonical)?;
                let maps = network.infer(image).await?;
                let judgement = network.judge(image, &maps)?;
                let is_sure = judgement.found;
                // Where the target is not in the image, the mask is empty or nearly so.
                let is_seen = network.covers_enough(judgement.area);
                Ok(is_seen.then_some(Sighting { by, maps, is_sure }))
            }
            Self::Features(finder) => {
                let (features, camera) = view.features()?;
                let found = finder.find(features, camera, canonical)?;
                Ok(found.map(|FoundSheet { maps, .. }| Sighting {
                    by,
                    maps,
                    is_sure: true,
                }))
            }
        }
    }
}
