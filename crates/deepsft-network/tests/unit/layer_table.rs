//! The table of layers as text.

use deepsft_network::{Block, Cost, LayerDescription, layer_table};

#[test]
fn blocks_and_the_whole_are_summed_and_digits_come_in_groups_of_three() {
    let layer = |block, parameters, flops| LayerDescription {
        block,
        name: "conv".to_owned(),
        output: [1, 2, 3],
        cost: Cost {
            parameters,
            flops,
            executed_flops: flops,
        },
    };
    let layers = [
        layer(Block::Main, 13_618_600, 1_500_000_000),
        layer(Block::Main, 89, 500_000_000),
        layer(Block::RegistrationRefinement, 0, 250_000_000),
    ];
    let text = layer_table("test", &layers);
    let line = |start: &str| {
        let line = text.lines().rfind(|line| line.trim().starts_with(start)).unwrap();
        line.split_whitespace().rev().take(2).collect::<Vec<_>>().join(" ")
    };
    assert_eq!(line("main block"), "2.0000 13,618,689");
    assert_eq!(line("registration refinement"), "0.2500 0");
    assert_eq!(line("all"), "2.2500 13,618,689");
    assert!(!text.contains("depth refinement") && !text.contains("executed"));
    let of_one = |parameters| layer_table("test", &[layer(Block::Main, parameters, 0)]);
    for (parameters, digits) in [(577, " 577 "), (1_154, " 1,154 ")] {
        assert!(of_one(parameters).contains(digits), "{parameters}");
    }
}
