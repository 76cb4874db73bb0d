//! The folder of a model bundle that a training writes.

use super::recording_steps::FIGURES_FILE;
use crate::output::curve_plot;
use anyhow::{Context, Result};
use deepsft::MODEL_FILE;
use deepsft_train::{CARD_FILE, CURVE_FILE};
use std::collections::BTreeMap;
use std::fs;
use std::path::Path;

/// File of the template inside a bundle: a folder with it may become a bundle.
const TEMPLATE_IN_BUNDLE: &str = "template/template.json";

/// Files by which a bundle's folder is known.
pub const MARKERS: [&str; 2] = [MODEL_FILE, TEMPLATE_IN_BUNDLE];

/// Files that a bundle's folder holds and that are not made by a training, by their paths in it.
pub fn companions(folder: &Path) -> Result<BTreeMap<String, Vec<u8>>> {
    let made = [
        MODEL_FILE,
        "weights.bpk",
        "template",
        CARD_FILE,
        CURVE_FILE,
        curve_plot::PLOT_FILE,
        FIGURES_FILE,
        "step-2.csv",
        "step-2.png",
        "step-3.csv",
        "step-3.png",
    ];
    let mut files = BTreeMap::new();
    if folder.is_dir() {
        collect(folder, "", &made, &mut files)?;
    }
    Ok(files)
}

/// Adds the files below `folder` but for those of the names `left_out`, their paths after `prefix`.
fn collect(folder: &Path, prefix: &str, left_out: &[&str], files: &mut BTreeMap<String, Vec<u8>>) -> Result<()> {
    let unreadable = |path: &Path| format!("could not read {}", path.display());
    for entry in fs::read_dir(folder).with_context(|| unreadable(folder))? {
        let path = entry.with_context(|| unreadable(folder))?.path();
        let Some(name) = file_name(&path).filter(|name| !left_out.contains(&name.as_str())) else {
            continue;
        };
        if path.is_dir() {
            collect(&path, &format!("{prefix}{name}/"), &[], files)?;
        } else {
            let bytes = fs::read(&path).with_context(|| unreadable(&path))?;
            files.insert(format!("{prefix}{name}"), bytes);
        }
    }
    Ok(())
}

/// The last part of a path, for people.
pub fn file_name(path: &Path) -> Option<String> {
    path.file_name().map(|name| name.to_string_lossy().into_owned())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_else_is_in_the_bundles_folder_is_kept_and_old_weights_are_not() {
        let folder = tempfile::tempdir().unwrap();
        for name in ["template", "figures/old"] {
            fs::create_dir_all(folder.path().join(name)).unwrap();
        }
        for name in [
            "poster.pdf",
            "weights.bpk",
            "model.json",
            "template/template.json",
            "figures/old/template",
        ] {
            fs::write(folder.path().join(name), name).unwrap();
        }
        assert_eq!(
            companions(folder.path()).unwrap().into_keys().collect::<Vec<_>>(),
            ["figures/old/template", "poster.pdf"]
        );
        assert!(companions(&folder.path().join("none")).unwrap().is_empty());
    }
}
