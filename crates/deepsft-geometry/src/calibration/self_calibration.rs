//! The camera from a sheet that bends.

use super::view::{ASPECT, PARAMETERS, Reduced, View, between, stepped};
use crate::camera::Camera;
use crate::error::{Result, check_size, check_start};
use crate::fitting::mesh_fitter::{MeshFitter, RIGIDITY};
use crate::image::{GreyImage, Picture};
use crate::mesh::Template;
use glam::{DVec3, DVec4};

/// Information that holds a parameter where it is.
const HELD: f64 = 1e12;

/// Most that the focal length changes in one update, ln f.
const MAX_STEP: f64 = 0.15;

/// Change of ln f from one update to the next, as a fraction of its deviation, below which the camera is found.
const FOUND_STEP: f64 = 0.1;

/// Energy of a view's fit, as a multiple of what a quarter of the views keep below, beyond which its mesh is a wrong one: bent the
/// other way, mostly, which a wrong camera has led to. In the synthetic clips that were looked at right ones
/// stay below 1.4, wrong ones begin near 2.
const WRONG_MESH: f64 = 1.6;

/// Energy up to which a mesh explains its image, whatever the others do. On synthetic clips right ones have 60 and more.
const RIGHT_MESH: f64 = 50.0;

/// So many of the newest views whose meshes are all wrong were taken through another lens.
const OTHER_LENS_VIEWS: usize = 3;

/// Views for whose pixels room is made with the first: made one by one, it would grow the memory of a page that has long been at work.
const RESERVED_VIEWS: usize = 12;

/// Blur of image and drawing, pixels of the canonical image, of each update of the camera; later updates take the last.
const BLURS_PX: [f32; 3] = [2.0, 1.2, 0.8];

/// Steps of a mesh between two updates of the camera.
const STEPS: usize = 4;

/// Variance of the fit's residuals, in units of its energy. What deviations are stated comes from it; chosen such that they hold on
/// synthetic clips.
const RESIDUAL_VARIANCE: f64 = 0.8;

/// Least motion between two kept views, as a fraction of the template's diagonal: the mean way of the vertices.
const MIN_MOTION: f64 = 0.05;

/// What is known before the views are, and which views are taken.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SelfCalibrationOptions {
    /// Prior standard deviations of the true camera around the assumed one. They are of ln f, of the principal
    /// point's column and row as fractions of f, and of k1. 0 holds a parameter. Default 0.2, 0.02, 0.02, 0.03: a
    /// phone whose focal length was guessed.
    pub deviations: [f64; 4],
    /// Prior standard deviation of ln of the print's width over its height: printers and hands stretch paper. 0 holds it. Default 0.02.
    pub aspect_deviation: f64,
    /// Views from which the camera is solved for.
    pub min_views: usize,
    /// Views that are kept. One more takes the place of the one that tells least of the focal length.
    pub max_views: usize,
}

impl Default for SelfCalibrationOptions {
    fn default() -> Self {
        Self {
            deviations: [0.2, 0.02, 0.02, 0.03],
            aspect_deviation: 0.02,
            min_views: 4,
            max_views: 12,
        }
    }
}

/// A camera that was solved for.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct CalibratedCamera {
    /// The camera of the images that were given.
    pub camera: Camera,
    /// The camera that was assumed for them.
    pub assumed: Camera,
    /// Standard deviation of ln f: that of the focal length as a fraction of it.
    pub focal_deviation: f64,
    /// How much wider the print is, beside its height, than the template says: ln of the ratio.
    pub aspect: f64,
    /// Number of views that it comes from; those that were fitted far worse than the others are left out.
    pub views: usize,
}

impl CalibratedCamera {
    /// The camera of the original images, from which canonical ones were made as those of `source`.
    ///
    /// # Errors
    /// [`GeometryError::CameraParameter`](crate::GeometryError::CameraParameter) when that is no camera.
    pub fn of_source(&self, source: &Camera) -> Result<Camera> {
        stepped(source, between(&self.assumed, &self.camera))
    }
}

/// Self-calibrates a camera from views of one sheet: bundle adjustment with meshes in place of points.
///
/// The sheet's lengths are known and its print says which point of it a pixel shows. A camera of another focal length than the
/// assumed one would see the perspective of a sheet that stretches. So the camera is the one before which all meshes explain
/// their images with the least strain: the energy of the fit (photo-consistency, isometry, bending) is minimised over the meshes and
/// the camera's focal length, principal point and first radial distortion together, by Gauss and Newton's method. With them goes the
/// template's aspect: a print that is wider than it was said to be looks tilted before the wrong camera. Each mesh is
/// eliminated (the Schur complement of its own normal equations), so that a view costs about as much as fitting its mesh does.
///
/// A view whose mesh explains it far worse than the others' theirs has no say: it is a wrong one, until it fits.
///
/// After a camera was found, three new views in a row whose meshes are all wrong were taken through another lens, as a phone's that goes over
/// to its macro lens by itself: they alone begin anew.
///
/// Frontal views of a flat sheet say nothing of the focal length; [`CalibratedCamera::focal_deviation`] tells.
#[derive(Debug)]
pub struct SelfCalibration {
    fitter: MeshFitter,
    options: SelfCalibrationOptions,
    diagonal_mm: f64,
    views: Vec<View>,
    /// Pixels of views that are gone, for new ones: given back, the memory of a page that works for long would be torn to pieces, and grow.
    spare: Vec<Vec<f32>>,
    /// Assumed, and as far as it is known.
    cameras: Option<[Camera; 2]>,
    /// How much wider the print is than the template says, beside its height, ln.
    aspect: f64,
    /// Updates of the camera since the first.
    updates: usize,
    /// The next view to be fitted for the next update.
    next: usize,
    taken: usize,
    is_found: bool,
}

impl SelfCalibration {
    /// Prepares everything that does not depend on the views.
    ///
    /// # Errors
    /// [`GeometryError::NotASheet`](crate::GeometryError::NotASheet) for a template of another shape.
    pub fn new(template: &Template, options: SelfCalibrationOptions) -> Result<Self> {
        template.expect_sheet("telling the camera")?;
        Ok(Self {
            fitter: MeshFitter::new(template, RIGIDITY)?,
            options,
            diagonal_mm: template.size_mm().length(),
            views: Vec::new(),
            spare: Vec::new(),
            cameras: None,
            aspect: 0.0,
            updates: 0,
            next: 0,
            taken: 0,
            is_found: false,
        })
    }

    /// Forgets the views and what they told: for another camera.
    pub fn reset(&mut self) {
        self.spare.extend(self.views.drain(..).map(|view| view.image.values));
        self.cameras = None;
        self.begin();
    }

    fn begin(&mut self) {
        (self.updates, self.next, self.is_found) = (0, 0, false);
        self.set_aspect(0.0);
    }

    /// Offers a view: an undistorted image, the camera assumed for it, and the mesh in it. The mesh is the template's
    /// vertices as they were tracked or fitted, camera frame, mm. Says whether it is taken: one that differs from the
    /// others, between two updates of the camera. Another assumed camera starts afresh.
    ///
    /// # Errors
    /// [`GeometryError::StartLength`](crate::GeometryError::StartLength) when the mesh does not have the template's vertices, [`GeometryError::MapSize`](crate::GeometryError::MapSize) when the image
    /// is not of the camera's size.
    pub fn offer(&mut self, image: &Picture, assumed: &Camera, vertices_camera: &[DVec3]) -> Result<bool> {
        check_start(vertices_camera, self.fitter.template.mesh().vertices().len())?;
        check_size(image.size(), assumed.size())?;
        if self.cameras.is_none_or(|[known, _]| known != *assumed) {
            self.reset();
            self.cameras = Some([*assumed; 2]);
        }
        let mut vertices = self.fitter.coarse_vertices(vertices_camera);
        let far = MIN_MOTION * self.diagonal_mm;
        if self.next > 0 || self.views.iter().any(|view| view.motion_from(&vertices) < far) {
            return Ok(false);
        }
        let tracked = vertices.clone();
        if let Some([assumed, camera]) = self.cameras {
            // Before a longer focal length the sheet lies further away.
            let depth = vertices.iter().map(|p| p.z).sum::<f64>() / vertices.len().max(1) as f64;
            let away = DVec3::Z * depth * (camera.focal().x / assumed.focal().x - 1.0);
            vertices.iter_mut().for_each(|p| *p += away);
        }
        if self.views.len() >= self.options.max_views.max(1) {
            let tells = |&view: &usize| self.views[view].information(self.prior([0.0; PARAMETERS]));
            if let Some(least) = (0..self.views.len()).min_by(|a, b| tells(a).total_cmp(&tells(b))) {
                self.spare.push(self.views.swap_remove(least).image.values);
            }
        }
        let (there, pixels) = (self.views.len() + self.spare.len(), image.rgb().len() / 3);
        let reserved = self.options.max_views.min(RESERVED_VIEWS);
        self.spare.extend((there..reserved).map(|_| Vec::with_capacity(pixels)));
        let grey = GreyImage::of_into(image, self.spare.pop().unwrap_or_default());
        self.taken += 1;
        self.views.push(View::new(self.taken, grey, tracked, vertices));
        Ok(true)
    }

    /// Fits the mesh of the next view, for about the time of a frame that is tracked. When all views had their turn, the camera is
    /// updated; where that hardly changes it, it is returned.
    ///
    /// # Errors
    /// [`GeometryError`](crate::GeometryError) when a view cannot be fitted.
    pub fn step(&mut self) -> Result<Option<CalibratedCamera>> {
        let Some([assumed, camera]) = self.cameras else {
            return Ok(None);
        };
        if self.views.len() < self.options.min_views.max(1) {
            return Ok(None);
        }
        let last = BLURS_PX.len() - 1;
        let blur = BLURS_PX[self.updates.min(last)];
        let view = &mut self.views[self.next];
        view.fit(&mut self.fitter, &camera, (blur, STEPS))?;
        self.next += 1;
        if self.next < self.views.len() {
            return Ok(None);
        }
        self.next = 0;
        let [ln_f, cx, cy, k1] = between(&assumed, &camera).to_array();
        let mut told = self.prior([ln_f, cx, cy, k1, self.aspect]);
        let mut views = 0;
        let mut energies: Vec<f64> = self.views.iter().map(|view| view.energy).collect();
        energies.sort_by(f64::total_cmp);
        let good = energies.get(energies.len() / 4).copied().unwrap_or_default();
        let most = RIGHT_MESH.max(WRONG_MESH * good);
        if self.is_found && self.begins_with_newest(most) {
            self.cameras = Some([assumed; 2]);
            self.begin();
            return Ok(None);
        }
        for view in self.views.iter().filter(|view| view.energy <= most) {
            told.add(&view.reduced);
            views += 1;
        }
        let (mut step, covariance) = told.solve();
        for (step, deviation) in step.iter_mut().zip(self.options.deviations) {
            // Rounding would move what is held.
            *step *= f64::from(deviation > 0.0);
        }
        let fraction = (MAX_STEP / step[0].abs()).min(1.0);
        let step = step.map(|step| fraction * step);
        let camera = stepped(&camera, DVec4::from_slice(&step))?;
        self.set_aspect(self.aspect + step[ASPECT]);
        self.cameras = Some([assumed, camera]);
        self.views.iter_mut().for_each(|view| view.follow(step));
        self.updates += 1;
        let focal_deviation = (RESIDUAL_VARIANCE * covariance.x_axis.x).sqrt();
        let found = self.updates > last + 1 && step[0].abs() < FOUND_STEP * focal_deviation;
        self.is_found |= found;
        Ok(found.then_some(CalibratedCamera {
            camera,
            assumed,
            focal_deviation,
            aspect: self.aspect,
            views,
        }))
    }

    /// Whether the meshes of the newest views are all wrong, of an energy above `most`, though each had its turns. The others are dropped then,
    /// and these begin where they were tracked.
    fn begins_with_newest(&mut self, most: f64) -> bool {
        self.views.sort_by_key(|view| view.number);
        let is_wrong = |view: &View| view.energy > most && view.fits > BLURS_PX.len();
        let wrong = self.views.iter().rev().take_while(|view| is_wrong(view)).count();
        let others = self.views.len() - wrong;
        if wrong < OTHER_LENS_VIEWS || others == 0 {
            return false;
        }
        let dropped = self.views.drain(..others);
        self.spare.extend(dropped.map(|view| view.image.values));
        self.views.iter_mut().for_each(View::begin);
        true
    }

    /// Steps until the camera is found. `None` when there are too few views, or when it is not found in `max_updates`.
    ///
    /// # Errors
    /// As [`SelfCalibration::step`].
    pub fn solve(&mut self, max_updates: usize) -> Result<Option<CalibratedCamera>> {
        for _ in 0..max_updates * self.views.len() {
            if let Some(found) = self.step()? {
                return Ok(Some(found));
            }
        }
        Ok(None)
    }

    /// Returns the mesh of each kept view under the current camera: the template's vertices, camera frame, mm.
    pub fn meshes(&self) -> impl Iterator<Item = Vec<DVec3>> + '_ {
        self.views.iter().map(|view| self.fitter.fine_vertices(&view.vertices))
    }

    /// What was known of the parameters before the views, which are `off` from it.
    fn prior(&self, off: [f64; PARAMETERS]) -> Reduced {
        let [ln_f, cx, cy, k1] = self.options.deviations;
        let information = [ln_f, cx, cy, k1, self.options.aspect_deviation]
            .map(|deviation| (RESIDUAL_VARIANCE / (deviation * deviation)).min(HELD));
        Reduced::prior(information, off)
    }

    fn set_aspect(&mut self, aspect: f64) {
        self.aspect = aspect;
        self.fitter.coarse_mut().set_aspect(aspect);
    }
}
