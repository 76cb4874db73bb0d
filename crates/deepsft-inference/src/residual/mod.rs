//! The paper's network and R50F: a plan from the image to the pixels' depths and registration.

#[cfg(feature = "webgpu")]
mod gpu;
mod network;

#[cfg(feature = "webgpu")]
pub use gpu::ResidualGpuExecutor;

use crate::config::{DepthRange, NetworkConfig};
use crate::cpu::{CpuPlan, awake};
use crate::plan::{MapId, PlanError};
use crate::stage::Stage;
use crate::weights::Weights;
use deepsft_geometry::{CANONICAL_HEIGHT, CANONICAL_WIDTH, GeometryError, Maps, Picture, check_size};
pub(crate) use network::ResidualPlan;
use network::Said;
use std::fmt;

/// Depth beyond which something is seen: halfway between the -1 outside and the near end of the range.
const SEEN: f32 = -0.5;

/// The paper's network or R50F on the processor, for images of 480 x 270 pixels. On one thread it allocates nothing after it was
/// made.
pub struct ResidualExecutor {
    cpu: CpuPlan,
    image: MapId,
    said: Said,
    main_steps: usize,
    range: DepthRange,
}

impl fmt::Debug for ResidualExecutor {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("ResidualExecutor").finish_non_exhaustive()
    }
}

impl ResidualExecutor {
    /// Gets a network ready, see [`crate::Executor::new`].
    ///
    /// # Errors
    /// [`PlanError`] when `weights` are not those of `config`, and when that is of another architecture.
    pub fn new(config: &NetworkConfig, weights: &Weights, threads: usize) -> Result<Self, PlanError> {
        let ResidualPlan {
            plan,
            image,
            said,
            main_steps,
        } = ResidualPlan::new(config, weights)?;
        let kept = said.maps();
        Ok(Self {
            cpu: CpuPlan::new(plan, &kept, threads),
            image,
            said,
            main_steps,
            range: config.depth_range,
        })
    }

    /// Takes an image of the training camera through the network.
    ///
    /// # Errors
    /// [`GeometryError`] when the image has another size.
    pub fn run(&mut self, image: &Picture) -> Result<(), GeometryError> {
        self.run_to(Stage::RegistrationRefinement, image)
    }

    /// The same as far as [`ResidualExecutor::read`] needs for `stage`: later stages then say nothing of this image. The main block
    /// is somewhat more than half of the paper's network.
    ///
    /// # Errors
    /// [`GeometryError`] when the image has another size.
    pub fn run_to(&mut self, stage: Stage, image: &Picture) -> Result<(), GeometryError> {
        check_size(image.size(), (CANONICAL_WIDTH, CANONICAL_HEIGHT))?;
        let pitch = self.cpu.pitch(self.image);
        let places = self.cpu.values_mut(self.image).chunks_exact_mut(pitch);
        for (place, color) in places.zip(image.rgb().chunks_exact(3)) {
            for (value, &color) in place.iter_mut().zip(color) {
                *value = f32::from(color) * (2.0 / 255.0) - 1.0;
            }
        }
        let steps = match stage {
            Stage::Main => 0..self.main_steps,
            _ => 0..self.cpu.steps(),
        };
        awake(self.cpu.threads(), || self.cpu.run(steps));
        Ok(())
    }

    /// Writes the maps of the last image, see [`crate::Executor::read`].
    ///
    /// # Errors
    /// [`GeometryError::MapSize`] when `maps` or `seen` have another size than the image.
    pub fn read(&self, stage: Stage, seen: Option<&[bool]>, maps: &mut Maps) -> Result<(), GeometryError> {
        let values = |map| (self.cpu.values(map), self.cpu.pitch(map));
        read(self.said, self.range, values, (stage, seen), maps)
    }
}

/// Depth, u and v at a pixel, normalised; `values` gives a map's values and how many of them a place has.
fn at<'a>(said: Said, values: &impl Fn(MapId) -> (&'a [f32], usize), stage: Stage, pixel: usize) -> [f32; 3] {
    let place = |map: MapId| {
        let (values, pitch) = values(map);
        &values[pixel * pitch..]
    };
    match said {
        Said::Planes(map) => {
            let (values, _) = values(map);
            [0, 1, 2].map(|k| values[k * CANONICAL_WIDTH * CANONICAL_HEIGHT + pixel])
        }
        Said::Blocks {
            main,
            depth,
            correction,
        } => {
            let (main, correction) = (place(main), place(correction));
            match stage {
                Stage::Main => [main[0], main[1], main[2]],
                Stage::DepthRefinement => [place(depth)[0], main[1], main[2]],
                Stage::RegistrationRefinement => [place(depth)[0], main[1] + correction[0], main[2] + correction[1]],
            }
        }
    }
}

/// Writes maps of what a network said, wherever it ran.
fn read<'a>(
    said: Said,
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
        let [depth, u, v] = at(said, &values, stage, pixel);
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
