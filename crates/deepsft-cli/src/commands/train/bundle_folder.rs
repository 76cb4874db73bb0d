//! The folder of a model bundle that a training writes.

use super::recording_steps::FIGURES_FILE;
use crate::output::curve_plot;
use deepsft::MODEL_FILE;
use deepsft_formats::FolderKind;
use deepsft_train::{CARD_FILE, CURVE_FILE};

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
