//! From the network's output to depth and registration maps.

use super::{Network, NetworkOutput, PIXELS_PER_CELL};
use crate::DeepSftError;
use burn::tensor::{Device, Tensor, TensorData};
use deepsft_geometry::{Maps, Picture};

/// Pictures as the network's input, [N, 3, H, W] with values 0..=1: H and W are the pictures' sides
/// (all the same) rounded up to multiples of 16, black below and to the right.
pub fn images_to_tensor(pictures: &[&Picture], device: &Device) -> Tensor<4> {
    let multiple = super::INPUT_MULTIPLE;
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

/// The maps of each image of `output`, cut to `width` x `height` pixels: where the mask's
/// probability is at least one half, depth and registration up-sampled from the cells; outside as
/// [`Maps`] says. One read from the device.
///
/// # Errors
/// [`DeepSftError::Execution`] when the device no longer answers.
pub async fn read_maps(
    network: &Network,
    output: NetworkOutput,
    width: usize,
    height: usize,
) -> Result<Vec<Maps>, DeepSftError> {
    let [n, _, rows, columns] = output.mask.dims();
    debug_assert_eq!(output.refined.dims()[2] * PIXELS_PER_CELL, rows);
    let together = Tensor::cat(vec![Network::at_pixels(output.refined), output.mask], 1); // [N, 4, H, W]
    let data = together
        .into_data_async()
        .await
        .map_err(|error| DeepSftError::Execution {
            reason: format!("{error:?}"),
        })?;
    let values = data.try_to_vec::<f32>().map_err(|error| DeepSftError::Execution {
        reason: format!("{error:?}"),
    })?;
    let range = network.config().depth_range;
    let plane = rows * columns;
    let maps = (0..n).map(|frame| {
        let frame = &values[frame * 4 * plane..(frame + 1) * 4 * plane];
        let mut maps = Maps::empty(width, height);
        for y in 0..height {
            for x in 0..width {
                let at = y * columns + x;
                if frame[3 * plane + at] >= 0.0 {
                    let depth = range.depth_mm(f64::from(frame[2 * plane + at])) as f32;
                    maps.set(y * width + x, depth, [frame[at], frame[plane + at]]);
                }
            }
        }
        maps
    });
    Ok(maps.collect())
}
