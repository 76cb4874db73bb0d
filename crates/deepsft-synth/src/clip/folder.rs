//! Clips as folders: numbered frames, their camera, what happens in them, and the truth as a data set.

use super::ClipStory;
use crate::dataset::DatasetFolder;
use crate::sample::Sample;
use deepsft_formats::{CAMERA_FILE, FormatError, json_reason, read_camera, read_error};
use deepsft_geometry::Camera;
use serde::{Deserialize, Serialize};
use std::error::Error;
use std::fs;
use std::path::Path;

/// Name of the description, by which a clip's folder is known.
pub const CLIP_FILE: &str = "clip.json";

/// Name of the folder with the truth.
pub const TRUTH_FOLDER: &str = "truth";

const FORMAT_VERSION: u32 = 1;

/// The content of `clip.json`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct ClipDescription {
    /// Version of the layout.
    pub format_version: u32,
    /// Always true: nobody recorded this.
    pub synthetic: bool,
    /// Seed of the clip.
    pub seed: u64,
    /// Number of frames.
    pub frames: usize,
    /// Frames per second.
    pub frames_per_s: f64,
    /// Exposure of each frame, seconds.
    pub exposure_s: f64,
    /// What happens, by the name of its `ClipEvent`.
    pub event: String,
    /// The first frame in which it happens and the first after it.
    pub event_frames: [usize; 2],
}

impl ClipDescription {
    /// The description of a clip of the present version.
    pub fn new(story: &ClipStory<'_>) -> Self {
        let (length, during) = (story.length(), story.event_frames());
        Self {
            format_version: FORMAT_VERSION,
            synthetic: true,
            seed: story.seed(),
            frames: length.frames,
            frames_per_s: length.frames_per_s,
            exposure_s: length.exposure_s,
            event: story.event().name().to_owned(),
            event_frames: [during.start, during.end],
        }
    }
}

/// Name of a frame's file.
pub fn frame_name(frame: usize, ending: &str) -> String {
    format!("frame-{frame:05}.{ending}")
}

/// A clip with its truth.
#[derive(Clone, Debug)]
pub struct ClipFolder {
    /// The content of `clip.json`.
    pub description: ClipDescription,
    /// The camera of its frames.
    pub camera: Camera,
    truth: DatasetFolder,
}

impl ClipFolder {
    /// The clip in `folder`; `None` when there is no description of one.
    ///
    /// # Errors
    /// [`FormatError::Unusable`] with the file that is missing, corrupt or unfit.
    pub fn open(folder: &Path) -> Result<Option<Self>, FormatError> {
        let path = folder.join(CLIP_FILE);
        if !path.is_file() {
            return Ok(None);
        }
        let read = || -> Result<ClipDescription, Box<dyn Error>> {
            let text = fs::read(&path).map_err(read_error)?;
            let description: ClipDescription = serde_json::from_slice(&text).map_err(|error| json_reason(&error))?;
            let (version, rate) = (description.format_version, description.frames_per_s);
            if version != FORMAT_VERSION {
                let reason = format!("it has format version {version}, this program reads version {FORMAT_VERSION}");
                return Err(reason.into());
            }
            if !(rate > 0.0 && rate.is_finite()) {
                return Err(format!("frames_per_s is {rate}, expected a positive number").into());
            }
            Ok(description)
        };
        Ok(Some(Self {
            description: read().map_err(|error| FormatError::unusable("clip", &path, error))?,
            camera: read_camera(&folder.join(CAMERA_FILE))?,
            truth: DatasetFolder::open(&folder.join(TRUTH_FOLDER))?,
        }))
    }

    /// Width and height of the template in it, mm.
    pub fn template_size_mm(&self) -> [f64; 2] {
        self.truth.description().template_size_mm
    }

    /// The truth of the frames in order.
    ///
    /// # Errors
    /// Those of [`DatasetFolder::samples`].
    pub fn truth(&self) -> Result<impl Iterator<Item = Result<Sample, FormatError>> + use<>, FormatError> {
        self.truth.samples(self.camera)
    }
}
