//! Self-similarity of a print: where a fit may have hopped to another mode.

use super::mesh_fitter::WINDOW_PX;
use crate::image::{ContrastNormalizer, GreyMipmap, ImageSize, Region, turned_clockwise};
use crate::mesh::Template;
use glam::DVec2;
use std::iter::successors;

/// Longer side of the grey print that is compared with itself, in pixels of its own. A motif has to be a few of them wide to be told from
/// its neighbours: 15 mm on a sheet of A4.
const LONG_SIDE: usize = 96;

/// How much finer the print is when it is compared in detail.
const DETAIL: usize = 4;

/// Blur before the comparison, pixels of the small print: perspective and bends are no reason to look different.
const BLUR_PX: f32 = 0.7;

/// Correlation of two parts from which they look alike.
const ALIKE: f32 = 0.5;

/// Least part of the print's contrast that both show.
const MIN_OVERLAP: f32 = 0.3;

/// Shortest shift, pixels of the small print, and around a peak the pixels that belong to it.
const PEAK: isize = 3;

/// The shortest shifts that are tried, both ways: over two rows of neighbours in most patterns.
const MAX_SHIFTS: usize = 6;

/// A motion of the print in its plane onto a part of it that looks the same.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct SelfSimilarity {
    /// Quarter turns, clockwise as printed, of the print in its own frame.
    quarter_turns: usize,
    /// Where the turned print's top-left corner comes to lie, fractions of the print.
    offset: DVec2,
    /// Height over width.
    aspect: f64,
}

impl SelfSimilarity {
    /// The texture position that looks as `uv` does; outside the unit square where the print ends.
    pub(crate) fn of(&self, uv: DVec2) -> DVec2 {
        let size = DVec2::new(1.0, self.aspect);
        let place = uv * size;
        // From the turned print's top-left corner.
        let turned = match self.quarter_turns {
            1 => DVec2::new(size.y - place.y, place.x),
            2 => size - place,
            3 => DVec2::new(place.y, size.x - place.x),
            _ => place,
        };
        turned / size + self.offset
    }
}

/// The print, small and freed from light.
struct SmallPrint {
    width: usize,
    height: usize,
    values: Vec<f32>,
    /// Sums of squares above and left of each corner of a pixel.
    squares: Vec<f32>,
}

impl SmallPrint {
    fn new(width: usize, height: usize, values: Vec<f32>) -> Self {
        let mut squares = vec![0.0; (width + 1) * (height + 1)];
        for y in 0..height {
            let mut row = 0.0;
            for x in 0..width {
                row += values[y * width + x].powi(2);
                squares[(y + 1) * (width + 1) + x + 1] = squares[y * (width + 1) + x + 1] + row;
            }
        }
        Self {
            width,
            height,
            values,
            squares,
        }
    }

    fn of(template: &Template, long_side: usize) -> Self {
        let size = template.size_mm();
        let scale = long_side as f64 / size.max_element();
        let [width, height] = [size.x, size.y].map(|side| ((side * scale).round() as usize).max(1));
        let mipmap = GreyMipmap::new(template.texture(), long_side / 2);
        let texels = template.texture().width() as f64 / width as f64;
        let level = mipmap.level(texels.max(1.0).log2().round() as usize);
        let at = |index: usize, count: usize| (index as f32 + 0.5) / count as f32;
        let (size, everywhere) = (ImageSize { width, height }, vec![1.0; width * height]);
        let grey = (0..width * height).map(|p| level.sample([at(p % width, width), at(p / width, height)]));
        let normalizer = ContrastNormalizer::new(everywhere, Region::whole(size), size, BLUR_PX, WINDOW_PX);
        let normalized = normalizer.normalize(grey);
        Self::new(width, height, normalized.values)
    }

    /// The print turned by one, two and three quarters clockwise.
    fn turns(&self) -> impl Iterator<Item = Self> + use<> {
        let turned = |print: &Self| Self::new(print.height, print.width, turned_clockwise(&print.values, print.width));
        successors(Some(turned(self)), move |last| Some(turned(last))).take(3)
    }

    /// Sum of squares in the rectangle from `low` to before `high`.
    fn energy(&self, low: [usize; 2], high: [usize; 2]) -> f32 {
        let sum = |x: usize, y: usize| self.squares[y * (self.width + 1) + x];
        sum(high[0], high[1]) - sum(low[0], high[1]) - sum(high[0], low[1]) + sum(low[0], low[1])
    }

    /// Correlation with `other` when its top-left pixel lies on pixel (x, y); 0 when the overlap shows too little.
    fn correlation(&self, other: &Self, [x, y]: [isize; 2]) -> f32 {
        let range = |at: isize, own: usize, others: usize| {
            let (low, high) = (at.max(0), (own as isize).min(at + others as isize));
            (low as usize, high.max(low) as usize)
        };
        let ((left, right), (top, bottom)) = (range(x, self.width, other.width), range(y, self.height, other.height));
        let theirs = |column: usize, row: usize| [(column as isize - x) as usize, (row as isize - y) as usize];
        let energies = [
            self.energy([left, top], [right, bottom]),
            other.energy(theirs(left, top), theirs(right, bottom)),
        ];
        let all = self.energy([0, 0], [self.width, self.height]);
        if energies.iter().any(|&energy| energy <= MIN_OVERLAP * all) {
            return 0.0;
        }
        let row = |row: usize| {
            let [first, others_row] = theirs(left, row);
            let own = &self.values[row * self.width + left..row * self.width + right];
            let others = &other.values[others_row * other.width + first..][..right - left];
            dot(own, others)
        };
        (top..bottom).map(row).sum::<f32>() / (energies[0] * energies[1]).sqrt()
    }

    /// The places of `other` at which it looks like this print, with their correlations.
    fn peaks(&self, other: &Self) -> Vec<([isize; 2], f32)> {
        let (columns, rows) = (self.width + other.width - 1, self.height + other.height - 1);
        let place = |index: usize| {
            [
                (index % columns) as isize + 1 - other.width as isize,
                (index / columns) as isize + 1 - other.height as isize,
            ]
        };
        let places = (0..columns * rows).map(place);
        let all: Vec<f32> = places.map(|place| self.correlation(other, place)).collect();
        let highest_around = |index: usize| {
            let (x, y) = ((index % columns) as isize, (index / columns) as isize);
            let around = (-PEAK..=PEAK).flat_map(|dy| (-PEAK..=PEAK).map(move |dx| (x + dx, y + dy)));
            around
                .filter(|(x, y)| (0..columns as isize).contains(x) && (0..rows as isize).contains(y))
                .all(|(x, y)| all[y as usize * columns + x as usize] <= all[index])
        };
        let is_peak = |&index: &usize| all[index] >= ALIKE && highest_around(index);
        let peaks = (0..all.len()).filter(is_peak);
        peaks.map(|index| (place(index), all[index])).collect()
    }
}

/// The sum of products, in the order that vector units like.
fn dot(a: &[f32], b: &[f32]) -> f32 {
    const LANES: usize = 16;
    let (a_chunks, b_chunks) = (a.chunks_exact(LANES), b.chunks_exact(LANES));
    let rest = a_chunks.remainder().iter().zip(b_chunks.remainder());
    let rest: f32 = rest.map(|(a, b)| a * b).sum();
    let mut sums = [0.0; LANES];
    for (a, b) in a_chunks.zip(b_chunks) {
        for (sum, (a, b)) in sums.iter_mut().zip(a.iter().zip(b)) {
            *sum += a * b;
        }
    }
    rest + sums.iter().sum::<f32>()
}

/// Whether the print looks like itself in detail too: of a page of text only the blurred lines do.
pub(crate) fn is_alike_in_detail(template: &Template, similarities: &[SelfSimilarity]) -> bool {
    let print = SmallPrint::of(template, DETAIL * LONG_SIDE);
    let pixels = DVec2::new(print.width as f64, print.height as f64);
    let turned: Vec<_> = print.turns().collect();
    similarities.iter().any(|like| {
        let other = like.quarter_turns.checked_sub(1).map_or(&print, |turns| &turned[turns]);
        let at = (like.offset * pixels).round().as_i64vec2();
        let reach = DETAIL as isize + 1;
        let around = (-reach..=reach).flat_map(|dy| (-reach..=reach).map(move |dx| (dx, dy)));
        let mut places = around.map(|(dx, dy)| [at.x as isize + dx, at.y as isize + dy]);
        places.any(|place| print.correlation(other, place) >= ALIKE)
    })
}

/// How the print of `template` looks like itself elsewhere: the shortest shifts, and the best of each turn.
pub(crate) fn self_similarities(template: &Template) -> Vec<SelfSimilarity> {
    if !template.is_sheet() {
        return Vec::new();
    }
    let print = SmallPrint::of(template, LONG_SIDE);
    let pixels = DVec2::new(print.width as f64, print.height as f64);
    let aspect = template.size_mm().y / template.size_mm().x;
    let like = |quarter_turns: usize, [x, y]: [isize; 2]| SelfSimilarity {
        quarter_turns,
        offset: DVec2::new(x as f64, y as f64) / pixels,
        aspect,
    };
    let length = |[x, y]: [isize; 2]| x * x + y * y;
    let mut shifts = print.peaks(&print);
    shifts.retain(|&(at, _)| length(at) >= PEAK * PEAK);
    shifts.sort_by_key(|&(at, _)| length(at));
    let shifts = shifts.into_iter().take(MAX_SHIFTS).map(|(at, _)| like(0, at));
    let turns = (1..4).zip(print.turns()).filter_map(|(turns, turned)| {
        let peaks = print.peaks(&turned);
        let best = peaks.into_iter().max_by(|a, b| a.1.total_cmp(&b.1))?;
        Some(like(turns, best.0))
    });
    shifts.chain(turns).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::image::Picture;

    #[test]
    fn a_turn_takes_a_playing_card_onto_itself() {
        let half = |x: usize, y: usize| (x * 7 + y * y * 3 + x * y) / 60 % 5 * 50;
        let picture = Picture::from_fn(200, 300, |x, y| {
            let level = if y < 150 { half(x, y) } else { half(199 - x, 299 - y) };
            [level as u8; 3]
        });
        let card = Template::thin_shell(picture, 60.0, 90.0).unwrap();
        let found = self_similarities(&card);
        assert!(is_alike_in_detail(&card, &found));
        let turn = found.iter().find(|like| like.quarter_turns == 2).unwrap();
        let at = turn.of(DVec2::new(0.2, 0.1));
        assert!((at - DVec2::new(0.8, 0.9)).length() < 0.03, "{at}");
    }

    #[test]
    fn lines_of_text_are_alike_only_when_they_are_blurred() {
        let letter = |x: usize, y: usize| (x / 10 * 73 + y / 10 * 151 + 7).pow(3) % 1009 < 500;
        let page = Picture::from_fn(600, 800, |x, y| match y % 60 {
            0..30 if letter(x, y) => [0; 3],
            _ => [255; 3],
        });
        let page = Template::thin_shell(page, 210.0, 280.0).unwrap();
        let found = self_similarities(&page);
        assert!(!found.is_empty() && !is_alike_in_detail(&page, &found));
    }
}
