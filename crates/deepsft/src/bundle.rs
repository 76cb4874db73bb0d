//! Model bundle: everything an estimator needs, as files by name, checked before use.
//!
//! `model.json` describes the network and lists every other file with its size and SHA-256;
//! `weights.bpk` holds the folded weights (burnpack, filters in 8 bits); `template/` is the template.

use crate::error::DeepSftError;
use crate::weights_file::{weights_from_burnpack, weights_to_burnpack};
use deepsft_formats::{TEMPLATE_FILE, TemplateFile, camera_from_json, camera_to_json, json_reason, template_to_files};
use deepsft_geometry::{Camera, Template};
use deepsft_inference::{FoldedNetwork, NetworkConfig};
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

/// Name of the description in a bundle.
pub const MODEL_FILE: &str = "model.json";

/// Name of the weights in a bundle, and beside other networks' cards.
pub const WEIGHTS_FILE: &str = "weights.bpk";

/// Folder of the template in a bundle.
const TEMPLATE_FOLDER: &str = "template/";

/// The one version of the format that this version of the crate reads and writes.
const FORMAT_VERSION: u32 = 1;

/// When a frame counts as showing the template.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct FoundRule {
    /// Least fraction of the canonical image that the mask covers.
    pub min_area: f64,
    /// Least photo-consistency of what the mask covers, see [`crate::Judgement`].
    pub min_confidence: f64,
}

impl Default for FoundRule {
    fn default() -> Self {
        Self {
            min_area: 0.002,
            min_confidence: 0.3,
        }
    }
}

/// How a model came about.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Provenance {
    /// The command that trained it.
    pub command: String,
    /// Seed of weights and data.
    pub seed: u64,
    /// Training samples seen.
    pub samples: u64,
    /// Seconds of training.
    pub seconds: f64,
    /// Version of deepsft that trained it.
    pub deepsft_version: String,
}

/// Measured accuracy on held-out synthetic frames: medians over frames, as in `deepsft eval`.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Accuracy {
    /// Frames evaluated.
    pub frames: u64,
    /// Registration RMSE, pixels of the 480 x 270 image.
    pub registration_rmse_px: Option<f64>,
    /// Depth RMSE, mm.
    pub depth_rmse_mm: Option<f64>,
    /// Mask IoU (mean).
    pub mask_iou: Option<f64>,
}

/// What a bundle says beside its weights and template.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct ModelCard {
    /// Name for people.
    pub name: String,
    /// SPDX expression; `None` where none is stated.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub licence: Option<String>,
    /// When a frame counts as showing the template.
    pub found: FoundRule,
    /// How it came about.
    pub provenance: Provenance,
    /// How good it is.
    pub accuracy: Accuracy,
}

#[derive(Clone, Serialize, Deserialize)]
struct Manifest {
    format_version: u32,
    #[serde(flatten)]
    card: ModelCard,
    network: NetworkConfig,
    training_camera: serde_json::Value,
    files: BTreeMap<String, FileEntry>,
}

#[derive(Clone, PartialEq, Serialize, Deserialize)]
struct FileEntry {
    size: u64,
    sha256: String,
}

/// The field that is read first, so that a newer bundle is called newer and not malformed.
#[derive(Deserialize)]
struct Versioned {
    format_version: u32,
}

/// A checked model: network, template, training camera and card.
#[derive(Clone, Debug)]
pub struct ModelBundle {
    network: FoldedNetwork,
    template: Template,
    camera: Camera,
    card: ModelCard,
}

impl ModelBundle {
    /// Puts a bundle together.
    pub fn new(network: FoldedNetwork, template: Template, camera: Camera, card: ModelCard) -> Self {
        Self {
            network,
            template,
            camera,
            card,
        }
    }

    /// Reads a bundle from its files by name (`model.json`, `weights.bpk`, `template/template.json`, ...).
    ///
    /// # Errors
    /// * [`DeepSftError::BundleVersion`] for a newer format.
    /// * [`DeepSftError::BundleFileMissing`], [`DeepSftError::BundleFileSize`],
    ///   [`DeepSftError::BundleFileHash`] name the file that is missing, cut short or altered.
    /// * [`DeepSftError::BundleContent`] when a file's content does not fit the format or the network.
    pub fn from_files(files: &BTreeMap<String, Vec<u8>>) -> Result<Self, DeepSftError> {
        let manifest = read_manifest(file(files, MODEL_FILE)?)?;
        manifest.check(files, "")?;
        manifest.network.check().map_err(DeepSftError::content(MODEL_FILE))?;
        let (template, camera) = manifest.template(files)?;
        let weights = manifest.listed(files, WEIGHTS_FILE)?;
        let network = FoldedNetwork {
            weights: weights_from_burnpack(weights).map_err(DeepSftError::content(WEIGHTS_FILE))?,
            config: manifest.network,
        };
        network.check().map_err(DeepSftError::content(WEIGHTS_FILE))?;
        Ok(Self::new(network, template, camera, manifest.card))
    }

    /// Template and camera of a bundle without its network, for those who only fit meshes: of its files the
    /// description and those of the template are enough.
    ///
    /// # Errors
    /// As [`ModelBundle::from_files`].
    pub fn template_from_files(files: &BTreeMap<String, Vec<u8>>) -> Result<(Template, Camera), DeepSftError> {
        let manifest = read_manifest(file(files, MODEL_FILE)?)?;
        manifest.check(files, TEMPLATE_FOLDER)?;
        manifest.template(files)
    }

    /// Names of the files that the description `model_json` lists, with their sizes in bytes: what a
    /// loader has to fetch.
    ///
    /// # Errors
    /// As [`ModelBundle::from_files`] for the description.
    pub fn file_names(model_json: &[u8]) -> Result<Vec<(String, u64)>, DeepSftError> {
        let listed = read_manifest(model_json)?.files.into_iter();
        Ok(listed.map(|(name, entry)| (name, entry.size)).collect())
    }

    /// The bundle's files by name: what an estimator needs and the description that lists it. Whatever
    /// else lies in a model's folder (a card, a poster to print) is not listed, so that nobody has to
    /// fetch it.
    ///
    /// # Errors
    /// [`DeepSftError::BundleContent`] when something cannot be encoded.
    pub fn to_files(&self) -> Result<BTreeMap<String, Vec<u8>>, DeepSftError> {
        let mut files = BTreeMap::new();
        let weights = weights_to_burnpack(&self.network.weights).map_err(DeepSftError::content(WEIGHTS_FILE))?;
        files.insert(WEIGHTS_FILE.to_owned(), weights);
        for (name, bytes) in template_to_files(&self.template)? {
            files.insert(format!("{TEMPLATE_FOLDER}{name}"), bytes);
        }
        let entries = files.iter().map(|(name, bytes)| (name.clone(), FileEntry::of(bytes)));
        let training_camera = serde_json::from_str(&camera_to_json(&self.camera));
        let manifest = Manifest {
            format_version: FORMAT_VERSION,
            card: self.card.clone(),
            network: self.network.config.clone(),
            training_camera: training_camera.map_err(DeepSftError::content(MODEL_FILE))?,
            files: entries.collect(),
        };
        let mut json = serde_json::to_vec_pretty(&manifest).map_err(DeepSftError::content(MODEL_FILE))?;
        json.push(b'\n');
        files.insert(MODEL_FILE.to_owned(), json);
        Ok(files)
    }

    /// Name for people.
    pub fn name(&self) -> &str {
        &self.card.name
    }

    /// What the bundle says of itself.
    pub fn card(&self) -> &ModelCard {
        &self.card
    }

    /// Replaces what the bundle says of itself.
    pub fn set_card(&mut self, card: ModelCard) {
        self.card = card;
    }

    /// The finished network.
    pub fn network(&self) -> &FoldedNetwork {
        &self.network
    }

    /// The template the network knows.
    pub fn template(&self) -> &Template {
        &self.template
    }

    /// The camera of the training images: the canonical camera.
    pub fn camera(&self) -> &Camera {
        &self.camera
    }
}

impl Manifest {
    /// Whether the listed files in `folder` are those that were published.
    fn check(&self, files: &BTreeMap<String, Vec<u8>>, folder: &str) -> Result<(), DeepSftError> {
        for (name, entry) in self.files.iter().filter(|(name, _)| name.starts_with(folder)) {
            let actual = FileEntry::of(file(files, name)?);
            if actual.size != entry.size {
                return Err(DeepSftError::BundleFileSize {
                    file: name.clone(),
                    actual: actual.size,
                    expected: entry.size,
                });
            }
            if !actual.sha256.eq_ignore_ascii_case(&entry.sha256) {
                return Err(DeepSftError::BundleFileHash(name.clone()));
            }
        }
        Ok(())
    }

    /// A file that the description lists.
    fn listed<'a>(&self, files: &'a BTreeMap<String, Vec<u8>>, name: &str) -> Result<&'a [u8], DeepSftError> {
        match self.files.contains_key(name) {
            true => file(files, name),
            false => Err(DeepSftError::BundleFileMissing(name.to_owned())),
        }
    }

    /// The template and the camera that the maps are for.
    fn template(&self, files: &BTreeMap<String, Vec<u8>>) -> Result<(Template, Camera), DeepSftError> {
        let camera = camera_from_json(self.training_camera.to_string().as_bytes())?;
        let listed = |name: &str| self.listed(files, &format!("{TEMPLATE_FOLDER}{name}"));
        let description = TemplateFile::parse(listed(TEMPLATE_FILE)?)?;
        let texture = listed(description.texture())?;
        let mesh = description.mesh().map(listed).transpose()?;
        let template = description.template(texture, mesh)?;
        let fits = self.network.check_fits(&template, &camera);
        fits.map_err(DeepSftError::content(MODEL_FILE))?;
        Ok((template, camera))
    }
}

fn file<'a>(files: &'a BTreeMap<String, Vec<u8>>, name: &str) -> Result<&'a [u8], DeepSftError> {
    files
        .get(name)
        .map(Vec::as_slice)
        .ok_or_else(|| DeepSftError::BundleFileMissing(name.to_owned()))
}

fn read_manifest(json: &[u8]) -> Result<Manifest, DeepSftError> {
    let malformed = |error: serde_json::Error| DeepSftError::content(MODEL_FILE)(json_reason(&error));
    let Versioned { format_version: actual } = serde_json::from_slice(json).map_err(&malformed)?;
    if actual != FORMAT_VERSION {
        return Err(DeepSftError::BundleVersion {
            actual,
            expected: FORMAT_VERSION,
        });
    }
    serde_json::from_slice(json).map_err(malformed)
}

impl FileEntry {
    fn of(bytes: &[u8]) -> Self {
        Self {
            size: bytes.len() as u64,
            sha256: deepsft_formats::sha256(bytes),
        }
    }
}
