//! What is printed on the template, as a camera sees it.

use crate::image::{ContrastNormalizedImage, GreyMipmap, Region};
use crate::maps::raster::VisibleSurface;
use crate::maps::{Maps, erode};
use crate::mesh::{SurfacePoint, Template};
use crate::solver::TexturePoint;

/// The mipmap ends where the shorter side has this many texels.
const SHORTEST_SIDE: usize = 8;

/// The template's texture in grey, with its mipmap.
#[derive(Debug)]
pub(crate) struct Print {
    mipmap: GreyMipmap,
    pub(super) texels_per_mm: f64,
}

impl Print {
    pub(crate) fn of(template: &Template) -> Self {
        let texture = template.texture();
        Self {
            mipmap: GreyMipmap::new(texture, SHORTEST_SIDE),
            texels_per_mm: texture.width() as f64 / template.size_mm().x,
        }
    }

    /// The print as an image with this focal length (pixels) shows it at a `depth` (mm), where a pixel has a texture position; 0
    /// elsewhere.
    pub(crate) fn drawn(&self, uvs: &[Option<[f32; 2]>], depth: f64, focal: f64) -> Vec<f32> {
        // At most about one texel per pixel on a frontal sheet at this depth.
        let texels_per_pixel = self.texels_per_mm * depth / focal;
        let level = self.mipmap.level(texels_per_pixel.max(1.0).log2().round() as usize);
        uvs.iter().map(|uv| uv.map_or(0.0, |uv| level.sample(uv))).collect()
    }
}

/// A mesh drawn with its print, and the points of it that are compared with the image.
pub(crate) struct Drawing {
    /// The rectangle of the image that was drawn.
    pub(crate) region: Region,
    /// Of the pixels of the region: what is printed there.
    pub(crate) print: Vec<f32>,
    /// 1 where the mesh is seen and may be compared.
    pub(crate) mask: Vec<f32>,
    /// Index of a pixel of the region, and point of the mesh that it shows. Points of a face follow each other.
    anchors: Vec<(usize, SurfacePoint)>,
}

impl Drawing {
    /// Draws the front of `surface` and `border` pixels around it, as far as the image is `shown`; only pixels in the mask of `seen` may be
    /// compared, if it is given. Those within `margin` pixels of others are left out: there a mesh that is a little off would be compared
    /// with what lies beside the object, and creep out over it. Points stand `step` pixels apart; without it there are none.
    pub(crate) fn new(
        print: &Print,
        surface: &VisibleSurface,
        (shown, seen): (&Region, Option<&Maps>),
        (border, margin): (usize, usize),
        step: Option<usize>,
    ) -> Self {
        let camera = surface.camera();
        // The pixel beside the mesh's region says that there the mesh ends.
        let region = surface.region().grown(border.max(1), shown);
        let is_seen = |column: usize, row: usize| seen.is_none_or(|maps| maps.inside(row * maps.size().width + column));
        let mut mask = vec![0.0; region.area()];
        for (column, row, ..) in surface.front() {
            if let Some(pixel) = region.index(column, row).filter(|_| is_seen(column, row)) {
                mask[pixel] = 1.0;
            }
        }
        erode(&mut mask, region.width, margin);
        let (mut uvs, mut anchors) = (vec![None; region.area()], Vec::new());
        let (mut depths_mm, mut count) = (0.0, 0_usize);
        for (column, row, face, triangle) in surface.front() {
            let Some(pixel) = region.index(column, row).filter(|&pixel| mask[pixel] > 0.0) else {
                continue;
            };
            let (x, y) = (column as f64 + 0.5, row as f64 + 0.5);
            let point = triangle.seen_point(x, y);
            uvs[pixel] = Some(point.uv.as_vec2().to_array());
            depths_mm += point.depth_mm;
            count += 1;
            if step.is_some_and(|step| column % step == step / 2 && row % step == step / 2) {
                let barycentric = triangle.barycentric(x, y);
                anchors.push((pixel, SurfacePoint { face, barycentric }));
            }
        }
        anchors.sort_by_key(|(_, point)| point.face);
        Self {
            print: print.drawn(&uvs, depths_mm / count.max(1) as f64, camera.focal().x),
            region,
            mask,
            anchors,
        }
    }

    /// The photo-consistency points with what the normalised print shows there.
    pub(crate) fn points(&self, print: &ContrastNormalizedImage) -> Vec<TexturePoint> {
        let point = |&(pixel, point): &(usize, SurfacePoint)| TexturePoint {
            point,
            value: f64::from(print.values[pixel]),
        };
        self.anchors.iter().map(point).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::camera::training_camera;
    use crate::image::{ContrastNormalizer, GreyImage, Picture};
    use glam::DVec3;

    #[test]
    fn the_part_around_a_mesh_is_drawn_and_normalised_as_in_the_whole_image() {
        let texture = Picture::from_fn(300, 200, |x, y| [((x * x + 31 * y) % 251) as u8; 3]);
        let template = Template::thin_shell(texture, 297.0, 210.0).unwrap();
        let camera = training_camera();
        // Beyond the image's left border, and bent.
        let place = |p: &DVec3| DVec3::new(p.x - 250.0, p.y + 20.0, 600.0 + 0.002 * p.x * p.x);
        let vertices: Vec<_> = template.mesh().vertices().iter().map(place).collect();
        let surface = VisibleSurface::new(template.mesh(), &vertices, &camera);
        let print = Print::of(&template);
        let picture = Picture::from_fn(480, 270, |x, y| [((7 * x + y * y) % 249) as u8; 3]);
        let (grey, blur) = (GreyImage::of(&picture), 1.5);
        let mut seen = surface.maps();
        (0..270).for_each(|y| (0..=10).for_each(|x| seen.clear(480 * y + x)));
        let drawn = |border: usize| {
            let whole = Region::whole(camera.size());
            let drawing = Drawing::new(&print, &surface, (&whole, Some(&seen)), (border, 3), Some(3));
            let normalizer = ContrastNormalizer::new(drawing.mask.clone(), drawing.region, camera.size(), blur, 8.0);
            let image = normalizer.normalize(drawing.region.of(&grey));
            let points = drawing.points(&normalizer.normalize(drawing.print.iter().copied()));
            (drawing, image, points)
        };
        let (part, image, points) = drawn(ContrastNormalizer::reach(blur));
        let (whole, whole_image, whole_points) = drawn(480);
        assert!(whole.region.area() == 480 * 270 && part.region.area() < 480 * 270 / 3 && points.len() > 500);
        for (index, (column, row)) in whole.region.pixels().enumerate() {
            let in_part = part.region.index(column, row);
            let in_part = in_part.map_or((0.0, 0.0), |index| (part.mask[index], part.print[index]));
            let in_whole = (whole.mask[index], whole.print[index]);
            assert_eq!(in_part, in_whole, "{column}, {row}");
        }
        for (a, b) in points.iter().zip(&whole_points) {
            assert_eq!(a.point, b.point);
            // Mean and contrast are taken on cells that begin elsewhere.
            assert!((a.value - b.value).abs() < 0.2, "{} {}", a.value, b.value);
            let position = a.point.position(template.mesh().faces(), &vertices);
            let pixel = camera.project(position).unwrap();
            let seen = [&image, &whole_image].map(|image| image.sample(pixel).unwrap().0);
            assert!((seen[0] - seen[1]).abs() < 0.2, "{seen:?}");
        }
    }
}
