//! What networks learn from.

use burn::tensor::{Device, Tensor, TensorData};
use deepsft_geometry::Picture;
use deepsft_synth::Sample;

/// Sides of images are padded to multiples of this: encoders halve them five times.
const MULTIPLE: usize = 32;

/// Metres in a millimetre.
pub const M_PER_MM: f32 = 1e-3;

/// Depth outside the object, m: its logarithm is finite, and the mask leaves it out.
const OUTSIDE_M: f32 = 1.0;

/// Images and their truth as tensors. H and W are padded to multiples of 32, black and outside the object.
#[derive(Clone, Debug)]
pub struct Batch {
    /// Colours 0..=1, [N, 3, H, W].
    pub images: Tensor<4>,
    /// 1 where the object is seen, else 0, [N, 1, H, W].
    pub mask: Tensor<4>,
    /// Depth, m, [N, 1, H, W].
    pub depth: Tensor<4>,
    /// The sheet's vertices, m, camera frame, [N, 3, rows, columns].
    pub points: Tensor<4>,
}

fn padded(width: usize, height: usize, device: &Device, planes: &[Vec<f32>], outside: f32) -> Tensor<4> {
    let (w, h) = (width.next_multiple_of(MULTIPLE), height.next_multiple_of(MULTIPLE));
    let mut values = vec![outside; planes.len() * w * h];
    for (plane, into) in planes.iter().zip(values.chunks_exact_mut(w * h)) {
        for (row, into) in plane.chunks_exact(width).zip(into.chunks_exact_mut(w)) {
            into[..width].copy_from_slice(row);
        }
    }
    Tensor::from_data(TensorData::new(values, [1, planes.len(), h, w]), device)
}

impl Batch {
    /// The image as networks see it, [1, 3, H, W].
    pub fn image(picture: &Picture, device: &Device) -> Tensor<4> {
        let plane = |channel: usize| -> Vec<f32> {
            let colors = picture.rgb().chunks_exact(3);
            colors.map(|color| f32::from(color[channel]) / 255.0).collect()
        };
        padded(picture.width(), picture.height(), device, &[0, 1, 2].map(plane), 0.0)
    }

    /// Samples that show a sheet with `grid` (columns, rows) vertices; at least one.
    pub fn new(samples: &[Sample], grid: (usize, usize), device: &Device) -> Self {
        let all = |of: &dyn Fn(&Sample) -> Tensor<4>| Tensor::cat(samples.iter().map(of).collect(), 0);
        let map = |sample: &Sample, outside: f32, of: &dyn Fn(f32) -> f32| {
            let truth = &sample.truth;
            let values = truth.depth().iter().enumerate();
            let plane = values.map(|(pixel, &mm)| if truth.inside(pixel) { of(mm) } else { outside });
            let (width, height) = (truth.size().width, truth.size().height);
            padded(width, height, device, &[plane.collect()], outside)
        };
        let points = |sample: &Sample| {
            let axis = |k: usize| sample.vertices_camera.iter().map(move |p| p[k] as f32 * M_PER_MM);
            let values: Vec<f32> = (0..3).flat_map(axis).collect();
            Tensor::from_data(TensorData::new(values, [1, 3, grid.1, grid.0]), device)
        };
        Self {
            images: all(&|sample| Self::image(&sample.image, device)),
            mask: all(&|sample| map(sample, 0.0, &|_| 1.0)),
            depth: all(&|sample| map(sample, OUTSIDE_M, &|mm| mm * M_PER_MM)),
            points: all(&points),
        }
    }
}
