//! A network of any architecture.

use crate::compact::CompactExecutor;
#[cfg(feature = "webgpu")]
use crate::compact::CompactGpuExecutor;
use crate::config::{Architecture, NetworkConfig};
#[cfg(feature = "webgpu")]
use crate::gpu::{Gpu, GpuError};
use crate::plan::PlanError;
use crate::residual::ResidualExecutor;
#[cfg(feature = "webgpu")]
use crate::residual::ResidualGpuExecutor;
use crate::stage::Stage;
use crate::weights::Weights;
use deepsft_geometry::{CANONICAL_HEIGHT, CANONICAL_WIDTH, GeometryError, Maps, Picture};

/// A network on the processor, for images of one size. On one thread it allocates nothing after it was made.
#[derive(Debug)]
pub enum Executor {
    /// The compact network.
    Compact(Box<CompactExecutor>),
    /// The paper's network or R50F.
    Residual(Box<ResidualExecutor>),
}

impl Executor {
    /// Gets a network ready for images of `image` (columns, rows) pixels and `threads` threads, see [`crate::available_threads`].
    ///
    /// # Errors
    /// [`PlanError`] when `weights` are not those of `config`, and for an image of a size that the network is not for: the paper's
    /// network and R50F are for 480 x 270 pixels, the compact network for any.
    pub fn new(
        config: &NetworkConfig,
        image: (usize, usize),
        weights: &Weights,
        threads: usize,
    ) -> Result<Self, PlanError> {
        if let Architecture::Compact(_) = config.architecture {
            let executor = CompactExecutor::new(config, image, weights, threads)?;
            return Ok(Self::Compact(Box::new(executor)));
        }
        let expected = (CANONICAL_WIDTH, CANONICAL_HEIGHT);
        if image != expected {
            return Err(PlanError::Shape {
                what: "the image".to_owned(),
                actual: vec![image.0, image.1],
                expected: vec![expected.0, expected.1],
            });
        }
        let executor = ResidualExecutor::new(config, weights, threads)?;
        Ok(Self::Residual(Box::new(executor)))
    }

    /// Takes an image of the training camera through the network.
    ///
    /// # Errors
    /// [`GeometryError`] when the image has another size.
    pub fn run(&mut self, image: &Picture) -> Result<(), GeometryError> {
        match self {
            Self::Compact(executor) => executor.run(image),
            Self::Residual(executor) => executor.run(image),
        }
    }

    /// The same as far as [`Executor::read`] needs for `stage`, see [`ResidualExecutor::run_to`]. The compact network always runs
    /// whole: nearly all of it is its main block.
    ///
    /// # Errors
    /// [`GeometryError`] when the image has another size.
    pub fn run_to(&mut self, stage: Stage, image: &Picture) -> Result<(), GeometryError> {
        match self {
            Self::Compact(executor) => executor.run(image),
            Self::Residual(executor) => executor.run_to(stage, image),
        }
    }

    /// Writes the maps of the last image: depth (mm) and registration at the pixels of `seen` (row-major) if given, else in the
    /// network's mask. That of the compact network is where the mask's probability is at least one half; the paper's network and
    /// R50F say a depth nearer to the range than to the -1 outside, at the stage that is read. R50F says the same at all stages.
    ///
    /// # Errors
    /// [`GeometryError::MapSize`] when `maps` or `seen` have another size than the image.
    pub fn read(&mut self, stage: Stage, seen: Option<&[bool]>, maps: &mut Maps) -> Result<(), GeometryError> {
        match self {
            Self::Compact(executor) => executor.read(stage, seen, maps),
            Self::Residual(executor) => executor.read(stage, seen, maps),
        }
    }
}

/// A network on a GPU, for images of one size.
#[cfg(feature = "webgpu")]
#[derive(Debug)]
pub enum GpuExecutor {
    /// The compact network.
    Compact(Box<CompactGpuExecutor>),
    /// The paper's network.
    Residual(Box<ResidualGpuExecutor>),
}

#[cfg(feature = "webgpu")]
impl GpuExecutor {
    /// Gets a network ready for images of 480 x 270 pixels. What the GPU refuses, the first run reports.
    ///
    /// # Errors
    /// [`GpuError::Plan`] when `weights` are not those of `config`, and with [`PlanError::Architecture`] for R50F: its dense layers are
    /// larger than what every GPU can bind. Others when the GPU failed before.
    pub fn new(gpu: &Gpu, config: &NetworkConfig, weights: &Weights) -> Result<Self, GpuError> {
        match config.architecture {
            Architecture::Compact(_) => {
                let image = (CANONICAL_WIDTH, CANONICAL_HEIGHT);
                let executor = CompactGpuExecutor::new(gpu, config, image, weights)?;
                Ok(Self::Compact(Box::new(executor)))
            }
            Architecture::Paper(_) => {
                let executor = ResidualGpuExecutor::new(gpu, config, weights)?;
                Ok(Self::Residual(Box::new(executor)))
            }
            Architecture::R50F(_) => Err(PlanError::Architecture(config.architecture.name()).into()),
        }
    }

    /// Takes an image of the training camera through the network.
    ///
    /// # Errors
    /// [`GpuError::Image`] when the image has another size; others when the GPU was lost or failed.
    pub async fn run(&mut self, image: &Picture) -> Result<(), GpuError> {
        match self {
            Self::Compact(executor) => executor.run(image).await,
            Self::Residual(executor) => executor.run(image).await,
        }
    }

    /// Writes the maps of the last image, see [`Executor::read`].
    ///
    /// # Errors
    /// [`GeometryError::MapSize`] when `maps` or `seen` have another size than the image.
    pub fn read(&mut self, stage: Stage, seen: Option<&[bool]>, maps: &mut Maps) -> Result<(), GeometryError> {
        match self {
            Self::Compact(executor) => executor.read(stage, seen, maps),
            Self::Residual(executor) => executor.read(stage, seen, maps),
        }
    }
}
