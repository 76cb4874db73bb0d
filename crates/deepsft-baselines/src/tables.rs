//! `deepsft-baselines tables`: the paper's tables, with our rows beside its figures.

use crate::compare::{self, Comparison};
use crate::figure;
use crate::frames::Source;
use crate::paper;
use crate::table;
use anyhow::{Context, Result, ensure};
use clap::Args;
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

/// A table that is to be made: its name, the model, the frames, and which of the paper's tables it stands beside.
type Table = (&'static str, &'static str, Source, &'static paper::Table);

impl TablesArguments {
    fn tables(&self) -> Vec<Table> {
        let stills = Source {
            stills: true,
            ..Source::default()
        };
        let recording = Source {
            recording: true,
            ..Source::default()
        };
        let blender = self.blender.clone().map(|folder| Source {
            data: Some(folder),
            ..Source::default()
        });
        let (sheets, solids) = (&paper::SYNTHETIC_SHEETS, &paper::SYNTHETIC_SOLIDS);
        let mut tables = vec![
            ("sheet, stills", "poster-a4", stills.clone(), sheets),
            ("sheet, clips", "poster-a4", Source::default(), sheets),
            (
                "sheet, simulated recording",
                "poster-a4",
                recording,
                &paper::REAL_SHEETS,
            ),
            ("tube, stills", "paper-tube", stills.clone(), solids),
            ("toy, stills", "soft-toy", stills, solids),
        ];
        tables.extend(blender.map(|source| ("sheet, Blender", "poster-a4", source, sheets)));
        tables.retain(|(name, ..)| self.only.as_ref().is_none_or(|only| name.contains(only)));
        tables
    }
}

pub fn run(arguments: &TablesArguments) -> Result<()> {
    let tables = arguments.tables();
    ensure!(!tables.is_empty(), "no table has this name; see `tables --help`");
    let (mut markdown, mut all, mut panels) = (Vec::new(), Vec::new(), Vec::new());
    for (name, model, source, beside) in tables {
        eprintln!("{name}");
        let folder = arguments.models.join(model);
        let comparison = Comparison {
            template: folder.join("template"),
            source,
            frames: arguments.frames,
            seed: compare::SEED,
            model: vec![folder],
            trained: arguments.trained.clone().filter(|_| model == "poster-a4"),
            ..Comparison::default()
        };
        let (mut rows, mut of_table) = comparison.run().with_context(|| name)?;
        beside.fill(&mut rows);
        let command = format!("deepsft-baselines tables --frames {} --only '{name}'", arguments.frames);
        let (sets, table) = (beside.sets, table::markdown(&rows));
        markdown.push(format!("## {name}\n\nThe paper's columns: {sets}.\n\n{table}\n"));
        let measured = table::json(&rows, &command);
        all.push(json!({"table": name, "sets_of_the_paper": sets, "measured": measured}));
        panels.append(&mut of_table);
        // What has ended is not lost when a later table fails.
        table::write(&arguments.out, &markdown.join("\n"), &json!(all))?;
        figure::write(&arguments.out, &panels)?;
    }
    println!("{}", markdown.join("\n"));
    Ok(())
}
