//! What is printed on the template, as a camera sees it.

use crate::raster::VisibleSurface;
use crate::solver::normalized_image::GreyImage;
use crate::solver::{NormalizedImage, SurfacePoint, TexturePoint};
use crate::{Maps, Template};

/// The template's texture in grey, with its mipmap.
pub(crate) struct Print {
    levels: Vec<Level>,
    texels_per_mm: f64,
}

struct Level {
    image: GreyImage,
    /// Texels in the print's width and height. Not the image's size where a finer level had an odd one: the texels that
    /// were left over in halving count here.
    extent: [f32; 2],
}

impl Print {
    pub(crate) fn of(template: &Template) -> Self {
        let mut texture = template.texture().clone();
        let texels_per_mm = texture.width() as f64 / template.size_mm().x;
        let mut levels = vec![Level {
            image: GreyImage::of(&texture),
            extent: [texture.width() as f32, texture.height() as f32],
        }];
        while texture.width() > 8 && texture.height() > 8 {
            texture = texture.halved();
            let [columns, rows] = levels[levels.len() - 1].extent;
            levels.push(Level {
                image: GreyImage::of(&texture),
                extent: [columns / 2.0, rows / 2.0],
            });
        }
        Self { levels, texels_per_mm }
    }

    /// The print as `maps` place it in an image with this focal length (pixels), where `mask` is 1; 0 elsewhere.
    pub(crate) fn drawn(&self, maps: &Maps, mask: &[f32], focal: f64) -> GreyImage {
        let seen = || mask.iter().zip(maps.depth()).filter(|(m, _)| **m > 0.0);
        let depth = seen().map(|(_, d)| f64::from(*d)).sum::<f64>() / seen().count().max(1) as f64;
        let level = self.level(depth, focal);
        let value = |(&m, &[u, v]): (&f32, &[f32; 2])| if m > 0.0 { level.sample(u, v) } else { 0.0 };
        GreyImage {
            width: maps.width(),
            height: maps.height(),
            values: mask.iter().zip(maps.registration()).map(value).collect(),
        }
    }

    /// The level of the mipmap with at most about one texel a pixel on a frontal sheet at this depth (mm).
    fn level(&self, depth: f64, focal: f64) -> &Level {
        let texels_a_pixel = self.texels_per_mm * depth / focal;
        let level = texels_a_pixel.max(1.0).log2().round() as usize;
        &self.levels[level.min(self.levels.len() - 1)]
    }
}

impl Level {
    /// Bilinear value at texture position (u, v); edges are repeated.
    fn sample(&self, u: f32, v: f32) -> f32 {
        let (image, [columns, rows]) = (&self.image, self.extent);
        let x = (u * columns - 0.5).clamp(0.0, (image.width - 1) as f32);
        let y = (v * rows - 0.5).clamp(0.0, (image.height - 1) as f32);
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Picture;

    #[test]
    fn an_edge_stays_where_it_is_on_every_level_also_of_an_odd_size() {
        // Black up to u = 0.8. A level of 46.4 texels that is taken for one of 46 has its edge 0.3 texels off.
        let texture = Picture::from_fn(1485, 1050, |x, _| [if x < 1188 { 0 } else { 255 }; 3]);
        let print = Print::of(&Template::thin_shell(texture, 297.0, 210.0).unwrap());
        for level in &print.levels[..6] {
            let mut u = 0.0;
            while level.sample(u, 0.5) < 127.5 {
                u += 1e-4;
            }
            let off = (u - 0.8) * level.extent[0];
            // An edge within a texel makes it grey: interpolation finds the edge to a quarter of a texel.
            assert!(off.abs() < 0.26, "{off} texels of {}", level.extent[0]);
        }
    }
}
