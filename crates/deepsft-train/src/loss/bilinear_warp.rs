//! The template seen through the registration, differentiable (paper, appendix "Warping with Bilinear Interpolation").

use burn::tensor::{Device, Int, Tensor, TensorData};
use deepsft_geometry::{MipLevel, Picture};

/// A template's texture and its successive halvings on a device, intensities 0..=255: level k is [3, h / 2^k, w / 2^k].
///
/// The paper samples the texture map itself; ours is averaged first as far as the image's pixels are coarser than its
/// texels, as a camera averages it, and as [`deepsft_geometry::photo_consistency_error`] draws it.
#[derive(Clone, Debug)]
pub struct TexturePyramid {
    /// With the texels in the template's width and height: not the level's own where a finer one had an odd number.
    levels: Vec<(Tensor<3>, [f64; 2])>,
}

impl TexturePyramid {
    /// All levels of `texture`.
    pub fn new(texture: &Picture, device: &Device) -> Self {
        let levels = std::iter::successors(Some(MipLevel::finest(texture.clone())), MipLevel::coarser);
        Self {
            levels: levels
                .map(|level| (texels(&level.picture, device), level.extent.to_array()))
                .collect(),
        }
    }

    /// Casts the texels, for gradients in double precision.
    #[cfg(test)]
    pub fn cast(self, dtype: burn::tensor::DType) -> Self {
        let levels = self.levels.into_iter();
        Self {
            levels: levels.map(|(texels, extent)| (texels.cast(dtype), extent)).collect(),
        }
    }

    /// Level `level` (the last one beyond) through the registration of one image, [1, 2, H, W] -> [1, 3, H, W].
    ///
    /// With x = u W - 1/2 (the first texel's centre is at half a texel) the value is
    /// (1 - a) A(floor x) + a A(floor x + 1), a = x - floor x, likewise along v, texels clamped to the texture. The
    /// derivative goes through the weights a alone: floor and clamping are constants. Beyond the texture's edge both
    /// texels are the same, so the derivative is zero there.
    ///
    /// The appendix writes floor and ceil; where x is a whole number these are one, and its weights would sum to two.
    /// floor + 1 is the same elsewhere and right there.
    pub fn warp(&self, level: usize, registration: Tensor<4>) -> Tensor<4> {
        let (texels, extent) = &self.levels[level.min(self.levels.len() - 1)];
        let [_, height, width] = texels.dims();
        let [_, _, rows, columns] = registration.dims();
        let pixels = rows * columns;
        let (left, right, along_u) = neighbours(&registration, 0, extent[0], width);
        let (above, below, along_v) = neighbours(&registration, 1, extent[1], height);
        let flat: Tensor<2> = texels.clone().reshape([3, height * width]);
        let at = |row: &Tensor<1, Int>, column: &Tensor<1, Int>| -> Tensor<2> {
            flat.clone().select(1, row.clone() * width as i64 + column.clone()) // [3, H * W]
        };
        let along_u: Tensor<2> = along_u.reshape([1, pixels]);
        let along_v: Tensor<2> = along_v.reshape([1, pixels]);
        let between = |a: Tensor<2>, b: Tensor<2>, fraction: &Tensor<2>| a.clone() + (b - a) * fraction.clone();
        let top = between(at(&above, &left), at(&above, &right), &along_u);
        let bottom = between(at(&below, &left), at(&below, &right), &along_u);
        between(top, bottom, &along_v).reshape([1, 3, rows, columns])
    }
}

/// Of one coordinate of the registration: both neighbouring texels, clamped, and the weight of the second, [H * W] each.
fn neighbours(
    registration: &Tensor<4>,
    coordinate: usize,
    extent: f64,
    length: usize,
) -> (Tensor<1, Int>, Tensor<1, Int>, Tensor<1>) {
    let [_, _, rows, columns] = registration.dims();
    let one = registration.clone().narrow(1, coordinate, 1);
    let position: Tensor<1> = one.reshape([rows * columns]) * extent - 0.5;
    let floor = position.clone().detach().floor();
    // Far beyond the texture a whole number would not fit its type.
    let first = floor.clone().clamp(-1.0, length as f64).int();
    let last = length as i64 - 1;
    let weight = position - floor;
    (first.clone().clamp(0, last), (first + 1).clamp(0, last), weight)
}

fn texels(picture: &Picture, device: &Device) -> Tensor<3> {
    let (width, height) = (picture.width(), picture.height());
    let channel = |k: usize| picture.rgb().iter().skip(k).step_by(3);
    let values: Vec<f32> = (0..3).flat_map(channel).map(|&value| f32::from(value)).collect();
    Tensor::from_data(TensorData::new(values, [3, height, width]), device)
}
