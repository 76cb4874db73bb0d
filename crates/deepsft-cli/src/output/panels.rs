//! The panels of picture sheets: what an estimate looks like.

use super::color_map::ColorMap;
use super::sheet::{ColorBar, Panel};
use deepsft_geometry::glam::DVec2;
use deepsft_geometry::{Camera, Maps, Picture, draw_template, metrics};

/// Squares along the shorter side of the checkerboard laid on the template.
const SQUARES: f64 = 6.0;

/// Colour of pixels without a value.
const NOTHING: [u8; 3] = [48, 48, 54];

/// Shades of grey (of 255) at which the scale of the photometric difference ends.
const MOST_DIFFERENCE: f64 = 100.0;

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
    let picture = Picture::from_fn(maps.width(), maps.height(), |x, y| {
        let (pixel, seen) = (y * maps.width() + x, image.pixel(x, y));
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
    Panel {
        title: title.to_owned(),
        picture,
        bar: None,
    }
}

/// The depth in colours, from its 2nd to its 98th percentile.
pub fn depth(title: &str, maps: &Maps) -> Panel {
    depth_within(title, maps, depth_range(maps))
}

/// The 2nd and the 98th percentile of the depth, mm, whole numbers at least 1 mm apart.
pub fn depth_range(maps: &Maps) -> [f64; 2] {
    let mut depths: Vec<f64> = (0..maps.depth().len())
        .filter(|&p| maps.inside(p))
        .map(|p| f64::from(maps.depth()[p]))
        .collect();
    depths.sort_unstable_by(f64::total_cmp);
    let percentile = |fraction: f64| {
        depths
            .get((fraction * depths.len() as f64) as usize)
            .copied()
            .unwrap_or(0.0)
    };
    let (low, high) = (percentile(0.02).floor(), percentile(0.98).ceil());
    [low, high.max(low + 1.0)]
}

/// The depth in colours over `range`, mm.
pub fn depth_within(title: &str, maps: &Maps, range: [f64; 2]) -> Panel {
    let bar = ColorBar {
        colors: ColorMap::Viridis,
        range,
        unit: "mm",
    };
    values(title, maps, bar, |pixel| {
        maps.inside(pixel).then(|| f64::from(maps.depth()[pixel]))
    })
}

/// One coordinate of the registration in colours from 0 to 1: u is 0, v is 1.
pub fn coordinate(title: &str, maps: &Maps, coordinate: usize) -> Panel {
    let bar = ColorBar {
        colors: ColorMap::Viridis,
        range: [0.0, 1.0],
        unit: "",
    };
    values(title, maps, bar, |pixel| {
        maps.inside(pixel)
            .then(|| f64::from(maps.registration()[pixel][coordinate]))
    })
}

/// I_avg of the paper: the mean of the image and of the template drawn through the registration, which is black outside
/// the mask. Where the registration is off, what is printed is seen twice.
pub fn average(title: &str, image: &Picture, texture: &Picture, maps: &Maps) -> Panel {
    let drawn = draw_template(texture, maps);
    let picture = Picture::from_fn(maps.width(), maps.height(), |x, y| {
        let (drawn, seen) = (drawn.pixel(x, y), image.pixel(x, y));
        std::array::from_fn(|k| u8::midpoint(drawn[k], seen[k]))
    });
    plain(title, &picture)
}

/// The absolute depth error in the pixels inside both masks; the scale ends at `most_mm`.
pub fn depth_error(title: &str, predicted: &Maps, truth: &Maps, most_mm: f64) -> Panel {
    let bar = ColorBar {
        colors: ColorMap::Inferno,
        range: [0.0, most_mm],
        unit: "mm",
    };
    values(title, truth, bar, |pixel| {
        let both = predicted.inside(pixel) && truth.inside(pixel);
        both.then(|| f64::from((predicted.depth()[pixel] - truth.depth()[pixel]).abs()))
    })
}

/// The registration error in mm on the template in the pixels inside both masks; the scale ends at `most_mm`.
pub fn registration_error(title: &str, predicted: &Maps, truth: &Maps, size_mm: DVec2, most_mm: f64) -> Panel {
    let bar = ColorBar {
        colors: ColorMap::Inferno,
        range: [0.0, most_mm],
        unit: "mm",
    };
    values(title, truth, bar, |pixel| {
        let both = predicted.inside(pixel) && truth.inside(pixel);
        let uv = |maps: &Maps| DVec2::from_array(maps.registration()[pixel].map(f64::from));
        both.then(|| ((uv(predicted) - uv(truth)) * size_mm).length())
    })
}

/// The registration error in pixels where it is defined: by how much an overlay is displaced; the scale ends at `most_px`.
pub fn registration_error_px(
    title: &str,
    predicted: &Maps,
    (truth, camera): (&Maps, &Camera),
    size_mm: DVec2,
    most_px: f64,
) -> Panel {
    let bar = ColorBar {
        colors: ColorMap::Inferno,
        range: [0.0, most_px],
        unit: "px",
    };
    values(title, truth, bar, |pixel| {
        metrics::registration_error_px(predicted, (truth, camera), pixel, size_mm).map(DVec2::length)
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
    let bar = ColorBar {
        colors: ColorMap::Inferno,
        range: [0.0, MOST_DIFFERENCE],
        unit: "levels",
    };
    values(title, maps, bar, |pixel| {
        let difference = |k: usize| {
            let (gain, offset) = lines[k];
            (gain * value(&drawn, pixel, k) + offset - value(image, pixel, k)).abs()
        };
        maps.inside(pixel)
            .then(|| (difference(0) + difference(1) + difference(2)) / 3.0)
    })
}

fn values(title: &str, maps: &Maps, bar: ColorBar, value: impl Fn(usize) -> Option<f64>) -> Panel {
    let picture = Picture::from_fn(maps.width(), maps.height(), |x, y| {
        value(y * maps.width() + x).map_or(NOTHING, |value| bar.color(value))
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

#[cfg(test)]
mod tests {
    use super::*;

    const SIZE: DVec2 = DVec2::new(200.0, 100.0);

    /// The left half of 200 x 100 pixels sees the left half of the sheet, one texel a pixel.
    fn half() -> Maps {
        let mut maps = Maps::empty(200, 100);
        for y in 0..100 {
            for x in 0..100 {
                maps.set(
                    y * 200 + x,
                    400.0 + x as f32,
                    [(x as f32 + 0.5) / 200.0, (y as f32 + 0.5) / 100.0],
                );
            }
        }
        maps
    }

    #[test]
    fn a_dimmed_and_tinted_photograph_of_the_template_shows_no_difference() {
        let texture = Picture::from_fn(200, 100, |x, y| [(x % 16 * 10) as u8, (y % 16 * 10) as u8, 100]);
        let image = Picture::from_fn(200, 100, |x, y| {
            let [r, g, b] = texture.pixel(x, y);
            [r / 2 + 20, g, b / 2]
        });
        let panel = photometric_difference("", &image, &texture, &half());
        // Halving loses half a level: at most half of 1/100 of the scale, so the first colours of the map.
        assert!(
            panel.picture.pixel(50, 50).iter().all(|&c| c < 8),
            "{:?}",
            panel.picture.pixel(50, 50)
        );
        assert_eq!(panel.picture.pixel(150, 50), NOTHING);
    }

    #[test]
    fn the_checkerboard_has_six_squares_along_the_short_side() {
        let panel = overlay("", &Picture::from_fn(200, 100, |_, _| [0; 3]), &half(), SIZE);
        let column: Vec<bool> = (0..100).map(|y| panel.picture.pixel(3, y) == [127; 3]).collect();
        assert_eq!(column.windows(2).filter(|pair| pair[0] != pair[1]).count(), 5);
        assert_eq!(panel.picture.pixel(150, 50), [0; 3]);
    }

    #[test]
    fn the_depth_scale_leaves_out_the_outermost_percents() {
        let bar = depth("", &half()).bar.unwrap();
        assert_eq!(bar.range, [402.0, 498.0]);
        assert_eq!(depth("", &Maps::empty(4, 4)).bar.unwrap().range, [0.0, 1.0]);
    }

    #[test]
    fn error_panels_show_the_error_in_millimetres() {
        let truth = half();
        let mut predicted = truth.clone();
        // 5 mm deeper; (3, 4) mm along the sheet.
        predicted.set(
            0,
            truth.depth()[0] + 5.0,
            [truth.registration()[0][0] + 0.015, truth.registration()[0][1] + 0.04],
        );
        let depth = depth_error("", &predicted, &truth, 10.0);
        assert_eq!(depth.picture.pixel(0, 0), ColorMap::Inferno.color(0.5));
        let registration = registration_error("", &predicted, &truth, SIZE, 10.0);
        assert_eq!(registration.picture.pixel(0, 0), ColorMap::Inferno.color(0.5));
        assert_eq!(registration.picture.pixel(1, 0), ColorMap::Inferno.color(0.0));
    }

    #[test]
    fn the_registration_error_in_pixels_is_that_of_the_metrics() {
        // At 380 mm a pixel is 1 mm for f = 380, so 200 x 100 mm fill 200 x 100 pixels; 3 px and 4 px off.
        let camera = Camera::pinhole(200, 100, 380.0, 380.0, 100.0, 50.0).unwrap();
        let (mut truth, mut predicted) = (Maps::empty(200, 100), Maps::empty(200, 100));
        for pixel in 0..200 * 100 {
            let uv = [(pixel % 200) as f32 + 0.5, (pixel / 200) as f32 + 0.5];
            truth.set(pixel, 380.0, [uv[0] / 200.0, uv[1] / 100.0]);
            predicted.set(pixel, 380.0, [(uv[0] + 3.0) / 200.0, (uv[1] + 4.0) / 100.0]);
        }
        let panel = registration_error_px("", &predicted, (&truth, &camera), SIZE, 10.0);
        let difference = |a: [u8; 3], b: [u8; 3]| (0..3).map(|k| a[k].abs_diff(b[k])).max().unwrap();
        assert!(difference(panel.picture.pixel(50, 50), ColorMap::Inferno.color(0.5)) <= 1);
        assert_eq!(
            panel.picture.pixel(0, 0),
            NOTHING,
            "a pixel at the border lacks neighbours"
        );
    }

    #[test]
    fn coordinates_go_over_the_whole_ramp_and_the_average_is_half_of_each() {
        let maps = half();
        let v = coordinate("", &maps, 1).picture;
        assert_eq!(v.pixel(7, 0), ColorMap::Viridis.color(0.005));
        assert_eq!(v.pixel(7, 99), ColorMap::Viridis.color(0.995));
        assert_eq!(v.pixel(150, 50), NOTHING);
        let [image, texture] = [[40; 3], [100; 3]].map(|color| Picture::from_fn(200, 100, |_, _| color));
        let average = average("", &image, &texture, &maps).picture;
        assert_eq!((average.pixel(50, 50), average.pixel(150, 50)), ([70; 3], [20; 3]));
    }
}
