//! A network of others by its name: its weights, its loss, and what it answers.

use super::batch::{Batch, M_PER_MM};
use super::bts::Bts;
use super::dense_depth::DenseDepth;
use super::hdm_net::HdmNet;
use super::ismo_gan::IsMoGan;
use anyhow::{Result, anyhow};
use burn::module::{Module, ModuleVisitor, Param};
use burn::tensor::{Device, Tensor};
use clap::{Args, ValueEnum};
use deepsft_geometry::glam::DVec3;
use deepsft_geometry::{Maps, Picture};
use serde::{Deserialize, Serialize};
use std::sync::{Mutex, PoisonError};

/// A network that can be trained.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Rival {
    /// HDM-Net (Golyanik et al. 2018): the sheet's grid
    HdmNet,
    /// IsMo-GAN (Shimada et al. 2019): the same, adversarial
    IsmoGan,
    /// DenseDepth (Alhashim, Wonka 2018): depth alone
    DenseDepth,
    /// BTS (Lee et al. 2019): depth alone
    Bts,
}

/// What is trained, and on what.
#[derive(Args, Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Settings {
    /// The network
    #[arg(value_name = "METHOD", value_enum)]
    pub method: Rival,
    /// What all widths are divided by: 1 for the authors', for which a GPU is needed
    #[arg(long, value_name = "N", default_value_t = 8, value_parser = clap::value_parser!(u64).range(1..=32))]
    pub width_divisor: u64,
    /// Samples in a batch
    #[arg(long, value_name = "N", default_value_t = 4, value_parser = clap::value_parser!(u64).range(2..=64))]
    pub batch: u64,
    /// Seed of samples and weights
    #[arg(long, value_name = "S", default_value_t = 1)]
    pub seed: u64,
}

/// A network with its weights.
#[derive(Module, Debug)]
#[allow(
    clippy::large_enum_variant,
    reason = "there are few of them, and burn takes no boxed modules"
)]
pub enum RivalNetwork {
    HdmNet(HdmNet),
    IsmoGan(IsMoGan),
    DenseDepth(DenseDepth),
    Bts(Bts),
}

/// What a network says of an image.
#[derive(Clone, Debug)]
pub enum Said {
    /// The sheet's vertices, mm, camera frame.
    Vertices(Vec<DVec3>),
    /// Maps of depth alone, of every pixel: their registration means nothing.
    Depth(Maps),
}

/// Draws the weights, which burn leaves until they are used.
struct Draw;

impl ModuleVisitor for Draw {
    fn visit_float<const D: usize>(&mut self, param: &Param<Tensor<D>>) {
        param.val();
    }
}

impl RivalNetwork {
    /// New weights for sheets with `grid` (columns, rows) vertices, by the seed of `settings`.
    pub fn new(settings: &Settings, grid: (usize, usize), device: &Device) -> Self {
        // All threads draw from one generator: of two networks that are made at once none would have the weights of its seed.
        static DRAWING: Mutex<()> = Mutex::new(());
        let _drawing = DRAWING.lock().unwrap_or_else(PoisonError::into_inner);
        device.seed(settings.seed);
        let divisor = settings.width_divisor as usize;
        let network = match settings.method {
            Rival::HdmNet => Self::HdmNet(HdmNet::new(3, grid, divisor, device)),
            Rival::IsmoGan => Self::IsmoGan(IsMoGan::new(grid, divisor, device)),
            Rival::DenseDepth => Self::DenseDepth(DenseDepth::new(divisor, device)),
            Rival::Bts => Self::Bts(Bts::new(divisor, device)),
        };
        network.visit(&mut Draw);
        network
    }

    /// What training minimises, [1].
    pub fn loss(&self, batch: &Batch) -> Tensor<1> {
        match self {
            Self::HdmNet(network) => network.loss(batch),
            Self::IsmoGan(network) => network.loss(batch),
            Self::DenseDepth(network) => network.loss(batch),
            Self::Bts(network) => network.loss(batch),
        }
    }

    /// What it says of `picture`; the network is on the plain `device`.
    /// Fails when the device fails.
    pub fn say(&self, picture: &Picture, device: &Device) -> Result<Said> {
        let images = Batch::image(picture, device);
        let (said, is_depth) = match self {
            Self::HdmNet(network) => (network.points(images), false),
            Self::IsmoGan(network) => (network.points(images), false),
            Self::DenseDepth(network) => (network.depth(images), true),
            Self::Bts(network) => (network.depth(images), true),
        };
        let [.., padded_width] = said.dims();
        let values = said.into_data().try_to_vec::<f32>();
        let values = values.map_err(|error| anyhow!("{error:?}"))?;
        if !is_depth {
            let count = values.len() / 3;
            let of = |k: usize| [0, 1, 2].map(|axis| f64::from(values[axis * count + k] / M_PER_MM));
            return Ok(Said::Vertices((0..count).map(|k| DVec3::from(of(k))).collect()));
        }
        let mut maps = Maps::empty(picture.size());
        for pixel in 0..maps.depth().len() {
            let (row, column) = (pixel / picture.width(), pixel % picture.width());
            maps.set(pixel, values[row * padded_width + column] / M_PER_MM, [0.0; 2]);
        }
        Ok(Said::Depth(maps))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Counts weights that learn: no running means and variances.
    struct Learning(usize);

    impl ModuleVisitor for Learning {
        fn visit_float<const D: usize>(&mut self, param: &Param<Tensor<D>>) {
            self.0 += usize::from(param.is_require_grad()) * param.shape().num_elements();
        }
    }

    #[test]
    fn full_networks_have_as_many_parameters_as_when_they_were_written() {
        let device = Device::flex().autodiff();
        let parameters = |method| {
            let mut learning = Learning(0);
            let settings = Settings {
                method,
                width_divisor: 1,
                batch: 2,
                seed: 1,
            };
            RivalNetwork::new(&settings, (73, 73), &device).visit(&mut learning);
            learning.0
        };
        // As we remember, the authors print 42.6 and 47.0 million; it was not looked up.
        assert_eq!(parameters(Rival::DenseDepth), 42_657_689);
        assert_eq!(parameters(Rival::Bts), 47_000_688);
        assert_eq!([Rival::HdmNet, Rival::IsmoGan].map(parameters), [2_107_779, 4_629_253]);
    }
}
