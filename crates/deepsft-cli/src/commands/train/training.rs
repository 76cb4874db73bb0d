//! A training that runs: its steps one after another, and the bundle that each leaves behind.

use super::arguments::TrainArguments;
use super::bundle_folder::BUNDLE_FOLDER;
use super::data_sets::DataSets;
use super::plan::Plan;
use super::progress_lines::tell;
use super::recording_steps::{self, TunedBundle};
use crate::output::curve_plot;
use crate::progress;
use crate::synthesis::quoted;
use anyhow::Result;
use deepsft::{DeviceDescription, ModelBundle, encode_png};
use deepsft_formats::{FolderLock, StagedFolder};
use deepsft_synth::Synthesizer;
use deepsft_train::{
    CARD_FILE, CURVE_FILE, Checkpoint, CurvePoint, Device, ModelLabel, SampleSource, Trained, TrainingCourse,
    curve_csv, export_bundle, model_card, train,
};
use std::collections::BTreeMap;
use std::path::Path;
use std::sync::Arc;

/// A training that runs.
pub struct Training<'a> {
    pub arguments: &'a TrainArguments,
    pub plan: &'a Plan<'a>,
    /// Of the bundle's folder.
    pub alone: &'a FolderLock,
    pub synthesizer: Arc<Synthesizer>,
    /// What step 1 is trained on; without it on images of the synthesizer.
    pub data_sets: Option<DataSets>,
    pub device: Device,
    pub description: DeviceDescription,
}

impl Training<'_> {
    /// Step 1: a bundle from nothing, written, and how it learned.
    pub fn step_one(&self) -> Result<(ModelBundle, Vec<CurvePoint>)> {
        let (template, config) = (self.synthesizer.template(), &self.plan.config);
        let mut network = self.arguments.network.config(
            self.arguments.width_divisor.into(),
            template.size_mm().to_array(),
            &self.synthesizer.config().camera,
        )?;
        if !template.is_sheet() {
            network = network.with_seams();
        }
        let source: Arc<dyn SampleSource> = match &self.data_sets {
            Some(data_sets) => data_sets.samples.clone(),
            None => self.synthesizer.clone(),
        };
        let bar = progress::fraction();
        let trained = train(&source, &network, config, &self.device, |told| tell(&bar, told))?;
        bar.finish_and_clear();
        let curve = trained.state.curve.clone();
        Ok((self.write(trained, &curve, None)?, curve))
    }

    /// Steps 2 and 3: a bundle from another one, written. `curve` is how that learned, if it did so now.
    pub fn recording_steps(&self, bundle: ModelBundle, curve: &[CurvePoint], recording: &Path) -> Result<ModelBundle> {
        let tuned = recording_steps::run(&bundle, recording, self.plan, &self.device)?;
        println!("\n{}", tuned.table);
        let before = &bundle.card().provenance;
        let trained = Trained {
            network: tuned.network.clone(),
            state: Checkpoint {
                samples: before.samples + tuned.samples,
                seconds: before.seconds + tuned.seconds,
                ..Checkpoint::default()
            },
        };
        self.write(trained, curve, Some(tuned))
    }

    /// The card of a bundle.
    fn card(&self, bundle: &ModelBundle, curve: &[CurvePoint], tuning: Option<&str>) -> String {
        let images = &self.arguments.images;
        let training_images = match &self.data_sets {
            Some(data_sets) => data_sets.to_string(),
            None => format!("made on the fly{}", images.note()),
        };
        let course = TrainingCourse {
            device: &self.description,
            training_images: self.plan.synthetic.then_some(training_images),
            curve,
            tuning,
            measured_images: [images.note(), images.options()],
        };
        model_card(bundle, &course)
    }

    /// Measures a network on synthetic images, and writes its bundle.
    fn write(&self, trained: Trained, curve: &[CurvePoint], tuned: Option<TunedBundle>) -> Result<ModelBundle> {
        println!("measuring on held-out synthetic images");
        let arguments = self.arguments;
        let folder_name = || {
            arguments
                .out
                .file_name()
                .unwrap_or_default()
                .to_string_lossy()
                .into_owned()
        };
        let label = ModelLabel {
            name: arguments.name.clone().unwrap_or_else(folder_name),
            licence: arguments.licence.clone(),
            command: command_line(),
        };
        let bundle = export_bundle(trained, &self.synthesizer, &self.plan.config, label)?;
        let mut extra = BTreeMap::new();
        let table = tuned.as_ref().map(|tuned| tuned.table.as_str());
        extra.insert(CARD_FILE.to_owned(), self.card(&bundle, curve, table).into_bytes());
        if !curve.is_empty() {
            extra.insert(CURVE_FILE.to_owned(), curve_csv(curve).into_bytes());
        }
        if let Some(plot) = curve_plot::curve_plot(curve) {
            extra.insert(curve_plot::PLOT_FILE.to_owned(), encode_png(&plot)?);
        }
        extra.extend(tuned.into_iter().flat_map(|tuned| tuned.files));
        extra.extend(bundle.to_files()?);
        StagedFolder::under(self.alone, &arguments.out, &BUNDLE_FOLDER)?
            .filled(&extra)?
            .commit()?;
        Ok(bundle)
    }
}

/// The command as it was typed, for the record.
fn command_line() -> String {
    let words = std::env::args().skip(1).map(quoted);
    std::iter::once("deepsft".to_owned())
        .chain(words)
        .collect::<Vec<_>>()
        .join(" ")
}
