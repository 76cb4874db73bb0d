//! Model bundles.

use crate::files::{is_one_of, join, parts, patched};
use crate::{picture, template, weights};
use anyhow::{Context, Result};
use deepsft::{Accuracy, FoundRule, MODEL_FILE, ModelBundle, ModelCard, Provenance, WEIGHTS_FILE};
use deepsft_formats::sha256;
use serde_json::{Map, Value, json};
use std::collections::BTreeMap;

const TEMPLATE: [&str; 3] = ["template/template.json", "template/texture.png", "template/mesh.obj"];

/// The files are the description, the three of the template and the weights. The description lists them by their sizes and
/// hashes, which no mutation finds.
pub(crate) fn read(input: &[u8]) -> Result<()> {
    let [description, template, texture, mesh, changes] = parts(input);
    if picture::is_slow(&texture) {
        return Ok(());
    }
    let given = TEMPLATE.into_iter().zip([template, texture, mesh]);
    let mut files: BTreeMap<String, Vec<u8>> = (given.filter(|(_, file)| !file.is_empty()))
        .map(|(name, file)| (name.to_owned(), file))
        .collect();
    files.insert(WEIGHTS_FILE.to_owned(), patched(&changes, weights::small_file()?));
    files.insert(MODEL_FILE.to_owned(), sealed(&description, &files));
    let _ = ModelBundle::file_names(&description);
    let bundle = ModelBundle::from_files(&files)?;
    assert!(
        ModelBundle::template_from_files(&files).is_ok(),
        "its template alone cannot be read"
    );
    template::check(bundle.template());
    if is_one_of(weights::RUN, input) {
        weights::run(bundle.network())?;
    }
    if let Ok(files) = bundle.to_files() {
        let again = ModelBundle::from_files(&files).expect("a bundle that was written can be read");
        assert_eq!(again.card(), bundle.card());
    }
    Ok(())
}

/// The description with an entry for each file; as it is where it is no object.
fn sealed(description: &[u8], files: &BTreeMap<String, Vec<u8>>) -> Vec<u8> {
    let Ok(Value::Object(mut object)) = serde_json::from_slice(description) else {
        return description.to_vec();
    };
    let listed = object.entry("files").or_insert_with(|| Value::Object(Map::new()));
    if let Some(listed) = listed.as_object_mut() {
        for (name, bytes) in files {
            listed.insert(name.clone(), json!({"size": bytes.len(), "sha256": sha256(bytes)}));
        }
    }
    Value::Object(object).to_string().into_bytes()
}

pub(crate) fn seeds() -> Result<Vec<Vec<u8>>> {
    let card = ModelCard {
        name: "small".to_owned(),
        licence: Some("CC0-1.0".to_owned()),
        found: FoundRule::default(),
        provenance: Provenance::default(),
        accuracy: Accuracy::default(),
    };
    let seed = |template: &deepsft_geometry::Template| -> Result<Vec<u8>> {
        let mut network = weights::small_network()?;
        network.config.template_size_mm = template.size_mm().to_array();
        let bundle = ModelBundle::new(network, template.clone(), weights::small_camera()?, card.clone());
        let files = bundle.to_files()?;
        let mut description: Value = serde_json::from_slice(&files[MODEL_FILE])?;
        description.as_object_mut().context("no object")?.remove("files");
        let [json, texture, mesh] = TEMPLATE.map(|name| files.get(name).map(Vec::as_slice).unwrap_or_default());
        Ok(join(&[description.to_string().as_bytes(), json, texture, mesh, b"~"]))
    };
    template::small()?.iter().map(seed).collect()
}
