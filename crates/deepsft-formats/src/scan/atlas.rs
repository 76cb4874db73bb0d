//! All textures of a scan in one.

use super::refused;
use crate::error::FormatError;
use deepsft_geometry::Picture;
use deepsft_geometry::glam::DVec2;
use std::borrow::Cow;
use std::iter::successors;

/// Longest side of a template's texture, texels. Fuzzing paints less and tries more.
pub(super) const LONGEST_SIDE: usize = if cfg!(fuzzing) { 512 } else { 4096 };

/// Texels between two textures in the common one; each continues over half of them.
const GAP: usize = 16;

/// Where a texture lies in the common one: corner and size, fractions of it.
#[derive(Clone, Copy)]
pub(super) struct Region {
    pub(super) corner: DVec2,
    pub(super) size: DVec2,
}

/// All textures in one, and where each lies.
pub(super) fn atlas(textures: &[Picture]) -> Result<(Picture, Vec<Region>), FormatError> {
    let mut textures = Vec::from_iter(textures.iter().map(Cow::Borrowed));
    if let [texture] = textures.as_mut_slice() {
        while texture.width().max(texture.height()) > LONGEST_SIDE {
            *texture = Cow::Owned(texture.halved());
        }
        let (corner, size) = (DVec2::ZERO, DVec2::ONE);
        return Ok((texture.clone().into_owned(), vec![Region { corner, size }]));
    }
    loop {
        let sizes: Vec<(usize, usize)> = textures.iter().map(|t| (t.width(), t.height())).collect();
        if let Some((corners, side)) = packed(&sizes, GAP, 0) {
            return paint_atlas(&textures, &corners, side);
        }
        if textures.iter().all(|t| t.width() == 1 && t.height() == 1) {
            return refused(format!("it has too many textures ({})", textures.len()));
        }
        (textures.iter_mut()).for_each(|texture| *texture = Cow::Owned(texture.halved()));
    }
}

/// Corner (x, y) of each of some rectangles, texels.
pub(super) type Corners = Vec<(usize, usize)>;

/// Lays rectangles (width, height) into a texture hardly larger than they are, at first wider by `spare` texels: the corner (x, y) of each and
/// the sides of the texture, the longer across. `None` when there is no room. See [`pack_rectangles`].
pub(super) fn packed(sizes: &[(usize, usize)], gap: usize, spare: usize) -> Option<(Corners, [usize; 2])> {
    let area = |&(w, h): &(usize, usize)| w.saturating_add(gap) as f64 * h.saturating_add(gap) as f64;
    let narrowest = (sizes.iter().map(area).sum::<f64>().sqrt() as usize)
        .saturating_add(spare)
        .max(2 * gap);
    let widths = successors(Some(narrowest), |width| Some(width + width / 16 + 1));
    widths.take_while(|&width| width <= LONGEST_SIDE).find_map(|width| {
        let (corners, height) = pack_rectangles(sizes, width, gap)?;
        (height <= width).then_some((corners, [width, height]))
    })
}

/// Lays rectangles (width, height) into a strip of `width` texels without overlap, `gap` texels between them and around
/// them: the corner (x, y) of each, and the height that is used. Shelves, the highest rectangles first (next fit by
/// decreasing height). `None` when one is too long.
fn pack_rectangles(sizes: &[(usize, usize)], width: usize, gap: usize) -> Option<(Corners, usize)> {
    let mut order: Vec<usize> = (0..sizes.len()).collect();
    order.sort_by_key(|&i| std::cmp::Reverse(sizes[i].1));
    let mut corners = vec![(0, 0); sizes.len()];
    let (mut x, mut y, mut shelf) = (gap, gap, 0);
    for i in order {
        let (w, h) = sizes[i];
        if w.max(h) > LONGEST_SIDE || w + 2 * gap > width {
            return None;
        }
        if x + w + gap > width {
            (x, y, shelf) = (gap, y + shelf + gap, 0);
        }
        corners[i] = (x, y);
        x += w + gap;
        shelf = shelf.max(h);
    }
    Some((corners, y + shelf + gap))
}

fn paint_atlas(
    textures: &[Cow<'_, Picture>],
    corners: &[(usize, usize)],
    [width, height]: [usize; 2],
) -> Result<(Picture, Vec<Region>), FormatError> {
    let mut rgb = vec![128; 3 * width * height];
    let mut regions = Vec::new();
    for (texture, &(left, top)) in textures.iter().zip(corners) {
        // The border's colours go on into the gap, so that filters do not mix two textures.
        for y in top - GAP / 2..top + texture.height() + GAP / 2 {
            for x in left - GAP / 2..left + texture.width() + GAP / 2 {
                let inside = |at: usize, from: usize, size: usize| at.saturating_sub(from).min(size - 1);
                let (i, j) = (inside(x, left, texture.width()), inside(y, top, texture.height()));
                rgb[3 * (y * width + x)..][..3].copy_from_slice(&texture.pixel(i, j));
            }
        }
        let all = DVec2::new(width as f64, height as f64);
        regions.push(Region {
            corner: DVec2::new(left as f64, top as f64) / all,
            size: texture.size().as_dvec2() / all,
        });
    }
    Ok((Picture::new(width, height, rgb)?, regions))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rectangles_lie_on_shelves_the_highest_first() {
        let packed = pack_rectangles(&[(30, 10), (30, 20), (50, 10)], 64, 1).unwrap();
        assert_eq!(packed, (vec![(32, 1), (1, 1), (1, 22)], 33));
        assert!(pack_rectangles(&[(63, 1)], 64, 1).is_none());
    }
}
