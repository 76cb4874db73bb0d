//! Frames of an RGB-D recording made ready for training: which pixels count, and at which resolution the template is seen.

use crate::TrainError;
use crate::evaluation::depth_counts;
use burn::tensor::{Device, Tensor, TensorData};
use deepsft::{Network, pictures_to_tensor};
use deepsft_geometry::{Camera, GeometryError, Maps, Picture, mipmap_level};
use deepsft_synth::{RecordedFrame, Recording};

/// Fewest pixels of the object in a frame that is used.
const FEWEST_PIXELS: usize = 500;

/// A frame of a recording and what training needs to know of it. About a megabyte; they are kept in memory.
#[derive(Clone, Debug)]
pub struct TrainingFrame {
    /// Number of the frame in its recording.
    pub index: usize,
    /// The canonical image.
    pub image: Picture,
    /// Measured depth, mm; 0 where there is none.
    pub depth_mm: Vec<f32>,
    /// Where the object is seen: the recording's mask if it has one, and the network's.
    pub inside: Vec<bool>,
    /// Where its depth is compared with the measured one.
    pub depth_counts: Vec<bool>,
    /// Level of the template's texture, see [`crate::TexturePyramid`].
    pub level: usize,
}

impl TrainingFrame {
    /// Reads frame `index` of `recording` for `network`, which is on the plain `device`, and returns with it what the
    /// network says there; `None` when it does not see the object.
    ///
    /// The object is where the network's mask has it before the refinement, which is trained together with the main block
    /// and frozen here, and where the recording's own mask has it, if it comes with masks. Depth counts two pixels further
    /// in, where the sensor measured something within 15 % of what the network says (our choice; the paper segments by
    /// the same network).
    ///
    /// # Errors
    /// [`TrainError::Synth`] names a file that cannot be read, [`TrainError::Core`] when the device fails.
    pub fn read(
        recording: &Recording,
        index: usize,
        network: &Network,
        canonical: &Camera,
        texture: &Picture,
        device: &Device,
    ) -> Result<Option<(Self, Maps)>, TrainError> {
        let RecordedFrame { image, depth_mm, mask } = recording.frame(index, canonical)?;
        let mut found = pollster::block_on(network.infer(&[&image], device))?;
        let Some(mut maps) = found.pop() else { return Ok(None) };
        if let Some(mask) = mask {
            for pixel in (0..mask.len()).filter(|&pixel| !mask[pixel]) {
                maps.clear(pixel);
            }
        }
        if maps.area() < FEWEST_PIXELS {
            return Ok(None);
        }
        let depth_counts = depth_counts(&maps, &depth_mm);
        let frame = Self {
            index,
            level: mipmap_level(texture, &maps) as usize,
            inside: maps.mask(),
            depth_counts,
            image,
            depth_mm,
        };
        Ok(Some((frame, maps)))
    }

    /// The pixels on which networks are measured and compared: where the object is, and where it is by the `truth`, if
    /// that is known.
    ///
    /// # Errors
    /// [`GeometryError::MapSize`] when the truth is not of the image's size.
    pub fn seen(&self, truth: Option<&Maps>) -> Result<Vec<bool>, GeometryError> {
        let expected = (self.image.width(), self.image.height());
        if let Some(actual) = truth.map(|truth| (truth.width(), truth.height()))
            && actual != expected
        {
            return Err(GeometryError::MapSize { actual, expected });
        }
        let known = |pixel: usize| truth.is_none_or(|truth| truth.inside(pixel));
        let seen = (0..self.inside.len()).map(|pixel| self.inside[pixel] && known(pixel));
        Ok(seen.collect())
    }

    /// The measured depth as maps with no registration, inside where it counts.
    pub fn measured(&self) -> Maps {
        let mut maps = Maps::empty(self.image.width(), self.image.height());
        for pixel in (0..self.depth_mm.len()).filter(|&pixel| self.depth_counts[pixel]) {
            maps.set(pixel, self.depth_mm[pixel], [0.5; 2]);
        }
        maps
    }
}

/// Frames on a device.
pub(crate) struct FrameTensors {
    /// [N, 3, H, W], 0..=1.
    pub(crate) images: Tensor<4>,
    /// Measured depth, mm, [N, 1, H, W].
    pub(crate) depth_mm: Tensor<4>,
    /// [N, 1, H, W], 0 or 1.
    pub(crate) depth_counts: Tensor<4>,
    /// [N, 1, H, W], 0 or 1.
    pub(crate) inside: Tensor<4>,
}

impl FrameTensors {
    pub(crate) fn new(frames: &[&TrainingFrame], device: &Device) -> Self {
        let pictures: Vec<&Picture> = frames.iter().map(|frame| &frame.image).collect();
        let images = pictures_to_tensor(&pictures, device);
        let [n, _, h, w] = images.dims();
        let map = |values: Vec<f32>| Tensor::<4>::from_data(TensorData::new(values, [n, 1, h, w]), device);
        let flags = |of: fn(&TrainingFrame) -> &Vec<bool>| {
            let all = frames
                .iter()
                .flat_map(|frame| of(frame).iter().map(|&flag| f32::from(u8::from(flag))));
            map(all.collect())
        };
        Self {
            images,
            depth_mm: map(frames.iter().flat_map(|frame| frame.depth_mm.iter().copied()).collect()),
            depth_counts: flags(|frame| &frame.depth_counts),
            inside: flags(|frame| &frame.inside),
        }
    }
}
