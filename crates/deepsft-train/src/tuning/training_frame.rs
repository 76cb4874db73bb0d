//! Frames of an RGB-D recording made ready for training: which pixels count, and at which resolution the template is seen.

use crate::error::TrainError;
use crate::evaluation::{eroded, measured_maps, trusted_depth};
use burn::tensor::{Device, Tensor, TensorData};
use deepsft_geometry::{Camera, GeometryError, Maps, Picture, RestSurface, check_size, mipmap_level};
use deepsft_network::Network;
use deepsft_synth::{RecordedFrame, Recording};

/// Fewest pixels of the object in a frame that is used.
const MIN_PIXELS: usize = 500;

/// A frame of a recording and what training needs to know of it. About a megabyte; they are kept in memory.
#[derive(Clone, Debug)]
pub struct TrainingFrame {
    /// Number of the frame in its recording.
    pub index: usize,
    /// The canonical image.
    pub image: Picture,
    /// Measured depth, mm; 0 where there is none.
    pub depth_mm: Vec<f32>,
    /// Where the object is: the recording's mask if it has one, else the network's.
    pub object: Vec<bool>,
    /// Where the object is trained on: in the recording's mask, if it has one, and in the network's.
    pub inside: Vec<bool>,
    /// Where its depth is trained on.
    pub depth_counts: Vec<bool>,
    /// Level of the template's texture pyramid; 0 is the finest.
    pub level: usize,
}

impl TrainingFrame {
    /// Reads frame `index` of `recording` for `network`, which is on the plain `device`. The template has the texture `texture`, and
    /// rest positions are those of `surface`. It returns with it what the network says there; `None` when neither it nor the
    /// recording's mask has the object.
    ///
    /// The object is where the network's mask has it before the tuning, and where the recording's own mask has it, if it
    /// comes with masks. Depth is trained on two pixels further in, where the sensor measured something within 15 % of what
    /// the network says (our choice; the paper segments by the same network).
    ///
    /// # Errors
    /// [`TrainError::Synth`] names a file that cannot be read, [`TrainError::Core`] when the device fails.
    pub fn read(
        recording: &Recording,
        index: usize,
        network: &Network,
        canonical: &Camera,
        (texture, surface): (&Picture, Option<&RestSurface>),
        device: &Device,
    ) -> Result<Option<(Self, Maps)>, TrainError> {
        let RecordedFrame { image, depth_mm, mask } = recording.frame(index, canonical)?;
        let mut maps = pollster::block_on(network.infer(&image, None, surface, device))?;
        for pixel in mask
            .iter()
            .flat_map(|mask| (0..mask.len()).filter(|&pixel| !mask[pixel]))
        {
            maps.clear(pixel);
        }
        let object = mask.unwrap_or_else(|| maps.mask());
        if object.iter().filter(|&&object| object).count() < MIN_PIXELS {
            return Ok(None);
        }
        let level = if maps.area() > 0 {
            mipmap_level(texture, &maps) as usize
        } else {
            0
        };
        let frame = Self {
            index,
            level,
            inside: maps.mask(),
            depth_counts: trusted_depth(&maps, &depth_mm),
            object,
            image,
            depth_mm,
        };
        Ok(Some((frame, maps)))
    }

    /// Whether the network sees enough of the object to train on it.
    pub fn is_trainable(&self) -> bool {
        self.inside.iter().filter(|&&inside| inside).count() >= MIN_PIXELS
    }

    /// Returns the pixels on which networks are measured and compared. They are where the object is by the `truth`, if that is
    /// known, else by the recording's mask, if it has one. Only without either the network that the frame was read for has a
    /// say.
    ///
    /// # Errors
    /// [`GeometryError::MapSize`] when the truth is not of the image's size.
    pub fn measured_region(&self, truth: Option<&Maps>) -> Result<Vec<bool>, GeometryError> {
        if let Some(truth) = truth {
            check_size(truth.size(), self.image.size())?;
        }
        Ok(truth.map_or_else(|| self.object.clone(), Maps::mask))
    }

    /// Returns the measured depth as maps with no registration, inside where it is compared with that of networks. That is in
    /// `region`, two pixels away from its edge and from jumps of the measured depth.
    pub fn measured(&self, region: &[bool]) -> Maps {
        measured_maps(region, &self.depth_mm, self.image.size())
    }

    /// Where the object surely is not: two pixels and more from where it is.
    pub fn outside(&self) -> Vec<bool> {
        let not_object: Vec<bool> = self.object.iter().map(|object| !object).collect();
        eroded(&not_object, self.image.width(), true)
    }
}

/// Numbers of the pixels of `frames`, which are of one size, on a device, [N, 1, H, W]; `of` gives those of a frame.
pub(crate) fn pixels(frames: &[&TrainingFrame], device: &Device, of: impl Fn(&TrainingFrame) -> Vec<f32>) -> Tensor<4> {
    let values: Vec<f32> = frames.iter().flat_map(|frame| of(frame)).collect();
    let (width, height) = frames
        .first()
        .map_or((0, 0), |frame| (frame.image.width(), frame.image.height()));
    Tensor::from_data(TensorData::new(values, [frames.len(), 1, height, width]), device)
}

/// Flags as 0 and 1.
pub(crate) fn numbers(flags: &[bool]) -> Vec<f32> {
    flags.iter().map(|&flag| f32::from(u8::from(flag))).collect()
}
