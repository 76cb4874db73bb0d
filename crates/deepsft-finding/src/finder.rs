//! The finder: a picture in an image.

use crate::consensus::groups;
use crate::descriptor::BITS;
use crate::features::{FeatureOptions, Features};
use crate::matching::{Match, matches};
use crate::sheet_pose::SheetSolver;
use crate::target::{PictureTarget, resized};
use deepsft_geometry::glam::DVec3;
use deepsft_geometry::raster::VisibleSurface;
use deepsft_geometry::{Camera, GeometryError, Maps, Picture};

/// Longest side of the image that corners are taken from, pixels.
const LONGEST_SIDE: usize = 960;

/// Fewest matches in a group that a sheet is fitted to.
const FEWEST: usize = 6;

/// How far in the image neighbours are looked for, as a fraction of its width.
const REACH: f32 = 0.12;

/// Within how many pixels of an image of 480 columns matches are looked for again, round by round.
const SEARCH_PX: [f64; 3] = [16.0, 8.0, 5.0];

/// Matches found again may differ in this fraction of their bits.
const MOST_DIFFERENT: f32 = 0.35;

/// A sheet that was found.
#[derive(Clone, Debug)]
pub struct FoundSheet {
    /// Depth and registration of the sheet's mesh, as if nothing hid it, in the image of the camera that was given for them.
    pub maps: Maps,
    /// Matches that the mesh explains.
    pub inliers: usize,
    /// Matches of the first group.
    pub confirmed: usize,
}

/// Finds one picture.
pub struct FeatureFinder {
    target: PictureTarget,
    solver: SheetSolver,
}

impl FeatureFinder {
    /// Prepares for a target.
    ///
    /// # Errors
    /// [`GeometryError`] when its mesh cannot be solved on.
    pub fn new(target: PictureTarget) -> Result<Self, GeometryError> {
        Ok(Self {
            solver: SheetSolver::new(target.template())?,
            target,
        })
    }

    /// The image as features are taken from it, and its camera.
    ///
    /// # Errors
    /// [`GeometryError::CameraParameter`] for an empty image.
    pub fn prepared(image: &Picture, camera: &Camera) -> Result<(Picture, Camera), GeometryError> {
        let image = resized(image, LONGEST_SIDE);
        let camera = camera.resized(image.width() as u32, image.height() as u32)?;
        Ok((image, camera))
    }

    /// Looks for the picture among `features` of an image of `camera`. The maps are those of `view`, a camera at the same
    /// place. `None` when too few matches agree.
    ///
    /// # Errors
    /// [`GeometryError`] when the solver refuses its input.
    pub fn find(
        &mut self,
        features: &Features,
        camera: &Camera,
        view: &Camera,
    ) -> Result<Option<FoundSheet>, GeometryError> {
        let width = camera.width() as f32;
        let all = matches(features, &self.target);
        let groups = groups(&all, REACH * width);
        let Some(first) = groups.first().filter(|g| g.len() >= FEWEST) else {
            return Ok(None);
        };
        let confirmed = first.len();
        let pixel = f64::from(width) / 480.0;
        let Some(starts) = self.solver.flat_starts(camera, first) else {
            return Ok(None);
        };
        let mut best: Option<(Vec<DVec3>, f64)> = None;
        for start in starts {
            let bent = self.solver.bend(camera, first, &start, 3.0 * pixel, true)?;
            if best.as_ref().is_none_or(|(_, cost)| bent.1 < *cost) {
                best = Some(bent);
            }
        }
        let Some((mut vertices, _)) = best else {
            return Ok(None);
        };
        let mut again = Vec::new();
        for search in SEARCH_PX {
            again = self.matches_near(features, camera, &vertices, (search * pixel) as f32);
            if again.len() < FEWEST {
                return Ok(None);
            }
            let deviation = search / 5.0 * pixel;
            (vertices, _) = self.solver.bend(camera, &again, &vertices, deviation, false)?;
        }
        let maps = VisibleSurface::new(self.solver.mesh(), &vertices, view).maps();
        Ok(Some(FoundSheet {
            maps,
            inliers: again.len(),
            confirmed,
        }))
    }

    /// For each feature of the image on the mesh at `vertices`: the most similar of the target's within `search` pixels.
    fn matches_near(&self, features: &Features, camera: &Camera, vertices: &[DVec3], search: f32) -> Vec<Match> {
        let maps = VisibleSurface::new(self.solver.mesh(), vertices, camera).maps();
        let (width, height) = maps.size();
        let size = self.target.template().size_mm().as_vec2();
        let cell = 8.0_f32;
        let columns = (size.x / cell).ceil() as usize + 1;
        let rows = (size.y / cell).ceil() as usize + 1;
        let mut cells: Vec<Vec<usize>> = vec![Vec::new(); columns * rows];
        for (i, p) in self.target.places.iter().enumerate() {
            let (x, y) = ((p[0] / cell) as usize, (p[1] / cell) as usize);
            cells[y.min(rows - 1) * columns + x.min(columns - 1)].push(i);
        }
        let others = &self.target.features().all;
        let most = (MOST_DIFFERENT * BITS as f32) as u32;
        let focal = camera.focal().x as f32;
        let mut found = Vec::new();
        for feature in &features.all {
            let (x, y) = (feature.position[0] as usize, feature.position[1] as usize);
            let index = y.min(height - 1) * width + x.min(width - 1);
            if !maps.inside(index) {
                continue;
            }
            let [u, v] = maps.registration()[index];
            let expected = [u * size.x, v * size.y];
            let mm = maps.depth()[index] / focal;
            let reach = search * mm;
            let (mut best, mut least) = (None, most + 1);
            let column = |x: f32| ((x / cell).max(0.0) as usize).min(columns - 1);
            let row = |y: f32| ((y / cell).max(0.0) as usize).min(rows - 1);
            for j in row(expected[1] - reach)..=row(expected[1] + reach) {
                for i in column(expected[0] - reach)..=column(expected[0] + reach) {
                    for &k in &cells[j * columns + i] {
                        let place = self.target.places[k];
                        if (place[0] - expected[0]).hypot(place[1] - expected[1]) > reach {
                            continue;
                        }
                        // Of the same size on the sheet, within a factor of two.
                        let scale = others[k].scale * self.target.mm_per_pixel / (feature.scale * mm);
                        if !(0.4..2.0).contains(&scale) {
                            continue;
                        }
                        let distance = feature.descriptor.distance(&others[k].descriptor);
                        if distance < least {
                            (best, least) = (Some(k), distance);
                        }
                    }
                }
            }
            if let Some(k) = best {
                found.push(Match {
                    pixel: feature.position,
                    place: self.target.places[k],
                    angle: others[k].angle - feature.angle,
                    log_scale: 0.0,
                    ratio: least as f32 / BITS as f32,
                });
            }
        }
        found
    }

    /// Options with which features of images are looked for.
    pub fn options() -> FeatureOptions {
        FeatureOptions::default()
    }
}
