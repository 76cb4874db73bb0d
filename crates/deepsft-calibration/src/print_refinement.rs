//! The exact positions of a flat print's places in a photograph: small pieces of the print, laid where the matches around them say,
//! and moved until they agree with the image (Lucas and Kanade).

use crate::correspondence::Correspondence;
use deepsft_geometry::glam::{DMat2, DVec2};
use deepsft_geometry::{Picture, Template};

/// Places along the print's longer side.
const PLACES: f64 = 24.0;

/// Matches that say where a place is about.
const NEIGHBOURS: usize = 40;

/// Half the side of a piece, pixels.
const RADIUS: i32 = 8;

/// Farther than this from where the neighbours say a piece has found something else, pixels.
const FARTHEST_PX: f64 = 3.0;

/// Least correlation with the image.
const MIN_CORRELATION: f64 = 0.9;

/// Least mean square slope of a piece in its flattest direction, standard deviations per pixel: flatter pieces slide.
const MIN_SLOPE: f64 = 0.02;

/// Refines the correspondences of a flat print and a photograph to a fraction of a pixel, on a grid of points. The `matches` are less exact and
/// may be wrong.
pub fn refine_print(template: &Template, photograph: &Picture, matches: &[Correspondence]) -> Vec<Correspondence> {
    if matches.len() < NEIGHBOURS {
        return Vec::new();
    }
    let size = template.size_mm();
    let spacing = size.max_element() / PLACES;
    let (columns, rows) = ((size.x / spacing) as usize, (size.y / spacing) as usize);
    let places = (0..columns * rows).map(|k| (DVec2::new((k % columns) as f64, (k / columns) as f64) + 0.5) * spacing);
    let texels = template.texture().width() as f64 / size.x;
    let print = |place: DVec2| grey(template.texture(), place * texels);
    let refined = |place_mm| {
        let (pixel, slope) = local_map(matches, place_mm)?;
        let pixel = aligned(&print, photograph, place_mm, pixel, slope.inverse())?;
        Some(Correspondence { place_mm, pixel })
    };
    places.filter_map(refined).collect()
}

/// Where `place` is in the image and how its neighbourhood lies there (pixels per mm): the affine map of the nearest matches, the worse half
/// of them left out.
fn local_map(matches: &[Correspondence], place: DVec2) -> Option<(DVec2, DMat2)> {
    let mut near: Vec<_> = matches.iter().map(|m| (m.place_mm - place, m.pixel)).collect();
    near.select_nth_unstable_by(NEIGHBOURS - 1, |a, b| {
        a.0.length_squared().total_cmp(&b.0.length_squared())
    });
    near.truncate(NEIGHBOURS);
    let mut map = affine(&near)?;
    for _ in 0..2 {
        let error = |(p, pixel): &(DVec2, DVec2)| (map.0 + map.1 * *p).distance_squared(*pixel);
        near.sort_by(|a, b| error(a).total_cmp(&error(b)));
        map = affine(&near[..NEIGHBOURS / 2])?;
    }
    (map.1.determinant() > 0.0).then_some(map)
}

fn affine(pairs: &[(DVec2, DVec2)]) -> Option<(DVec2, DMat2)> {
    let count = pairs.len() as f64;
    let (from, to) = pairs.iter().fold((DVec2::ZERO, DVec2::ZERO), |(a, b), (p, q)| {
        (a + p / count, b + q / count)
    });
    let (mut spread, mut together) = (DMat2::ZERO, DMat2::ZERO);
    for (p, q) in pairs {
        let (p, q) = (p - from, q - to);
        spread += DMat2::from_cols(p * p.x, p * p.y);
        together += DMat2::from_cols(q * p.x, q * p.y);
    }
    let slope = together * spread.inverse();
    slope.is_finite().then(|| (to - slope * from, slope))
}

/// Where the piece of the print around `place` lies in the photograph, from `pixel` on; `None` where it is flat, hidden or elsewhere.
fn aligned(
    print: &impl Fn(DVec2) -> f64,
    photograph: &Picture,
    place: DVec2,
    pixel: DVec2,
    mm_per_pixel: DMat2,
) -> Option<DVec2> {
    let offsets: Vec<DVec2> = (-RADIUS..=RADIUS)
        .flat_map(|y| (-RADIUS..=RADIUS).map(move |x| DVec2::new(f64::from(x), f64::from(y))))
        .collect();
    // What a pixel sees: the mean over its area.
    let seen = |offset: DVec2| {
        let corners = [[-0.25, -0.25], [0.25, -0.25], [-0.25, 0.25], [0.25, 0.25]].map(DVec2::from);
        let at = |corner: DVec2| print(place + mm_per_pixel * (offset + corner));
        corners.into_iter().map(at).sum::<f64>() / 4.0
    };
    let (piece, deviation) = normalised(offsets.iter().map(|o| seen(*o)))?;
    let along = |o: DVec2, axis: DVec2| seen(o + axis) - seen(o - axis);
    let slope = |o: &DVec2| DVec2::new(along(*o, DVec2::X), along(*o, DVec2::Y)) / (2.0 * deviation);
    let slopes: Vec<DVec2> = offsets.iter().map(slope).collect();
    let squares = slopes.iter().map(|s| DMat2::from_cols(*s * s.x, *s * s.y));
    let matrix = squares.fold(DMat2::ZERO, |sum, square| sum + square);
    let (half_trace, determinant) = ((matrix.x_axis.x + matrix.y_axis.y) / 2.0, matrix.determinant());
    let flattest = half_trace - (half_trace * half_trace - determinant).max(0.0).sqrt();
    if flattest < MIN_SLOPE * offsets.len() as f64 {
        return None;
    }
    let inverse = matrix.inverse();
    let mut at = pixel;
    let margin = f64::from(RADIUS + 1);
    let limit = photograph.size().as_dvec2() - margin;
    for _ in 0..30 {
        if at.cmplt(DVec2::splat(margin)).any() || at.cmpgt(limit).any() || at.distance(pixel) > FARTHEST_PX {
            return None;
        }
        let (image, _) = normalised(offsets.iter().map(|o| grey(photograph, at + o)))?;
        let pulls = slopes.iter().zip(image.iter().zip(&piece));
        let step = -(inverse * pulls.map(|(slope, (a, b))| *slope * (a - b)).sum::<DVec2>());
        at += step;
        if step.length() < 0.003 {
            let correlation = image.iter().zip(&piece).map(|(a, b)| a * b).sum::<f64>() / offsets.len() as f64;
            return (correlation >= MIN_CORRELATION).then_some(at);
        }
    }
    None
}

/// Values with a mean of 0 and a deviation of 1, and their deviation before; `None` where all are alike.
fn normalised(values: impl Iterator<Item = f64>) -> Option<(Vec<f64>, f64)> {
    let mut values: Vec<f64> = values.collect();
    let count = values.len() as f64;
    let mean = values.iter().sum::<f64>() / count;
    let deviation = (values.iter().map(|v| (v - mean).powi(2)).sum::<f64>() / count).sqrt();
    values.iter_mut().for_each(|v| *v = (*v - mean) / deviation);
    (deviation > 4.0).then_some((values, deviation))
}

fn grey(picture: &Picture, at: DVec2) -> f64 {
    let [r, g, b] = picture.sample(at.x, at.y).map(f64::from);
    0.299 * r + 0.587 * g + 0.114 * b
}
