//! The finder: a picture in an image.

use crate::consensus::groups;
use crate::descriptor::BITS;
use crate::features::{FeatureOptions, Features};
use crate::matching::{Match, matches};
use crate::sheet_pose::SheetSolver;
use crate::target::{PictureTarget, resized};
use deepsft_geometry::glam::{DVec3, Vec2};
use deepsft_geometry::raster::VisibleSurface;
use deepsft_geometry::{Camera, GeometryError, Maps, Picture};
use std::f32::consts::{PI, TAU};

/// Longest side of the image that corners are taken from, pixels.
const LONGEST_SIDE: usize = 960;

/// Fewest matches in a group that a sheet is fitted to.
const FEWEST: usize = 6;

/// How far in the image neighbours are looked for, as a fraction of its width.
const REACH: f32 = 0.12;

/// Within how many pixels of an image of 480 columns matches are looked for again, round by round.
const SEARCH_PX: [f64; 5] = [16.0, 16.0, 10.0, 6.0, 5.0];

/// Most groups that a mesh is tried on.
const MOST_GROUPS: usize = 4;

/// Largest angle between a match found again and the mesh, radians.
const TURN: f32 = 0.5;

/// Matches found again may differ in this fraction of their bits.
const MOST_DIFFERENT: f32 = 0.25;

/// A sheet that was found.
#[derive(Clone, Debug)]
pub struct FoundSheet {
    /// Depth and registration of the sheet's mesh, as if nothing hid it, in the image of the camera that was given for them.
    pub maps: Maps,
    /// Matches that the mesh explains.
    pub inliers: usize,
    /// Matches of the first group.
    pub confirmed: usize,
    /// Image position (pixels) and place on the sheet (mm) of the first group's matches and of the last ones.
    pub stages: [Vec<([f32; 2], [f32; 2])>; 2],
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
        let mut best: Option<(Vec<DVec3>, f64)> = None;
        let tried = groups.iter().take(MOST_GROUPS);
        for group in tried.filter(|g| g.len() >= FEWEST && g.len() * 4 >= confirmed) {
            let Some(starts) = self.solver.flat_starts(camera, group) else {
                continue;
            };
            for start in starts {
                let bent = self.solver.bend(camera, group, &start, 3.0 * pixel, true)?;
                let near = self.matches_near(features, camera, &bent, (SEARCH_PX[0] * pixel) as f32);
                if near.len() < FEWEST {
                    continue;
                }
                let bent = self.solver.bend(camera, &near, &bent, 3.0 * pixel, false)?;
                let score = self.solver.explained(camera, &near, &bent, 2.0 * pixel);
                if best.as_ref().is_none_or(|(_, most)| score > *most) {
                    best = Some((bent, score));
                }
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
            vertices = self.solver.bend(camera, &again, &vertices, deviation, false)?;
        }
        let maps = VisibleSurface::new(self.solver.mesh(), &vertices, view).maps();
        Ok(Some(FoundSheet {
            maps,
            inliers: again.len(),
            confirmed,
            stages: [first, &again].map(|all| all.iter().map(|m| (m.pixel, m.place)).collect()),
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
            let Some(turn) = turn(&maps, index, size) else {
                continue;
            };
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
                        let off = others[k].angle - feature.angle - turn;
                        if ((off + PI).rem_euclid(TAU) - PI).abs() > TURN {
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

/// The angle by which the registration turns directions of the image around a pixel into directions on the sheet, radians.
fn turn(maps: &Maps, index: usize, size: Vec2) -> Option<f32> {
    let width = maps.width();
    if index % width + 1 == width || index + width >= maps.depth().len() {
        return None;
    }
    if !(maps.inside(index + 1) && maps.inside(index + width)) {
        return None;
    }
    let place = |p: usize| Vec2::from(maps.registration()[p]) * size;
    let (x, y) = (place(index + 1) - place(index), place(index + width) - place(index));
    // The rotation nearest to the matrix of both columns.
    Some((x.y - y.x).atan2(x.x + y.y))
}
