//! What a visitor of the page downloads.

use super::rivals::Rivals;
use crate::{manifest::Manifest, web};
use anyhow::{Context, Result};
use serde::Serialize;
use serde_json::Value;
use std::path::Path;

/// One file as it is stored, and compressed as a server sends it.
#[derive(Debug, PartialEq, Serialize)]
pub struct Download {
    pub of: String,
    pub file: String,
    pub bytes: usize,
    pub gzip_bytes: usize,
}

/// The engine (if it is built), the model, and onnxruntime-web (if it is installed).
///
/// # Errors
/// When a file cannot be read.
pub fn sizes(root: &Path, manifest: &Manifest, model: &Path, rivals: Option<&Rivals>) -> Result<Vec<Download>> {
    let mut downloads = Vec::new();
    let package = root.join(&manifest.package.out_dir);
    let name = manifest.package.crate_name.replace('-', "_");
    let engine = [format!("{name}_bg.wasm"), format!("{name}.js")];
    if engine.iter().all(|file| package.join(file).is_file()) {
        add(&mut downloads, "engine", &package, &engine)?;
    }
    add(
        &mut downloads,
        "model",
        model,
        &model_files(&web::read(&model.join("model.json"))?)?,
    )?;
    if let Some(folder) = rivals.and_then(Rivals::web) {
        let files = [
            "ort-wasm-simd-threaded.wasm",
            "ort-wasm-simd-threaded.mjs",
            "ort.wasm.min.mjs",
        ];
        add(&mut downloads, "onnxruntime-web", folder, &files.map(str::to_owned))?;
    }
    Ok(downloads)
}

/// The files that a loader fetches: `model.json` and those it lists.
fn model_files(model_json: &[u8]) -> Result<Vec<String>> {
    let model: Value = serde_json::from_slice(model_json).context("reading model.json")?;
    let listed = model["files"].as_object().context("model.json lists no files")?;
    let listed = listed.keys().cloned();
    Ok(std::iter::once("model.json".to_owned()).chain(listed).collect())
}

fn add(downloads: &mut Vec<Download>, of: &str, folder: &Path, files: &[String]) -> Result<()> {
    for file in files {
        let bytes = web::read(&folder.join(file))?;
        downloads.push(Download {
            of: of.to_owned(),
            file: file.clone(),
            bytes: bytes.len(),
            gzip_bytes: web::gzip_length(&bytes)?,
        });
    }
    Ok(())
}

/// Prints the files and their sums.
pub fn print(downloads: &[Download]) {
    const MB: f64 = 1e6;
    println!("\n{:<46}{:>14}{:>14}", "download, MB", "stored", "gzipped");
    for group in downloads.chunk_by(|a, b| a.of == b.of) {
        for Download {
            file,
            bytes,
            gzip_bytes,
            ..
        } in group
        {
            println!(
                "  {file:<44}{:>14.3}{:>14.3}",
                *bytes as f64 / MB,
                *gzip_bytes as f64 / MB
            );
        }
        let sum = |size: fn(&Download) -> usize| group.iter().map(size).sum::<usize>() as f64 / MB;
        println!(
            "{:<46}{:>14.3}{:>14.3}",
            group[0].of,
            sum(|d| d.bytes),
            sum(|d| d.gzip_bytes)
        );
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::fs;

    #[test]
    fn a_models_downloads_are_its_description_and_what_that_lists() {
        let folder = tempfile::tempdir().unwrap();
        let description = br#"{"files": {"weights.bpk": {"size": 4000}}, "name": "m"}"#;
        fs::write(folder.path().join("model.json"), description).unwrap();
        fs::write(folder.path().join("weights.bpk"), [7; 4000]).unwrap();
        fs::write(folder.path().join("curve.csv"), "not listed").unwrap();
        let mut downloads = Vec::new();
        add(
            &mut downloads,
            "model",
            folder.path(),
            &model_files(description).unwrap(),
        )
        .unwrap();
        let files: Vec<_> = downloads.iter().map(|d| (d.file.as_str(), d.bytes)).collect();
        assert_eq!(files, [("model.json", description.len()), ("weights.bpk", 4000)]);
        // Four thousand equal bytes.
        assert!(downloads[1].gzip_bytes < 100);
        assert!(model_files(b"{}").is_err());
    }
}
