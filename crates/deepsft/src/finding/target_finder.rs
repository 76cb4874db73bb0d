//! The finders of one target.

use super::finder::{DescriptorFinder, Finder, FinderKind, Sighting};
use super::picture_descriptors::SharedDescriptorNetwork;
use super::target::Target;
use super::view::View;
use crate::error::DeepSftError;
use crate::estimator::{Estimator, Judgement};
use deepsft_finding::{FeatureFinder, PictureGrade, PictureTarget};
use deepsft_geometry::fitting::{FitOptions, FrameFit, FrameFitter};
use deepsft_geometry::tracking::TrackingOptions;
use deepsft_geometry::{Camera, Maps, Picture};

/// Of a target that counts as found the image confirms this fraction of the visible print ([`FrameFit::explained`]).
const MIN_EXPLAINED: f64 = 0.4;

/// Where the next place that looks alike is confirmed so much ([`FrameFit::ambiguity`], with the bound above which nothing is
/// found), the image must confirm this fraction: a sheet that has slipped shows much that is right.
const AMBIGUITY: [f64; 2] = [0.5, 0.94];
const MIN_EXPLAINED_OF_AMBIGUOUS: f64 = 0.7;

/// Least fraction times the pixels that confirm it ([`FrameFit::confirmed_px`]): a large sheet has to show less of itself than a small
/// one. On frames with another print the product has reached 1,800, on a nearly black one 2,300; of right fits one in a
/// hundred has less than 2,500.
const MIN_WORTH_PX: f64 = 2500.0;

/// Whether a fit shows the target: the same rule for all finders.
pub fn is_found(fit: &FrameFit) -> bool {
    let [some, most] = AMBIGUITY;
    let is_clear = match fit.ambiguity {
        Some(ambiguity) if ambiguity >= some => fit.explained >= MIN_EXPLAINED_OF_AMBIGUOUS && ambiguity < most,
        _ => fit.explained >= MIN_EXPLAINED,
    };
    is_clear && fit.explained * fit.confirmed_px >= MIN_WORTH_PX
}

/// The fraction from which no other finder is asked.
const CLEAR: f64 = 0.8;

/// Looks for one target in images.
pub struct TargetFinder {
    target: Target,
    finders: Vec<Finder>,
    /// Made for the first image in which something is seen; sheets only.
    fitter: Option<FrameFitter>,
}

impl std::fmt::Debug for TargetFinder {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("TargetFinder")
            .field("target", &self.target)
            .field("finders", &self.finders)
            .finish_non_exhaustive()
    }
}

/// One target in one image.
#[derive(Clone, Debug)]
#[non_exhaustive]
pub struct TargetEstimate {
    /// Who saw it.
    pub by: Option<FinderKind>,
    /// Depth (mm) and registration in the image of `canonical_camera`: the fitted mesh's, or the finder's where there is none.
    pub maps: Maps,
    /// The camera of the maps: the canonical one, zoomed out where the target is too near for that.
    pub canonical_camera: Camera,
    /// Whether to believe them.
    pub judgement: Judgement,
    /// The fitted mesh. `None` for templates that are no sheets, and where too little is seen.
    pub fit: Option<FrameFit>,
}

impl TargetEstimate {
    /// How much speaks for it: that it is found, then the fraction of the print that the image confirms, and its size.
    fn worth(&self) -> (bool, f64) {
        let confidence = f64::from(self.judgement.confidence);
        let size = self.fit.as_ref().map_or(1.0, |fit| fit.confirmed_px);
        (self.judgement.found, confidence * size)
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
            let picture = PictureTarget::from_template(target.template().clone())?;
            finders.push(Finder::Features(Box::new(FeatureFinder::new(picture)?)));
        }
        Ok(Self::with_finders(target, finders))
    }

    /// Has the network that describes any picture asked too, after the others. Templates that are no sheets stay as they are.
    ///
    /// # Errors
    /// As [`DescriptorFinder::new`].
    pub fn add_descriptors(&mut self, network: &SharedDescriptorNetwork) -> Result<(), DeepSftError> {
        if self.target.template().is_sheet() {
            let finder = DescriptorFinder::new(network, self.target.template())?;
            self.finders.push(Finder::Descriptors(Box::new(finder)));
        }
        Ok(())
    }

    /// With these finders, asked in this order.
    pub fn with_finders(target: Target, finders: Vec<Finder>) -> Self {
        Self {
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

    /// Whether that nothing is seen means that the target is not there. Features say so of many frames that show it.
    pub fn can_deny(&self) -> bool {
        self.finders.iter().any(|finder| finder.kind() == FinderKind::Network)
    }

    /// Where the finders see the target in `view` as `camera` sees it, one of the target's [`Target::canonical_views`]; asked in turn until
    /// one is sure; the likeliest first. Matches on a print that repeats itself may have slipped: those sightings are fitted and judged
    /// before they count.
    ///
    /// # Errors
    /// As [`Finder::find`].
    pub async fn find(&mut self, view: &mut View<'_>, camera: &Camera) -> Result<Vec<Sighting>, DeepSftError> {
        self.find_and_fit(view, camera, false).await
    }

    /// As [`Self::find`], without the matches that no fit to the image confirms: matches often see something where the target
    /// is not, and a tracker of several targets stands still while it finds that out. The maps of the others are their fit's.
    ///
    /// # Errors
    /// As [`Finder::find`].
    pub async fn find_confirmed(
        &mut self,
        view: &mut View<'_>,
        camera: &Camera,
    ) -> Result<Vec<Sighting>, DeepSftError> {
        self.find_and_fit(view, camera, true).await
    }

    async fn find_and_fit(
        &mut self,
        view: &mut View<'_>,
        camera: &Camera,
        fits_all: bool,
    ) -> Result<Vec<Sighting>, DeepSftError> {
        let least = TrackingOptions::default().start_correlation;
        let mut sightings = Vec::new();
        for k in 0..self.finders.len() {
            let Some(sighting) = self.finders[k].find(view, camera).await? else {
                continue;
            };
            self.prepare()?;
            let Sighting { by, is_sure, .. } = sighting;
            if by == FinderKind::Network {
                sightings.push(sighting);
            } else if self.can_slip()? {
                let TargetEstimate {
                    maps, judgement, fit, ..
                } = self.judged(view.canonical(camera)?, camera, sighting)?;
                let counts = judgement.found && (!fits_all || fit.is_some_and(|fit| fit.correlation >= least));
                sightings.extend(counts.then_some(Sighting { by, maps, is_sure }));
            } else if fits_all {
                let fit = self
                    .fitter()?
                    .fit(view.canonical(camera)?, camera, &sighting.maps, None)?;
                let confirmed = fit.filter(|fit| fit.correlation >= least);
                sightings.extend(confirmed.map(|FrameFit { maps, .. }| Sighting { by, maps, is_sure }));
            } else {
                sightings.push(sighting);
            }
            if is_sure {
                break;
            }
        }
        // A network that is not sure, and descriptors, are right less often than features.
        sightings.sort_by_key(|sighting| sighting.by != FinderKind::Features);
        Ok(sightings)
    }

    /// Makes what judging sightings of a sheet takes, at the first of any finder: made at some later one it would grow the memory of a
    /// page that has long been at work, and hold up a frame.
    fn prepare(&mut self) -> Result<(), DeepSftError> {
        if self.target.template().is_sheet() {
            // It needs more for a moment than a fit does, which then finds room there.
            self.fitter()?.is_self_similar();
        }
        Ok(())
    }

    /// Whether the print looks like itself elsewhere.
    fn can_slip(&mut self) -> Result<bool, DeepSftError> {
        Ok(self.target.template().is_sheet() && self.fitter()?.is_self_similar())
    }

    /// The target in `view`: what the finders see, fitted to the image and judged. The best of them: that of which the image
    /// confirms most. It is measured in the image of the canonical camera, or where the target is not found in that or reaches over its
    /// border, of one that is zoomed out as far as the image goes on.
    ///
    /// # Errors
    /// As [`Finder::find`].
    pub async fn estimate(&mut self, view: &mut View<'_>) -> Result<TargetEstimate, DeepSftError> {
        let views = self.target.canonical_views(view.camera());
        let mut best = self.estimate_in(view, views.nearest()).await?;
        for camera in &views.all()[1..] {
            if best.judgement.found && !views.cuts(&best.canonical_camera, &best.maps) {
                break;
            }
            let wider = self.estimate_in(view, camera).await?;
            if wider.judgement.found {
                best = wider;
            }
        }
        Ok(best)
    }

    /// As [`TargetFinder::estimate`], in the image of `camera` alone, one of the target's [`Target::canonical_views`].
    ///
    /// # Errors
    /// As [`Finder::find`].
    pub async fn estimate_in(&mut self, view: &mut View<'_>, camera: &Camera) -> Result<TargetEstimate, DeepSftError> {
        let mut best: Option<TargetEstimate> = None;
        for k in 0..self.finders.len() {
            let Some(sighting) = self.finders[k].find(view, camera).await? else {
                continue;
            };
            let estimate = self.judged(view.canonical(camera)?, camera, sighting)?;
            let is_clear = estimate.judgement.found && f64::from(estimate.judgement.confidence) >= CLEAR;
            if best.as_ref().is_none_or(|best| estimate.worth() > best.worth()) {
                best = Some(estimate);
            }
            if is_clear {
                break;
            }
        }
        Ok(best.unwrap_or_else(|| TargetEstimate {
            by: None,
            maps: Maps::empty(camera.width(), camera.height()),
            canonical_camera: *camera,
            judgement: Judgement::default(),
            fit: None,
        }))
    }

    fn fitter(&mut self) -> Result<&mut FrameFitter, DeepSftError> {
        Ok(match &mut self.fitter {
            Some(fitter) => fitter,
            none => none.insert(FrameFitter::new(self.target.template(), FitOptions::default())?),
        })
    }

    /// What the image says of a sighting.
    fn judged(
        &mut self,
        canonical: &Picture,
        camera: &Camera,
        sighting: Sighting,
    ) -> Result<TargetEstimate, DeepSftError> {
        let Sighting { by, maps, .. } = sighting;
        if !self.target.template().is_sheet() {
            let judgement = match self.target.network() {
                Some(network) => network.judge(canonical, &maps)?,
                None => Judgement::default(),
            };
            return Ok(TargetEstimate {
                by: Some(by),
                maps,
                canonical_camera: *camera,
                judgement,
                fit: None,
            });
        }
        let fit = match by {
            FinderKind::Network => self.fitter()?.fit(canonical, camera, &maps, None)?,
            FinderKind::Features | FinderKind::Descriptors => self.fitter()?.fit_unmasked(canonical, camera, &maps)?,
        };
        let explained = fit.as_ref().map_or(0.0, |fit| fit.explained);
        let maps = fit.as_ref().map_or(maps, |fit| fit.maps.clone());
        Ok(TargetEstimate {
            by: Some(by),
            judgement: Judgement {
                found: fit.as_ref().is_some_and(is_found),
                confidence: explained as f32,
                area: Estimator::area(&maps) as f32,
            },
            maps,
            canonical_camera: *camera,
            fit,
        })
    }
}
