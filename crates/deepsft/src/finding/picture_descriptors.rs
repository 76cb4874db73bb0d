//! A picture as the descriptor network sees it, and matches of images with it.

use crate::error::DeepSftError;
use crate::weights_file::weights_from_burnpack;
use deepsft_finding::Match;
use deepsft_geometry::glam::{DVec2, Vec2};
use deepsft_geometry::{CANONICAL_HEIGHT, CANONICAL_WIDTH, ImageSize, MipLevel, Picture, Template};
use deepsft_inference::{DESCRIPTOR_LENGTH, DescriptorExecutor, DescriptorSimilarities, Weights, available_threads};
use std::collections::{BTreeMap, btree_map::Entry};
use std::f32::consts::TAU;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

/// Pixels along a cell's side.
const CELL: usize = 8;

/// What of a cell its descriptor is about, pixels from its corner: as the labels of the training had it.
const CELL_CENTRE: f32 = 4.5;

/// Directions in which the picture is shown to the network, which knows half of 45 degrees itself.
const ROLLS: usize = 8;

/// Longer sides of the picture in its views, pixels: an A4 sheet 47 and 94 cm away from the canonical camera.
const SIDES: [f64; 2] = [240.0, 120.0];

/// Factor between a similarity and its logarithmic odds, as the network has learnt it.
const SHARPNESS: f32 = 30.0;

/// How much more similar than the best place elsewhere a match must be: odds of about 2 to 1.
const MIN_MARGIN: f32 = 0.035;

/// Similarity below which a cell shows something else; the network learnt 0.73 as the point of even odds.
const MIN_SIMILARITY: f32 = 0.65;

/// Elsewhere: farther than this, in cells of the smaller view. Neighbouring cells overlap.
const ELSEWHERE_CELLS: f32 = 2.5;

/// Cells of the image that are compared at a time: bounds the memory of the similarities.
const BATCH: usize = 512;

/// Sides of the pictures that the network is shown are multiples of this.
const INPUT_MULTIPLE: usize = 16;

/// What its file is called in errors.
const FILE: &str = "the weights of the descriptor network";

/// Executors that wait for the next image.
const MAX_IDLE: usize = 2;

/// The descriptor network, shared by all targets. Several threads may use it at the same time.
#[derive(Clone, Debug)]
pub struct SharedDescriptorNetwork {
    weights: Arc<Weights>,
    /// Executors, one for each caller at a time; the last used is the last.
    idle: Arc<Mutex<Vec<DescriptorExecutor>>>,
}

impl SharedDescriptorNetwork {
    /// Reads the network from its file.
    ///
    /// # Errors
    /// [`DeepSftError::BundleContent`] for bytes that are no weights of this network.
    pub fn from_bytes(file: &[u8]) -> Result<Self, DeepSftError> {
        let weights = weights_from_burnpack(file).map_err(DeepSftError::content(FILE))?;
        let first = executor((CANONICAL_WIDTH, CANONICAL_HEIGHT).into(), &weights)?;
        Ok(Self {
            weights: Arc::new(weights),
            idle: Arc::new(Mutex::new(vec![first])),
        })
    }

    /// Computes descriptors of a canonical image.
    pub(super) fn describe(&self, image: &Picture) -> Result<ImageDescriptors, DeepSftError> {
        // No lock is held while the network runs.
        let free = {
            let mut idle = self.idle();
            let free = idle.iter().rposition(|executor| executor.size() == image.size());
            free.map(|free| idle.remove(free))
        };
        let mut network = free.map_or_else(|| executor(image.size(), &self.weights), Ok)?;
        let rows = network.describe(image)?;
        let (columns, _) = network.cells();
        let mut idle = self.idle();
        if idle.len() == MAX_IDLE {
            idle.remove(0);
        }
        idle.push(network);
        Ok(ImageDescriptors { rows, columns })
    }

    fn idle(&self) -> MutexGuard<'_, Vec<DescriptorExecutor>> {
        self.idle.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

fn executor(size: ImageSize, weights: &Weights) -> Result<DescriptorExecutor, DeepSftError> {
    let made = DescriptorExecutor::new(size, weights, available_threads());
    made.map_err(DeepSftError::content(FILE))
}

/// Descriptors of a picture, rolled and scaled.
#[derive(Debug)]
pub struct PictureDescriptors {
    similarities: DescriptorSimilarities,
    places: PicturePlaces,
}

/// Where on the picture each descriptor is.
#[derive(Debug)]
struct PicturePlaces {
    values: Vec<f32>,
    cells: Vec<PictureCell>,
    views: Vec<PictureView>,
    elsewhere_mm: f32,
}

#[derive(Clone, Copy, Debug)]
struct PictureCell {
    view: usize,
    at: [usize; 2],
    place: Vec2,
}

/// The picture turned by `angle`, with the index of each cell's descriptor.
#[derive(Debug)]
struct PictureView {
    angle: f64,
    mm_per_pixel: f64,
    columns: usize,
    index: Vec<Option<usize>>,
}

/// Descriptors of an image, cell after cell, row-major.
#[derive(Debug)]
pub struct ImageDescriptors {
    rows: Vec<f32>,
    columns: usize,
}

impl PictureDescriptors {
    /// Those of the picture on `template`, a sheet. [`DeepSftError::Geometry`] for a picture without pixels.
    pub(super) fn new(network: &SharedDescriptorNetwork, template: &Template) -> Result<Self, DeepSftError> {
        let (mut values, mut cells, mut views) = (Vec::new(), Vec::new(), Vec::new());
        // Most views are of the size of another one.
        let mut networks = BTreeMap::new();
        let size = template.size_mm();
        for side in SIDES {
            let mm_per_pixel = size.max_element() / side;
            for roll in 0..ROLLS {
                let angle = f64::from(TAU) * roll as f64 / ROLLS as f64;
                let (picture, from_view) = turned(template, angle, mm_per_pixel);
                let picture_size = picture.size();
                let network = match networks.entry(picture_size) {
                    Entry::Occupied(made) => made.into_mut(),
                    Entry::Vacant(none) => none.insert(executor(picture_size, &network.weights)?),
                };
                let descriptors = network.describe(&picture)?;
                let (columns, rows) = network.cells();
                let mut index = vec![None; rows * columns];
                for (cell, descriptor) in descriptors.chunks_exact(DESCRIPTOR_LENGTH).enumerate() {
                    let at = [cell % columns, cell / columns];
                    let centre = at.map(|k| (CELL * k + CELL / 2) as f64);
                    let place = from_view(DVec2::from(centre));
                    if place.cmplt(DVec2::ZERO).any() || place.cmpgt(size).any() {
                        continue;
                    }
                    index[cell] = Some(cells.len());
                    values.extend_from_slice(descriptor);
                    cells.push(PictureCell {
                        view: views.len(),
                        at,
                        place: place.as_vec2(),
                    });
                }
                views.push(PictureView {
                    angle,
                    mm_per_pixel,
                    columns,
                    index,
                });
            }
        }
        let similarities = DescriptorSimilarities::new(values.clone(), BATCH, available_threads());
        let elsewhere_mm = ELSEWHERE_CELLS * CELL as f32 * (size.max_element() / SIDES[1]) as f32;
        Ok(Self {
            similarities: similarities.map_err(DeepSftError::content(FILE))?,
            places: PicturePlaces {
                values,
                cells,
                views,
                elsewhere_mm,
            },
        })
    }

    /// Matches of an image's cells with places on the picture, the clearest first. Pixels are those of the image that was
    /// described.
    pub fn matches(&mut self, image: &ImageDescriptors) -> Vec<Match> {
        let mut found = Vec::new();
        for (batch, rows) in image.rows.chunks(BATCH * DESCRIPTOR_LENGTH).enumerate() {
            let descriptors = rows.chunks_exact(DESCRIPTOR_LENGTH);
            for (k, (descriptor, similarities)) in descriptors.zip(self.similarities.of(rows)).enumerate() {
                let cell = BATCH * batch + k;
                let centre = [cell % image.columns, cell / image.columns].map(|at| (CELL * at) as f32 + CELL_CENTRE);
                found.extend(self.places.best(descriptor, similarities, centre.into()));
            }
        }
        found.sort_by(|a: &(f32, Match), b| b.0.total_cmp(&a.0));
        with_local_similarity(&found.into_iter().map(|(_, m)| m).collect::<Vec<_>>())
    }
}

impl PicturePlaces {
    /// The most similar place, if it stands out, and by how much.
    fn best(&self, descriptor: &[f32], similarities: &[f32], pixel: Vec2) -> Option<(f32, Match)> {
        let (mut best, mut most) = (0, f32::NEG_INFINITY);
        for (k, &similarity) in similarities.iter().enumerate() {
            if similarity > most {
                (best, most) = (k, similarity);
            }
        }
        let place = self.cells.get(best).filter(|_| most >= MIN_SIMILARITY)?.place;
        let limit = most - 4.0 * MIN_MARGIN;
        let mut rival = limit;
        for (cell, &similarity) in self.cells.iter().zip(similarities) {
            if similarity > rival && cell.place.distance(place) > self.elsewhere_mm {
                rival = similarity;
            }
        }
        let margin = most - rival;
        let view = &self.views[self.cells[best].view];
        let at = Match {
            pixel,
            place: self.refined(best, most, descriptor),
            angle: -view.angle as f32,
            scale: view.mm_per_pixel as f32,
        };
        (margin >= MIN_MARGIN).then_some((margin, at))
    }

    /// The mean of a cell's place and those of its neighbours in the view, weighted by their odds.
    fn refined(&self, best: usize, most: f32, descriptor: &[f32]) -> Vec2 {
        let cell = &self.cells[best];
        let view = &self.views[cell.view];
        let rows = view.index.len() / view.columns;
        let around = |at: usize, count: usize| at.saturating_sub(1)..(at + 2).min(count);
        let (mut sum, mut weights) = (Vec2::ZERO, 0.0);
        for y in around(cell.at[1], rows) {
            for x in around(cell.at[0], view.columns) {
                let Some(k) = view.index[y * view.columns + x] else {
                    continue;
                };
                let there = &self.values[DESCRIPTOR_LENGTH * k..DESCRIPTOR_LENGTH * (k + 1)];
                let similarity: f32 = descriptor.iter().zip(there).map(|(a, b)| a * b).sum();
                let weight = (SHARPNESS * (similarity - most)).exp();
                sum += weight * self.cells[k].place;
                weights += weight;
            }
        }
        if weights > 0.0 { sum / weights } else { cell.place }
    }
}

/// The picture on `template` turned by `angle` on a ground of its mean colour, and the way from the view's pixels to mm on
/// the sheet.
fn turned(template: &Template, angle: f64, mm_per_pixel: f64) -> (Picture, impl Fn(DVec2) -> DVec2) {
    let size = template.size_mm();
    let turn = DVec2::from_angle(angle);
    let extent = DVec2::new(
        turn.x.abs() * size.x + turn.y.abs() * size.y,
        turn.y.abs() * size.x + turn.x.abs() * size.y,
    ) / mm_per_pixel;
    let [width, height] = [extent.x, extent.y].map(|side| (side.ceil() as usize).next_multiple_of(INPUT_MULTIPLE));
    let centre = DVec2::new(width as f64, height as f64) / 2.0;
    let back = DVec2::from_angle(-angle);
    let from_view = move |pixel: DVec2| back.rotate(pixel - centre) * mm_per_pixel + size / 2.0;
    // Coarser until a texel is about a pixel.
    let longest = 1.6 * size.max_element() / mm_per_pixel;
    let mut texture = MipLevel::finest(template.texture().clone());
    while let Some(coarser) = texture.coarser().filter(|_| texture.extent.max_element() > longest) {
        texture = coarser;
    }
    let mean = mean_color(&texture.picture);
    let picture = Picture::from_fn(width, height, |x, y| {
        let place = from_view(DVec2::new(x as f64 + 0.5, y as f64 + 0.5));
        if place.cmplt(DVec2::ZERO).any() || place.cmpgt(size).any() {
            return mean;
        }
        texture.sample(place / size).map(|value| value.round() as u8)
    });
    (picture, from_view)
}

fn mean_color(picture: &Picture) -> [u8; 3] {
    let mut sum = [0_u64; 3];
    for pixel in picture.rgb().as_chunks::<3>().0 {
        for (sum, &value) in sum.iter_mut().zip(pixel) {
            *sum += u64::from(value);
        }
    }
    let count = (picture.rgb().len() / 3).max(1) as u64;
    sum.map(|sum| (sum / count) as u8)
}

/// Distance within which matches tell of each other's angle and scale, pixels.
const NEIGHBOURHOOD_PX: f32 = 20.0;

/// Fewest neighbours that do.
const MIN_NEIGHBOURS: usize = 3;

/// A view tells angle and scale roughly. Neighbours that agree with it tell them better: the similarity through their places.
fn with_local_similarity(matches: &[Match]) -> Vec<Match> {
    let refined = |m: &Match| {
        let (mut cross, mut square, mut count) = (Vec2::ZERO, 0.0, 0);
        for other in matches {
            let d = other.pixel - m.pixel;
            let length = d.length();
            if !(1.0..=NEIGHBOURHOOD_PX).contains(&length) {
                continue;
            }
            let moved = other.place - m.place;
            let expected = Vec2::from_angle(m.angle).rotate(d) * m.scale;
            if moved.distance(expected) > 0.9 * expected.length() {
                continue;
            }
            // moved = z * d as complex numbers, in the least squares sense.
            cross += Vec2::new(moved.dot(d), d.perp_dot(moved));
            square += d.length_squared();
            count += 1;
        }
        if count < MIN_NEIGHBOURS {
            return *m;
        }
        let similarity = cross / square;
        Match {
            angle: similarity.to_angle(),
            scale: similarity.length().clamp(m.scale / 3.0, 3.0 * m.scale),
            ..*m
        }
    };
    matches.iter().map(refined).collect()
}
