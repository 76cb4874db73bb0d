//! What is printed on the template, as a camera sees it.

use crate::image::{GreyImage, NormalizedImage};
use crate::maps::Maps;
use crate::maps::raster::VisibleSurface;
use crate::mesh::{SurfacePoint, Template};
use crate::solver::TexturePoint;

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
    /// Draws the front of `surface`; `seen` says which pixels may be compared. Those within `margin` pixels of others are
    /// left out: there a mesh that is a little off would be compared with what lies beside the object, and creep out
    /// over it. Points stand `step` pixels apart.
    pub(crate) fn new(
        print: &Print,
        surface: &VisibleSurface,
        seen: impl Fn(usize) -> bool,
        margin: usize,
        step: usize,
    ) -> Self {
        let camera = surface.camera();
        let (width, height) = (camera.width() as usize, camera.height() as usize);
        let mut mask = vec![0.0; width * height];
        for (column, row, ..) in surface.front() {
            let pixel = row * width + column;
            if seen(pixel) {
                mask[pixel] = 1.0;
            }
        }
        erode(&mut mask, width, margin);
        let mut anchors = Vec::new();
        for (column, row, face, triangle) in surface.front() {
            let pixel = row * width + column;
            if mask[pixel] > 0.0 && column % step == step / 2 && row % step == step / 2 {
                let barycentric = triangle.barycentric(column as f64 + 0.5, row as f64 + 0.5);
                anchors.push((pixel, SurfacePoint { face, barycentric }));
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

/// Clears every pixel of a 0-or-1 mask (rows of `width`) within `margin` pixels, along rows and columns, of one that is
/// clear. The image's border does not count: what is cut off by it goes on beyond.
fn erode(mask: &mut [f32], width: usize, margin: usize) {
    if margin == 0 || width == 0 {
        return;
    }
    let height = mask.len() / width;
    let mut line = Vec::new();
    for row in mask.chunks_exact_mut(width) {
        line.clear();
        line.extend_from_slice(row);
        erode_line(&line, margin, |x| row[x] = 0.0);
    }
    for x in 0..width {
        line.clear();
        line.extend((0..height).map(|y| mask[y * width + x]));
        erode_line(&line, margin, |y| mask[y * width + x] = 0.0);
    }
}

/// Calls `clear` with every place of `line` within `margin` of a 0.
fn erode_line(line: &[f32], margin: usize, mut clear: impl FnMut(usize)) {
    for ends in [false, true] {
        let mut since = margin;
        for k in 0..line.len() {
            let at = if ends { line.len() - 1 - k } else { k };
            since = if line[at] > 0.0 { since + 1 } else { 0 };
            if since <= margin && line[at] > 0.0 {
                clear(at);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::image::Picture;

    #[test]
    fn erosion_takes_the_margin_away_but_not_at_the_images_border() {
        // Columns 2 to 9 of 10, all 6 rows but the last.
        let mut mask: Vec<f32> = (0..60).map(|i| f32::from(u8::from(i % 10 >= 2 && i < 50))).collect();
        erode(&mut mask, 10, 2);
        for (i, &m) in mask.iter().enumerate() {
            let kept = i % 10 >= 4 && i < 30;
            assert_eq!(m > 0.0, kept, "column {}, row {}", i % 10, i / 10);
        }
    }

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
