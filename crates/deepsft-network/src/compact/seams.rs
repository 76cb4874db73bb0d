//! Up-sampling where the registration jumps from one chart of the texture to another.

use crate::resampling::{upsample_bilinear, upsample_nearest};
use burn::tensor::Tensor;

/// Cells beside one another whose u or v differ by more than this belong to different charts. A surface whose charts
/// are a third of the texture and fill a sixth of the image's height changes by half of it over a cell.
pub const SEAM_JUMP: f32 = 0.12;

/// (u, v, d) of cells [N, 3, h, w] up-sampled `factor` (even) times, [N, 3, factor h, factor w]: bilinear, but between
/// cells of different charts the registration is that of the nearest cell. Depth does not jump at seams.
pub fn upsample_across_seams(coordinates: Tensor<4>, factor: usize) -> Tensor<4> {
    let [n, _, h, w] = coordinates.dims();
    let (rows, columns) = (factor * h, factor * w);
    let smooth = upsample_bilinear(coordinates.clone(), factor);
    let registration = coordinates.slice([0..n, 0..2]);
    // Every pixel lies between four cells; beyond the border the outermost stand for those that are not there.
    let edge = |x: &Tensor<4>, dim: usize, from: usize| x.clone().narrow(dim, from, 1);
    let wide = registration.clone().detach();
    let wide = Tensor::cat(vec![edge(&wide, 3, 0), wide.clone(), edge(&wide, 3, w - 1)], 3);
    let wide = Tensor::cat(vec![edge(&wide, 2, 0), wide.clone(), edge(&wide, 2, h - 1)], 2);
    let four = |row: usize, column: usize| {
        wide.clone()
            .slice([0..n, 0..2, row..row + h + 1, column..column + w + 1])
    };
    let [a, b, c, d] = [four(0, 0), four(0, 1), four(1, 0), four(1, 1)];
    let most = a.clone().max_pair(b.clone()).max_pair(c.clone().max_pair(d.clone()));
    let least = a.min_pair(b).min_pair(c.min_pair(d));
    let jump = (most - least).max_dim(1); // [N, 1, h + 1, w + 1]
    let jump = upsample_nearest(jump, factor);
    let half = factor / 2;
    let jump = jump.slice([0..n, 0..1, half..half + rows, half..half + columns]);
    let seam = jump.greater_elem(SEAM_JUMP).expand([n, 2, rows, columns]);
    let nearest = upsample_nearest(registration, factor);
    let registration = smooth.clone().slice([0..n, 0..2]).mask_where(seam, nearest);
    Tensor::cat(vec![registration, smooth.slice([0..n, 2..3])], 1)
}
