//! Maps from what the paper's network or R50F says of the pixels.

use crate::config::DepthRange;
use crate::plan::MapId;
use crate::stage::Stage;
use deepsft_geometry::{CANONICAL_HEIGHT, CANONICAL_WIDTH, GeometryError, Maps, check_size};

/// Depth beyond which something is seen: halfway between the -1 outside and the near end of the range.
const SEEN: f32 = -0.5;

/// The maps that a network's plan ends with.
#[derive(Clone, Copy, Debug)]
pub(super) enum OutputMaps {
    /// The paper's network: depth, u and v of the main block, the refined depth, corrections of u and v.
    Blocks {
        main: MapId,
        depth: MapId,
        correction: MapId,
    },
    /// R50F: a map of depths, one of u, one of v, row after row.
    Planes(MapId),
}

impl OutputMaps {
    /// All maps.
    pub(super) fn maps(self) -> Vec<MapId> {
        match self {
            Self::Blocks {
                main,
                depth,
                correction,
            } => vec![main, depth, correction],
            Self::Planes(map) => vec![map],
        }
    }
}

/// Depth, u and v at a pixel, normalised; `values` gives a map's values and how many of them a position has.
fn at<'a>(outputs: OutputMaps, values: &impl Fn(MapId) -> (&'a [f32], usize), stage: Stage, pixel: usize) -> [f32; 3] {
    let position = |map: MapId| {
        let (values, pitch) = values(map);
        &values[pixel * pitch..]
    };
    match outputs {
        OutputMaps::Planes(map) => {
            let (values, _) = values(map);
            [0, 1, 2].map(|k| values[k * CANONICAL_WIDTH * CANONICAL_HEIGHT + pixel])
        }
        OutputMaps::Blocks {
            main,
            depth,
            correction,
        } => {
            let (main, correction) = (position(main), position(correction));
            match stage {
                Stage::Main => [main[0], main[1], main[2]],
                Stage::DepthRefinement => [position(depth)[0], main[1], main[2]],
                Stage::RegistrationRefinement => [position(depth)[0], main[1] + correction[0], main[2] + correction[1]],
            }
        }
    }
}

/// Writes the maps of a network that ran on whichever device, see [`crate::Executor::read`].
pub(super) fn read<'a>(
    outputs: OutputMaps,
    range: DepthRange,
    values: impl Fn(MapId) -> (&'a [f32], usize),
    (stage, seen): (Stage, Option<&[bool]>),
    maps: &mut Maps,
) -> Result<(), GeometryError> {
    let (width, height) = (CANONICAL_WIDTH, CANONICAL_HEIGHT);
    check_size(maps.size(), (width, height))?;
    if let Some(seen) = seen {
        check_size((seen.len(), 1), (width * height, 1))?;
    }
    for pixel in 0..width * height {
        let [depth, u, v] = at(outputs, &values, stage, pixel);
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
