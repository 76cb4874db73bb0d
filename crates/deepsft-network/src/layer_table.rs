//! The table of a network's layers as text.

use super::block::Block;
use super::description::LayerDescription;
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
        let of_block: Vec<_> = layers.iter().filter(|layer| layer.block == block).collect();
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
                grouped(layer.parameters),
                giga(layer.flops),
            );
        }
        let _ = writeln!(text, "  {:longest$}  {:>16}  {}", block.name(), "", total(&of_block));
    }
    let all: Vec<_> = layers.iter().collect();
    let _ = writeln!(text, "\n  {:longest$}  {:>16}  {}", "all", "", total(&all));
    let parameters: usize = layers.iter().map(|layer| layer.parameters).sum();
    let executed: u64 = layers.iter().map(|layer| layer.executed_flops).sum();
    let flops: u64 = layers.iter().map(|layer| layer.flops).sum();
    let megabytes = |bytes: usize| (parameters * bytes) as f64 / 1e6;
    let _ = writeln!(
        text,
        "\nweights: {:.1} MB in f32, {:.1} MB in a bundle (8 bits)",
        megabytes(4),
        megabytes(1)
    );
    if executed < flops {
        let _ = writeln!(
            text,
            "executed: {:.1} GFLOP, since 1x1 convolutions of decoding blocks run before the up-sampling",
            giga(executed)
        );
    }
    text
}

/// Parameters and operations of `layers` together, as wide as their columns.
fn total(layers: &[&LayerDescription]) -> String {
    let parameters = layers.iter().map(|layer| layer.parameters).sum();
    let flops = layers.iter().map(|layer| layer.flops).sum();
    format!("{:>12}  {:>10.4}", grouped(parameters), giga(flops))
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
