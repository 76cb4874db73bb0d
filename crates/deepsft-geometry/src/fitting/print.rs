//! What is printed on the template, as a camera sees it.

use crate::image::{GreyImage, GreyMipmap, NormalizedImage};
use crate::maps::raster::VisibleSurface;
use crate::maps::{Maps, erode};
use crate::mesh::{SurfacePoint, Template};
use crate::solver::TexturePoint;

/// The mipmap ends where the shorter side has this many texels.
const SHORTEST_SIDE: usize = 8;

/// The template's texture in grey, with its mipmap.
pub(crate) struct Print {
    mipmap: GreyMipmap,
    texels_per_mm: f64,
}

impl Print {
    pub(crate) fn of(template: &Template) -> Self {
        let texture = template.texture();
        Self {
            mipmap: GreyMipmap::new(texture, SHORTEST_SIDE),
            texels_per_mm: texture.width() as f64 / template.size_mm().x,
        }
    }

    /// The print as `maps` place it in an image with this focal length (pixels), where `mask` is 1; 0 elsewhere.
    pub(crate) fn drawn(&self, maps: &Maps, mask: &[f32], focal: f64) -> GreyImage {
        let seen = || mask.iter().zip(maps.depth()).filter(|(m, _)| **m > 0.0);
        let depth = seen().map(|(_, d)| f64::from(*d)).sum::<f64>() / seen().count().max(1) as f64;
        // At most about one texel per pixel on a frontal sheet at this depth.
        let texels_per_pixel = self.texels_per_mm * depth / focal;
        let level = self.mipmap.level(texels_per_pixel.max(1.0).log2().round() as usize);
        let value = |(&m, &uv): (&f32, &[f32; 2])| if m > 0.0 { level.sample(uv) } else { 0.0 };
        GreyImage {
            width: maps.width(),
            height: maps.height(),
            values: mask.iter().zip(maps.registration()).map(value).collect(),
        }
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

    /// The photo-consistency points with what the normalised print shows there.
    pub(crate) fn points(&self, print: &NormalizedImage) -> Vec<TexturePoint> {
        let point = |&(pixel, point): &(usize, SurfacePoint)| TexturePoint {
            point,
            value: print.pixel(pixel),
        };
        self.anchors.iter().map(point).collect()
    }
}
