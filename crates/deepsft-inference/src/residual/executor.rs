//! The paper's network and R50F on the processor.

use super::network::ResidualPlan;
use super::output::{OutputMaps, read};
use crate::config::{DepthRange, NetworkConfig};
use crate::cpu::CpuPlan;
use crate::plan::{MapId, PlanError};
use crate::stage::Stage;
use crate::weights::Weights;
use deepsft_geometry::{CANONICAL_HEIGHT, CANONICAL_WIDTH, GeometryError, Maps, Picture, check_size};

/// The paper's network or R50F on the processor, for images of 480 x 270 pixels. On one thread it allocates nothing after it was
/// made.
#[derive(Debug)]
pub(crate) struct ResidualExecutor {
    cpu: CpuPlan,
    image: MapId,
    outputs: OutputMaps,
    range: DepthRange,
}

impl ResidualExecutor {
    /// # Errors
    /// [`PlanError`] when `weights` are not those of `config`, and when that is of another architecture.
    pub(crate) fn new(config: &NetworkConfig, weights: &Weights, threads: usize) -> Result<Self, PlanError> {
        let ResidualPlan { plan, image, outputs } = ResidualPlan::new(config, weights)?;
        Ok(Self {
            cpu: CpuPlan::new(plan, &outputs.maps(), threads),
            image,
            outputs,
            range: config.depth_range,
        })
    }

    /// See [`crate::Executor::run`].
    pub(crate) fn run(&mut self, image: &Picture) -> Result<(), GeometryError> {
        check_size(image.size(), (CANONICAL_WIDTH, CANONICAL_HEIGHT))?;
        let pitch = self.cpu.pitch(self.image);
        let positions = self.cpu.values_mut(self.image).chunks_exact_mut(pitch);
        for (position, color) in positions.zip(image.rgb().chunks_exact(3)) {
            for (value, &color) in position.iter_mut().zip(color) {
                *value = f32::from(color) * (2.0 / 255.0) - 1.0;
            }
        }
        self.cpu.run(0..self.cpu.steps());
        Ok(())
    }

    /// See [`crate::Executor::read`].
    pub(crate) fn read(&self, stage: Stage, seen: Option<&[bool]>, maps: &mut Maps) -> Result<(), GeometryError> {
        let values = |map| (self.cpu.values(map), self.cpu.pitch(map));
        read(self.outputs, self.range, values, (stage, seen), maps)
    }
}
