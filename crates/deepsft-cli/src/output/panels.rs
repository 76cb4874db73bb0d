//! The panels of picture sheets: what an estimate looks like.

use super::color_map::ColorMap;
use super::sheet::{ColorBar, Panel};
use deepsft_geometry::glam::DVec2;
use deepsft_geometry::metrics::RestShape;
use deepsft_geometry::raster::VisibleSurface;
use deepsft_geometry::{Camera, Maps, Picture, Surface, TriangleMesh, draw_template, metrics};

/// Squares along the shorter side of the checkerboard laid on the template.
const SQUARES: f64 = 6.0;

/// Colour of pixels without a value.
const NOTHING: [u8; 3] = [48, 48, 54];

/// Shades of grey (of 255) at which the scale of the photometric difference ends.
const MAX_DIFFERENCE: f64 = 100.0;

/// A picture as it is.
pub fn plain(title: &str, picture: &Picture) -> Panel {
    Panel {
        title: title.to_owned(),
        picture: picture.clone(),
        bar: None,
    }
}

/// `image` with a checkerboard that is glued to the template: white squares, and squares whose red grows
/// with u and green with v. The shading of the image shows through.
pub fn overlay(title: &str, image: &Picture, maps: &Maps, template_size_mm: DVec2) -> Panel {
    let squares = template_size_mm * (SQUARES / template_size_mm.min_element());
    let picture = Picture::from_fn(maps.size().width, maps.size().height, |x, y| {
        let (pixel, seen) = (y * maps.size().width + x, image.pixel(x, y));
        if !maps.inside(pixel) {
            return seen.map(|c| c / 2);
        }
        let [u, v] = maps.registration()[pixel].map(f64::from);
        let white = ((u * squares.x).floor() + (v * squares.y).floor()).rem_euclid(2.0) < 1.0;
        let paint = if white {
            [255; 3]
        } else {
            [(u * 255.0) as u8, (v * 255.0) as u8, 160]
        };
        std::array::from_fn(|k| ((u16::from(seen[k]) + u16::from(paint[k])) / 2) as u8)
    });
    plain(title, &picture)
}

/// The depth in colours, from its 2nd to its 98th percentile.
pub fn depth(title: &str, maps: &Maps) -> Panel {
    depth_within(title, maps, depth_range(maps))
}

/// The 2nd and the 98th percentile of the depth, mm, whole numbers at least 1 mm apart.
pub fn depth_range(maps: &Maps) -> [f64; 2] {
    let inside = (0..maps.depth().len()).filter(|&p| maps.inside(p));
    let mut depths: Vec<f64> = inside.map(|p| f64::from(maps.depth()[p])).collect();
    depths.sort_unstable_by(f64::total_cmp);
    let at = |fraction: f64| (fraction * depths.len() as f64) as usize;
    let percentile = |fraction| depths.get(at(fraction)).copied().unwrap_or(0.0);
    let (low, high) = (percentile(0.02).floor(), percentile(0.98).ceil());
    [low, high.max(low + 1.0)]
}

/// The depth in colours over `range`, mm.
pub fn depth_within(title: &str, maps: &Maps, range: [f64; 2]) -> Panel {
    values(title, maps, bar(ColorMap::Viridis, range, "mm"), |pixel| {
        maps.inside(pixel).then(|| f64::from(maps.depth()[pixel]))
    })
}

/// The standard deviations of a surface where its camera sees it, from 0 to the 95th percentile of its vertices. `template`: the mesh at
/// rest.
pub fn deviation(title: &str, surface: &Surface, template: &TriangleMesh) -> Panel {
    let visible = VisibleSurface::new(template, &surface.vertices_camera, &surface.camera);
    let maps = visible.maps();
    let mut seen = vec![0.0; maps.depth().len()];
    for (column, row, face, triangle) in visible.front() {
        let at = visible.centres().position(column, row);
        let corners = template.faces()[face].into_iter().zip(triangle.barycentric(at.x, at.y));
        let weighted = corners.map(|(vertex, weight)| weight * f64::from(surface.deviations[vertex]));
        seen[row * maps.size().width + column] = weighted.sum();
    }
    let mut sorted = surface.deviations.clone();
    sorted.sort_unstable_by(f32::total_cmp);
    let most = sorted
        .get(sorted.len() * 95 / 100)
        .map_or(1.0, |most| f64::from(*most).ceil().max(1.0));
    values(title, &maps, bar(ColorMap::Inferno, [0.0, most], "mm"), |pixel| {
        maps.inside(pixel).then_some(seen[pixel])
    })
}

/// One coordinate of the registration in colours from 0 to 1: u is 0, v is 1.
pub fn coordinate(title: &str, maps: &Maps, coordinate: usize) -> Panel {
    values(title, maps, bar(ColorMap::Viridis, [0.0, 1.0], ""), |pixel| {
        maps.inside(pixel)
            .then(|| f64::from(maps.registration()[pixel][coordinate]))
    })
}

/// I_avg of the paper: the mean of the image and of the template drawn through the registration, which is black outside
/// the mask. Where the registration is off, what is printed is seen twice.
pub fn average(title: &str, image: &Picture, texture: &Picture, maps: &Maps) -> Panel {
    let drawn = draw_template(texture, maps);
    let picture = Picture::from_fn(maps.size().width, maps.size().height, |x, y| {
        let (drawn, seen) = (drawn.pixel(x, y), image.pixel(x, y));
        std::array::from_fn(|k| u8::midpoint(drawn[k], seen[k]))
    });
    plain(title, &picture)
}

/// The absolute depth error in the pixels inside both masks; the scale ends at `max_mm`.
pub fn depth_error(title: &str, predicted: &Maps, truth: &Maps, max_mm: f64) -> Panel {
    values(title, truth, bar(ColorMap::Inferno, [0.0, max_mm], "mm"), |pixel| {
        let both = predicted.inside(pixel) && truth.inside(pixel);
        both.then(|| f64::from((predicted.depth()[pixel] - truth.depth()[pixel]).abs()))
    })
}

/// The registration error in pixels where it is defined: by how much an overlay is displaced; the scale ends at `max_px`.
pub fn registration_error_px(
    title: &str,
    predicted: &Maps,
    truth: &Maps,
    camera: &Camera,
    rest: RestShape<'_>,
    max_px: f64,
) -> Panel {
    values(title, truth, bar(ColorMap::Inferno, [0.0, max_px], "px"), |pixel| {
        metrics::registration_error_px(predicted, truth, camera, pixel, rest).map(DVec2::length)
    })
}

/// How far `image` is from the template drawn through the registration, mean over the three colours,
/// after the drawn colours got the gain and the offset that fit best (the light is not known).
pub fn photometric_difference(title: &str, image: &Picture, texture: &Picture, maps: &Maps) -> Panel {
    let drawn = draw_template(texture, maps);
    let inside: Vec<usize> = (0..maps.depth().len()).filter(|&pixel| maps.inside(pixel)).collect();
    let value = |picture: &Picture, pixel: usize, k: usize| f64::from(picture.rgb()[3 * pixel + k]);
    let lines: [(f64, f64); 3] =
        std::array::from_fn(|k| fitted_line(inside.iter().map(|&p| (value(&drawn, p, k), value(image, p, k)))));
    let scale = bar(ColorMap::Inferno, [0.0, MAX_DIFFERENCE], "levels");
    values(title, maps, scale, |pixel| {
        let difference = |k: usize| {
            let (gain, offset) = lines[k];
            (gain * value(&drawn, pixel, k) + offset - value(image, pixel, k)).abs()
        };
        let mean = || (difference(0) + difference(1) + difference(2)) / 3.0;
        maps.inside(pixel).then(mean)
    })
}

fn bar(colors: ColorMap, range: [f64; 2], unit: &'static str) -> ColorBar {
    ColorBar { colors, range, unit }
}

/// A panel of the `value` of each pixel, in the colours of `bar`.
fn values(title: &str, maps: &Maps, bar: ColorBar, value: impl Fn(usize) -> Option<f64>) -> Panel {
    let picture = Picture::from_fn(maps.size().width, maps.size().height, |x, y| {
        value(y * maps.size().width + x).map_or(NOTHING, |value| bar.color(value))
    });
    Panel {
        title: title.to_owned(),
        picture,
        bar: Some(bar),
    }
}

/// Gain and offset of the least-squares line y = gain x + offset; gain 0 when x does not vary.
fn fitted_line(points: impl Iterator<Item = (f64, f64)> + Clone) -> (f64, f64) {
    let (mut n, mut sum_x, mut sum_y) = (0.0, 0.0, 0.0);
    for (x, y) in points.clone() {
        (n, sum_x, sum_y) = (n + 1.0, sum_x + x, sum_y + y);
    }
    let (mean_x, mean_y) = (sum_x / f64::max(n, 1.0), sum_y / f64::max(n, 1.0));
    let (mut variance, mut covariance) = (0.0, 0.0);
    for (x, y) in points {
        variance += (x - mean_x) * (x - mean_x);
        covariance += (x - mean_x) * (y - mean_y);
    }
    let gain = if variance > 0.0 { covariance / variance } else { 0.0 };
    (gain, mean_y - gain * mean_x)
}
