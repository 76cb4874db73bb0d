//! `deepsft network`: what a network is made of.

use crate::network_choice;
use anyhow::Result;
use clap::Subcommand;
use deepsft_network::layer_table;

#[derive(Subcommand)]
pub enum NetworkCommand {
    /// Print a network's layers: sizes, parameters and operations, by block and in all.
    #[command(after_help = "\
Operations are those of convolutions and dense layers for one 480 x 270 image; a multiplication and an addition count as
two. A network given by name is described as it is trained, with batch normalisation (four parameters per channel). The
network of a model is folded.

Examples:
  deepsft network describe paper
  deepsft network describe models/poster-a4")]
    Describe {
        /// compact, paper, r50f, or the folder of a model bundle
        #[arg(value_name = "NETWORK|DIR")]
        network: String,
    },
}

pub fn run(command: &NetworkCommand) -> Result<()> {
    let NetworkCommand::Describe { network } = command;
    let network = network_choice::named(network)?;
    let name = network.config().architecture.name();
    print!("{}", layer_table(name, &network.describe()));
    Ok(())
}
