//! A training that runs: its steps one after another, and the bundle that each leaves behind.

use super::data_sets::DataSets;
use super::plan::Plan;
use super::progress_lines::tell;
use super::recording_steps::{self, FIGURES_FILE, Figures};
use crate::output::curve_plot;
use crate::progress;
use crate::synthesis::quoted;
use anyhow::Result;
use deepsft::{DeviceDescription, MODEL_FILE, ModelBundle, encode_png};
use deepsft_formats::{FolderKind, FolderLock, StagedFolder};
use deepsft_geometry::RestSurface;
use deepsft_synth::Synthesizer;
use deepsft_train::{
    CARD_FILE, CURVE_FILE, CurvePoint, Device, ModelLabel, SampleSource, Trained, TrainingCourse, curve_csv,
    export_bundle, model_card, train,
};
use std::collections::BTreeMap;
use std::path::Path;
use std::sync::Arc;

/// The folder of a model bundle. One with a template in it may become a bundle.
pub const BUNDLE_FOLDER: FolderKind = FolderKind {
    known_by: &[MODEL_FILE, "template/template.json"],
    files: &[
        MODEL_FILE,
        "weights.bpk",
        "template/template.json",
        "template/texture.png",
        "template/mesh.obj",
        CARD_FILE,
        CURVE_FILE,
        curve_plot::PLOT_FILE,
        FIGURES_FILE,
        "step-2.csv",
        "step-2.png",
        "step-3.csv",
        "step-3.png",
    ],
};

/// A training that runs.
pub struct Training<'a> {
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
        let mut network = self.plan.arguments.network.config(
            self.plan.arguments.width_divisor.into(),
            template.size_mm().to_array(),
            &self.synthesizer.config().camera,
        )?;
        if !template.is_sheet() {
            network = network.with_rest_positions(RestSurface::side_mm(template));
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
        let (trained, figures) = recording_steps::run(&bundle, recording, self.plan, &self.device)?;
        println!("\n{}", figures.table);
        self.write(trained, curve, Some(figures))
    }

    /// The card of a bundle.
    fn card(&self, bundle: &ModelBundle, curve: &[CurvePoint], tuning: Option<&str>) -> String {
        let images = &self.plan.arguments.images;
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
    fn write(&self, trained: Trained, curve: &[CurvePoint], figures: Option<Figures>) -> Result<ModelBundle> {
        println!("measuring on held-out synthetic images");
        let arguments = self.plan.arguments;
        let folder = arguments.out.file_name().unwrap_or_default();
        let name = arguments.name.clone();
        let label = ModelLabel {
            name: name.unwrap_or_else(|| folder.to_string_lossy().into_owned()),
            licence: arguments.licence.clone(),
            command: command_line(),
        };
        let bundle = export_bundle(trained, &self.synthesizer, &self.plan.config, label)?;
        let mut extra = BTreeMap::new();
        let table = figures.as_ref().map(|figures| figures.table.as_str());
        extra.insert(CARD_FILE.to_owned(), self.card(&bundle, curve, table).into_bytes());
        if !curve.is_empty() {
            extra.insert(CURVE_FILE.to_owned(), curve_csv(curve).into_bytes());
        }
        if let Some(plot) = curve_plot::curve_plot(curve) {
            extra.insert(curve_plot::PLOT_FILE.to_owned(), encode_png(&plot)?);
        }
        extra.extend(figures.into_iter().flat_map(|figures| figures.files));
        extra.extend(bundle.to_files()?);
        StagedFolder::under(self.alone, &arguments.out, &BUNDLE_FOLDER)?
            .filled(&extra)?
            .commit()?;
        Ok(bundle)
    }
}

/// The command as it was typed, for the record.
fn command_line() -> String {
    let words = std::env::args().skip(1).map(|word| format!(" {}", quoted(word)));
    format!("deepsft{}", words.collect::<String>())
}
