//! The finders of one target.

use super::camera_origin::CameraOrigin;
use super::finder::{DescriptorFinder, Finder};
use super::finder_kind::FinderKind;
use super::picture_descriptors::SharedDescriptorNetwork;
use super::target::Target;
use super::target_fitter::{Lookalike, TargetFitter};
use super::view::View;
use crate::error::DeepSftError;
use crate::estimate::{Estimate, Judgement};
use deepsft_finding::{FeatureFinder, PictureGrade};
use deepsft_geometry::fitting::Start;
use deepsft_geometry::glam::DVec3;
use deepsft_geometry::raster::VisibleSurface;
use deepsft_geometry::tracking::START_CORRELATION;
use deepsft_geometry::{
    CalibratedCamera, Camera, CanonicalWarp, Maps, Picture, SelfCalibration, SelfCalibrationOptions, Surface,
};
use std::sync::Arc;

/// The explained fraction from which no other finder is asked.
const CLEAR: f64 = 0.8;

/// How much surer than before of the focal length one view of a sheet must be to tell it: the fraction of the standard deviation that is left.
const TOLD: f64 = 0.5;

/// Part of the print, beside that before, which a camera that was told must still explain. With a longer focal length the canonical image
/// shows it smaller.
const STILL_SEEN: f32 = 0.8;

/// Updates of the camera at most.
const MAX_UPDATES: usize = 30;

/// Most detail in which two prints are compared, times that of the canonical image.
const MAX_DETAIL: f64 = 2.0;

/// Share of their corners from which two pictures resemble each other.
pub const ALIKE: f64 = 0.15;

/// Where a track of the target may start in an image.
#[derive(Clone, Debug)]
#[non_exhaustive]
pub struct Sighting {
    /// The finder that saw it.
    pub by: FinderKind,
    /// Vertices of the template's mesh, camera frame, mm.
    pub vertices_camera: Vec<DVec3>,
}

/// The finders of one target, and the fit that judges what they see.
#[derive(Debug)]
pub struct TargetFinder {
    target: Target,
    finders: Vec<Finder>,
    fitter: Arc<TargetFitter>,
    lookalikes: Vec<Lookalike>,
    copies: u32,
}

impl TargetFinder {
    /// Prepares the finders that `target` can have, [`Finder::all`].
    ///
    /// # Errors
    /// As there, [`TemplateError::PrintSize`](deepsft_geometry::TemplateError::PrintSize) among them.
    pub fn new(target: Target) -> Result<Self, DeepSftError> {
        let finders = Finder::all(&target)?;
        Ok(Self::with_finders(target, finders))
    }

    /// Adds learned descriptors, asked after the others. Templates that are no sheets stay as they are.
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

    /// Takes these finders, asked in this order.
    pub fn with_finders(target: Target, finders: Vec<Finder>) -> Self {
        Self {
            fitter: TargetFitter::new(target.template()),
            target,
            finders,
            lookalikes: Vec::new(),
            copies: 1,
        }
    }

    /// The target.
    pub fn target(&self) -> &Target {
        &self.target
    }

    /// Looks for so many copies of the print in one image from now on, at least 1: each takes about as long again.
    pub fn look_for_copies(&mut self, copies: u32) {
        self.copies = copies.max(1);
    }

    /// How many copies of the print are looked for.
    pub fn copies(&self) -> u32 {
        self.copies
    }

    /// Grades how well features find the target's picture; `None` for a solid, and where none of the finders uses them. Takes up to
    /// 50 ms.
    pub fn grade(&self) -> Option<PictureGrade> {
        let features = self.features().filter(|_| self.target.template().is_sheet());
        features.map(FeatureFinder::grade)
    }

    fn features(&self) -> Option<&FeatureFinder> {
        self.finders.iter().find_map(|finder| match finder {
            Finder::Features(features) => Some(&**features),
            _ => None,
        })
    }

    /// Tells the two targets apart from now on, if their pictures share [`ALIKE`] of their corners or more. Where an image confirms the
    /// other more, this one is then not found, as long as both live. Their meshes must be of one shape, whatever their size.
    ///
    /// Returns the fraction of the corners of one that the other has at the same places, of the two fractions the greater; 0 where features
    /// do not look for both.
    pub fn tell_apart(&mut self, other: &mut Self) -> f64 {
        let (Some(own), Some(others)) = (self.features(), other.features()) else {
            return 0.0;
        };
        let share = own.shared_with(others).max(others.shared_with(own));
        if share >= ALIKE {
            let lookalike = |of: &Self| Lookalike {
                fitter: Arc::downgrade(&of.fitter),
                share,
            };
            self.lookalikes.retain(|lookalike| lookalike.fitter.strong_count() > 0);
            self.lookalikes.push(lookalike(other));
            other.lookalikes.push(lookalike(self));
        }
        share
    }

    /// Whether the image confirms another target more where `surface` lies, one that [`TargetFinder::tell_apart`] has named.
    ///
    /// # Errors
    /// As [`Finder::find`].
    pub fn is_outdone(&self, view: &mut View<'_>, surface: &Surface) -> Result<bool, DeepSftError> {
        if self.lookalikes.is_empty() {
            return Ok(false);
        }
        let camera = &surface.camera;
        // After close-ups fine print counts too, which the canonical image does not show.
        let detail = surface.verdict.detail.clamp(1.0, MAX_DETAIL);
        let [width, height] = [camera.size().width, camera.size().height].map(|side| (detail * side as f64) as usize);
        let close_up = camera.resized((width, height))?;
        let image = match close_up == *camera {
            true => None,
            false => Some(CanonicalWarp::new(view.camera(), &close_up).apply(view.image())?),
        };
        let canonical = (view.canonical(camera)?, camera);
        let closest = image.as_ref().map_or(canonical, |image| (image, &close_up));
        self.fitter
            .is_outdone(&self.lookalikes, (closest, canonical), surface, true)
    }

    /// Whether a negative answer is trustworthy: a network's is; features miss many frames that show the target.
    pub fn can_deny(&self) -> bool {
        self.finders.iter().any(|finder| finder.kind().can_deny())
    }

    /// Finds where a track may start in `view` as `camera` sees it, one of the target's [`Target::canonical_views`], with the depth (mm) and
    /// registration that a network sees. The finders are asked in turn until one is sure; the likeliest sighting comes first. Matches
    /// often see something where the target is not, so only those count that the image confirms after a fit. A network's sighting is its
    /// own, before any fit; it has none where its maps show too little of the mesh.
    ///
    /// Where [several copies](TargetFinder::look_for_copies) are looked for, the sightings of the next come after: it is found as the first,
    /// where that is painted over.
    ///
    /// # Errors
    /// As [`Finder::find`].
    pub async fn find(
        &mut self,
        view: &mut View<'_>,
        camera: &Camera,
    ) -> Result<(Vec<Sighting>, Option<Maps>), DeepSftError> {
        let (mut sightings, seen) = self.find_one(view, camera).await?;
        let mut newest = 0;
        for _ in 1..self.copies {
            if sightings.len() == newest {
                break;
            }
            let rest = self.painted_over(view, &sightings);
            newest = sightings.len();
            let (more, _) = self.find_one(&mut View::new(&rest, view.camera()), camera).await?;
            sightings.extend(more);
        }
        Ok((sightings, seen))
    }

    /// The image of `view`, grey where copies of the print were seen.
    fn painted_over(&self, view: &View<'_>, sightings: &[Sighting]) -> Picture {
        let (image, mesh) = (view.image(), self.target.template().mesh());
        let mut is_seen = vec![false; image.size().area()];
        for Sighting { vertices_camera, .. } in sightings {
            for (column, row, ..) in VisibleSurface::new(mesh, vertices_camera, view.camera()).front() {
                is_seen[row * image.width() + column] = true;
            }
        }
        Picture::from_fn(image.width(), image.height(), |x, y| {
            match is_seen[y * image.width() + x] {
                true => [128; 3],
                false => image.pixel(x, y),
            }
        })
    }

    async fn find_one(
        &mut self,
        view: &mut View<'_>,
        camera: &Camera,
    ) -> Result<(Vec<Sighting>, Option<Maps>), DeepSftError> {
        let (mut sightings, mut seen) = (Vec::new(), None);
        for k in 0..self.finders.len() {
            let by = self.finders[k].kind();
            let Some((start, is_sure)) = self.finders[k].find(view, camera).await? else {
                continue;
            };
            // At the first sighting of any finder: made later, what judging a sheet takes would grow the memory of a page that has long been at
            // work, and hold up a frame. It needs more for a moment than a fit does, which then finds room there.
            self.fitter.with(|fitter| Ok(fitter.is_self_similar()))?;
            let vertices_camera = match &start {
                Start::Maps(_) => self.fitter.with(|fitter| fitter.initial_mesh(camera, &start))?,
                Start::Mesh(_) => self.confirmed(view, camera, &start)?,
            };
            sightings.extend(vertices_camera.map(|vertices_camera| Sighting { by, vertices_camera }));
            if let Start::Maps(maps) = start {
                seen = Some(maps);
            }
            if is_sure {
                break;
            }
        }
        sightings.sort_by_key(|sighting| sighting.by);
        Ok((sightings, seen))
    }

    /// The fitted mesh, if a track could start from it. On a print that repeats itself the place must be clear as well, and no target that
    /// resembles this one may be the better.
    fn confirmed(
        &mut self,
        view: &mut View<'_>,
        camera: &Camera,
        start: &Start,
    ) -> Result<Option<Vec<DVec3>>, DeepSftError> {
        let canonical = view.canonical(camera)?;
        let surface = self.fitter.with(|fitter| fitter.fit(canonical, camera, start))?;
        let confirmed = surface.filter(|surface| {
            let verdict = &surface.verdict;
            verdict.correlation >= START_CORRELATION && (verdict.ambiguity.is_none() || verdict.is_found())
        });
        match confirmed {
            Some(surface) if !self.is_outdone(view, &surface)? => Ok(Some(surface.vertices_camera)),
            _ => Ok(None),
        }
    }

    /// Estimates the target in `view`: of what the finders see, fitted to the image and judged, that of which the image confirms most.
    /// It is measured in the image of the canonical camera, or where the target is not found in that or reaches over its border, of
    /// one that is zoomed out as far as the image goes on. What is seen of a sheet is then fitted to the pixels of the image itself
    /// ([`FrameFitter::fit_close_ups`]).
    ///
    /// # Errors
    /// As [`Finder::find`].
    pub async fn estimate(&mut self, view: &mut View<'_>) -> Result<Estimate, DeepSftError> {
        let seen = self.in_views(view, None).await?;
        self.in_close_ups(view, seen)
    }

    /// Estimates the target in `image` and the camera that took it, by [`SelfCalibration`] from this one view. `assumed` is the likeliest
    /// camera, of this `origin`. The camera is `None` where it is known or the sheet does not tell it, frontal or not found: the estimate is
    /// before the assumed one then.
    ///
    /// # Errors
    /// As [`Finder::find`].
    pub async fn estimate_with_camera(
        &mut self,
        image: &Picture,
        assumed: &Camera,
        origin: CameraOrigin,
    ) -> Result<(Estimate, Option<CalibratedCamera>), DeepSftError> {
        let mut view = View::new(image, assumed);
        let seen = self.in_views(&mut view, None).await?;
        if let Some((told, mesh)) = self.told_camera(&mut view, &seen, origin.focal_deviation(assumed.size()))? {
            let mut view = View::new(image, &told.camera);
            let again = self.in_views(&mut view, seen.by.map(|by| (by, mesh))).await?;
            let is_seen = again.judgement.found && again.judgement.confidence >= STILL_SEEN * seen.judgement.confidence;
            if is_seen {
                return Ok((self.in_close_ups(&mut view, again)?, Some(told)));
            }
        }
        Ok((self.in_close_ups(&mut view, seen)?, None))
    }

    /// The camera of `view` as what is `seen` of a sheet tells it, and the mesh before it.
    fn told_camera(
        &self,
        view: &mut View<'_>,
        seen: &Estimate,
        focal_deviation: f64,
    ) -> Result<Option<(CalibratedCamera, Vec<DVec3>)>, DeepSftError> {
        let template = self.target.template();
        let can_tell = focal_deviation > 0.0 && seen.judgement.found && template.is_sheet();
        let Some(surface) = seen.surface.as_ref().filter(|_| can_tell) else {
            return Ok(None);
        };
        let mut options = SelfCalibrationOptions {
            min_views: 1,
            ..SelfCalibrationOptions::default()
        };
        // One view cannot tell a lens's distortion from a bend.
        (options.deviations[0], options.deviations[3]) = (focal_deviation, 0.0);
        let mut calibration = SelfCalibration::new(template, options)?;
        let canonical = &seen.canonical_camera;
        calibration.offer(view.canonical(canonical)?, canonical, &surface.vertices_camera)?;
        let told = calibration.solve(MAX_UPDATES)?;
        let Some(mut told) = told.filter(|told| told.focal_deviation < TOLD * focal_deviation) else {
            return Ok(None);
        };
        (told.camera, told.assumed) = (told.of_source(view.camera())?, *view.camera());
        Ok(calibration.meshes().next().map(|mesh| (told, mesh)))
    }

    /// The estimate in the canonical camera's image or one that is zoomed out: of what the finders see, or of a mesh that one of them saw.
    async fn in_views(
        &mut self,
        view: &mut View<'_>,
        known: Option<(FinderKind, Vec<DVec3>)>,
    ) -> Result<Estimate, DeepSftError> {
        let views = self.target.canonical_views(view.camera());
        let mut best = self.seen_in(view, views.nearest(), known.as_ref()).await?;
        for camera in &views.all()[1..] {
            if best.judgement.found && !views.cuts(&best.canonical_camera, &best.maps) {
                break;
            }
            let wider = self.seen_in(view, camera, known.as_ref()).await?;
            if wider.judgement.found {
                best = wider;
            }
        }
        Ok(best)
    }

    async fn seen_in(
        &mut self,
        view: &mut View<'_>,
        camera: &Camera,
        known: Option<&(FinderKind, Vec<DVec3>)>,
    ) -> Result<Estimate, DeepSftError> {
        match known {
            None => self.estimate_in(view, camera).await,
            Some((by, mesh)) => self.judged(view, camera, *by, Start::Mesh(mesh.clone())),
        }
    }

    /// The estimate after its sheet was fitted to the image's own pixels.
    fn in_close_ups(&mut self, view: &mut View<'_>, mut best: Estimate) -> Result<Estimate, DeepSftError> {
        if let Some(surface) = best.surface.take() {
            // A print that another outdoes already needs no close-ups.
            let seen = (view.canonical(&surface.camera)?, &surface.camera);
            if self
                .fitter
                .is_outdone(&self.lookalikes, (seen, seen), &surface, false)?
            {
                (best.judgement.found, best.judgement.shape_determined) = (false, false);
                return Ok(best);
            }
            let (image, camera) = (view.image(), view.camera());
            let surface = self
                .fitter
                .with(|fitter| fitter.fit_close_ups(image, camera, surface))?;
            let drawn = surface.maps(self.target.template().mesh());
            // A network's mask leaves out what hides the object; the surface itself tells otherwise.
            best.maps = match surface.is_hidden.is_empty() {
                true => drawn.within(&best.maps),
                false => drawn,
            };
            best.judgement = Judgement::of_surface(&surface, &best.maps);
            // Doubts count only now: the right one may lie off before and explain too little, and close-ups bring a lookalike to its place.
            if best.judgement.found && self.is_outdone(view, &surface)? {
                (best.judgement.found, best.judgement.shape_determined) = (false, false);
            }
            best.surface = Some(surface);
        }
        Ok(best)
    }

    /// As [`TargetFinder::estimate`], in the image of `camera` alone, one of the target's [`Target::canonical_views`].
    ///
    /// # Errors
    /// As [`Finder::find`].
    pub async fn estimate_in(&mut self, view: &mut View<'_>, camera: &Camera) -> Result<Estimate, DeepSftError> {
        let mut best = Estimate::nothing(view.canonical(camera)?, camera);
        for k in 0..self.finders.len() {
            let by = self.finders[k].kind();
            let Some((start, _)) = self.finders[k].find(view, camera).await? else {
                continue;
            };
            let estimate = self.judged(view, camera, by, start)?;
            let Judgement { found, confidence, .. } = estimate.judgement;
            if best.by.is_none() || estimate.worth() > best.worth() {
                best = estimate;
            }
            if found && f64::from(confidence) >= CLEAR {
                break;
            }
        }
        Ok(best)
    }

    /// The estimate from what a finder sees: the fit to the image and its verdict. Of a solid whose fit the image does not confirm it is
    /// what the network says, with its own judgement.
    fn judged(
        &mut self,
        view: &mut View<'_>,
        camera: &Camera,
        by: FinderKind,
        start: Start,
    ) -> Result<Estimate, DeepSftError> {
        let canonical = view.canonical(camera)?;
        let fitted = self.fitter.with(|fitter| fitter.fit(canonical, camera, &start))?;
        let is_sheet = self.target.template().is_sheet();
        let surface = fitted.filter(|surface| is_sheet || surface.verdict.is_found());
        let mesh = self.target.template().mesh();
        let drawn = surface.as_ref().map(|surface| surface.maps(mesh));
        let maps = match (drawn, start) {
            (Some(drawn), Start::Maps(seen)) => drawn.within(&seen),
            (None, Start::Maps(seen)) => seen,
            (Some(drawn), Start::Mesh(_)) => drawn,
            (None, Start::Mesh(_)) => Maps::empty(camera.size()),
        };
        let judgement = match (&surface, self.target.network()) {
            (Some(surface), _) => Judgement::of_surface(surface, &maps),
            (None, Some(network)) if !is_sheet => network.judge(canonical, &maps)?,
            (None, _) => Judgement::default(),
        };
        Ok(Estimate {
            by: Some(by),
            judgement,
            maps,
            canonical: canonical.clone(),
            canonical_camera: *camera,
            surface,
        })
    }
}
