//! The photographed print, laid flat, and the light on it, divided out.

use crate::camera::Camera;
use crate::error::{GeometryError, check_size, check_start};
use crate::image::{ImageSize, MipLevel, Picture};
use crate::maps::raster::{ImageTriangle, VisibleSurface};
use crate::mesh::Template;
use crate::surface::Surface;
use glam::{DVec2, DVec3};
use std::iter::successors;

/// Distance of the texture's plane from the camera that looks at it head-on, mm, and that camera's focal length, pixels: one for the other.
const PLANE_MM: f64 = 1000.0;

/// A place of the surface is seen where nothing lies nearer by more than this fraction of its depth. Layers that are nearer to each other
/// count as one.
const SAME_DEPTH: f64 = 0.005;

/// Colour of what the image does not show: bare paper.
const UNSEEN: [u8; 3] = [255; 3];

/// A print as an image shows it, laid flat.
#[derive(Clone, Debug, PartialEq)]
pub struct FlatPrint {
    /// The print in the frame of its texture; white where the image does not show it.
    pub picture: Picture,
    /// How much the image shows of each pixel, 0 to 1, row-major: pixels of the image along its shorter way across the pixel, at most 1. 0
    /// where the print is out of the image, turned away, or hidden by itself or by something else ([`Surface::is_hidden`]).
    pub confidence: Vec<f32>,
}

/// Flat prints of a video that are kept at most: a few seconds apart they show the print in light and bends of its own.
const MAX_PRINTS: usize = 32;

/// The print that most frames of a video show: reflections and hands that move go.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct FlatMedian {
    /// Of one frame of `every`: all of a short video, later fewer, spread over all of it.
    prints: Vec<FlatPrint>,
    frames: usize,
    every: usize,
}

impl FlatMedian {
    /// Takes the next frame. `flatten` is called for those that are kept; they must be flat prints of one size.
    ///
    /// # Errors
    /// Those of `flatten`, [`GeometryError::MapSize`] for a print of another size than those before.
    pub fn add(&mut self, flatten: impl FnOnce() -> Result<FlatPrint, GeometryError>) -> Result<(), GeometryError> {
        let frame = self.frames;
        self.frames += 1;
        if !frame.is_multiple_of(self.every.max(1)) {
            return Ok(());
        }
        let print = flatten()?;
        if let Some(first) = self.prints.first() {
            check_size(print.picture.size(), first.picture.size())?;
        }
        self.prints.push(print);
        if self.prints.len() > MAX_PRINTS {
            let mut is_kept = [true, false].into_iter().cycle();
            self.prints.retain(|_| is_kept.next() == Some(true));
            self.every = 2 * self.every.max(1);
        }
        Ok(())
    }

    /// The median of the frames, each channel by itself and each frame counted by its confidence, and the mean of their confidences; `None`
    /// without a frame.
    pub fn median(&self) -> Option<FlatPrint> {
        let size = self.prints.first()?.picture.size();
        let mut rgb = UNSEEN.repeat(size.area());
        let mut seen: Vec<([u8; 3], f32)> = Vec::with_capacity(self.prints.len());
        let mut confidence = Vec::with_capacity(size.area());
        for place in 0..size.area() {
            let (column, row) = (place % size.width, place / size.width);
            seen.clear();
            let shown = self.prints.iter().filter(|print| print.confidence[place] > 0.0);
            seen.extend(shown.map(|print| (print.picture.pixel(column, row), print.confidence[place])));
            let whole: f32 = seen.iter().map(|(_, weight)| weight).sum();
            for channel in 0..3 {
                seen.sort_unstable_by_key(|(color, _)| color[channel]);
                let mut below = 0.0;
                let middle = seen.iter().find(|(_, weight)| {
                    below += weight;
                    2.0 * below >= whole
                });
                if let Some((color, _)) = middle {
                    rgb[3 * place + channel] = color[channel];
                }
            }
            confidence.push(whole / self.prints.len() as f32);
        }
        let picture = Picture::new(size.width, size.height, rgb).ok()?;
        Some(FlatPrint { picture, confidence })
    }
}

impl Surface {
    /// Lays the print of `template` flat as `image` shows it, `width` pixels wide, in the proportions of its texture: the inverse of drawing
    /// the surface, each pixel looked up in the image where the surface has it. `camera` took the image and looks as the surface's own does.
    ///
    /// # Errors
    /// [`GeometryError::MapSize`] when image and camera are not of one size, [`GeometryError::CameraParameter`] for a `width` of 0,
    /// [`GeometryError::StartLength`] for a template with another number of vertices.
    pub fn flatten(
        &self,
        template: &Template,
        (image, camera): (&Picture, &Camera),
        width: usize,
    ) -> Result<FlatPrint, GeometryError> {
        let (mesh, texture) = (template.mesh(), template.texture());
        let size = ImageSize::from((width, (texture.height() * width / texture.width()).max(1)));
        check_size(image.size(), camera.size())?;
        check_start(&self.vertices_camera, mesh.vertices().len())?;
        let head_on = Camera::pinhole(size, DVec2::splat(PLANE_MM), DVec2::ZERO)?;
        let on_plane = |uv: &DVec2| (*uv * size.as_dvec2()).extend(PLANE_MM);
        let plane: Vec<DVec3> = mesh.texture_coordinates().iter().map(on_plane).collect();
        let flat = VisibleSurface::new(mesh, &plane, &head_on);
        let seen = VisibleSurface::new(mesh, &self.vertices_camera, camera);
        let levels: Vec<MipLevel> = successors(Some(MipLevel::finest(image.clone())), MipLevel::coarser).collect();

        let mut rgb = UNSEEN.repeat(size.area());
        let mut confidence = vec![0.0; size.area()];
        for (index, (column, row)) in flat.region().pixels().enumerate() {
            let face = flat.centres().triangle(index);
            let Some((face, on_flat)) = face.and_then(|face| Some((face, flat.triangles()[face].as_ref()?))) else {
                continue;
            };
            let at = flat.centres().position(column, row);
            let weights = on_flat.barycentric(at.x, at.y);
            let corners = || mesh.faces()[face].into_iter().zip(weights);
            let point: DVec3 = corners().map(|(v, weight)| self.vertices_camera[v] * weight).sum();
            let Some((pixel, across)) = shown(&seen, face, point, size) else {
                continue;
            };
            // The level whose pixels are about as large as one of the flat print.
            let level = (1.0 / across.min(1.0)).log2() as usize;
            let color = levels[level.min(levels.len() - 1)].sample(pixel / image.size().as_dvec2());
            let place = row * size.width + column;
            rgb[3 * place..3 * place + 3].copy_from_slice(&color.map(|c| (c + 0.5) as u8));
            let hidden = corners().filter(|(v, _)| self.is_hidden.get(*v) == Some(&true));
            if hidden.map(|(_, weight)| weight).sum::<f64>() < 0.5 {
                confidence[place] = (1.0 / across.max(1.0)) as f32;
            }
        }
        let picture = Picture::new(size.width, size.height, rgb)?;
        Ok(FlatPrint { picture, confidence })
    }
}

/// Where the image shows the point of a face, and how many pixels of the flat print one of the image is across there, along the way that is
/// foreshortened most. `None` where it does not show it.
fn shown(seen: &VisibleSurface, face: usize, point: DVec3, size: ImageSize) -> Option<(DVec2, f64)> {
    let triangle = seen.triangles()[face].as_ref().filter(|triangle| triangle.front)?;
    let pixel = seen.camera().project(point)?;
    if !seen.camera().size().holds(pixel) {
        return None;
    }
    let is_before = |other: &ImageTriangle| other.depth_mm(pixel.x, pixel.y) < point.z * (1.0 - SAME_DEPTH);
    if seen.triangle_at(pixel).is_some_and(is_before) {
        return None;
    }
    let there = triangle.seen_point(pixel.x, pixel.y);
    let [right, down] = [there.duv_dx, there.duv_dy].map(|duv| duv * size.as_dvec2());
    Some((pixel, right.length().max(down.length())))
}

/// Cells of the light's grid across the print: of 1.2 mm on an upright A4 page, about as sharp as shadows are.
const COLUMNS: usize = 170;

/// Difference from the print under its light, a fraction of that light, at which a pixel counts half: what is written on the print says
/// nothing of the light.
const WRITTEN: f32 = 0.05;

/// Rounds of reweighted least squares.
const ROUNDS: usize = 3;

/// Weight of the mean light in a cell, as a fraction of what a cell of the mean print has: where a cell is black, or is not shown.
const PRIOR: f32 = 0.002;

impl FlatPrint {
    /// The same print without shading: shadows, uneven light and its colour are divided out, and what is written on the print stays.
    ///
    /// `texture` is the template's. The light is the factor, smooth over a hundredth of the width, that makes it most like what is seen, for
    /// each channel by itself (least squares, reweighted so that ink which the texture lacks does not count). Where the image shows nothing the
    /// picture stays as it is.
    #[must_use]
    pub fn without_shading(&self, texture: &Picture) -> Self {
        let size = self.picture.size();
        let halvings = (texture.width() / size.width).max(1).ilog2();
        let level = MipLevel::halved(texture.clone(), halvings);
        let drawn = |x: usize, y: usize| level.sample(DVec2::new(x as f64 + 0.5, y as f64 + 0.5) / size.as_dvec2());
        let seen = |x: usize, y: usize| self.picture.pixel(x, y).map(f32::from);
        let is_shown = |x: usize, y: usize| self.confidence.get(y * size.width + x).is_some_and(|c| *c > 0.0);

        let light_with = |weight: &dyn Fn(usize, usize) -> f32| {
            let mut sums = LightSums::new(size);
            for (x, y) in (0..size.area()).map(|place| (place % size.width, place / size.width)) {
                if is_shown(x, y) {
                    sums.add((x, y), weight(x, y), seen(x, y), drawn(x, y));
                }
            }
            sums.light()
        };
        let mut light = light_with(&|_, _| 1.0);
        for _ in 1..ROUNDS {
            light = light_with(&|x, y| robust_weight(light.at(x, y), seen(x, y), drawn(x, y)));
        }
        let even = |x: usize, y: usize| {
            let (light, seen) = (light.at(x, y), seen(x, y));
            // `as` saturates.
            [0, 1, 2].map(|k| (seen[k] / light[k]).round() as u8)
        };
        let color = |x: usize, y: usize| match is_shown(x, y) {
            true => even(x, y),
            false => self.picture.pixel(x, y),
        };
        Self {
            picture: Picture::from_fn(size.width, size.height, color),
            confidence: self.confidence.clone(),
        }
    }
}

fn robust_weight(light: [f32; 3], seen: [f32; 3], drawn: [f32; 3]) -> f32 {
    let off: f32 = (0..3).map(|k| seen[k] - light[k] * drawn[k]).sum();
    let whole: f32 = 255.0 * light.iter().sum::<f32>();
    1.0 / (1.0 + (off / (WRITTEN * whole.max(1.0))).powi(2))
}

/// What there is in each cell of a print.
struct Cells<T> {
    size: ImageSize,
    cells: ImageSize,
    values: Vec<T>,
}

/// Sums of least squares in each cell: seen times drawn, and drawn squared.
type LightSums = Cells<[[f32; 3]; 2]>;

/// The light on a print: a factor for each channel.
type Light = Cells<[f32; 3]>;

impl LightSums {
    fn new(size: ImageSize) -> Self {
        let columns = COLUMNS.min(size.width);
        let cells = ImageSize::from((columns, (columns * size.height / size.width).max(1)));
        let values = vec![[[0.0; 3]; 2]; cells.area()];
        Self { size, cells, values }
    }

    fn add(&mut self, (x, y): (usize, usize), weight: f32, seen: [f32; 3], drawn: [f32; 3]) {
        let column = x * self.cells.width / self.size.width;
        let row = y * self.cells.height / self.size.height;
        let sums = &mut self.values[row * self.cells.width + column];
        for k in 0..3 {
            sums[0][k] += weight * seen[k] * drawn[k];
            sums[1][k] += weight * drawn[k] * drawn[k];
        }
    }

    /// The light of each cell, from it and its neighbours.
    fn light(mut self) -> Light {
        let mut whole = [[0.0; 3]; 2];
        for sums in &self.values {
            add(&mut whole, sums, 1.0);
        }
        let (width, height) = (self.cells.width, self.cells.height);
        for (step, stride, count) in [(1, width, height), (width, 1, width)].repeat(2) {
            let along = self.values.len() / count;
            for line in 0..count {
                let place = |k: usize| line * stride + k * step;
                let mut before = self.values[place(0)];
                for k in 0..along {
                    let here = self.values[place(k)];
                    let after = self.values[place((k + 1).min(along - 1))];
                    let mut blurred = [[0.0; 3]; 2];
                    for (sums, share) in [(&before, 0.25), (&here, 0.5), (&after, 0.25)] {
                        add(&mut blurred, sums, share);
                    }
                    self.values[place(k)] = blurred;
                    before = here;
                }
            }
        }
        let prior = PRIOR / self.values.len() as f32;
        let light = self.values.into_iter().map(|mut sums| {
            add(&mut sums, &whole, prior);
            let [product, square] = sums;
            [0, 1, 2].map(|k| product[k] / square[k].max(f32::MIN_POSITIVE))
        });
        let (size, cells, values) = (self.size, self.cells, light.collect());
        Light { size, cells, values }
    }
}

fn add(to: &mut [[f32; 3]; 2], sums: &[[f32; 3]; 2], share: f32) {
    for (to, sums) in to.iter_mut().flatten().zip(sums.iter().flatten()) {
        *to += share * sums;
    }
}

impl Light {
    /// Between the centres of cells, bilinear.
    fn at(&self, x: usize, y: usize) -> [f32; 3] {
        let between = |at: usize, size: usize, cells: usize| {
            let at = ((at as f32 + 0.5) * cells as f32 / size as f32 - 0.5).clamp(0.0, (cells - 1) as f32);
            let low = (at as usize).min(cells.saturating_sub(2));
            (low, (low + 1).min(cells - 1), at - low as f32)
        };
        let (left, right, across) = between(x, self.size.width, self.cells.width);
        let (top, bottom, down) = between(y, self.size.height, self.cells.height);
        let cell = |column: usize, row: usize| self.values[row * self.cells.width + column];
        let rows = [top, bottom].map(|row| [cell(left, row), cell(right, row)]);
        let mix = |a: f32, b: f32, part: f32| a + part * (b - a);
        [0, 1, 2].map(|k| {
            let [above, below] = rows.map(|[left, right]| mix(left[k], right[k], across));
            mix(above, below, down)
        })
    }
}
