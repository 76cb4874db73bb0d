//! Maps from what the paper's network or R50F says of the pixels.

use crate::config::DepthRange;
use crate::stage::Stage;
use deepsft_geometry::{CANONICAL_HEIGHT, CANONICAL_WIDTH, GeometryError, Maps, check_size};

/// Depth beyond which something is seen: halfway between the -1 outside and the near end of the range.
const SEEN: f32 = -0.5;

/// Depth, u and v at a pixel, normalised; `said` gives the values of a map that the plan ends with, and how many a position has.
fn at<'a>(count: usize, said: &impl Fn(usize) -> (&'a [f32], usize), stage: Stage, pixel: usize) -> [f32; 3] {
    if count == 1 {
        return [0, 1, 2].map(|k| said(0).0[k * CANONICAL_WIDTH * CANONICAL_HEIGHT + pixel]);
    }
    let [main, depth, correction] = [0, 1, 2].map(|k| {
        let (values, pitch) = said(k);
        &values[pixel * pitch..]
    });
    match stage {
        Stage::Main => [main[0], main[1], main[2]],
        Stage::DepthRefinement => [depth[0], main[1], main[2]],
        Stage::RegistrationRefinement => [depth[0], main[1] + correction[0], main[2] + correction[1]],
    }
}

/// Writes the maps of a network that ran on whichever device, see [`crate::Executor::read`]; `said` gives the `count` maps of
/// [`super::ResidualPlan::outputs`].
pub(crate) fn read<'a>(
    count: usize,
    range: DepthRange,
    said: impl Fn(usize) -> (&'a [f32], usize),
    (stage, seen): (Stage, Option<&[bool]>),
    maps: &mut Maps,
) -> Result<(), GeometryError> {
    let (width, height) = (CANONICAL_WIDTH, CANONICAL_HEIGHT);
    check_size(maps.size(), (width, height))?;
    if let Some(seen) = seen {
        check_size((seen.len(), 1), (width * height, 1))?;
    }
    for pixel in 0..width * height {
        let [depth, u, v] = at(count, &said, stage, pixel);
        if !seen.map_or(depth >= SEEN, |seen| seen[pixel]) {
            maps.clear(pixel);
            continue;
        }
        // Inside is above half of the nearest depth and the -1 outside: what is inside is nowhere nearer than near.
        let mm = range.depth_mm_linear(f64::from(depth)).max(range.near_mm);
        maps.set(pixel, mm as f32, [u, v]);
    }
    Ok(())
}
