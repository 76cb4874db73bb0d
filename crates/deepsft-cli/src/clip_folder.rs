//! Clips as folders: numbered frames, their camera, what happens in them, and the truth as a data set.

use crate::failure::BlameInput;
use crate::{dataset, input};
use anyhow::{Result, bail};
use deepsft_geometry::Camera;
use deepsft_synth::{ClipEvent, ClipStory, DatasetDescription, Sample};
use serde::{Deserialize, Serialize};
use std::fs;
use std::path::{Path, PathBuf};

/// Name of the description, by which a clip's folder is known.
pub const CLIP_FILE: &str = "clip.json";

/// Name of the camera file.
pub const CAMERA_FILE: &str = "camera.json";

/// Name of the folder with the truth.
pub const TRUTH_FOLDER: &str = "truth";

/// Version of the layout.
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

/// What happens in a clip, by its name on the command line.
pub fn event(text: &str) -> Result<ClipEvent, String> {
    let known = ClipEvent::ALL.into_iter().find(|event| event.name() == text);
    known.ok_or_else(|| format!("expected one of {}", ClipEvent::ALL.map(ClipEvent::name).join(", ")))
}

/// A clip with its truth.
pub struct Clip {
    /// The content of `clip.json`.
    pub description: ClipDescription,
    /// The camera of its frames.
    pub camera: Camera,
    truth: PathBuf,
    samples: DatasetDescription,
}

impl Clip {
    /// The clip in `folder`; `None` when there is no description of one.
    pub fn open(folder: &Path) -> Result<Option<Self>> {
        let path = folder.join(CLIP_FILE);
        if !path.is_file() {
            return Ok(None);
        }
        let read = || -> Result<ClipDescription> {
            let description: ClipDescription = serde_json::from_slice(&fs::read(&path)?)?;
            if description.format_version != FORMAT_VERSION {
                let version = description.format_version;
                bail!("it has format version {version}, this program reads version {FORMAT_VERSION}");
            }
            if !(description.frames_per_s > 0.0 && description.frames_per_s.is_finite()) {
                bail!(
                    "frames_per_s is {}, expected a positive number",
                    description.frames_per_s
                );
            }
            Ok(description)
        };
        let description = read().blame("clip", &path)?;
        let truth = folder.join(TRUTH_FOLDER);
        Ok(Some(Self {
            description,
            camera: input::camera(&folder.join(CAMERA_FILE))?,
            samples: dataset::open(&truth)?,
            truth,
        }))
    }

    /// Width and height of the template in it, mm.
    pub fn template_size_mm(&self) -> [f64; 2] {
        self.samples.template_size_mm
    }

    /// The truth of the frames in order.
    pub fn truth(&self) -> impl Iterator<Item = Result<Sample>> + use<> {
        dataset::samples(&self.truth, &self.samples, self.camera)
    }
}
