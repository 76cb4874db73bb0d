//! From pictures to a network's input, and from its output to depth and registration maps.

use super::any_network::Network;
use super::compact::{CompactNetwork, INPUT_MULTIPLE};
use crate::error::NetworkError;
use crate::resampling::padded_to_multiple;
use burn::tensor::{Device, Tensor, TensorData};
use deepsft_geometry::glam::DVec3;
use deepsft_geometry::{GeometryError, Maps, Picture, RestSurface, check_size};
use std::fmt::Debug;

/// Converts pictures to the compact network's input, [N, 3, H, W] with values 0..=1. H and W are the pictures' sides (all the
/// same) rounded up to multiples of 16, black below and to the right.
pub fn images_to_tensor(pictures: &[&Picture], device: &Device) -> Tensor<4> {
    padded_to_multiple(pictures_to_tensor(pictures, device), INPUT_MULTIPLE)
}

/// Converts pictures of one size to the input of [`Network::forward_maps`], [N, 3, H, W] with values 0..=1.
pub fn pictures_to_tensor(pictures: &[&Picture], device: &Device) -> Tensor<4> {
    let (width, height) = pictures.first().map_or((0, 0), |p| (p.width(), p.height()));
    let colors = pictures.iter().flat_map(|picture| {
        let rgb = picture.rgb();
        (0..3).flat_map(move |channel| rgb.iter().skip(channel).step_by(3))
    });
    let values: Vec<f32> = colors.map(|&value| f32::from(value) / 255.0).collect();
    Tensor::from_data(TensorData::new(values, [pictures.len(), 3, height, width]), device)
}

impl Network {
    /// Estimates the maps of a picture of the training camera: refined depth and registration at the pixels of `seen` (row-major) if
    /// given, else where the mask's probability is at least one half; outside as [`Maps`] says. Rest positions are looked up on the
    /// `surface` that they are of; other networks need none. `device` is the network's; it is read from once.
    ///
    /// # Errors
    /// [`NetworkError::Execution`] when the device no longer answers, and [`NetworkError::Geometry`] when `seen` has another number
    /// of pixels than the picture, and for rest positions without a surface.
    pub async fn infer(
        &self,
        picture: &Picture,
        seen: Option<&[bool]>,
        surface: Option<&RestSurface>,
        device: &Device,
    ) -> Result<Maps, NetworkError> {
        if let Some(seen) = seen {
            check_size((seen.len(), 1), (picture.width() * picture.height(), 1))?;
        }
        let range = self.config().depth_range;
        if let Self::Compact(network) = self {
            let output = network.forward(images_to_tensor(&[picture], device));
            let coordinates = CompactNetwork::at_pixels(output.refined);
            let surface = match self.config().has_rest_positions() {
                true => Some(surface.ok_or(GeometryError::NoRestSurface)?),
                false => None,
            };
            let output = Tensor::cat(vec![output.mask, coordinates], 1);
            return read_maps(output, picture, seen, surface, |d| range.depth_mm(d)).await;
        }
        let maps = self.forward_maps(pictures_to_tensor(&[picture], device));
        let output = Tensor::cat(vec![maps.mask_logits, maps.registration, maps.depth], 1);
        // Inside is above half of the nearest depth and the -1 outside: what is inside is nowhere nearer than near.
        let depth_mm = |d| range.depth_mm_linear(d).max(range.near_mm);
        read_maps(output, picture, seen, None, depth_mm).await
    }
}

/// The maps of what a network says of an image, [1, C, H, W]: the mask's logit, u, v and a measure of depth; or with a `surface`
/// x, y, depth and z behind the logit. They are cut to the size of `picture` and hold the pixels of `seen`, else those of the mask.
async fn read_maps(
    output: Tensor<4>,
    picture: &Picture,
    seen: Option<&[bool]>,
    surface: Option<&RestSurface>,
    depth_mm: impl Fn(f64) -> f64,
) -> Result<Maps, NetworkError> {
    fn failure(error: impl Debug) -> NetworkError {
        let reason = format!("{error:?}");
        NetworkError::Execution { reason }
    }
    let [.., rows, columns] = output.dims();
    let data = output.into_data_async().await.map_err(failure)?;
    let values = data.try_to_vec::<f32>().map_err(failure)?;
    let (width, height) = (picture.width(), picture.height());
    let plane = rows * columns;
    let mut maps = Maps::empty((width, height));
    for y in 0..height {
        for x in 0..width {
            let (at, pixel) = (y * columns + x, y * width + x);
            let said = |channel: usize| values[channel * plane + at];
            if !seen.map_or(said(0) >= 0.0, |seen| seen[pixel]) {
                continue;
            }
            let position = || DVec3::new(said(1).into(), said(2).into(), said(4).into());
            let registration = match surface {
                Some(surface) => surface.registration(position()).map(|uv| uv.as_vec2().to_array()),
                None => Some([said(1), said(2)]),
            };
            if let Some(registration) = registration {
                maps.set(pixel, depth_mm(f64::from(said(3))) as f32, registration);
            }
        }
    }
    Ok(maps)
}
