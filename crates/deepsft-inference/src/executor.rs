//! Runs a network of any architecture.

use crate::compact::CompactFrame;
#[cfg(feature = "webgpu")]
use crate::compact::{CellMaps, compact_pipeline, logit};
use crate::config::{Architecture, DepthRange, NetworkConfig};
use crate::cpu::{CpuPlan, with_team};
#[cfg(feature = "webgpu")]
use crate::gpu::{FramePipeline, Gpu, GpuError};
use crate::plan::{MapId, PlanError, misfit};
#[cfg(feature = "webgpu")]
use crate::residual::residual_pipeline;
use crate::residual::{ResidualPlan, read};
use crate::stage::Stage;
use crate::weights::Weights;
use deepsft_geometry::{
    CANONICAL_HEIGHT, CANONICAL_WIDTH, GeometryError, ImageSize, Maps, Picture, RestSurface, check_size,
};

/// Checks the size of images for networks that know one only.
fn check_canonical(image: ImageSize) -> Result<(), PlanError> {
    let (actual, expected) = ([image.width, image.height], [CANONICAL_WIDTH, CANONICAL_HEIGHT]);
    if actual == expected {
        return Ok(());
    }
    Err(misfit("the image", &actual, &expected))
}

/// Runs a network on the processor, for images of one size. On one thread it allocates nothing after it was made.
#[derive(Debug)]
pub struct Executor {
    cpu: CpuPlan,
    size: ImageSize,
    network: Network,
}

#[derive(Debug)]
enum Network {
    Compact(Box<CompactFrame>),
    /// The paper's network and R50F.
    Residual {
        image: MapId,
        outputs: Vec<MapId>,
        range: DepthRange,
    },
}

impl Executor {
    /// Prepares a network for images of size `image` and `threads` threads, see [`crate::available_threads`].
    ///
    /// # Errors
    /// [`PlanError`] when `weights` are not those of `config`, and for an image of a size that the network is not for: the paper's
    /// network and R50F are for 480 x 270 pixels, the compact network for any.
    pub fn new(
        config: &NetworkConfig,
        image: impl Into<ImageSize>,
        weights: &Weights,
        threads: usize,
    ) -> Result<Self, PlanError> {
        let size = image.into();
        let (cpu, network) = if let Architecture::Compact(_) = config.architecture {
            let (cpu, frame) = CompactFrame::new(config, [size.width, size.height], weights, threads)?;
            (cpu, Network::Compact(Box::new(frame)))
        } else {
            check_canonical(size)?;
            let ResidualPlan { plan, image, outputs } = ResidualPlan::new(config, weights)?;
            let (cpu, range) = (CpuPlan::new(plan, &outputs, threads), config.depth_range);
            (cpu, Network::Residual { image, outputs, range })
        };
        Ok(Self { cpu, size, network })
    }

    /// Takes an image of the training camera through the network.
    ///
    /// # Errors
    /// [`GeometryError`] when the image has another size.
    pub fn run(&mut self, image: &Picture) -> Result<(), GeometryError> {
        check_size(image.size(), self.size)?;
        let (cpu, network) = (&mut self.cpu, &mut self.network);
        with_team(cpu.threads(), || match network {
            Network::Compact(frame) => frame.run(cpu, image),
            Network::Residual { image: map, .. } => {
                let pitch = cpu.pitch(*map);
                let positions = cpu.values_mut(*map).chunks_exact_mut(pitch);
                for (position, color) in positions.zip(image.rgb().chunks_exact(3)) {
                    for (value, &color) in position.iter_mut().zip(color) {
                        *value = f32::from(color) * (2.0 / 255.0) - 1.0;
                    }
                }
                cpu.run(0..cpu.steps());
            }
        });
        Ok(())
    }

    /// Writes the maps of the last image: depth (mm) and registration at the pixels of `seen` (row-major) if given, else in the
    /// network's mask. That of the compact network is where the mask's probability is at least one half; the paper's network and
    /// R50F say a depth nearer to the range than to the -1 outside, at the stage that is read. R50F says the same at all stages.
    /// Rest positions are looked up on the `surface` that they are of; other networks need none.
    ///
    /// # Errors
    /// [`GeometryError::MapSize`] when `maps` or `seen` have another size than the image, [`GeometryError::NoRestSurface`].
    pub fn read(
        &mut self,
        stage: Stage,
        seen: Option<&[bool]>,
        surface: Option<&RestSurface>,
        maps: &mut Maps,
    ) -> Result<(), GeometryError> {
        let cpu = &self.cpu;
        match &mut self.network {
            Network::Compact(frame) => {
                let mask = frame.mask(cpu);
                frame.cell_maps.read(stage, seen, surface, mask, maps)
            }
            Network::Residual { outputs, range, .. } => {
                let said = |k: usize| (cpu.values(outputs[k]), cpu.pitch(outputs[k]));
                read(outputs.len(), *range, said, (stage, seen), maps)
            }
        }
    }

    /// Returns u, v and d, or x, y, d and z of rest positions, of the compact network's cells of 8 pixels: row after row, d in
    /// normalised log depth, the fourth empty where there is none. `None` for others.
    pub fn cells(&self, stage: Stage) -> Option<[&[f32]; 4]> {
        match &self.network {
            Network::Compact(frame) => Some(frame.cell_maps.cells(stage)),
            Network::Residual { .. } => None,
        }
    }

    /// Returns the compact network's logit of "the object is seen here" at a pixel of the last image. `None` for others.
    ///
    /// # Panics
    /// May panic for a pixel outside of the image.
    pub fn mask_logit(&self, x: usize, y: usize) -> Option<f32> {
        match &self.network {
            Network::Compact(frame) => {
                let (patch, within) = frame.cell_maps.index_in_mask(x, y);
                Some(frame.mask(&self.cpu)(patch, within))
            }
            Network::Residual { .. } => None,
        }
    }
}

/// Runs a network on a GPU, for images of one size.
#[cfg(feature = "webgpu")]
#[derive(Debug)]
pub struct GpuExecutor {
    pipeline: FramePipeline,
    /// Of the compact network.
    cells: Option<CellMaps>,
    range: DepthRange,
}

#[cfg(feature = "webgpu")]
impl GpuExecutor {
    /// Prepares a network for images of size `image`. What the GPU refuses, the first run reports.
    ///
    /// # Errors
    /// [`GpuError::Plan`] as [`Executor::new`], and with [`PlanError::Architecture`] for R50F: its dense layers are larger than what
    /// every GPU can bind. Others when the GPU failed before.
    pub fn new(
        gpu: &Gpu,
        config: &NetworkConfig,
        image: impl Into<ImageSize>,
        weights: &Weights,
    ) -> Result<Self, GpuError> {
        gpu.check()?;
        let image = image.into();
        let range = config.depth_range;
        let (pipeline, cells) = match config.architecture {
            Architecture::Compact(_) => {
                let image = [image.width, image.height];
                let pipeline = compact_pipeline(gpu, config, image, weights)?;
                (pipeline, Some(CellMaps::new(image, config, 1)))
            }
            Architecture::Paper(_) => {
                check_canonical(image)?;
                (residual_pipeline(gpu, config, weights)?, None)
            }
            Architecture::R50F(_) => return Err(PlanError::Architecture(config.architecture.name()).into()),
        };
        Ok(Self { pipeline, cells, range })
    }

    /// Takes an image of the training camera through the network.
    ///
    /// # Errors
    /// [`GpuError::Image`] when the image has another size; others when the GPU was lost or failed.
    pub async fn run(&mut self, image: &Picture) -> Result<(), GpuError> {
        self.pipeline.run(image).await?;
        if let Some(cells) = &mut self.cells {
            cells.set(self.pipeline.result(0), self.pipeline.result(1));
        }
        Ok(())
    }

    /// Writes the maps of the last image, see [`Executor::read`].
    ///
    /// # Errors
    /// As [`Executor::read`].
    pub fn read(
        &mut self,
        stage: Stage,
        seen: Option<&[bool]>,
        surface: Option<&RestSurface>,
        maps: &mut Maps,
    ) -> Result<(), GeometryError> {
        let pipeline = &self.pipeline;
        match &mut self.cells {
            Some(cells) => {
                // In a browser the pipeline cannot be shared between threads; its numbers can.
                let logits = pipeline.result(2);
                cells.read(stage, seen, surface, |patch, at| logit(logits, patch, at), maps)
            }
            None => read(3, self.range, |k| (pipeline.result(k), 4), (stage, seen), maps),
        }
    }

    /// The compact network's cells, see [`Executor::cells`].
    #[cfg(test)]
    pub(crate) fn cells(&self, stage: Stage) -> Option<[&[f32]; 4]> {
        self.cells.as_ref().map(|cells| cells.cells(stage))
    }

    /// A logit of the compact network's mask, see [`Executor::mask_logit`].
    #[cfg(test)]
    pub(crate) fn mask_logit(&self, x: usize, y: usize) -> Option<f32> {
        let (patch, at) = self.cells.as_ref()?.index_in_mask(x, y);
        Some(logit(self.pipeline.result(2), patch, at))
    }
}
