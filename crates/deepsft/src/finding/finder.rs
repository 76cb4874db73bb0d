//! The ways to find a target.

use super::finder_kind::FinderKind;
use super::picture_descriptors::{PictureDescriptors, SharedDescriptorNetwork};
use super::target::Target;
use super::view::View;
use crate::error::DeepSftError;
use crate::estimator::Estimator;
use deepsft_finding::{FeatureFinder, Match};
use deepsft_geometry::fitting::Start;
use deepsft_geometry::{Camera, Template};

/// One way to find one target.
#[derive(Debug)]
#[non_exhaustive]
pub enum Finder {
    /// The target's own network.
    Network(Box<Estimator>),
    /// The features of its picture.
    Features(Box<FeatureFinder>),
    /// The descriptors of its picture, and its features.
    Descriptors(Box<DescriptorFinder>),
}

/// The finder of a picture by learned descriptors.
#[derive(Debug)]
pub struct DescriptorFinder {
    network: SharedDescriptorNetwork,
    picture: PictureDescriptors,
    features: FeatureFinder,
}

impl DescriptorFinder {
    /// Describes the picture on `template`, a sheet.
    ///
    /// # Errors
    /// [`DeepSftError::Geometry`] for a template that is no sheet.
    pub fn new(network: &SharedDescriptorNetwork, template: &Template) -> Result<Self, DeepSftError> {
        Ok(Self {
            picture: PictureDescriptors::new(network, template)?,
            network: network.clone(),
            features: FeatureFinder::new(template.clone())?,
        })
    }

    /// The matches of the picture with the image, the clearest first, in pixels of the image that features are taken from
    /// ([`View::features`]).
    ///
    /// # Errors
    /// As [`Finder::find`].
    pub fn matches(&mut self, view: &mut View<'_>, canonical: &Camera) -> Result<Vec<Match>, DeepSftError> {
        let matches = self.picture.matches(view.descriptors(&self.network, canonical)?);
        let (_, camera) = view.features()?;
        let ratio = (camera.focal().x / canonical.focal().x) as f32;
        let to_camera = |m: Match| {
            let pixel = camera.project(canonical.unproject(m.pixel.as_dvec2(), 1.0))?.as_vec2();
            let scale = m.scale / ratio;
            Some(Match { pixel, scale, ..m })
        };
        Ok(matches.into_iter().filter_map(to_camera).collect())
    }
}

impl Finder {
    /// The finders that `target` can have, in the order in which they are asked: its network, and features.
    ///
    /// # Errors
    /// [`TemplateError::PrintSize`](deepsft_geometry::TemplateError::PrintSize) for a print of under 5 mm or over 20 m.
    pub fn all(target: &Target) -> Result<Vec<Self>, DeepSftError> {
        let network = target.network().cloned();
        let mut finders: Vec<Self> = network.map(Box::new).map(Self::Network).into_iter().collect();
        let features = FeatureFinder::new(target.template().clone())?;
        finders.push(Self::Features(Box::new(features)));
        Ok(finders)
    }

    /// Its kind.
    pub fn kind(&self) -> FinderKind {
        match self {
            Self::Network(_) => FinderKind::Network,
            Self::Features(_) => FinderKind::Features,
            Self::Descriptors(_) => FinderKind::Descriptors,
        }
    }

    /// Where it sees the target in `view`, as `canonical` sees it, the canonical camera or one zoomed out, and whether it is sure before
    /// any fit, so that no other finder need be asked. A network may be; matches never are: a wrong sheet can have as many. `None`
    /// where it sees nothing that a fit could start from.
    ///
    /// # Errors
    /// [`DeepSftError::Geometry`] when the image is not of its camera's size, [`DeepSftError::Execution`] when the device
    /// fails.
    pub async fn find(
        &mut self,
        view: &mut View<'_>,
        canonical: &Camera,
    ) -> Result<Option<(Start, bool)>, DeepSftError> {
        let sheet = match self {
            Self::Network(network) => {
                let image = view.canonical(canonical)?;
                let maps = network.infer(image, canonical).await?;
                let judgement = network.judge(image, &maps)?;
                // Where the target is not in the image, the mask is empty or nearly so.
                let is_seen = network.covers_enough(judgement.area);
                return Ok(is_seen.then_some((Start::Maps(maps), judgement.found)));
            }
            Self::Features(finder) => {
                let (features, camera) = view.features()?;
                match finder.find(features, camera)? {
                    Some(found) => Some(found),
                    None => match view.detailed_features()? {
                        Some((features, camera)) => finder.find(features, camera)?,
                        None => None,
                    },
                }
            }
            Self::Descriptors(finder) => {
                let candidates = finder.matches(view, canonical)?;
                let (features, camera) = view.features()?;
                finder.features.find_among(&candidates, features, camera)?
            }
        };
        Ok(sheet.map(|sheet| (Start::Mesh(sheet.vertices_camera), false)))
    }
}
