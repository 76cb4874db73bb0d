//! Recordings in the layouts of others, made one of ours.

use super::frame_files::{FrameFiles, FramePairing, MatchedFiles, matched, read};
use super::pairing::{DEPTH_FOLDER, MASK_FOLDER, RGB_FOLDER};
use super::sensor::RgbdSensor;
use super::truth_files::{TRUTH, is_truth, read_truth};
use crate::camera_images::{
    decode_depth, decode_of_camera, decode_picture_of_camera, encode_depth_png, encode_mask_png,
};
use crate::canonical_truth::canonical_truth;
use crate::clip::TRUTH_FOLDER;
use crate::dataset::write_dataset;
use crate::error::SynthError;
use crate::in_order::in_order;
use crate::sample::Sample;
use deepsft_formats::{CAMERA_FILE, FolderKind, FormatError, StagedFolder, encode_png, is_picture};
use deepsft_geometry::glam::DVec3;
use deepsft_geometry::raster::VisibleSurface;
use deepsft_geometry::{CanonicalWarp, Picture, Template, training_camera};
use image::ImageFormat;
use serde_json::json;
use std::fmt::Write;
use std::path::{Path, PathBuf};

/// Name of the file that lists what each frame was made of, and by which an imported recording is known.
const LIST_FILE: &str = "imported.csv";

/// What is this fraction nearer than the true surface hides it: a hand.
const HIDES: f64 = 0.03;

/// The folder of an imported recording. One that somebody made otherwise is never replaced.
const IMPORTED_FOLDER: FolderKind = FolderKind {
    known_by: &[LIST_FILE],
    files: &[
        CAMERA_FILE,
        LIST_FILE,
        "rgb/#.jpg",
        "rgb/#.png",
        "depth/#.png",
        "mask/#.png",
        "truth/dataset.json",
        "truth/shard-#.tar",
    ],
};

/// Where the files of a recording in another layout are.
///
/// Places are folders, or paths with one `*` for what differs in the names of the files, as `scene/frame-*.color.png`.
#[derive(Clone, Debug)]
pub struct RecordingSource {
    /// Colour pictures.
    pub color: PathBuf,
    /// Depth pictures, 16-bit grey, in the colour camera's image.
    pub depth: PathBuf,
    /// Masks of the object in the colour camera's image: what is brighter than half of the brightest pixel.
    pub masks: Option<PathBuf>,
    /// The true surfaces.
    pub truth: Option<TruthSource>,
    /// How the files of a frame are known.
    pub pairing: FramePairing,
    /// The camera of the pictures, and the unit of depth; depth must be registered.
    pub sensor: RgbdSensor,
}

/// The true surface of each frame, in the colour camera's frame (x right, y down, z forward).
///
/// | file | content |
/// |---|---|
/// | `.obj`, `.ply` | a mesh with the template's texture coordinates; or without, and its vertices are the template's |
/// | `.txt`, `.csv`, `.xyz`, `.npy` | rows `u v x y z`, v down; or `vertex x y z`, from 0; or `x y z` for every vertex |
///
/// Vertices that it does not tell are recovered by ARAP, and what lies around them is no part of the truth.
#[derive(Clone, Debug)]
pub struct TruthSource {
    /// Place of its files.
    pub files: PathBuf,
    /// What is recorded.
    pub template: Template,
    /// Millimetres of its unit.
    pub mm_per_unit: f64,
}

/// A recording that is imported from the layout of another program.
#[derive(Debug)]
pub struct RecordingImport {
    source: RecordingSource,
    files: MatchedFiles,
}

/// The files that a frame becomes, by name, and its truth.
type ImportedFrame = (Vec<(String, Vec<u8>)>, Option<Sample>);

impl RecordingImport {
    /// Matches the files of `source`, which are read later.
    ///
    /// # Errors
    /// [`FormatError::Unusable`] names the place: there are no files, their numbers differ, none
    /// belong together.
    pub fn open(source: RecordingSource) -> Result<Self, SynthError> {
        let files_of = |what, place, is_one| FrameFiles { what, place, is_one };
        let mut kinds = vec![
            files_of(
                "colour pictures",
                source.color.as_path(),
                is_picture as fn(&Path) -> bool,
            ),
            files_of("depth pictures", &source.depth, is_picture),
        ];
        kinds.extend(source.masks.iter().map(|masks| files_of("masks", masks, is_picture)));
        kinds.extend(source.truth.iter().map(|truth| files_of(TRUTH, &truth.files, is_truth)));
        let files = matched(&kinds, source.pairing)?;
        Ok(Self { source, files })
    }

    /// Returns the number of frames, at least one.
    pub fn frames(&self) -> usize {
        self.files.frames.len()
    }

    /// Returns the files without a partner, which are left out.
    pub fn left_out(&self) -> &[PathBuf] {
        &self.files.left_out
    }

    /// Writes the recording to the folder `out`, in place of an older import there, and its truth to `truth` in it, as a data set. `each` is
    /// called before each frame; its error ends the import.
    ///
    /// # Errors
    /// [`FormatError::Unusable`] names the file that is broken, of another size than the camera's image,
    /// or depth that is not 16-bit; those of [`StagedFolder`] and of `each`.
    pub fn write<E: From<SynthError>>(&self, out: &Path, mut each: impl FnMut() -> Result<(), E>) -> Result<(), E> {
        let folder = StagedFolder::new(out, &IMPORTED_FOLDER).map_err(SynthError::from)?;
        let write = |name: &str, bytes: &[u8]| folder.write(name, bytes).map_err(SynthError::from);
        let frames = in_order(0..self.frames() as u64, |index| self.frame(index as usize));
        let mut written = frames.map(|frame| -> Result<Option<Sample>, E> {
            each()?;
            let (files, truth) = frame?;
            files.iter().try_for_each(|(name, bytes)| write(name, bytes))?;
            Ok(truth)
        });
        match &self.source.truth {
            None => written.try_for_each(|frame| frame.map(drop))?,
            Some(TruthSource {
                template, mm_per_unit, ..
            }) => {
                let configuration = json!({ "imported": true, "mm_per_unit": mm_per_unit });
                let samples = written.filter_map(Result::transpose);
                write_dataset(&folder.path().join(TRUTH_FOLDER), template, configuration, 0, samples)?;
            }
        }
        write(CAMERA_FILE, self.source.sensor.to_json().as_bytes())?;
        write(LIST_FILE, self.list().as_bytes())?;
        Ok(folder.commit().map_err(SynthError::from)?)
    }

    fn list(&self) -> String {
        let mut list = String::from("frame,color,depth,others\n");
        for (index, files) in self.files.frames.iter().enumerate() {
            let names = files
                .iter()
                .map(|file| file.file_name().unwrap_or_default().to_string_lossy());
            // Writing to a string cannot fail.
            let _ = writeln!(list, "{index:06},{}", names.collect::<Vec<_>>().join(","));
        }
        list
    }

    fn frame(&self, index: usize) -> Result<ImportedFrame, SynthError> {
        let RecordingSource {
            masks, truth, sensor, ..
        } = &self.source;
        let camera = &sensor.color;
        let sources = &self.files.frames[index];
        let (picture, color) = read("colour picture", &sources[0], |bytes| {
            let picture = decode_picture_of_camera(bytes, camera)?;
            Ok::<_, FormatError>(match image::guess_format(bytes) {
                Ok(ImageFormat::Jpeg) => (picture, (format!("{RGB_FOLDER}/{index:06}.jpg"), bytes.to_vec())),
                _ => {
                    let png = encode_png(&picture)?;
                    (picture, (format!("{RGB_FOLDER}/{index:06}.png"), png))
                }
            })
        })?;
        let depth = read("depth picture", &sources[1], |bytes| decode_depth(bytes, camera))?;
        let mut files = vec![
            color,
            (
                format!("{DEPTH_FOLDER}/{index:06}.png"),
                encode_depth_png(&depth, camera)?,
            ),
        ];
        let mut mask = None;
        if masks.is_some() {
            let grey = read("mask", &sources[2], |bytes| decode_of_camera(bytes, camera))?.into_luma16();
            // Masks have 255, 65535 or 1 on the object.
            let most = grey.pixels().map(|pixel| pixel.0[0]).max().unwrap_or(0);
            let inside: Vec<bool> = grey.pixels().map(|pixel| pixel.0[0] > most / 2).collect();
            files.push((
                format!("{MASK_FOLDER}/{index:06}.png"),
                encode_mask_png(&inside, camera)?,
            ));
            mask = Some(inside);
        }
        let sample = |truth| self.truth(truth, &sources[sources.len() - 1], picture, &depth, mask.as_deref());
        let truth = truth.as_ref().map(sample).transpose()?;
        Ok((files, truth))
    }

    /// The frame as the training camera would have taken it, with its truth where nothing hides it.
    fn truth(
        &self,
        truth: &TruthSource,
        file: &Path,
        picture: Picture,
        depth: &[u16],
        mask: Option<&[bool]>,
    ) -> Result<Sample, SynthError> {
        let surface = read_truth(file, &truth.template, truth.mm_per_unit)?;
        let (mesh, sensor) = (&surface.told, &self.source.sensor);
        let mut maps = VisibleSurface::new(mesh, &surface.vertices_camera, &sensor.color).maps();
        for pixel in 0..depth.len() {
            let measured_mm = 1000.0 * f64::from(depth[pixel]) / sensor.depth_scale;
            let is_hidden = measured_mm > 0.0 && measured_mm < (1.0 - HIDES) * f64::from(maps.depth()[pixel]);
            let is_outside = is_hidden || mask.is_some_and(|mask| !mask[pixel]);
            if maps.inside(pixel) && (is_outside || !surface.tells(maps.uv(pixel) * truth.template.size_mm())) {
                maps.clear(pixel);
            }
        }
        let canonical = training_camera();
        let image = CanonicalWarp::new(&sensor.color, &canonical).apply(&picture)?;
        let seen = Sample::new(picture, maps, surface.vertices_camera, sensor.color, DVec3::NEG_Z);
        let maps = canonical_truth(&seen, mesh, &canonical);
        Ok(Sample::new(
            image,
            maps,
            seen.vertices_camera,
            canonical,
            seen.towards_light,
        ))
    }
}
