//! The data sets that `deepsft eval` measures on: made on the fly, from disk, recorded.

use crate::failure::BlameInput;
use crate::progress;
use crate::synthesis::{self, SynthesisOptions};
use anyhow::{Result, anyhow};
use deepsft::ModelBundle;
use deepsft_synth::{CAMERA_FILE, DATASET_FILE, DatasetFolder, Recording, TRUTH_FOLDER};
use deepsft_train::{EvaluationFrame, FrameTruth, TrainError};
use indicatif::ProgressBar;
use std::path::{Path, PathBuf};

/// A data set as it was asked for.
pub enum DataSet<'a> {
    /// Images made of the model's own template.
    Synthetic {
        count: u64,
        seed: u64,
        images: &'a SynthesisOptions,
    },
    /// A data set or a recording in a folder.
    Folder(&'a PathBuf),
}

/// The frames to measure on.
pub struct FrameSet {
    /// The set's name in tables.
    pub name: String,
    /// How many frames it has.
    pub count: u64,
    /// The frames in order.
    pub frames: Box<dyn Iterator<Item = Result<EvaluationFrame>>>,
}

impl FrameSet {
    /// What `measure` finds of the frames, which also gets a bar to count them on. A frame that cannot be read is an error.
    pub fn measure<T>(
        self,
        measure: impl FnOnce(&mut dyn Iterator<Item = EvaluationFrame>, &ProgressBar) -> Result<T, TrainError>,
    ) -> Result<T> {
        let bar = progress::counting(self.count, "frames");
        let mut unreadable = None;
        let mut frames = self
            .frames
            .map_while(|frame| frame.map_err(|error| unreadable = Some(error)).ok());
        let measured = measure(&mut frames, &bar)?;
        bar.finish_and_clear();
        unreadable.map_or(Ok(measured), Err)
    }
}

impl DataSet<'_> {
    /// The frames for a model.
    pub fn open(&self, bundle: &ModelBundle) -> Result<FrameSet> {
        match self {
            Self::Synthetic { count, seed, images } => synthetic(*count, *seed, images, bundle),
            Self::Folder(folder) if folder.join(CAMERA_FILE).is_file() => recording(folder, bundle),
            Self::Folder(folder) => {
                let set = DatasetFolder::open(folder)?;
                let template = set.description().check_template(bundle.template());
                template.blame("data set", folder)?;
                let samples = set.samples(*bundle.camera())?;
                Ok(FrameSet {
                    name: format!("data set {}", folder.display()),
                    count: set.description().samples,
                    frames: Box::new(samples.map(|sample| Ok(sample?.into()))),
                })
            }
        }
    }
}

fn synthetic(count: u64, seed: u64, images: &SynthesisOptions, bundle: &ModelBundle) -> Result<FrameSet> {
    if seed == bundle.card().provenance.seed {
        eprintln!("warning: the model was trained with seed {seed}: these frames are not new to it");
    }
    let synthesizer = synthesis::synthesizer(bundle.template(), images)?;
    Ok(FrameSet {
        name: format!("{count} synthetic frames of seed {seed}{}", images.note()),
        count,
        frames: Box::new(deepsft_synth::samples(synthesizer, seed, 0..count).map(|sample| Ok(sample?.into()))),
    })
}

/// A recording: with exact truth if it is simulated and the truth lies beside, otherwise with the depth it measured.
fn recording(folder: &Path, bundle: &ModelBundle) -> Result<FrameSet> {
    let recording = Recording::open(folder).blame("recording", folder)?;
    let count = recording.frames() as u64;
    let camera = *bundle.camera();
    let simulated = recording.sensor().simulated;
    let kind = if simulated { "simulated recording" } else { "recording" };
    let path = folder.to_path_buf();
    let recorded = deepsft_synth::in_order(0..count, move |index| -> Result<EvaluationFrame> {
        let frame = recording.frame(index as usize, &camera);
        Ok(EvaluationFrame::recorded(frame.blame("recording", &path)?, camera))
    });
    let truth = folder.join(TRUTH_FOLDER);
    let (truth, frames): (_, Box<dyn Iterator<Item = _>>) = if simulated && truth.join(DATASET_FILE).is_file() {
        let truth = DatasetFolder::open(&truth)?;
        let description = truth.description();
        let template = description.check_template(bundle.template());
        template.blame("recording", folder)?;
        let samples = description.samples;
        if samples != count {
            Err(anyhow!("its truth has {samples} frames, it has {count}")).blame("recording", folder)?;
        }
        let frames = recorded.zip(truth.samples(camera)?).map(|(recorded, exact)| {
            let (mut frame, sample) = (recorded?, exact?);
            frame.truth = FrameTruth::Exact {
                maps: sample.truth,
                has_template: sample.has_template,
            };
            Ok(frame)
        });
        ("exact truth", Box::new(frames))
    } else {
        ("measured depth", Box::new(recorded))
    };
    Ok(FrameSet {
        name: format!("{kind} {}, {truth}", folder.display()),
        count,
        frames,
    })
}
