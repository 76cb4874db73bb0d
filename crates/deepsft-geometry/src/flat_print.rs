//! The photographed print, laid flat.

use crate::camera::Camera;
use crate::error::{GeometryError, check_size};
use crate::image::{ImageSize, MipLevel, Picture};
use crate::maps::raster::VisibleSurface;
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
    /// Of every [`FlatMedian::every`]th frame.
    prints: Vec<FlatPrint>,
    frames: usize,
    doubled: u32,
}

impl FlatMedian {
    /// One frame of so many is kept: all of a short video, later fewer, spread over all of it.
    fn every(&self) -> usize {
        1 << self.doubled
    }

    /// Takes the next frame. `flatten` is called for those that are kept; they must be flat prints of one size.
    ///
    /// # Errors
    /// Those of `flatten`, [`GeometryError::MapSize`] for a print of another size than those before.
    pub fn add(&mut self, flatten: impl FnOnce() -> Result<FlatPrint, GeometryError>) -> Result<(), GeometryError> {
        let frame = self.frames;
        self.frames += 1;
        if !frame.is_multiple_of(self.every()) {
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
            self.doubled += 1;
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
        let (actual, expected) = (self.vertices_camera.len(), mesh.vertices().len());
        if actual != expected {
            return Err(GeometryError::StartLength { actual, expected });
        }
        let head_on = Camera::pinhole(size, DVec2::splat(PLANE_MM), DVec2::ZERO)?;
        let on_plane = |uv: &DVec2| (*uv * size.as_dvec2()).extend(PLANE_MM);
        let plane: Vec<DVec3> = mesh.texture_coordinates().iter().map(on_plane).collect();
        let flat = VisibleSurface::new(mesh, &plane, &head_on);
        let seen = VisibleSurface::new(mesh, &self.vertices_camera, camera);
        let levels: Vec<MipLevel> = successors(Some(MipLevel::finest(image.clone())), MipLevel::coarser).collect();

        let mut rgb = UNSEEN.repeat(size.area());
        let mut confidence = vec![0.0; size.area()];
        for (index, (column, row)) in flat.region().pixels().enumerate() {
            let Some(face) = flat.centres().triangle(index) else {
                continue;
            };
            let Some(on_flat) = &flat.triangles()[face] else {
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
    let nearest = seen
        .triangle_at(pixel)
        .and_then(|nearest| seen.triangles()[nearest].as_ref());
    if nearest.is_some_and(|nearest| nearest.depth_mm(pixel.x, pixel.y) < point.z * (1.0 - SAME_DEPTH)) {
        return None;
    }
    let there = triangle.seen_point(pixel.x, pixel.y);
    let [right, down] = [there.duv_dx, there.duv_dy].map(|duv| duv * size.as_dvec2());
    Some((pixel, right.length().max(down.length())))
}
