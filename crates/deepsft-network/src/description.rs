//! A network as a table of layers: sizes, parameters, cost.

use super::block::Block;
use burn::module::Module;
use deepsft_geometry::{CANONICAL_HEIGHT, CANONICAL_WIDTH};

/// A row of the table.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct LayerDescription {
    /// Block it belongs to.
    pub block: Block,
    /// Its name and what it is.
    pub name: String,
    /// Channels, rows and columns of what comes out.
    pub output: [usize; 3],
    /// Its parameters and operations.
    pub cost: Cost,
}

/// Parameters and operations of a layer.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Cost {
    /// Values of its weights; batch normalisation counts four per channel.
    pub parameters: usize,
    /// Floating-point operations of convolutions and dense layers for one 480 x 270 image. A multiplication and an addition
    /// count as two; all are counted as the architecture has them. Not counted: additions of biases, normalisation,
    /// activations, pooling, up-sampling, and the compact network's geometric cues.
    pub flops: u64,
    /// The same as they are executed: 1x1 convolutions of decoding blocks run before the up-sampling.
    pub executed_flops: u64,
}

impl Cost {
    /// A `layer` with filters of shape [out, in, k, k] that says `pixels` values per filter, and is executed on
    /// 1 / `saving` of them.
    pub(super) fn of<M: Module>(
        layer: &M,
        [outputs, inputs, height, width]: [usize; 4],
        pixels: usize,
        saving: usize,
    ) -> Self {
        let flops = 2 * (outputs * inputs * height * width * pixels) as u64;
        Self {
            parameters: layer.num_params(),
            flops,
            executed_flops: flops / saving as u64,
        }
    }
}

impl std::iter::Sum for Cost {
    fn sum<I: Iterator<Item = Self>>(costs: I) -> Self {
        costs.fold(Self::default(), |a, b| Self {
            parameters: a.parameters + b.parameters,
            flops: a.flops + b.flops,
            executed_flops: a.executed_flops + b.executed_flops,
        })
    }
}

/// The table while layers write themselves into it, one after the other, each on what the last one said.
pub(super) struct LayerTable {
    block: Block,
    /// Channels, rows and columns of the map that the next layer sees.
    pub size: [usize; 3],
    pub layers: Vec<LayerDescription>,
}

impl LayerTable {
    pub fn new() -> Self {
        Self {
            block: Block::Main,
            size: [3, CANONICAL_HEIGHT, CANONICAL_WIDTH],
            layers: Vec::new(),
        }
    }

    /// Goes on with `block` on a map of `size` (channels, rows, columns).
    pub fn begin(&mut self, block: Block, size: [usize; 3]) {
        self.block = block;
        self.size = size;
    }

    /// Adds a layer.
    pub fn add(&mut self, name: impl Into<String>, output: [usize; 3], cost: Cost) {
        self.layers.push(LayerDescription {
            block: self.block,
            name: name.into(),
            output,
            cost,
        });
        self.size = output;
    }

    /// Adds a layer without weights that changes the size.
    pub fn resize(&mut self, name: &str, rows: usize, columns: usize) {
        self.add(name, [self.size[0], rows, columns], Cost::default());
    }
}
