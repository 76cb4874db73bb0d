//! From pictures to a network's input, and from its output to depth and registration maps.

use super::{INPUT_MULTIPLE, Network, NetworkMaps};
use crate::DeepSftError;
use burn::tensor::{Device, Tensor, TensorData};
use deepsft_geometry::{Maps, Picture};

/// Pictures as the compact network's input, [N, 3, H, W] with values 0..=1: H and W are the pictures' sides
/// (all the same) rounded up to multiples of 16, black below and to the right.
pub fn images_to_tensor(pictures: &[&Picture], device: &Device) -> Tensor<4> {
    padded_to_tensor(pictures, INPUT_MULTIPLE, device)
}

/// Pictures of one size as [`Network::forward_maps`] wants them, [N, 3, H, W] with values 0..=1.
pub fn pictures_to_tensor(pictures: &[&Picture], device: &Device) -> Tensor<4> {
    padded_to_tensor(pictures, 1, device)
}

fn padded_to_tensor(pictures: &[&Picture], multiple: usize, device: &Device) -> Tensor<4> {
    let (width, height) = pictures.first().map_or((0, 0), |p| (p.width(), p.height()));
    let (w, h) = (width.next_multiple_of(multiple), height.next_multiple_of(multiple));
    let mut values = vec![0.0_f32; pictures.len() * 3 * h * w];
    for (n, picture) in pictures.iter().enumerate() {
        for (pixel, color) in picture.rgb().chunks_exact(3).enumerate() {
            let (x, y) = (pixel % width, pixel / width);
            for (channel, &value) in color.iter().enumerate() {
                values[((n * 3 + channel) * h + y) * w + x] = f32::from(value) / 255.0;
            }
        }
    }
    Tensor::from_data(TensorData::new(values, [pictures.len(), 3, h, w]), device)
}

impl Network {
    /// Maps of each of `pictures` (all of one size, taken by the training camera): refined depth and registration
    /// where the mask's probability is at least one half, outside as [`Maps`] says. `device` is the network's; it is
    /// read from once.
    ///
    /// # Errors
    /// [`DeepSftError::Execution`] when the device no longer answers.
    pub async fn infer(&self, pictures: &[&Picture], device: &Device) -> Result<Vec<Maps>, DeepSftError> {
        let Some(first) = pictures.first() else {
            return Ok(Vec::new());
        };
        let range = self.config().depth_range;
        match self {
            Self::Compact(network) => {
                let output = network.forward(images_to_tensor(pictures, device));
                let coordinates = network.upsample(output.refined);
                let said = Tensor::cat(vec![coordinates, output.mask], 1);
                read_maps(said, first, |d| range.depth_mm(d)).await
            }
            _ => {
                let NetworkMaps {
                    depth,
                    registration,
                    mask_logits,
                    ..
                } = self.forward_maps(pictures_to_tensor(pictures, device));
                let said = Tensor::cat(vec![registration, depth, mask_logits], 1);
                read_maps(said, first, |d| range.depth_mm_linear(d)).await
            }
        }
    }
}

/// The maps of each image of what a network says, [N, 4, H, W]: u, v, a measure of depth, the mask's logit. They
/// are cut to the size of `picture`.
async fn read_maps(
    said: Tensor<4>,
    picture: &Picture,
    depth_mm: impl Fn(f64) -> f64,
) -> Result<Vec<Maps>, DeepSftError> {
    let [n, _, rows, columns] = said.dims();
    let data = said.into_data_async().await.map_err(|error| DeepSftError::Execution {
        reason: format!("{error:?}"),
    })?;
    let values = data.try_to_vec::<f32>().map_err(|error| DeepSftError::Execution {
        reason: format!("{error:?}"),
    })?;
    let (width, height) = (picture.width(), picture.height());
    let plane = rows * columns;
    let maps = (0..n).map(|frame| {
        let frame = &values[frame * 4 * plane..(frame + 1) * 4 * plane];
        let mut maps = Maps::empty(width, height);
        for y in 0..height {
            for x in 0..width {
                let at = y * columns + x;
                if frame[3 * plane + at] >= 0.0 {
                    let depth = depth_mm(f64::from(frame[2 * plane + at])) as f32;
                    maps.set(y * width + x, depth, [frame[at], frame[plane + at]]);
                }
            }
        }
        maps
    });
    Ok(maps.collect())
}
