//! The table of layers against numbers worked out by hand, and against the weights themselves.

use super::network;
use burn::module::Module;
use deepsft::{Architecture, CompactConfig, PaperConfig, R50FConfig};
use deepsft_network::{Block, LayerDescription};

fn of(layers: &[LayerDescription], block: Block) -> Vec<&LayerDescription> {
    layers.iter().filter(|layer| layer.block == block).collect()
}

/// Sizes and parameters of a block's rows that have any.
fn rows(layers: &[LayerDescription], block: Block) -> Vec<([usize; 3], usize)> {
    let weighty = of(layers, block).into_iter().filter(|layer| layer.cost.parameters > 0);
    weighty.map(|layer| (layer.output, layer.cost.parameters)).collect()
}

/// 10^9 floating-point operations of a block.
fn gigaflops(layers: &[LayerDescription], block: Block) -> f64 {
    of(layers, block).iter().map(|layer| layer.cost.flops).sum::<u64>() as f64 / 1e9
}

/// Parameters of a bottleneck block by hand: a convolution has k^2 in out + out, its batch normalisation 4 out.
fn bottleneck(inputs: usize, [a, b, c]: [usize; 3], shortcut: bool) -> usize {
    let normalised = |inputs: usize, outputs: usize, area: usize| area * inputs * outputs + 5 * outputs;
    let branch = normalised(inputs, a, 1) + normalised(a, b, 9) + normalised(b, c, 1);
    branch + if shortcut { normalised(inputs, c, 1) } else { 0 }
}

/// 2 x multiply-adds of a bottleneck block for each pixel of its output.
fn operations(inputs: usize, [a, b, c]: [usize; 3], shortcut: bool) -> usize {
    2 * (inputs * a + 9 * a * b + b * c + if shortcut { inputs * c } else { 0 })
}

#[test]
fn the_paper_s_main_block_row_by_row() {
    let layers = network(Architecture::Paper(PaperConfig::default())).describe();
    let expected = [
        ([64, 135, 240], 9_728),
        ([256, 45, 80], 76_928),
        ([256, 45, 80], 143_104),
        ([512, 23, 40], 383_232),
        ([512, 23, 40], 847_104),
        ([1024, 12, 20], 1_520_128),
        ([1024, 12, 20], 5_608_960),
        ([256, 12, 20], 11_022_848),
        ([256, 12, 20], 49_864_960),
        ([128, 24, 40], 2_595_072),
        ([128, 23, 40], 7_488_384),
        ([64, 46, 80], 650_368),
        ([64, 46, 80], 1_250_944),
        ([64, 136, 240], 201_024),
        ([3, 270, 480], 1_731),
    ];
    assert_eq!(rows(&layers, Block::Main), expected);
    assert_eq!(bottleneck(64, [64, 64, 256], true), 76_928);
    assert_eq!(5 * bottleneck(256, [1024, 1024, 256], false), 49_864_960);
    assert_eq!(
        expected.iter().map(|(_, parameters)| parameters).sum::<usize>(),
        81_664_515
    );
    // 83.2 by hand; the stack of decoder 6 is worked out here: a block at 24 x 40, three at 23 x 40.
    assert!(
        (gigaflops(&layers, Block::Main) - 83.2).abs() < 0.05,
        "{}",
        gigaflops(&layers, Block::Main)
    );
    let decoder: u64 = layers
        .iter()
        .filter(|l| l.name.starts_with("dec6"))
        .take(3)
        .map(|l| l.cost.flops)
        .sum();
    let by_hand =
        24 * 40 * operations(256, [512, 512, 128], true) + 3 * 23 * 40 * operations(128, [512, 512, 128], false);
    assert_eq!(decoder, by_hand as u64);
}

#[test]
fn the_paper_s_refinement_blocks_row_by_row() {
    let layers = network(Architecture::Paper(PaperConfig::default())).describe();
    for (block, outputs, last) in [
        (Block::DepthRefinement, 1, 577),
        (Block::RegistrationRefinement, 2, 1_154),
    ] {
        let expected = [
            ([64, 135, 240], 19_136),
            ([256, 45, 80], 76_928),
            ([256, 45, 80], 143_104),
            ([512, 23, 40], 383_232),
            ([512, 23, 40], 847_104),
            ([128, 46, 80], 2_758_912),
            ([128, 46, 80], 7_488_384),
            ([64, 92, 160], 650_368),
            ([64, 90, 160], 1_250_944),
            ([outputs, 270, 480], last),
        ];
        assert_eq!(rows(&layers, block), expected);
        assert!(
            (gigaflops(&layers, block) - 135.3).abs() < 0.2,
            "{}",
            gigaflops(&layers, block)
        );
    }
    // What runs before the up-sampling costs a quarter: in decoders 6 and 7 the 1x1 convolutions that come in.
    let saved: u64 = of(&layers, Block::DepthRefinement)
        .iter()
        .map(|l| l.cost.flops - l.cost.executed_flops)
        .sum();
    let incoming = 2_u64 * (46 * 80 * 512 * (512 + 128) + 92 * 160 * 128 * (256 + 64));
    assert_eq!(saved, incoming * 3 / 4);
}

#[test]
fn rows_add_up_to_the_weights_and_end_in_the_maps_for_every_architecture() {
    for architecture in [
        Architecture::Compact(Default::default()),
        Architecture::Paper(PaperConfig::narrow(8)),
        Architecture::R50F(R50FConfig::narrow(8)),
    ] {
        let network = network(architecture);
        for network in [network.clone(), network.fold()] {
            let layers = network.describe();
            for &block in Block::ALL {
                let sum: usize = of(&layers, block).iter().map(|layer| layer.cost.parameters).sum();
                assert_eq!(
                    sum,
                    super::block_parameters(&network, block),
                    "{} of {:?}",
                    block.name(),
                    network.config()
                );
            }
            assert_eq!(
                layers.iter().map(|layer| layer.cost.parameters).sum::<usize>(),
                network.num_params()
            );
            assert!(layers.iter().all(|layer| layer.cost.executed_flops <= layer.cost.flops));
        }
    }
}

#[test]
fn the_compact_network_has_a_67th_of_the_papers_parameters_and_a_250th_of_its_operations() {
    let [compact, paper] = [
        Architecture::Compact(CompactConfig::default()),
        Architecture::Paper(PaperConfig::default()),
    ]
    .map(|architecture| network(architecture).describe());
    let ratio =
        |of: fn(&LayerDescription) -> f64| paper.iter().map(of).sum::<f64>() / compact.iter().map(of).sum::<f64>();
    assert_eq!(ratio(|layer| layer.cost.parameters as f64).round(), 67.0);
    let operations = ratio(|layer| layer.cost.flops as f64);
    assert!((245.0..255.0).contains(&operations), "{operations}");
}

/// ResNet-50 is known for 4.1 x 10^9 multiply-adds on 224 x 224 pixels (with the stride in the 3x3 convolutions; in the
/// 1x1, as in Keras, 3.9). Ours sees 2.58 times as many pixels, its sides rounded up at each stride.
#[test]
fn r50f_costs_what_a_resnet_50_of_its_size_costs() {
    let layers = network(Architecture::R50F(R50FConfig::default())).describe();
    let (encoder, dense): (Vec<_>, Vec<_>) = layers.iter().partition(|layer| !layer.name.starts_with("dense"));
    let encoder = encoder.iter().map(|layer| layer.cost.flops).sum::<u64>() as f64 / 2e9;
    let expected = 3.86 * (270.0 * 480.0) / (224.0 * 224.0);
    assert!((encoder / expected - 1.0).abs() < 0.05, "{encoder} {expected}");
    let dense: u64 = dense.iter().map(|layer| layer.cost.flops).sum();
    assert_eq!(dense, 2 * (276_480 * 200 + 200 * 388_800));
}
