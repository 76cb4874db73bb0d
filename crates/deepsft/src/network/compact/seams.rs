//! Up-sampling where the registration jumps from one chart of the texture to another.

use super::layers::upsample_bilinear;
use crate::network::upsampling::upsample_nearest;
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

#[cfg(test)]
mod tests {
    use super::*;
    use burn::tensor::Device;

    #[test]
    fn charts_are_not_mixed_and_one_chart_is_as_smooth_as_without_seams() {
        // u = 0.1, 0.14, 0.8, 0.84 along x: a seam between the second and the third cell; v and d rise evenly.
        let (device, factor) = (Device::flex(), 8);
        let u = [0.1, 0.14, 0.8, 0.84];
        let mut values = vec![0.0_f32; 3 * 2 * 4];
        for row in 0..2 {
            for column in 0..4 {
                values[row * 4 + column] = u[column];
                values[8 + row * 4 + column] = 0.02 * column as f32;
                values[16 + row * 4 + column] = 0.3 * column as f32;
            }
        }
        let cells = Tensor::<1>::from_floats(values.as_slice(), &device).reshape([1, 3, 2, 4]);
        let data = upsample_across_seams(cells.clone(), factor)
            .into_data()
            .try_to_vec::<f32>()
            .unwrap();
        let smooth = upsample_bilinear(cells, factor)
            .into_data()
            .try_to_vec::<f32>()
            .unwrap();
        let at = |values: &[f32], channel: usize, x: usize| values[(channel * 16 + 5) * 32 + x];
        for x in 0..32 {
            // The seam's pixels lie between the centres of the cells: 12 and 20.
            let expected = match x {
                12..16 => 0.14,
                16..20 => 0.8,
                _ => at(&smooth, 0, x),
            };
            assert!(
                (at(&data, 0, x) - expected).abs() < 1e-6,
                "u at {x}: {}",
                at(&data, 0, x)
            );
            assert_eq!(at(&data, 2, x), at(&smooth, 2, x), "d at {x}");
        }
        // 0.1 at 4, 0.14 at 12, linear between.
        assert!((at(&data, 0, 8) - (0.1 + 0.04 * 4.5 / 8.0)).abs() < 1e-6);
    }
}
