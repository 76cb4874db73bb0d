//! Targets followed through one video.

use super::exchange::{Answer, Effect, Followed, FollowedFrame, Next, Question, SessionOptions, Source, TargetId};
use super::focal_search::FocalSearch;
use super::followed_target::FollowedTarget;
use super::search_plan::SearchPlan;
use super::view_choice::ViewChoice;
use crate::error::DeepSftError;
use crate::finding::View;
use deepsft_geometry::glam::DVec3;
use deepsft_geometry::tracking::{MEMORY, TrackerImage};
use deepsft_geometry::{CalibratedCamera, Camera, CanonicalViews, Evidence, Maps, Template, training_camera};
use std::collections::{BTreeMap, BTreeSet};

/// Follows targets through one video, without files, clocks and threads.
///
/// For each frame ask [`next`](Self::next) what it is for, put the question to finders if there is one ([`ask`](Self::ask)), and have it
/// followed ([`frame`](Self::frame)). Hand in the answer ([`answer`](Self::answer)) whenever it is there, some frames later or at once.
#[derive(Debug, Default)]
pub struct Session {
    options: SessionOptions,
    targets: BTreeMap<TargetId, FollowedTarget>,
    /// Of each further copy of a print the target whose copy it is.
    copies: BTreeMap<TargetId, TargetId>,
    plan: SearchPlan,
    view: ViewChoice,
    focal: FocalSearch,
    /// The question that waits for its answer.
    asked: Option<Asked>,
    /// What the last answer took, seconds.
    took_s: f64,
    /// Number of the next frame.
    number: u64,
    /// Time and view of the last frame of this video.
    last: Option<(f64, Camera)>,
}

#[derive(Debug)]
struct Asked {
    frame: u64,
    at_s: f64,
    question: Question,
}

/// Part of the frames that trackers remember which an answer may be late by: the finders may take longer than the last time.
const ANSWERABLE: f64 = 0.75;

/// Most time between two frames for the sake of an answer, seconds: one that came much later than others must not stop the video.
const MAX_INTERVAL_S: f64 = 0.25;

/// Least time between two frames while nothing is followed, seconds.
const SEARCHING_INTERVAL_S: f64 = 0.06;

impl Session {
    /// A session that follows nothing yet.
    pub fn new(options: SessionOptions) -> Self {
        Self {
            options,
            ..Self::default()
        }
    }

    /// Follows a target too, which is measured in images of `training_camera`. `can_deny` says whether its finders see it whenever it is
    /// there, as a network of its own does: that they see nothing then speaks against a track.
    ///
    /// # Errors
    /// As [`Tracker::new`](deepsft_geometry::tracking::Tracker::new).
    pub fn add(
        &mut self,
        id: TargetId,
        template: &Template,
        training_camera: Camera,
        can_deny: bool,
    ) -> Result<(), DeepSftError> {
        let target = FollowedTarget::new(template, training_camera, can_deny, &self.options)?;
        self.targets.insert(id, target);
        self.plan.add(id, can_deny);
        Ok(())
    }

    /// Follows one more copy of the print of the target `of`, as a target of its own. Questions name `of` alone: its finders should see as
    /// many copies ([`TargetFinder::look_for_copies`](crate::TargetFinder::look_for_copies)). Of what they see, each copy that is followed is
    /// confirmed by what lies near it, and the rest starts those that are not.
    ///
    /// # Errors
    /// As [`Session::add`]. Nothing is added where `of` is not followed.
    pub fn add_copy(&mut self, id: TargetId, of: TargetId) -> Result<(), DeepSftError> {
        if let Some(target) = self.targets.get(&of) {
            let (copy, can_deny) = (target.copy(&self.options)?, target.can_deny);
            self.targets.insert(id, copy);
            self.copies.insert(id, of);
            self.plan.add(id, can_deny);
        }
        Ok(())
    }

    /// Follows a target and its copies no longer, or one copy.
    pub fn remove(&mut self, id: TargetId) {
        for id in self.copies_of(id) {
            self.targets.remove(&id);
            self.copies.remove(&id);
            self.plan.remove(id);
        }
    }

    /// A target and the copies of it.
    fn copies_of(&self, id: TargetId) -> Vec<TargetId> {
        let copies = self.copies.iter().filter(|(_, of)| **of == id);
        [id].into_iter().chain(copies.map(|(copy, _)| *copy)).collect()
    }

    /// What the next frame is for, if `source` takes it and the caller's clock says `now_s`.
    pub fn next(&self, source: &Camera, now_s: f64) -> Next {
        let first = self.targets.values().next();
        let training_camera = first.map_or_else(training_camera, |target| target.training_camera);
        let views = CanonicalViews::new(&training_camera, source);
        let targets = match self.options.ask_every {
            _ if self.asked.is_some() => Vec::new(),
            None => self.plan.next(now_s),
            Some(frames) if self.number.is_multiple_of(frames.max(1)) => self.targets.keys().copied().collect(),
            Some(_) => Vec::new(),
        };
        let meshes = self.targets.values().filter_map(FollowedTarget::tracked_vertices);
        let question = (!targets.is_empty()).then(|| {
            let only_confirms = self.plan.only_confirms(&targets);
            let mut named = BTreeSet::new();
            let originals = targets.iter().map(|id| *self.copies.get(id).unwrap_or(id));
            Question {
                targets: originals.filter(|id| named.insert(*id)).collect(),
                only_confirms,
            }
        });
        // The frames between a question and its answer must be among those that the trackers remember.
        let answerable_s = match self.plan.misses_some() {
            true => (self.took_s / (ANSWERABLE * MEMORY as f64)).min(MAX_INTERVAL_S),
            false => 0.0,
        };
        let searching_s = match self.plan.follows_some() {
            true => 0.0,
            false => SEARCHING_INTERVAL_S,
        };
        Next {
            view: self.view.next(&views, meshes, question.is_some()),
            question,
            interval_s: answerable_s.max(searching_s),
        }
    }

    /// The finders are asked about the next frame now. No other question comes until it is answered.
    pub fn ask(&mut self, question: Question, now_s: f64) {
        self.asked = Some(Asked {
            frame: self.number,
            at_s: now_s,
            question,
        });
    }

    /// Follows the next frame, which `source` took at `time_s` (seconds of the video), in the image of `view`. `image` is the frame, or
    /// already what `view` sees of it.
    ///
    /// A time that does not ascend and a camera that is turned start afresh, as [`restart`](Self::restart) does.
    ///
    /// # Errors
    /// [`DeepSftError::Geometry`] when the image is not of its camera's size.
    pub fn frame(
        &mut self,
        time_s: f64,
        source: &Source,
        view: &Camera,
        image: &mut View<'_>,
    ) -> Result<FollowedFrame, DeepSftError> {
        let is_other = |(last_s, last): (f64, Camera)| time_s <= last_s || !view.is_zoom_of(&last);
        if self.last.is_some_and(is_other) {
            self.restart();
        }
        let afresh = self.last.replace((time_s, *view)).is_none();
        let number = self.number;
        self.number += 1;
        let searched = self.asked.as_ref().filter(|asked| asked.frame == number);
        if let Some(Asked { at_s, question, .. }) = searched {
            let asked = question.targets.iter().flat_map(|id| self.copies_of(*id));
            let asked: Vec<_> = asked.collect();
            self.plan.asked(&asked, *at_s);
        }
        let follows_some = self.plan.follows_some();
        self.view.take(&source.camera, view, follows_some, searched.is_some());
        let is_other_camera = self.focal.begins(source);
        let mut calibrated: Option<CalibratedCamera> = None;
        // Targets share the canonical image.
        let mut shared: Option<(Camera, TrackerImage)> = None;
        // All have forgotten it; the others drop it.
        let spares = self
            .targets
            .values_mut()
            .filter_map(|target| target.tracker.spare_image());
        let mut spare = spares.last();
        for (id, target) in &mut self.targets {
            let [nearest, seen] = target.cameras(image.size(), view);
            let canonical = match shared.take().filter(|(camera, _)| *camera == seen) {
                Some((_, canonical)) => canonical,
                None => TrackerImage::of_into(image.canonical(&seen)?, spare.take()),
            };
            target.follow((number, time_s), &canonical, &seen)?;
            shared = Some((seen, canonical));
            self.plan.tracked(*id, target.correlation());
            if is_other_camera {
                target.forget_views();
            } else if self.focal.goes_on() {
                // All of one camera's images.
                let picture = image.canonical(&nearest)?;
                let found = target.calibrate(picture, &nearest, FocalSearch::steps_in(number))?;
                calibrated = calibrated
                    .into_iter()
                    .chain(found)
                    .min_by(|a, b| a.focal_deviation.total_cmp(&b.focal_deviation));
            }
        }
        self.settle();
        Ok(FollowedFrame {
            number,
            afresh,
            targets: self.followed(),
            calibrated: calibrated.filter(|found| self.focal.tells(found)),
        })
    }

    /// All targets in the newest frame, by number: as [`frame`](Self::frame) told them, or as an answer about that very frame has changed
    /// them since.
    pub fn followed(&mut self) -> Vec<Followed> {
        self.targets.iter_mut().map(|(id, target)| target.tell(*id)).collect()
    }

    /// Takes the answer to the last question at `now_s`, by the clock by which it was asked. The finders took `took_s` for it, and the caller
    /// last missed a frame `since_missed_s` ago, infinite if it never did. Targets without an answer, and those that are followed no longer,
    /// are left as they are.
    ///
    /// # Errors
    /// [`DeepSftError::Geometry`] when a start does not have the vertices of its template.
    pub fn answer(
        &mut self,
        answers: &[Answer],
        now_s: f64,
        took_s: f64,
        since_missed_s: f64,
    ) -> Result<Vec<Effect>, DeepSftError> {
        let Some(asked) = self.asked.take() else {
            return Ok(Vec::new());
        };
        self.took_s = took_s;
        let newest_s = self.last.map_or(0.0, |(time_s, _)| time_s);
        let mut effects = Vec::new();
        for Answer { target, starts } in answers {
            for (id, own) in self.shared_out(asked.frame, *target, starts) {
                let Some(target) = self.targets.get_mut(&id) else {
                    continue;
                };
                let (update, start) = target.answer(asked.frame, (&own, starts), newest_s)?;
                self.plan.tracked(id, target.correlation());
                effects.push(Effect {
                    target: id,
                    of_frame: asked.frame,
                    update,
                    start,
                });
            }
        }
        self.settle();
        self.plan.took(&asked.question, now_s, took_s, since_missed_s);
        Ok(effects)
    }

    /// Which of the `starts` in `frame` are for which copy of a target: for one that is followed those near it, for another those in a place where
    /// none is followed. All are for a target without copies.
    fn shared_out(&self, frame: u64, of: TargetId, starts: &[Vec<DVec3>]) -> Vec<(TargetId, Vec<usize>)> {
        let group = self.copies_of(of);
        let (1.., Some(first)) = (group.len() - 1, self.targets.get(&of)) else {
            return vec![(of, (0..starts.len()).collect())];
        };
        let place = |id: &TargetId| self.targets.get(id)?.tracker.vertices_in(frame);
        let (followed, missing): (Vec<_>, Vec<_>) = group.into_iter().partition(|id| place(id).is_some());
        let mut shares: Vec<(TargetId, Vec<usize>)> = followed.into_iter().map(|id| (id, Vec::new())).collect();
        let mut missing = missing.into_iter();
        for (k, start) in starts.iter().enumerate() {
            let lies_there = |(id, own): &&mut (TargetId, Vec<usize>)| {
                let there = place(id).or_else(|| Some(&starts[*own.first()?][..]));
                there.is_some_and(|there| first.are_one([there, start]))
            };
            if let Some((_, own)) = shares.iter_mut().find(lies_there) {
                own.push(k);
            } else if let Some(id) = missing.next() {
                shares.push((id, vec![k]));
            }
        }
        // That a copy was not among those that were seen says little.
        shares.retain(|(_, own)| !own.is_empty());
        shares
    }

    /// Ends the tracks that lie in one place of the newest frame with another of which the image confirms more.
    fn settle(&mut self) {
        let followed = self.targets.values().filter(|target| target.correlation().is_some());
        let cameras: Vec<_> = followed.filter_map(|target| target.tracker.camera()).collect();
        let [camera, _, ..] = cameras[..] else {
            return;
        };
        let evidence: Vec<_> = self.targets.values().map(|target| target.evidence(&camera)).collect();
        for ((id, target), own) in self.targets.iter_mut().zip(&evidence) {
            let gives_way = |own: &Evidence| evidence.iter().flatten().any(|other| own.gives_way_to(other));
            if own.as_ref().is_some_and(gives_way) {
                target.restart();
                self.plan.tracked(*id, None);
            }
        }
    }

    /// Withdraws the question that waits for its answer, if one does: its finders have failed.
    pub fn withdraw(&mut self) {
        self.asked = None;
    }

    /// Forgets the video: for another camera, or another file. What was found counts as lost with the next frame.
    pub fn restart(&mut self) {
        self.last = None;
        self.view = ViewChoice::default();
        self.focal = FocalSearch::default();
        self.plan.restart();
        self.targets.values_mut().for_each(FollowedTarget::restart);
    }

    /// Depth and registration of a target's mesh in the newest frame, and their camera; empty maps without a track.
    pub fn maps(&self, id: TargetId) -> Option<(Camera, Maps)> {
        Some(self.targets.get(&id)?.maps())
    }

    /// The canonical camera as the views of a target so far tell it, of a [`Source`] that was not known well enough; `None` where they do
    /// not tell, or not after `max_updates` of it.
    ///
    /// # Errors
    /// [`DeepSftError::Geometry`] when a view cannot be fitted.
    pub fn solve_camera(&mut self, id: TargetId, max_updates: usize) -> Result<Option<CalibratedCamera>, DeepSftError> {
        let target = self.targets.get_mut(&id);
        target.map_or(Ok(None), |target| target.solve_camera(max_updates))
    }
}
