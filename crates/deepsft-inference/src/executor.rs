//! Runs a network of any architecture.

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
use deepsft_geometry::{CANONICAL_HEIGHT, CANONICAL_WIDTH, GeometryError, ImageSize, Maps, Picture};

/// Checks the size of images for networks that know one only.
fn check_canonical(image: ImageSize) -> Result<(), PlanError> {
    let expected = ImageSize::from((CANONICAL_WIDTH, CANONICAL_HEIGHT));
    if image == expected {
        return Ok(());
    }
    Err(PlanError::Shape {
        what: "the image".to_owned(),
        actual: vec![image.width, image.height],
        expected: vec![expected.width, expected.height],
    })
}

/// Runs a network on the processor, for images of one size. On one thread it allocates nothing after it was made.
#[derive(Debug)]
pub struct Executor(Network);

#[derive(Debug)]
enum Network {
    Compact(Box<CompactExecutor>),
    Residual(Box<ResidualExecutor>),
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
        let image = image.into();
        if let Architecture::Compact(_) = config.architecture {
            let executor = CompactExecutor::new(config, image, weights, threads)?;
            return Ok(Self(Network::Compact(Box::new(executor))));
        }
        check_canonical(image)?;
        let executor = ResidualExecutor::new(config, weights, threads)?;
        Ok(Self(Network::Residual(Box::new(executor))))
    }

    /// Takes an image of the training camera through the network.
    ///
    /// # Errors
    /// [`GeometryError`] when the image has another size.
    pub fn run(&mut self, image: &Picture) -> Result<(), GeometryError> {
        match &mut self.0 {
            Network::Compact(executor) => executor.run(image),
            Network::Residual(executor) => executor.run(image),
        }
    }

    /// Writes the maps of the last image: depth (mm) and registration at the pixels of `seen` (row-major) if given, else in the
    /// network's mask. That of the compact network is where the mask's probability is at least one half; the paper's network and
    /// R50F say a depth nearer to the range than to the -1 outside, at the stage that is read. R50F says the same at all stages.
    ///
    /// # Errors
    /// [`GeometryError::MapSize`] when `maps` or `seen` have another size than the image.
    pub fn read(&mut self, stage: Stage, seen: Option<&[bool]>, maps: &mut Maps) -> Result<(), GeometryError> {
        match &mut self.0 {
            Network::Compact(executor) => executor.read(stage, seen, maps),
            Network::Residual(executor) => executor.read(stage, seen, maps),
        }
    }

    /// Returns (u, v, d) of the compact network's cells of 8 pixels, d in normalised log depth: row after row. `None` for others.
    pub fn cells(&self, stage: Stage) -> Option<[&[f32]; 3]> {
        match &self.0 {
            Network::Compact(executor) => Some(executor.cells(stage)),
            Network::Residual(_) => None,
        }
    }

    /// Returns the compact network's logit of "the object is seen here" at a pixel of the last image. `None` for others.
    ///
    /// # Panics
    /// May panic for a pixel outside of the image.
    pub fn mask_logit(&self, x: usize, y: usize) -> Option<f32> {
        match &self.0 {
            Network::Compact(executor) => Some(executor.mask_logit(x, y)),
            Network::Residual(_) => None,
        }
    }
}

/// Runs a network on a GPU, for images of one size.
#[cfg(feature = "webgpu")]
#[derive(Debug)]
pub struct GpuExecutor(GpuNetwork);

#[cfg(feature = "webgpu")]
#[derive(Debug)]
enum GpuNetwork {
    Compact(Box<CompactGpuExecutor>),
    Residual(Box<ResidualGpuExecutor>),
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
        let image = image.into();
        let network = match config.architecture {
            Architecture::Compact(_) => {
                GpuNetwork::Compact(Box::new(CompactGpuExecutor::new(gpu, config, image, weights)?))
            }
            Architecture::Paper(_) => {
                check_canonical(image)?;
                GpuNetwork::Residual(Box::new(ResidualGpuExecutor::new(gpu, config, weights)?))
            }
            Architecture::R50F(_) => return Err(PlanError::Architecture(config.architecture.name()).into()),
        };
        Ok(Self(network))
    }

    /// Takes an image of the training camera through the network.
    ///
    /// # Errors
    /// [`GpuError::Image`] when the image has another size; others when the GPU was lost or failed.
    pub async fn run(&mut self, image: &Picture) -> Result<(), GpuError> {
        match &mut self.0 {
            GpuNetwork::Compact(executor) => executor.run(image).await,
            GpuNetwork::Residual(executor) => executor.run(image).await,
        }
    }

    /// Writes the maps of the last image, see [`Executor::read`].
    ///
    /// # Errors
    /// [`GeometryError::MapSize`] when `maps` or `seen` have another size than the image.
    pub fn read(&mut self, stage: Stage, seen: Option<&[bool]>, maps: &mut Maps) -> Result<(), GeometryError> {
        match &mut self.0 {
            GpuNetwork::Compact(executor) => executor.read(stage, seen, maps),
            GpuNetwork::Residual(executor) => executor.read(stage, seen, maps),
        }
    }

    /// Returns the compact network's cells, see [`Executor::cells`].
    pub fn cells(&self, stage: Stage) -> Option<[&[f32]; 3]> {
        match &self.0 {
            GpuNetwork::Compact(executor) => Some(executor.cells(stage)),
            GpuNetwork::Residual(_) => None,
        }
    }

    /// Returns a logit of the compact network's mask, see [`Executor::mask_logit`].
    ///
    /// # Panics
    /// May panic for a pixel outside of the image.
    pub fn mask_logit(&self, x: usize, y: usize) -> Option<f32> {
        match &self.0 {
            GpuNetwork::Compact(executor) => Some(executor.mask_logit(x, y)),
            GpuNetwork::Residual(_) => None,
        }
    }
}
