//! The table of a network's layers as text.

use super::block::Block;
use super::description::{Cost, LayerDescription};
use std::fmt::Write;

/// The layers of the network called `name`, the totals of its blocks and of all: lines for a terminal.
pub fn layer_table(name: &str, layers: &[LayerDescription]) -> String {
    let longest = layers.iter().map(|layer| layer.name.len()).max().unwrap_or(0);
    let mut text = String::new();
    // Writing into a String cannot fail.
    let _ = writeln!(
        text,
        "{name}, one image of 480 x 270 pixels (sizes: channels x rows x columns)"
    );
    for &block in Block::ALL {
        let of_block: Vec<&LayerDescription> = layers.iter().filter(|layer| layer.block == block).collect();
        if of_block.is_empty() {
            continue;
        }
        let _ = writeln!(text, "\n{}", block.name());
        let _ = writeln!(
            text,
            "  {:longest$}  {:>16}  {:>12}  {:>10}",
            "layer", "output", "parameters", "GFLOP"
        );
        for layer in &of_block {
            let [channels, rows, columns] = layer.output;
            let _ = writeln!(
                text,
                "  {:longest$}  {:>16}  {:>12}  {:>10.4}",
                layer.name,
                format!("{channels} x {rows} x {columns}"),
                grouped(layer.cost.parameters),
                giga(layer.cost.flops),
            );
        }
        let _ = writeln!(
            text,
            "  {:longest$}  {:>16}  {}",
            block.name(),
            "",
            total(of_block.iter().map(|layer| layer.cost).sum())
        );
    }
    let all: Cost = layers.iter().map(|layer| layer.cost).sum();
    let _ = writeln!(text, "\n  {:longest$}  {:>16}  {}", "all", "", total(all));
    let megabytes = |bytes: usize| (all.parameters * bytes) as f64 / 1e6;
    let _ = writeln!(
        text,
        "\nweights: {:.1} MB in f32, {:.1} MB in a bundle (8 bits)",
        megabytes(4),
        megabytes(1)
    );
    if all.executed_flops < all.flops {
        let _ = writeln!(
            text,
            "executed: {:.1} GFLOP, since 1x1 convolutions of decoding blocks run before the up-sampling",
            giga(all.executed_flops)
        );
    }
    text
}

/// Parameters and operations, as wide as their columns.
fn total(cost: Cost) -> String {
    format!("{:>12}  {:>10.4}", grouped(cost.parameters), giga(cost.flops))
}

fn giga(flops: u64) -> f64 {
    flops as f64 / 1e9
}

/// Digits in groups of three: 13,618,689.
fn grouped(number: usize) -> String {
    let digits = number.to_string();
    let groups: Vec<&str> = (0..digits.len())
        .rev()
        .step_by(3)
        .map(|last| &digits[last.saturating_sub(2)..=last])
        .collect();
    groups.into_iter().rev().collect::<Vec<_>>().join(",")
}
