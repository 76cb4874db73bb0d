//! Reads RGB-D recordings, from which training steps 2 and 3 learn.

use crate::camera_images::{decode_depth, decode_picture_of_camera};
use crate::error::SynthError;
use crate::recording::alignment::DepthAlignment;
use crate::recording::pairing::{self, MASK_FOLDER, Pair};
use crate::recording::sensor::RgbdSensor;
use deepsft_formats::{CAMERA_FILE, FormatError, read_error};
use deepsft_geometry::{Camera, CanonicalWarp, Picture};
use std::fs;
use std::path::{Path, PathBuf};

/// Least value of a mask's pixel that counts as the object.
const MASK_THRESHOLD: u8 = 128;

/// A recording in a folder, in the layout of TUM and Open3D.
///
/// | path | content |
/// |---|---|
/// | `camera.json` | the colour camera as everywhere: `width`, `height`, `fx`, `fy`, `cx`, `cy`, `distortion`, `pixel_centers` (`"integer"` for intrinsics by OpenCV and TUM, of both cameras); `depth_scale`: units of a depth picture in a metre (default 1000: millimetres; TUM has 5000) |
/// | | where depth was not registered to colour: `depth_camera` with its own intrinsics, and `color_from_depth`, the depth camera's pose in the colour camera's frame as three rows (r, r, r, t) with t in mm |
/// | `rgb/` | colour pictures, PNG or JPEG |
/// | `depth/` | depth pictures, 16-bit grey PNG: z along the optical axis, 0 where nothing was measured |
/// | `mask/` | optional: where the object is seen, 8-bit grey PNG in the colour camera's image, 128 and above is the object |
/// | `associations.txt` | optional: lines `time rgb/a.png time depth/b.png`, in either order; without it pictures of the same name belong together |
///
/// Frames come in the order of `associations.txt`, or else by name.
#[derive(Clone, Debug)]
pub struct Recording {
    folder: PathBuf,
    sensor: RgbdSensor,
    pairs: Vec<Pair>,
    has_masks: bool,
}

/// A frame as the canonical camera would have taken it.
#[derive(Clone, Debug, PartialEq)]
pub struct RecordedFrame {
    /// The colour picture.
    pub image: Picture,
    /// Depth in mm, row-major; 0 where the sensor measured nothing.
    pub depth_mm: Vec<f32>,
    /// Where the object is seen, if the recording has masks.
    pub mask: Option<Vec<bool>>,
}

impl Recording {
    /// Opens the recording in `folder` and pairs its pictures, which are read later.
    ///
    /// # Errors
    /// [`FormatError::File`] names the file and what is wrong with it: no camera file or a wrong one, a picture
    /// without its partner, no pictures at all.
    pub fn open(folder: &Path) -> Result<Self, SynthError> {
        let camera = folder.join(CAMERA_FILE);
        let text = fs::read_to_string(&camera).map_err(|error| SynthError::recording(read_error(error), &camera))?;
        let sensor = RgbdSensor::from_json(&text).map_err(|error| SynthError::recording(error, &camera))?;
        let pairs = pairing::pairs(folder)?;
        let masks = folder.join(MASK_FOLDER);
        let has_masks = masks.is_dir();
        for pair in pairs.iter().filter(|_| has_masks) {
            let (mask, rgb) = (pair.mask(&masks), pair.rgb.display());
            if !mask.is_file() {
                let reason = format!("there is no such mask for {rgb}: add it, or remove the folder of masks");
                return Err(SynthError::recording(reason, &mask));
            }
        }
        Ok(Self {
            folder: folder.to_path_buf(),
            sensor,
            pairs,
            has_masks,
        })
    }

    /// The folder.
    pub fn folder(&self) -> &Path {
        &self.folder
    }

    /// The cameras.
    pub fn sensor(&self) -> &RgbdSensor {
        &self.sensor
    }

    /// Number of frames, at least one.
    pub fn frames(&self) -> usize {
        self.pairs.len()
    }

    /// Whether the recording has masks of the object.
    pub fn has_masks(&self) -> bool {
        self.has_masks
    }

    /// Reads frame `index` as `canonical` would have taken it, a camera without distortion that stands where the colour
    /// camera does. Colour and mask go through the [`CanonicalWarp`], depth through the [`DepthAlignment`].
    ///
    /// # Errors
    /// [`FormatError::File`] names the file and what is wrong with it: broken, of another size than its camera, depth
    /// that is not 16-bit grey, no such frame.
    pub fn frame(&self, index: usize, canonical: &Camera) -> Result<RecordedFrame, SynthError> {
        let Some(pair) = self.pairs.get(index) else {
            let reason = format!("there is no frame {index}, it has {}", self.pairs.len());
            return Err(SynthError::recording(reason, &self.folder));
        };
        let warp = CanonicalWarp::new(&self.sensor.color, canonical);
        let color = |path: PathBuf| -> Result<Picture, SynthError> {
            let picture = read(&self.folder.join(path), &self.sensor.color, decode_picture_of_camera)?;
            Ok(warp.apply(&picture)?)
        };
        let image = color(pair.rgb.clone())?;
        let raw = read(&self.folder.join(&pair.depth), &self.sensor.depth, decode_depth)?;
        let depth_mm = DepthAlignment::new(&self.sensor, canonical).apply(&raw);
        let mut mask = None;
        if self.has_masks {
            let warped = color(pair.mask(Path::new(MASK_FOLDER)))?;
            mask = Some(warped.rgb().chunks_exact(3).map(|c| c[0] >= MASK_THRESHOLD).collect());
        }
        Ok(RecordedFrame { image, depth_mm, mask })
    }
}

/// What `decode` makes of a picture file of `camera`.
fn read<T>(
    path: &Path,
    camera: &Camera,
    decode: impl Fn(&[u8], &Camera) -> Result<T, FormatError>,
) -> Result<T, SynthError> {
    let bytes = fs::read(path).map_err(|error| SynthError::recording(read_error(error), path))?;
    decode(&bytes, camera).map_err(|error| SynthError::recording(error, path))
}
