//! The colours of a scan in a new texture.

use super::atlas::{Corners, LONGEST_SIDE, packed};
use super::charts::{Chart, charts};
use super::mending::bits;
use super::surface::{Surface, Vertex};
use super::{Wrap, refused};
use crate::error::FormatError;
use deepsft_geometry::glam::{DVec2, DVec3};
use deepsft_geometry::{Picture, TriangleMesh, rows_within, texture_barycentric};
use std::array::from_fn;
use std::borrow::Cow;
use std::collections::HashMap;
use std::iter::successors;

/// Texels between two charts; each continues over half of them. The smaller ones where there is no room.
const GAPS: [usize; 3] = [12, 6, 2];

/// How often the charts are made smaller with one gap, and with the last one, by which factor.
const TRIES: [usize; 2] = [5, 300];
const SMALLER: f64 = 0.93;

/// Shortest side of a texture that is full, texels.
const SHORTEST_SIDE: f64 = 256.0;

/// The fraction of the surface whose texels are no larger than in the file, if there is room.
const KEPT: f64 = 0.9;

/// Texels from vertex to vertex of faces whose vertices have colours.
const TEXELS_PER_EDGE: f64 = 2.0;

/// The mesh of a surface whose charts are laid out anew, and the texture with its colours.
pub(super) fn baked(surface: &Surface, textures: &[Picture]) -> Result<(TriangleMesh, Picture), FormatError> {
    let areas = (0..surface.faces.len()).map(|face| surface.normal(face).length() / 2.0);
    let area: f64 = areas.sum();
    let brush = Brush::new(surface, textures);
    let charts = charts(surface, |face| brush.texels(face));
    let laid: usize = charts.iter().map(|chart| chart.faces.len()).sum();
    if laid < surface.faces.len() || !(area.is_finite() && area > 0.0) {
        return refused("its faces cannot be laid out: their sides are too long or too short for numbers");
    }
    let full = |side: f64| side / area.sqrt();
    let wanted = brush.density().clamp(full(SHORTEST_SIDE), full(LONGEST_SIDE as f64));
    let (corners, side, gap, texels_per_mm) = pack(&charts, wanted)?;
    let mut canvas = Canvas::new(side);
    let (mut vertices, mut places, mut faces) = (Vec::new(), Vec::new(), Vec::new());
    let mut known: HashMap<([u64; 3], [u64; 2]), usize> = HashMap::new();
    for (chart, (x, y)) in charts.iter().zip(corners) {
        // The middles of the outermost texels are on the border.
        let corner = DVec2::new(x as f64, y as f64) + 0.5;
        for &(face, at) in &chart.faces {
            let at = at.map(|place| corner + place * texels_per_mm);
            brush.paint(face, at, texels_per_mm, &mut canvas);
            let corners = surface.corners(face);
            faces.push(from_fn(|k| {
                let place = at[k] / DVec2::new(side[0] as f64, side[1] as f64);
                let key = (bits(corners[k].position), place.to_array().map(f64::to_bits));
                *known.entry(key).or_insert_with(|| {
                    vertices.push(corners[k].position);
                    places.push(place);
                    vertices.len() - 1
                })
            }));
        }
    }
    canvas.go_on_by(gap / 2);
    let [width, height] = side;
    Ok((
        TriangleMesh::new(vertices, places, faces)?,
        Picture::new(width, height, canvas.colors.into_flattened())?,
    ))
}

/// Where charts lie in a texture: the first texel of each, the texels along each side, between two, and per mm.
fn pack(charts: &[Chart], wanted: f64) -> Result<(Corners, [usize; 2], usize, f64), FormatError> {
    for gap in GAPS {
        let mut texels_per_mm = wanted;
        for _ in 0..TRIES[usize::from(gap == GAPS[GAPS.len() - 1])] {
            let size = |extent: f64| ((extent * texels_per_mm).ceil() as usize).saturating_add(1);
            let sizes = charts.iter().map(|chart| (size(chart.extent.x), size(chart.extent.y)));
            if let Some((corners, side)) = packed(&sizes.collect::<Vec<_>>(), gap, gap) {
                return Ok((corners, side, gap, texels_per_mm));
            }
            texels_per_mm *= SMALLER;
        }
    }
    refused(
        "its faces do not fit into one texture: there are too many of them apart from one another, or they are too long and thin",
    )
}

/// Tells the colours of faces.
struct Brush<'a> {
    surface: &'a Surface,
    /// Each texture smaller and smaller, first as it is.
    textures: Vec<Vec<Cow<'a, Picture>>>,
}

impl<'a> Brush<'a> {
    fn new(surface: &'a Surface, textures: &'a [Picture]) -> Self {
        let smaller = |last: &Cow<'_, Picture>| {
            let is_divisible = last.width().max(last.height()) > 1;
            is_divisible.then(|| Cow::Owned(last.halved()))
        };
        let levels = |texture| successors(Some(Cow::Borrowed(texture)), smaller).collect();
        Self {
            surface,
            textures: textures.iter().map(levels).collect(),
        }
    }

    /// The texture of a face smaller and smaller.
    fn levels(&self, face: usize) -> Option<&Vec<Cow<'a, Picture>>> {
        let number = self.surface.texture_of(&self.surface.corners(face)[0])?;
        self.textures.get(number)
    }

    /// The size of the texture of a face; (1, 1) without one.
    fn texels(&self, face: usize) -> DVec2 {
        let levels = self.levels(face);
        levels.map_or(DVec2::ONE, |levels| levels[0].size().as_dvec2())
    }

    /// Texels per mm of the file's texture on a face; 0 without one.
    fn texels_per_mm(&self, face: usize) -> f64 {
        let in_texture = self.surface.texture_area(face).abs() * self.texels(face).element_product();
        let texels_per_mm = (in_texture / self.surface.normal(face).length()).sqrt();
        self.levels(face).map_or(0.0, |_| texels_per_mm)
    }

    /// Texels per mm that keep what is to be seen on most of the surface.
    fn density(&self) -> f64 {
        let of_face = |face: usize| {
            let corners = self.surface.corners(face).map(|at| at.color);
            let area = self.surface.normal(face).length();
            let texels_per_mm = match corners[0] == corners[1] && corners[0] == corners[2] {
                true => self.texels_per_mm(face),
                false => self.texels_per_mm(face).max(TEXELS_PER_EDGE / area.sqrt()),
            };
            (texels_per_mm > 0.0 && area > 0.0).then_some((texels_per_mm, area))
        };
        let mut faces: Vec<(f64, f64)> = (0..self.surface.faces.len()).filter_map(of_face).collect();
        faces.sort_by(|a, b| a.0.total_cmp(&b.0));
        let mut rest = KEPT * faces.iter().map(|(_, area)| area).sum::<f64>();
        let kept = faces.iter().find(|(_, area)| {
            rest -= area;
            rest <= 0.0
        });
        kept.map_or(0.0, |(texels_per_mm, _)| *texels_per_mm)
    }

    /// Paints a face whose corners are `at` these places of the canvas, texels.
    fn paint(&self, face: usize, at: [DVec2; 3], texels_per_mm: f64, canvas: &mut Canvas) {
        let larger = (self.texels_per_mm(face) / texels_per_mm).log2();
        let level = self
            .levels(face)
            .map(|levels| &levels[(larger.max(0.0) as usize).min(levels.len() - 1)]);
        let corners = self.surface.corners(face);
        let wraps = self.surface.paint_of(&corners[0]).wraps;
        let color = |place: DVec2| {
            let weights = weights(at, place);
            let own = mean(&corners, weights, |at| DVec3::from_array(at.color.map(f64::from)));
            let Some(level) = level else {
                return own.to_array().map(|part| part.round() as u8);
            };
            let uv = mean(&corners, weights, |at| at.uv.extend(0.0)).truncate();
            let sampled = sample(level, uv, wraps);
            let tinted = |k: usize| from_linear(linear(sampled[k]) * linear(own[k]));
            match own == DVec3::splat(255.0) {
                true => sampled.map(|part| part.round() as u8),
                false => from_fn(|k| tinted(k).round() as u8),
            }
        };
        rows_within(at, |row, columns| {
            for column in columns {
                canvas.set([column, row], color(DVec2::new(column as f64 + 0.5, row as f64 + 0.5)));
            }
        });
        // A face between the middles of texels has one too.
        let middle = (at[0] + at[1] + at[2]) / 3.0;
        let texel = middle.floor().as_i64vec2().to_array();
        if !canvas.is_covered(texel) {
            canvas.set(texel, color(middle));
        }
    }
}

/// Barycentric weights of a place in a triangle, within which it is or nearly.
fn weights(corners: [DVec2; 3], place: DVec2) -> [f64; 3] {
    let weights = texture_barycentric(place, corners);
    // Nothing is said of a triangle without area.
    let is_told = weights.iter().all(|weight| weight.is_finite());
    weights.map(|weight| if is_told { weight.clamp(0.0, 1.0) } else { 1.0 / 3.0 })
}

fn mean(corners: &[Vertex; 3], weights: [f64; 3], of: impl Fn(&Vertex) -> DVec3) -> DVec3 {
    let weighted = corners.iter().zip(weights).map(|(at, weight)| of(at) * weight);
    weighted.sum()
}

/// Bilinear value in 0..=255 of a texture at (u, v), which goes on beyond the unit square as `wraps` say.
fn sample(texture: &Picture, uv: DVec2, wraps: [Wrap; 2]) -> [f64; 3] {
    let sides = [texture.width(), texture.height()];
    let [x, y]: [[(usize, f64); 2]; 2] = from_fn(|k| {
        let last = sides[k] - 1;
        let t = match wraps[k] {
            Wrap::Repeat => uv[k] - uv[k].floor(),
            // To at even numbers, fro at odd ones.
            Wrap::Mirror => 1.0 - (uv[k].rem_euclid(2.0) - 1.0).abs(),
            Wrap::Clamp => uv[k].clamp(0.0, 1.0),
        };
        let at = t * sides[k] as f64 - 0.5;
        let (first, weight) = (at.floor(), at - at.floor());
        let inside = |texel: f64| match wraps[k] {
            Wrap::Repeat if texel < 0.0 => last,
            Wrap::Repeat if texel > last as f64 => 0,
            _ => (texel.max(0.0) as usize).min(last),
        };
        [(inside(first), 1.0 - weight), (inside(first + 1.0), weight)]
    });
    let mut color = [0.0; 3];
    for (row, across) in y {
        for (column, along) in x {
            let texel = texture.pixel(column, row);
            color = from_fn(|k| color[k] + across * along * f64::from(texel[k]));
        }
    }
    color
}

/// Linear light of an sRGB value in 0..=255, 0 to 1.
pub(super) fn linear(value: f64) -> f64 {
    let value = value / 255.0;
    match value <= 0.04045 {
        true => value / 12.92,
        false => ((value + 0.055) / 1.055).powf(2.4),
    }
}

/// sRGB value in 0..=255 of linear light.
pub(super) fn from_linear(light: f64) -> f64 {
    let light = light.clamp(0.0, 1.0);
    255.0
        * match light <= 0.003_130_8 {
            true => 12.92 * light,
            false => 1.055 * light.powf(1.0 / 2.4) - 0.055,
        }
}

/// A texture while it is painted.
struct Canvas {
    side: [usize; 2],
    colors: Vec<[u8; 3]>,
    is_covered: Vec<bool>,
}

impl Canvas {
    fn new(side: [usize; 2]) -> Self {
        let count = side[0] * side[1];
        Self {
            side,
            colors: vec![[128; 3]; count],
            is_covered: vec![false; count],
        }
    }

    /// The number of a texel (column, row).
    fn number(&self, texel: [i64; 2]) -> Option<usize> {
        let [column, row] = texel.map(|at| usize::try_from(at).unwrap_or(usize::MAX));
        (column < self.side[0] && row < self.side[1]).then(|| row * self.side[0] + column)
    }

    fn is_covered(&self, texel: [i64; 2]) -> bool {
        self.number(texel).is_some_and(|number| self.is_covered[number])
    }

    fn set(&mut self, texel: [i64; 2], color: [u8; 3]) {
        if let Some(number) = self.number(texel) {
            self.colors[number] = color;
            self.is_covered[number] = true;
        }
    }

    /// The texels around one that are covered, or are not.
    fn around(&self, number: usize, is_covered: bool) -> impl Iterator<Item = usize> + '_ {
        let [column, row] = [(number % self.side[0]) as i64, (number / self.side[0]) as i64];
        let around = (0..9).filter_map(move |k| self.number([column + k % 3 - 1, row + k / 3 - 1]));
        around.filter(move |&other| self.is_covered[other] == is_covered)
    }

    /// Lets the colours go on by so many texels over the border of what is covered, so that filters do not mix in what is around it.
    fn go_on_by(&mut self, texels: usize) {
        let mut border: Vec<usize> = (0..self.colors.len())
            .filter(|&number| self.is_covered[number])
            .collect();
        for _ in 0..texels {
            let mut next: Vec<usize> = border.iter().flat_map(|&number| self.around(number, false)).collect();
            next.sort_unstable();
            next.dedup();
            let mean = |&number: &usize| {
                let (mut sum, mut count) = ([0; 3], 0);
                for other in self.around(number, true) {
                    (sum, count) = (from_fn(|k| sum[k] + usize::from(self.colors[other][k])), count + 1);
                }
                sum.map(|sum| (sum / count.max(1)) as u8)
            };
            let colors: Vec<[u8; 3]> = next.iter().map(mean).collect();
            for (&number, color) in next.iter().zip(colors) {
                self.colors[number] = color;
                self.is_covered[number] = true;
            }
            border = next;
        }
    }
}
