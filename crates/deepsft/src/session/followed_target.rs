//! One target of a session.

use super::exchange::{Followed, SessionOptions, TargetId};
use super::presence::Presence;
use crate::error::DeepSftError;
use deepsft_geometry::glam::DVec3;
use deepsft_geometry::tracking::{OneEuro, TrackUpdate, Tracker, TrackerImage};
use deepsft_geometry::{
    CalibratedCamera, Camera, Evidence, ImageSize, Maps, Picture, SelfCalibration, SelfCalibrationOptions, Surface,
    Template, canonical_camera,
};

/// Correlation from which a mesh is good enough to tell of the camera.
const TELLING: f64 = 0.6;

/// A target with its track.
#[derive(Debug)]
pub(super) struct FollowedTarget {
    pub(super) tracker: Tracker,
    /// The camera of canonical images that lie across.
    pub(super) training_camera: Camera,
    pub(super) can_deny: bool,
    presence: Presence,
    /// Started afresh with each track.
    smoothing: Option<OneEuro>,
    /// The surface that was confirmed last, or stands since, smoothed.
    surface: Option<Surface>,
    /// Whether its caller knows it as found.
    is_told: bool,
    template: Template,
    /// Made when the camera is first looked for.
    calibration: Option<SelfCalibration>,
}

impl FollowedTarget {
    pub(super) fn new(
        template: &Template,
        training_camera: Camera,
        can_deny: bool,
        options: &SessionOptions,
    ) -> Result<Self, DeepSftError> {
        Ok(Self {
            tracker: Tracker::new(template)?,
            training_camera,
            can_deny,
            presence: Presence::default(),
            smoothing: options.smoothing.map(OneEuro::new),
            surface: None,
            is_told: false,
            template: template.clone(),
            calibration: None,
        })
    }

    /// One more copy of its print, which is followed nowhere yet.
    pub(super) fn copy(&self, options: &SessionOptions) -> Result<Self, DeepSftError> {
        Self::new(&self.template, self.training_camera, self.can_deny, options)
    }

    /// Whether two meshes are one copy of the print: nearer to each other than its sheets can lie side by side.
    pub(super) fn are_one(&self, meshes: [&[DVec3]; 2]) -> bool {
        let [a, b] = meshes.map(|vertices| vertices.iter().sum::<DVec3>() / vertices.len() as f64);
        a.distance(b) < self.template.size_mm().min_element() / 2.0
    }

    /// Its canonical camera for images of `size`, and the same with the focal length of `view`.
    pub(super) fn cameras(&self, size: ImageSize, view: &Camera) -> [Camera; 2] {
        let nearest = canonical_camera(&self.training_camera, size);
        let seen = match view.is_zoom_of(&nearest) {
            true => *view,
            false => nearest.zoomed(view.focal().x / nearest.focal().x),
        };
        [nearest, seen]
    }

    /// The vertices of the mesh in the newest frame, as the tracker has it; `None` without a track.
    pub(super) fn tracked_vertices(&self) -> Option<&[DVec3]> {
        let surface = self.tracker.current().surface.as_ref();
        surface.map(|surface| surface.vertices_camera.as_slice())
    }

    /// Depth and registration of its track in the newest frame, and their camera; empty maps without a track.
    pub(super) fn maps(&self) -> (Camera, Maps) {
        let camera = self.tracker.camera().unwrap_or(self.training_camera);
        let surface = self.tracker.current().surface.as_ref();
        let drawn = surface.map(|surface| surface.maps(self.template.mesh()));
        (camera, drawn.unwrap_or_else(|| Maps::empty(camera.size())))
    }

    /// How well the newest frame confirms its track, if there is one.
    pub(super) fn correlation(&self) -> Option<f64> {
        let surface = self.tracker.current().surface.as_ref();
        surface.map(|surface| surface.verdict.correlation)
    }

    /// What the newest frame confirms of its track, as `camera` sees it; `None` without a track.
    pub(super) fn evidence(&self, camera: &Camera) -> Option<Evidence> {
        let surface = self.tracker.current().surface.as_ref();
        surface.map(|surface| surface.evidence(self.template.mesh(), camera))
    }

    /// Follows frame number `frame` in the canonical `image` of `camera`.
    pub(super) fn follow(
        &mut self,
        (frame, time_s): (u64, f64),
        image: &TrackerImage,
        camera: &Camera,
    ) -> Result<(), DeepSftError> {
        self.tracker.follow(frame, time_s, image, camera)?;
        self.take(time_s);
        Ok(())
    }

    /// Takes over what the tracker says of the newest frame.
    fn take(&mut self, time_s: f64) {
        let tracked = self.tracker.current();
        let confirmed = tracked.surface.as_ref().filter(|_| !tracked.held);
        self.presence
            .update(confirmed.map(|surface| surface.verdict.correlation), time_s);
        if let Some(surface) = &tracked.surface {
            let mut surface = surface.clone();
            if let Some(filter) = &mut self.smoothing {
                filter.smooth(time_s, &mut surface.vertices_camera);
            }
            self.surface = Some(surface);
        }
    }

    /// Hears where finders see the target in `frame`: in those of `starts`, the likeliest first. Says what the tracker made of it, and by which
    /// of them.
    pub(super) fn answer(
        &mut self,
        frame: u64,
        (own, starts): (&[usize], &[Vec<DVec3>]),
        newest_s: f64,
    ) -> Result<(TrackUpdate, Option<usize>), DeepSftError> {
        let (mut update, mut by) = (TrackUpdate::Ignored, None);
        if own.is_empty() && self.can_deny {
            update = self.tracker.update(frame, None)?;
        }
        for &k in own {
            by = Some(k);
            update = self.tracker.update(frame, Some(&starts[k]))?;
            if update != TrackUpdate::Ignored {
                break;
            }
        }
        if matches!(update, TrackUpdate::Started | TrackUpdate::Restarted) {
            // A track that starts again somewhere else is no motion.
            if let Some(filter) = &mut self.smoothing {
                filter.reset();
            }
            self.presence.begin_track();
            self.take(newest_s);
        } else if update == TrackUpdate::Dropped {
            self.take(newest_s);
        }
        Ok((update, by))
    }

    /// What the newest frame shows of it; changes count from what was told before.
    pub(super) fn tell(&mut self, target: TargetId) -> Followed {
        let found = self.presence.is_found;
        let was_told = std::mem::replace(&mut self.is_told, found);
        Followed {
            target,
            found,
            changed: found != was_told,
            held: found && !self.presence.is_confirmed(),
            surface: self.surface.clone().filter(|_| found),
            correlation: self.correlation().unwrap_or(0.0),
            iterations: self.tracker.current().iterations,
        }
    }

    /// Forgets the video.
    pub(super) fn restart(&mut self) {
        self.tracker.reset();
        self.presence = Presence::default();
        self.surface = None;
        self.forget_views();
    }

    /// Forgets what was seen of the camera.
    pub(super) fn forget_views(&mut self) {
        // Kept: made anew at each change of the camera it would tear the memory of a page to pieces, which then grows.
        if let Some(calibration) = &mut self.calibration {
            calibration.reset();
        }
    }

    /// Lets the mesh in the newest frame, whose image `canonical` took, tell of the camera; with `steps` goes on with the search.
    ///
    /// It is the mesh as it was fitted: a smoothed one trails behind the image. Only sheets tell, whose lengths do not change.
    pub(super) fn calibrate(
        &mut self,
        image: &Picture,
        canonical: &Camera,
        steps: bool,
    ) -> Result<Option<CalibratedCamera>, DeepSftError> {
        if !self.template.is_sheet() {
            return Ok(None);
        }
        let calibration = match &mut self.calibration {
            Some(calibration) => calibration,
            none => none.insert(SelfCalibration::new(&self.template, SelfCalibrationOptions::default())?),
        };
        if let Some(surface) = &self.tracker.current().surface
            && surface.verdict.correlation >= TELLING
        {
            calibration.offer(image, canonical, &surface.vertices_camera)?;
        }
        Ok(if steps { calibration.step()? } else { None })
    }

    /// The camera as the views so far tell it, after at most `max_updates`.
    pub(super) fn solve_camera(&mut self, max_updates: usize) -> Result<Option<CalibratedCamera>, DeepSftError> {
        let calibration = self.calibration.as_mut();
        calibration.map_or(Ok(None), |calibration| Ok(calibration.solve(max_updates)?))
    }
}
