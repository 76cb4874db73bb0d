//! What is printed on the template, as a camera sees it.

use crate::raster::VisibleSurface;
use crate::solver::normalized_image::GreyImage;
use crate::solver::{NormalizedImage, SurfacePoint, TexturePoint};
use crate::{Maps, Template};

/// The template's texture in grey, with its mipmap.
pub(crate) struct Print {
    levels: Vec<GreyImage>,
    texels_per_mm: f64,
}

impl Print {
    pub(crate) fn of(template: &Template) -> Self {
        let mut level = template.texture().clone();
        let mut levels = vec![GreyImage::of(&level)];
        while level.width() > 8 && level.height() > 8 {
            level = level.halved();
            levels.push(GreyImage::of(&level));
        }
        Self {
            texels_per_mm: levels[0].width as f64 / template.size_mm().x,
            levels,
        }
    }

    /// The print as `maps` place it in an image with this focal length (pixels), where `mask` is 1; 0 elsewhere.
    pub(crate) fn drawn(&self, maps: &Maps, mask: &[f32], focal: f64) -> GreyImage {
        let seen = || mask.iter().zip(maps.depth()).filter(|(m, _)| **m > 0.0);
        let depth = seen().map(|(_, d)| f64::from(*d)).sum::<f64>() / seen().count().max(1) as f64;
        let level = self.level(depth, focal);
        let value = |(&m, &[u, v]): (&f32, &[f32; 2])| if m > 0.0 { sample(level, u, v) } else { 0.0 };
        GreyImage {
            width: maps.width(),
            height: maps.height(),
            values: mask.iter().zip(maps.registration()).map(value).collect(),
        }
    }

    /// The level of the mipmap with at most about one texel a pixel on a frontal sheet at this depth (mm).
    fn level(&self, depth: f64, focal: f64) -> &GreyImage {
        let texels_a_pixel = self.texels_per_mm * depth / focal;
        let level = texels_a_pixel.max(1.0).log2().round() as usize;
        &self.levels[level.min(self.levels.len() - 1)]
    }
}

/// Bilinear value of a grey image at texture position (u, v).
fn sample(image: &GreyImage, u: f32, v: f32) -> f32 {
    let x = (u * image.width as f32 - 0.5).clamp(0.0, (image.width - 1) as f32);
    let y = (v * image.height as f32 - 0.5).clamp(0.0, (image.height - 1) as f32);
    let (column, row) = (x as usize, y as usize);
    let (a, b) = (x - column as f32, y - row as f32);
    let right = (column + 1).min(image.width - 1);
    let below = (row + 1).min(image.height - 1) * image.width;
    let row = row * image.width;
    let value = |i: usize| image.values[i];
    let top = value(row + column) * (1.0 - a) + value(row + right) * a;
    let bottom = value(below + column) * (1.0 - a) + value(below + right) * a;
    top * (1.0 - b) + bottom * b
}

/// A mesh drawn with its print, and the points of it that are compared with the image.
pub(crate) struct Drawing {
    pub(crate) print: GreyImage,
    /// 1 where the mesh is seen and may be compared.
    pub(crate) mask: Vec<f32>,
    /// Pixel, and point of the mesh that it shows.
    anchors: Vec<(usize, SurfacePoint)>,
}

impl Drawing {
    /// Draws the front of `surface`; `seen` says which pixels may be compared. Points stand `step` pixels apart.
    pub(crate) fn new(print: &Print, surface: &VisibleSurface, seen: impl Fn(usize) -> bool, step: usize) -> Self {
        let camera = surface.camera();
        let (width, height) = (camera.width() as usize, camera.height() as usize);
        let mut mask = vec![0.0; width * height];
        let mut anchors = Vec::new();
        for (column, row, face, triangle) in surface.front() {
            let pixel = row * width + column;
            if seen(pixel) {
                mask[pixel] = 1.0;
                if column % step == step / 2 && row % step == step / 2 {
                    let barycentric = triangle.barycentric(column as f64 + 0.5, row as f64 + 0.5);
                    anchors.push((pixel, SurfacePoint { face, barycentric }));
                }
            }
        }
        let print = print.drawn(&surface.maps(), &mask, camera.focal().x);
        Self { print, mask, anchors }
    }

    /// The photometric points with what the normalised print shows there.
    pub(crate) fn points(&self, print: &NormalizedImage) -> Vec<TexturePoint> {
        let point = |&(pixel, point): &(usize, SurfacePoint)| TexturePoint {
            point,
            value: print.pixel(pixel),
        };
        self.anchors.iter().map(point).collect()
    }
}
