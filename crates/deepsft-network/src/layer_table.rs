//! The table of a network's layers as text.

use super::block::Block;
use super::description::{Cost, LayerDescription};

/// The layers of the network called `name`, the totals of its blocks and of all: lines for a terminal.
pub fn layer_table(name: &str, layers: &[LayerDescription]) -> String {
    let longest = layers.iter().map(|layer| layer.name.len()).max().unwrap_or(0);
    let line = |name: &str, output: &str, parameters: &str, operations: &str| {
        format!("  {name:longest$}  {output:>16}  {parameters:>12}  {operations:>10}\n")
    };
    let row = |name: &str, output: &str, cost: Cost| {
        let operations = format!("{:.4}", giga(cost.flops));
        line(name, output, &grouped(cost.parameters), &operations)
    };
    let mut text = format!("{name}, one image of 480 x 270 pixels (sizes: channels x rows x columns)\n");
    for &block in Block::ALL {
        let of_block: Vec<&LayerDescription> = layers.iter().filter(|layer| layer.block == block).collect();
        if of_block.is_empty() {
            continue;
        }
        text += &format!("\n{}\n", block.name());
        text += &line("layer", "output", "parameters", "GFLOP");
        for layer in &of_block {
            let [channels, rows, columns] = layer.output;
            text += &row(&layer.name, &format!("{channels} x {rows} x {columns}"), layer.cost);
        }
        text += &row(block.name(), "", of_block.iter().map(|layer| layer.cost).sum());
    }
    let all: Cost = layers.iter().map(|layer| layer.cost).sum();
    let megabytes = |bytes: usize| (all.parameters * bytes) as f64 / 1e6;
    text += &format!(
        "\n{}\nweights: {:.1} MB in f32, {:.1} MB in a bundle (8 bits)\n",
        row("all", "", all),
        megabytes(4),
        megabytes(1)
    );
    if all.executed_flops < all.flops {
        text += &format!(
            "executed: {:.1} GFLOP, since 1x1 convolutions of decoding blocks run before the up-sampling\n",
            giga(all.executed_flops)
        );
    }
    text
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
