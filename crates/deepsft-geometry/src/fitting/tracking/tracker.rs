//! The tracker of one template in one video.

use super::search::best_shift;
use super::settings::{
    BLURS_PX, DISAGREEMENT_PX, EARLIER_STEPS, HALVED_BLUR_PX, MARGIN_PX, MEMORY, MIN_CORRELATION, MIN_MISSED,
    MIN_POINTS, OTHER_COPY, PATIENCE_S, PERSISTENCE, RIGID_STEPS, RIGIDITY, START_CORRELATION, STEPS, WIDE_BLURS_PX,
    WIDE_STEPS,
};
use super::tracked::{TrackUpdate, Tracked};
use super::tracker_image::TrackerImage;
use crate::camera::Camera;
use crate::error::Result;
use crate::fitting::coarse_fitter::{self, CoarseStart};
use crate::fitting::measurements::{Measurement, Observation, Start};
use crate::fitting::mesh_fitter::{FitRound, Fitted, MeshFitter};
use crate::fitting::print::Drawing;
use crate::image::{GreyImage, Region};
use crate::maps::raster::VisibleSurface;
use crate::mesh::Template;
use crate::surface::Surface;
use glam::DVec3;
use std::collections::VecDeque;

/// Frames from one to the next in which a solid is asked whether it is bent, and how much lower its correlation is where it is asked at once.
const ASKED_FRAMES: u64 = 8;
const LESS: f64 = 0.02;

/// Confidence around a point below which it is taken as hidden.
const HIDDEN: f64 = 0.25;

/// A frame and the coarse mesh in it, if it was followed there.
#[derive(Debug)]
struct RememberedFrame {
    frame: u64,
    time_s: f64,
    camera: Camera,
    image: TrackerImage,
    mesh: Option<Fitted>,
    /// Whether the frame was missed and the mesh left standing.
    held: bool,
}

/// Follows one template through one video.
///
/// Give it every frame ([`follow`](Self::follow)) and, whenever a finder has one, its mesh in an earlier frame
/// ([`update`](Self::update)). The image must be a canonical one. From frame to frame the view may be zoomed (another focal length,
/// [`CanonicalViews`](crate::CanonicalViews)); any other change of the camera starts the video afresh.
#[derive(Debug)]
pub struct Tracker {
    fitter: MeshFitter,
    frames: VecDeque<RememberedFrame>,
    /// The last image that was forgotten.
    spare: Option<TrackerImage>,
    /// Missed frames in a row.
    missed: usize,
    /// The first frame since a finder's last answer in which the mesh was found by a search: it may sit in a wrong fold,
    /// or on something else.
    searched: Option<u64>,
    current: Tracked,
}

impl Tracker {
    /// Prepares everything that does not depend on the video.
    ///
    /// # Errors
    /// [`GeometryError`](crate::GeometryError) for a mesh without extent.
    pub fn new(template: &Template) -> Result<Self> {
        Ok(Self {
            fitter: MeshFitter::new(template, RIGIDITY)?,
            frames: VecDeque::new(),
            spare: None,
            missed: 0,
            searched: None,
            current: Tracked::default(),
        })
    }

    /// The object in the newest frame.
    pub fn current(&self) -> &Tracked {
        &self.current
    }

    /// The camera of the newest frame.
    pub fn camera(&self) -> Option<Camera> {
        self.frames.back().map(|frame| frame.camera)
    }

    /// Forgets the video: for a jump to another one.
    pub fn reset(&mut self) {
        self.frames.clear();
        self.lose(0);
    }

    /// An image that the tracker no longer remembers, for [`TrackerImage::of_into`]: a long video then makes no new ones. It is given
    /// once. Of several trackers that share their images ask all and keep one answer: an image that one of them still holds is not used.
    pub fn spare_image(&mut self) -> Option<TrackerImage> {
        self.spare.take()
    }

    /// Takes the next frame of the video: number `frame` at `time_s`, both ascending (a frame that does not ascend starts the
    /// video afresh), as the canonical `image` of `camera`. While nothing is followed it is only remembered.
    ///
    /// # Errors
    /// [`GeometryError::MapSize`](crate::GeometryError::MapSize) when the image is not of the camera's size.
    pub fn follow(&mut self, frame: u64, time_s: f64, image: &TrackerImage, camera: &Camera) -> Result<&Tracked> {
        Observation::new(&image.0.whole, camera)?;
        let is_next =
            |last: &RememberedFrame| frame > last.frame && time_s > last.time_s && camera.is_zoom_of(&last.camera);
        if !self.frames.back().is_none_or(is_next) {
            self.reset();
        }
        self.frames.push_back(RememberedFrame {
            frame,
            time_s,
            camera: *camera,
            image: image.clone(),
            mesh: None,
            held: false,
        });
        while self.frames.len() > MEMORY {
            self.spare = self.frames.pop_front().map(|forgotten| forgotten.image);
        }
        let newest = self.frames.len() - 1;
        let followed = newest.checked_sub(1).filter(|_| self.current.surface.is_some());
        if let Some(last) = followed.and_then(|last| self.frames[last].mesh.clone()) {
            let mesh = self.advance(newest, &last)?;
            self.take(newest, mesh, last);
        } else {
            self.lose(frame);
        }
        Ok(&self.current)
    }

    /// The vertices of the track's mesh in a frame that is remembered; `None` where it was not there, and without a track.
    pub fn vertices_in(&self, frame: u64) -> Option<&[DVec3]> {
        self.current.surface.as_ref()?;
        let index = self.frames.binary_search_by_key(&frame, |f| f.frame).ok()?;
        Some(&self.frames[index].mesh.as_ref()?.vertices)
    }

    /// Takes a finder's mesh in an earlier frame or in the newest: `vertices` of the template, camera frame, mm. `None` when the finder
    /// does not see the object there.
    ///
    /// Without a track, the mesh is fitted to that frame and followed through the frames since. With one, the two are compared; where
    /// they disagree, the image decides.
    ///
    /// # Errors
    /// [`GeometryError::StartLength`](crate::GeometryError::StartLength) when there are not as many vertices as the template has.
    pub fn update(&mut self, frame: u64, vertices: Option<&[DVec3]>) -> Result<TrackUpdate> {
        let Ok(index) = self.frames.binary_search_by_key(&frame, |f| f.frame) else {
            return Ok(TrackUpdate::Ignored);
        };
        let Some(vertices) = vertices else {
            return Ok(self.deny(frame));
        };
        let start = Start::Mesh(vertices.to_vec());
        let Some(start) = self.fitter.start(&start, &self.frames[index].camera)? else {
            return Ok(TrackUpdate::Ignored);
        };
        // After a search the image decides also where the two are near each other.
        let was_found = self.current.surface.is_some();
        let doubt = std::mem::take(&mut self.searched);
        if was_found && doubt.is_none() && self.agrees(index, &start.measured) {
            return Ok(TrackUpdate::Confirmed);
        }
        // The candidate is followed with its own history, not with the misses of the track that it may replace.
        let missed = std::mem::take(&mut self.missed);
        let candidate = self.caught_up(index, &start);
        let searched = std::mem::replace(&mut self.searched, doubt);
        self.missed = missed;
        let meshes = candidate?;
        let (reached, points) = meshes.last().map_or((0.0, 0), |Fitted { correlation, .. }| {
            (correlation.whole, correlation.points)
        });
        let is_elsewhere = meshes.last().is_some_and(|mesh| self.is_elsewhere(mesh));
        let kept = self.correlation() + if is_elsewhere { OTHER_COPY } else { 0.0 };
        if was_found && reached <= kept {
            self.searched = None;
            return Ok(TrackUpdate::Confirmed);
        }
        if reached < START_CORRELATION || points < MIN_POINTS {
            return Ok(TrackUpdate::Ignored);
        }
        self.searched = searched;
        let newest = self.frames.len() - 1;
        // Meshes of an earlier track tell nothing of this one's speed.
        self.frames.iter_mut().take(index).for_each(|frame| frame.mesh = None);
        for (remembered, mesh) in self.frames.iter_mut().skip(index).zip(meshes) {
            (remembered.mesh, remembered.held) = (Some(mesh), false);
        }
        self.missed = 0;
        self.show(newest);
        Ok(if was_found {
            TrackUpdate::Restarted
        } else {
            TrackUpdate::Started
        })
    }

    /// A finder that can tell does not see the object in `frame`.
    fn deny(&mut self, frame: u64) -> TrackUpdate {
        let found_by_search = self.searched.is_some_and(|since| since <= frame);
        if self.current.surface.is_none() {
            TrackUpdate::Ignored
        } else if !found_by_search && self.correlation() >= START_CORRELATION {
            TrackUpdate::Confirmed
        } else {
            self.lose(self.current.frame);
            TrackUpdate::Dropped
        }
    }

    /// Correlation of image and print in the newest frame; 0 while nothing is followed.
    fn correlation(&self) -> f64 {
        let surface = self.current.surface.as_ref();
        surface.map_or(0.0, |surface| surface.verdict.correlation)
    }

    /// Whether `mesh` is so far from the track in the newest frame that it is no other fold of it, but maybe another copy of the print.
    fn is_elsewhere(&self, mesh: &Fitted) -> bool {
        let middle = |vertices: &[DVec3]| vertices.iter().sum::<DVec3>() / vertices.len() as f64;
        let track = self.frames.back().and_then(|newest| newest.mesh.as_ref());
        let apart_mm = track.map_or(0.0, |track| middle(&track.vertices).distance(middle(&mesh.vertices)));
        apart_mm > self.fitter.template.size_mm().min_element() / 2.0
    }

    /// Whether the mesh in frame `index` shows four fifths of what is `measured` where it was measured.
    fn agrees(&self, index: usize, measured: &[Measurement]) -> bool {
        let frame = &self.frames[index];
        let Some(mesh) = &frame.mesh else {
            return false;
        };
        let coarse = self.fitter.coarse();
        let distance = |m: &Measurement| {
            let point = coarse.locator.locate(m.uv)?;
            let position = point.position(coarse.mesh.faces(), &mesh.vertices);
            Some(frame.camera.project(position)?.distance(m.pixel))
        };
        let mut distances: Vec<f64> = measured.iter().filter_map(distance).collect();
        let rank = distances.len() * 4 / 5;
        if distances.is_empty() {
            return true;
        }
        let (_, distance, _) = distances.select_nth_unstable_by(rank, f64::total_cmp);
        *distance <= DISAGREEMENT_PX
    }

    /// The meshes of frame `index`, fitted from `start`, and of all frames since.
    fn caught_up(&mut self, index: usize, start: &CoarseStart<'_>) -> Result<Vec<Fitted>> {
        let frame = &self.frames[index];
        let observation = Observation::new(&frame.image.0.whole, &frame.camera)?;
        let mut meshes = vec![self.fitter.fit_coarse(observation, start, &coarse_fitter::BLURS_PX)?];
        for later in index + 1..self.frames.len() {
            let last = &meshes[later - index - 1];
            let before = later.checked_sub(index + 2).map(|k| &meshes[k].vertices[..]);
            let start = self.predicted(later, &last.vertices, before);
            let mesh = self.fitted(later, start, &last.clone())?;
            meshes.push(mesh);
        }
        Ok(meshes)
    }

    /// The mesh of frame `index` from those of the frames before, the last of them `last`.
    fn advance(&mut self, index: usize, last: &Fitted) -> Result<Fitted> {
        let is_held = self.frames[index - 1].held;
        let before = index.checked_sub(2).map(|before| &self.frames[before]);
        let before = before.filter(|before| !is_held && !before.held);
        let before = before.and_then(|before| Some(&before.mesh.as_ref()?.vertices[..]));
        let start = self.predicted(index, &last.vertices, before);
        self.fitted(index, start, last)
    }

    /// Where the mesh should be in frame `index` if it moves on, from those in the two frames before it.
    fn predicted(&self, index: usize, last: &[DVec3], before: Option<&[DVec3]>) -> Vec<DVec3> {
        let Some(before) = before.filter(|_| self.missed == 0) else {
            return last.to_vec();
        };
        let now = self.frames[index].time_s - self.frames[index - 1].time_s;
        let then = self.frames[index - 1].time_s - self.frames[index - 2].time_s;
        let fraction = PERSISTENCE * (now / then).min(2.0);
        let step = |(p, q): (&DVec3, &DVec3)| p + fraction * (p - q);
        last.iter().zip(before).map(step).collect()
    }

    /// The mesh fitted to frame `index` from `start`; when the image does not confirm it, in wider steps from where `last`
    /// looks most like the image when it is shifted.
    fn fitted(&mut self, index: usize, start: Vec<DVec3>, last: &Fitted) -> Result<Fitted> {
        let first = self.fitted_in(false, index, start, last)?;
        if first.correlation.whole >= START_CORRELATION.min(0.8 * last.correlation.whole) {
            return Ok(first);
        }
        let shifted = self.shifted(index, &last.vertices);
        let mut second = self.fitted_in(true, index, shifted, last)?;
        second.iterations += first.iterations;
        Ok(if second.correlation.whole > first.correlation.whole {
            self.searched.get_or_insert(self.frames[index].frame);
            second
        } else {
            first
        })
    }

    /// `vertices` moved across the view to where the print correlates best with frame `index`: without a known speed a
    /// quick hand is beyond the reach of the widest blur.
    fn shifted(&mut self, index: usize, vertices: &[DVec3]) -> Vec<DVec3> {
        let RememberedFrame { camera, image, .. } = &self.frames[index];
        let fit = &self.fitter;
        let surface = VisibleSurface::new(&fit.coarse().mesh, vertices, camera);
        let grey = &image.0.whole;
        let drawing = Drawing::new(&fit.print, &surface, (&Region::shown(grey), None), (0, MARGIN_PX), None);
        // In the whole image.
        let mut print = GreyImage {
            values: vec![0.0; grey.values.len()],
            ..*grey
        };
        let mut mask = print.values.clone();
        for (index, (column, row)) in drawing.region.pixels().enumerate() {
            let pixel = row * grey.size.width + column;
            (print.values[pixel], mask[pixel]) = (drawing.print[index], drawing.mask[index]);
        }
        let shift = best_shift(&print, &mask, grey);
        let depth = vertices.iter().map(|p| p.z).sum::<f64>() / vertices.len().max(1) as f64;
        let way = (shift / camera.focal() * depth).extend(0.0);
        vertices.iter().map(|p| p + way).collect()
    }

    /// The mesh fitted to frame `index` from `start`; `wide` where it may be far off. A solid that is not bent is moved as it is at rest,
    /// until a frame tells otherwise.
    fn fitted_in(&mut self, wide: bool, index: usize, start: Vec<DVec3>, last: &Fitted) -> Result<Fitted> {
        let fit = &self.fitter;
        if fit.template.is_sheet() {
            return self.rounds((wide, false), index, start, last);
        }
        let at_rest = fit.rigid(&start, &last.correlation.confidence);
        let is_asked = self.frames[index].frame.is_multiple_of(ASKED_FRAMES);
        if !last.is_rigid && !is_asked {
            return self.rounds((wide, false), index, start, last);
        }
        let mut rigid = self.rounds((wide, true), index, at_rest, last)?;
        rigid.is_rigid = true;
        if !is_asked && rigid.correlation.whole >= last.correlation.whole - LESS {
            return Ok(rigid);
        }
        let bent = self.rounds((wide, false), index, start, last)?;
        Ok(rigid.unless_bent(bent))
    }

    /// The mesh fitted to frame `index` from `start`, round by round; of a solid that `is_rigid` by its motion alone.
    fn rounds(
        &mut self,
        (wide, is_rigid): (bool, bool),
        index: usize,
        start: Vec<DVec3>,
        last: &Fitted,
    ) -> Result<Fitted> {
        let RememberedFrame { camera, image, .. } = &self.frames[index];
        let half_camera = camera.halved()?;
        let whole = Observation::new(&image.0.whole, camera)?;
        let half = Observation::new(&image.0.half, &half_camera)?;
        let (blurs, earlier_steps) = match wide {
            true => (&WIDE_BLURS_PX[..], WIDE_STEPS),
            false => (&BLURS_PX[..], EARLIER_STEPS),
        };
        let mut mesh = Fitted::unmoved(start);
        for (k, &blur) in blurs.iter().enumerate() {
            let is_last = k + 1 == blurs.len();
            let steps = match is_rigid {
                true => 0,
                false if is_last => STEPS,
                false => earlier_steps,
            };
            let round = FitRound {
                margin: MARGIN_PX,
                rigid_steps: if k == 0 || is_rigid { RIGID_STEPS } else { 0 },
                is_near: !wide,
                // What lies before the sheet hides it in the next frame too; after a miss all may have changed.
                trusted: (self.missed == 0).then_some((&last.correlation.confidence, HIDDEN)),
                ..FitRound::new(blur, steps)
            };
            let (observation, round) = if !wide && !is_last && blur >= HALVED_BLUR_PX {
                (half, round.halved())
            } else {
                (whole, round)
            };
            let before = mesh.iterations;
            let fit = &mut self.fitter;
            mesh = fit.round(observation, &mesh.vertices, &round, &[])?;
            mesh.iterations += before;
        }
        Ok(mesh)
    }

    /// Makes `mesh` that of the newest frame, or counts a miss.
    fn take(&mut self, newest: usize, mesh: Fitted, last: Fitted) {
        let in_view = mesh.correlation.points >= MIN_POINTS;
        // What was searched for has found something that looks like the sheet: that is a start, until the network confirms it.
        let enough = self.searched.map_or(MIN_CORRELATION, |_| START_CORRELATION);
        if mesh.correlation.whole >= enough && in_view {
            self.missed = 0;
            self.frames[newest].mesh = Some(mesh);
            return self.show(newest);
        }
        self.missed += 1;
        let confirmed_s = self.frames[newest.saturating_sub(self.missed)].time_s;
        let is_over = self.frames[newest].time_s - confirmed_s >= PATIENCE_S;
        // What has left the view has nothing to come back with: no patience.
        if (is_over && self.missed >= MIN_MISSED) || !in_view {
            self.lose(self.frames[newest].frame);
            self.current.iterations = mesh.iterations;
            return;
        }
        // Stand still: the next frame may show it again.
        let vertices = last.vertices;
        self.frames[newest].mesh = Some(Fitted { vertices, ..mesh });
        self.frames[newest].held = true;
        self.show(newest);
    }

    /// Makes the mesh of frame `index` the current one.
    fn show(&mut self, index: usize) {
        let remembered = &self.frames[index];
        let Some(mesh) = &remembered.mesh else { return };
        let fit = &self.fitter;
        self.current = Tracked {
            frame: remembered.frame,
            surface: Some(Surface {
                camera: remembered.camera,
                vertices_camera: fit.fine_vertices(&mesh.vertices),
                confidence: fit.fine_confidence(&mesh.correlation.confidence),
                is_hidden: Vec::new(),
                deviations: Vec::new(),
                verdict: mesh.correlation.verdict(None),
            }),
            held: remembered.held,
            iterations: mesh.iterations,
        };
    }

    /// Ends the track; `frame` is the newest.
    fn lose(&mut self, frame: u64) {
        self.missed = 0;
        self.searched = None;
        self.current = Tracked {
            frame,
            ..Tracked::default()
        };
    }
}
