//! `deepsft-baselines tables`: the paper's tables, with our rows beside its figures.

use crate::compare::{Comparison, write_tables};
use crate::frames::{Condition, Source};
use crate::paper;
use crate::table;
use anyhow::{Context, Result, ensure};
use clap::Args;
use deepsft_synth::FIRST_CLIP_SEED;
use serde_json::json;
use std::path::PathBuf;

#[derive(Args)]
#[command(after_help = "\
Tables, each on its own frames by fixed seeds:
  sheet, stills        single images as of training: the paper's DS1S and DS2S
  sheet, clips         short videos, in which optical flow and tracking work
  sheet, recording     a simulated RGB-D recording: the paper's DS1R, DS2R and DS5R are real
  sheet, Blender       with --blender: the paper's own protocol by the paper's tool, `crates/deepsft-lab/blender/render_paper.py`
  tube, toy: stills    surfaces with a back: the paper's DS3S and DS4S are such objects

Rows are those of `compare`, and of R50F and the paper's network where --trained has bundles of them. The paper's figures stand beside
(mean RMSE of each of its sets), of its objects and its machine.

The command writes
  DIR/table.md      the tables as they are printed
  DIR/table.json    every figure of every frame
  DIR/figure.png    frames of each table: image, and the depth error of each method, black for none to yellow for 20 mm

Example:
  deepsft-baselines tables --trained trained --frames 30 --out tables")]
pub struct TablesArguments {
    /// Folder with the models poster-a4, paper-tube and soft-toy
    #[arg(long, value_name = "DIR", default_value = "models")]
    models: PathBuf,
    /// Folder of networks for the poster, as of `compare`
    #[arg(long, value_name = "DIR")]
    trained: Option<PathBuf>,
    /// Data set of the poster that Blender has rendered
    #[arg(long, value_name = "DIR")]
    blender: Option<PathBuf>,
    /// Frames to measure in each table
    #[arg(long, value_name = "N", default_value_t = 30, value_parser = clap::value_parser!(u64).range(1..=100_000))]
    frames: u64,
    /// Tables whose names have this in them alone
    #[arg(long, value_name = "NAME")]
    only: Option<String>,
    /// Folder for tables and figure
    #[arg(long, value_name = "DIR")]
    out: PathBuf,
}

/// A table that is to be made.
struct Table {
    name: &'static str,
    model: &'static str,
    source: Source,
    /// Which of the paper's tables it stands beside.
    beside: &'static paper::Table,
}

impl TablesArguments {
    fn tables(&self) -> Vec<Table> {
        let stills = || Source::Stills(Condition::Trained);
        let of = |name, model, source, beside| Table {
            name,
            model,
            source,
            beside,
        };
        let mut tables = vec![
            of("sheet, stills", "poster-a4", stills(), &paper::SYNTHETIC_SHEETS),
            of("sheet, clips", "poster-a4", Source::Clips, &paper::SYNTHETIC_SHEETS),
            of(
                "sheet, simulated recording",
                "poster-a4",
                Source::Recording,
                &paper::REAL_SHEETS,
            ),
            of("tube, stills", "paper-tube", stills(), &paper::SYNTHETIC_SOLIDS),
            of("toy, stills", "soft-toy", stills(), &paper::SYNTHETIC_SOLIDS),
        ];
        if let Some(folder) = &self.blender {
            let source = Source::DataSet(folder.clone());
            tables.push(of("sheet, Blender", "poster-a4", source, &paper::SYNTHETIC_SHEETS));
        }
        tables.retain(|table| self.only.as_ref().is_none_or(|only| table.name.contains(only)));
        tables
    }
}

pub fn run(arguments: &TablesArguments) -> Result<()> {
    let tables = arguments.tables();
    ensure!(!tables.is_empty(), "no table has this name; see `tables --help`");
    let (mut markdown, mut all, mut panels) = (Vec::new(), Vec::new(), Vec::new());
    for table in tables {
        eprintln!("{}", table.name);
        let model = arguments.models.join(table.model);
        let is_poster = table.model == "poster-a4";
        let comparison = Comparison {
            template: &model.join("template"),
            source: table.source,
            frames: arguments.frames as usize,
            seed: FIRST_CLIP_SEED + 500,
            methods: Vec::new(),
            models: std::slice::from_ref(&model),
            trained: arguments.trained.as_deref().filter(|_| is_poster),
            predictions: None,
            subdivisions: 0,
        };
        let mut compared = comparison.run().with_context(|| table.name)?;
        table.beside.fill(&mut compared.rows);
        let command = format!(
            "deepsft-baselines tables --frames {} --only '{}'",
            arguments.frames, table.name
        );
        markdown.push(format!(
            "## {}\n\nThe paper's columns: {}.\n\n{}\n",
            table.name,
            table.beside.sets,
            table::markdown(&compared.rows)
        ));
        all.push(json!({"table": table.name, "sets_of_the_paper": table.beside.sets, "measured": table::json(&compared.rows, &command)}));
        panels.append(&mut compared.panels);
        // What has ended is not lost when a later table fails.
        write_tables(&arguments.out, &markdown.join("\n"), &json!(all), &panels)?;
    }
    println!("{}", markdown.join("\n"));
    Ok(())
}
