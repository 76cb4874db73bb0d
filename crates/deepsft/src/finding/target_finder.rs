//! The finders of one target.

use super::finder::{DescriptorFinder, Finder, FinderKind, Sighting};
use super::picture_descriptors::SharedDescriptorNetwork;
use super::target::Target;
use super::view::View;
use crate::error::DeepSftError;
use crate::estimator::{Estimator, Judgement};
use deepsft_finding::{FeatureFinder, PictureGrade, PictureTarget};
use deepsft_geometry::fitting::{FitOptions, FrameFit, FrameFitter};
use deepsft_geometry::{Camera, Maps, Picture};

/// Of a target that counts as found the image confirms this fraction of the visible print ([`FrameFit::explained`]), and so
/// many pixels of it ([`FrameFit::confirmed_px`]). Of right fits one in twenty-five has less than 0.6. On frames with another
/// print the fraction is nearly always below; a nearly black photograph and equal checks have reached 0.9.
pub const LEAST_EXPLAINED: f64 = 0.6;
/// See [`LEAST_EXPLAINED`].
pub const LEAST_CONFIRMED_PX: f64 = 1500.0;

/// The fraction from which no other finder is asked.
const CLEAR: f64 = 0.8;

/// Looks for one target in images.
pub struct TargetFinder {
    target: Target,
    canonical: Camera,
    finders: Vec<Finder>,
    /// Made for the first image in which something is seen; sheets only.
    fitter: Option<FrameFitter>,
}

/// One target in one image.
#[derive(Clone, Debug)]
pub struct TargetEstimate {
    /// Who saw it.
    pub by: Option<FinderKind>,
    /// Depth (mm) and registration in the canonical image: the fitted mesh's, or the finder's where there is none.
    pub maps: Maps,
    /// Whether to believe them.
    pub judgement: Judgement,
    /// The fitted mesh. `None` for templates that are no sheets, and where too little is seen.
    pub fit: Option<FrameFit>,
}

impl TargetEstimate {
    /// How much speaks for it: the fraction of the print that the image confirms, and its size.
    fn worth(&self) -> f64 {
        let confidence = f64::from(self.judgement.confidence);
        self.fit
            .as_ref()
            .map_or(confidence, |fit| confidence * fit.confirmed_px)
    }
}

impl TargetFinder {
    /// The finders that `target` can have: its network, and features for a sheet.
    ///
    /// # Errors
    /// [`DeepSftError::Geometry`] for a template that is no sheet and has no network: nothing could find it.
    pub fn new(target: Target) -> Result<Self, DeepSftError> {
        let mut finders = Vec::new();
        if let Some(network) = target.network() {
            finders.push(Finder::Network(Box::new(network.clone())));
        }
        if target.template().is_sheet() || finders.is_empty() {
            let picture = PictureTarget::new(target.template().clone())?;
            finders.push(Finder::Features(Box::new(FeatureFinder::new(picture)?)));
        }
        Ok(Self::with_finders(target, finders))
    }

    /// Has the network that describes any picture asked too, after the others. Templates that are no sheets stay as they are.
    ///
    /// # Errors
    /// As [`DescriptorFinder::new`].
    pub async fn add_descriptors(&mut self, network: &SharedDescriptorNetwork) -> Result<(), DeepSftError> {
        if self.target.template().is_sheet() {
            let finder = DescriptorFinder::new(network, self.target.template()).await?;
            self.finders.push(Finder::Descriptors(Box::new(finder)));
        }
        Ok(())
    }

    /// With these finders, asked in this order.
    pub fn with_finders(target: Target, finders: Vec<Finder>) -> Self {
        Self {
            canonical: target.canonical_camera(),
            target,
            finders,
            fitter: None,
        }
    }

    /// What it looks for.
    pub fn target(&self) -> &Target {
        &self.target
    }

    /// How well features find the target's picture; `None` where none of the finders uses them. Takes up to 50 ms.
    pub fn grade(&self) -> Option<PictureGrade> {
        self.finders.iter().find_map(|finder| match finder {
            Finder::Features(features) => Some(features.target().grade()),
            Finder::Network(_) | Finder::Descriptors(_) => None,
        })
    }

    /// The camera of canonical images and maps.
    pub fn canonical_camera(&self) -> &Camera {
        &self.canonical
    }

    /// Whether that nothing is seen means that the target is not there. Features say so of many frames that show it.
    pub fn can_deny(&self) -> bool {
        self.finders.iter().any(|finder| finder.kind() == FinderKind::Network)
    }

    /// Where the finders see the target, asked in turn until one is sure.
    ///
    /// # Errors
    /// As [`Finder::find`].
    pub async fn find(&mut self, view: &mut View<'_>) -> Result<Vec<Sighting>, DeepSftError> {
        let mut sightings = Vec::new();
        for finder in &mut self.finders {
            sightings.extend(finder.find(view, &self.canonical).await?);
            if sightings.last().is_some_and(|sighting| sighting.is_sure) {
                break;
            }
        }
        Ok(sightings)
    }

    /// The target in `view`: what the finders see, fitted to the image and judged. The best of them: that of which the image
    /// confirms most.
    ///
    /// # Errors
    /// As [`Finder::find`].
    pub async fn estimate(&mut self, view: &mut View<'_>) -> Result<TargetEstimate, DeepSftError> {
        let mut best: Option<TargetEstimate> = None;
        for k in 0..self.finders.len() {
            let Some(sighting) = self.finders[k].find(view, &self.canonical).await? else {
                continue;
            };
            let estimate = self.judged(view.canonical(&self.canonical)?, sighting)?;
            let is_clear = f64::from(estimate.judgement.confidence) >= CLEAR;
            if best.as_ref().is_none_or(|best| estimate.worth() > best.worth()) {
                best = Some(estimate);
            }
            if is_clear {
                break;
            }
        }
        Ok(best.unwrap_or_else(|| TargetEstimate {
            by: None,
            maps: Maps::empty(self.canonical.width() as usize, self.canonical.height() as usize),
            judgement: Judgement::default(),
            fit: None,
        }))
    }

    /// What the image says of a sighting.
    fn judged(&mut self, canonical: &Picture, sighting: Sighting) -> Result<TargetEstimate, DeepSftError> {
        let Sighting { by, maps, .. } = sighting;
        if !self.target.template().is_sheet() {
            let judgement = match self.target.network() {
                Some(network) => network.judge(canonical, &maps)?,
                None => Judgement::default(),
            };
            return Ok(TargetEstimate {
                by: Some(by),
                maps,
                judgement,
                fit: None,
            });
        }
        let fitter = match &mut self.fitter {
            Some(fitter) => fitter,
            none => none.insert(FrameFitter::new(self.target.template(), FitOptions::default())?),
        };
        let fit = match by {
            FinderKind::Network => fitter.fit(canonical, &self.canonical, &maps, None)?,
            FinderKind::Features | FinderKind::Descriptors => fitter.fit_unmasked(canonical, &self.canonical, &maps)?,
        };
        let (explained, confirmed_px) = fit.as_ref().map_or((0.0, 0.0), |fit| (fit.explained, fit.confirmed_px));
        let maps = fit.as_ref().map_or(maps, |fit| fit.maps.clone());
        Ok(TargetEstimate {
            by: Some(by),
            judgement: Judgement {
                found: explained >= LEAST_EXPLAINED && confirmed_px >= LEAST_CONFIRMED_PX,
                confidence: explained as f32,
                area: Estimator::area(&maps) as f32,
            },
            maps,
            fit,
        })
    }
}
