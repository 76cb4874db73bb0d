//! The registration of rest positions, differentiable: step 3 compares the image with the texture, which (u, v) reads.

use crate::error::TrainError;
use burn::tensor::{Tensor, TensorData};
use deepsft_geometry::RestSurface;
use deepsft_geometry::glam::DVec3;
use deepsft_network::NetworkError;

/// Converts rest positions [N, 3, H, W] to the registration (u, v) of the nearest points of `surface`, [N, 2, H, W]. Its derivative
/// is that of the face on which the point lies: positions that move off the surface change nothing. Waits for the device.
///
/// # Errors
/// [`NetworkError::Execution`] when the device no longer answers.
pub fn registration_of_positions(positions: Tensor<4>, surface: &RestSurface) -> Result<Tensor<4>, TrainError> {
    let [n, _, h, w] = positions.dims();
    let (pixels, device) = (h * w, positions.device());
    let found = positions.clone().detach();
    let values = found.clone().into_data().try_to_vec::<f32>();
    let values = values.map_err(|error| NetworkError::Execution {
        reason: format!("{error:?}"),
    })?;
    let mut registration = vec![0.0_f32; n * 2 * pixels];
    // Of u by x, y and z, then of v.
    let mut gradients = vec![0.0_f32; n * 6 * pixels];
    for image in 0..n {
        for pixel in 0..pixels {
            let at = |k: usize| f64::from(values[(image * 3 + k) * pixels + pixel]);
            let position = DVec3::new(at(0), at(1), at(2));
            let Some(uv) = surface.registration(position) else {
                continue;
            };
            let slopes = surface.registration_gradients(position).unwrap_or_default();
            for k in 0..2 {
                registration[(image * 2 + k) * pixels + pixel] = uv[k] as f32;
                for axis in 0..3 {
                    gradients[(image * 6 + 3 * k + axis) * pixels + pixel] = slopes[k][axis] as f32;
                }
            }
        }
    }
    let registration: Tensor<4> = Tensor::from_data(TensorData::new(registration, [n, 2, h, w]), &device);
    let gradients: Tensor<4> = Tensor::from_data(TensorData::new(gradients, [n, 6, h, w]), &device);
    // Zero, and not its derivative.
    let moved = positions - found;
    let change = |k: usize| (gradients.clone().slice([0..n, 3 * k..3 * k + 3]) * moved.clone()).sum_dim(1);
    Ok(registration + Tensor::cat(vec![change(0), change(1)], 1))
}
