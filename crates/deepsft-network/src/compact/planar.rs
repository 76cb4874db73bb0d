//! Depth measured from the registration: the plane that explains it around every cell.
//!
//! A convolution sees scale and tilt only through the registration it has just predicted, over a
//! distance it hardly reaches; what they imply is known in closed form, so it is computed.

use super::cells::PIXELS_PER_CELL;
use burn::tensor::{Device, Tensor};
use deepsft_inference::{DepthRange, NetworkConfig};

/// Standard deviations of the Gaussian windows, cells: one that follows a bend, one that is steady.
const REACHES: [f64; PLANAR_CUES] = [5.0, 10.0];

/// Maps that [`planar_depth`] returns.
pub const PLANAR_CUES: usize = 2;

/// Unit of the template's coordinates here, mm: moments of the order of one.
const UNIT_MM: f64 = 100.0;

/// Damping of the template's covariance, units^2, and of the plane's slopes.
const COVARIANCE_DAMPING: f64 = 1e-5;
const SLOPE_DAMPING: f64 = 1e-5;

/// Fraction of a window that must be seen for its plane to count half.
const HALF_SUPPORT: f64 = 0.01;

/// Weighted moments, see [`moments`].
const MOMENTS: usize = 6 + 12 + 5;

/// Depth of the plane that explains the registration around each cell, by windowed least squares.
///
/// With q the ray (x, y) of a cell and P = (U, V) its registration, a plane is seen as
/// q (1 + g P) = A P + t (a homography; 1 + g P is the depth up to scale). For each window of
/// standard deviation [`REACHES`] the A, t, g that minimise the weighted squared residual are found
/// in closed form (A and t eliminated, 2 x 2 left for g); the columns r1 = (A_1, g_1) and
/// r2 = (A_2, g_2) of the pose are of length one for an isometric template, which gives the scale,
/// and the depth is where the cell's ray meets the plane.
///
/// `coordinates` [N, 3, h, w]; `seen` [N, 1, h, w], 0..=1: how much a cell counts; `corners`
/// [N, 2, 1, 1]: where the image lies in the canonical frame, pixels. Returned are normalised log depths
/// [N, 2, h, w], near the depth of `coordinates` where little is seen. Not differentiated: a measurement,
/// which the refinement learns to weigh.
pub fn planar_depth(
    coordinates: &Tensor<4>,
    seen: &Tensor<4>,
    corners: Option<&Tensor<4>>,
    config: &NetworkConfig,
) -> Tensor<4> {
    let [n, _, h, w] = coordinates.dims();
    let maps = coordinates.clone().detach();
    let coordinate = |k: usize| maps.clone().narrow(1, k, 1);
    let seen = seen.clone().detach();
    let device = maps.device();
    let [width, height] = config.template_size_mm;
    let u = (coordinate(0) - 0.5) * (width / UNIT_MM);
    let v = (coordinate(1) - 0.5) * (height / UNIT_MM);
    // [N, 2, h, w]: x and y of the ray through a cell's centre.
    let mut rays = rays(h, w, config, &device).expand([n, 2, h, w]);
    if let Some(corners) = corners {
        rays = rays + corners.clone() / config.focal;
    }

    let moments = moments(&u, &v, &rays) * seen.clone();
    let support = windows(Tensor::cat(vec![seen, moments], 1)); // [2 N, 1 + 23, h, w]
    let seen_fraction = support.clone().slice([0..2 * n, 0..1]);
    let means = support.slice([0..2 * n, 1..1 + MOMENTS]) / (seen_fraction.clone() + 1e-6);
    let rays = Tensor::cat(vec![rays.clone(), rays], 0);
    let depth =
        normalise_depth((plane_depth(&means, rays) * UNIT_MM).clamp_min(1.0), config.depth_range).clamp(-0.5, 1.5);

    let d = Tensor::cat(vec![coordinate(2), coordinate(2)], 0);
    let trust = seen_fraction.clone() / (seen_fraction + HALF_SUPPORT);
    let cue = d.clone() + (depth - d) * trust;
    Tensor::cat(vec![cue.clone().slice([0..n, 0..1]), cue.slice([n..2 * n, 0..1])], 1)
}

/// The rays (x, y) at z = 1 through the cells' centres of a frame of the training camera, [1, 2, h, w].
fn rays(h: usize, w: usize, config: &NetworkConfig, device: &Device) -> Tensor<4> {
    let [cx, cy] = config.principal_point;
    let along = |cell: usize, c: f64| (((cell as f64 + 0.5) * PIXELS_PER_CELL as f64 - c) / config.focal) as f32;
    let x = (0..h * w).map(|i| along(i % w, cx));
    let y = (0..h * w).map(|i| along(i / w, cy));
    let values: Vec<f32> = x.chain(y).collect();
    Tensor::<1>::from_floats(values.as_slice(), device).reshape([1, 2, h, w])
}

/// 1, U, V, UU, UV, VV; x times these six; y times these six; |q|^2 times the last five of them:
/// [N, 23, h, w].
fn moments(u: &Tensor<4>, v: &Tensor<4>, rays: &Tensor<4>) -> Tensor<4> {
    let [n, _, h, w] = u.dims();
    let one = Tensor::ones([n, 1, h, w], &u.device());
    let product = |a: &Tensor<4>, b: &Tensor<4>| a.clone() * b.clone();
    let squares = [product(u, u), product(u, v), product(v, v)];
    // [N, 6, h, w]
    let powers = Tensor::cat([one, u.clone(), v.clone()].into_iter().chain(squares).collect(), 1);
    let (x, y) = (rays.clone().narrow(1, 0, 1), rays.clone().narrow(1, 1, 1));
    let square = (product(&x, &x) + product(&y, &y)) * powers.clone().narrow(1, 1, 5);
    Tensor::cat(vec![powers.clone(), powers.clone() * x, powers * y, square], 1)
}

/// Gaussian windows of each reach over the cells, one reach after another along the batch:
/// [N, C, h, w] -> [2 N, C, h, w]. Nothing is seen beyond the edge.
fn windows(x: Tensor<4>) -> Tensor<4> {
    let [_, _, h, w] = x.dims();
    let device = x.device();
    let blurred = REACHES.map(|reach| {
        gaussian_matrix(h, reach, &device)
            .matmul(x.clone())
            .matmul(gaussian_matrix(w, reach, &device))
    });
    Tensor::cat(blurred.to_vec(), 0)
}

/// Entry (i, j) is the density at i - j of a normal distribution, [1, 1, length, length].
fn gaussian_matrix(length: usize, deviation: f64, device: &Device) -> Tensor<4> {
    let values: Vec<f32> = (0..length * length)
        .map(|k| {
            let t = ((k / length) as f64 - (k % length) as f64) / deviation;
            ((-t * t / 2.0).exp() / (deviation * (2.0 * std::f64::consts::PI).sqrt())) as f32
        })
        .collect();
    Tensor::<1>::from_floats(values.as_slice(), device).reshape([1, 1, length, length])
}

/// Depth of each window's plane along its centre's ray, in [`UNIT_MM`]: means of the moments
/// [B, 23, h, w] and rays [B, 2, h, w] -> [B, 1, h, w].
fn plane_depth(means: &Tensor<4>, rays: Tensor<4>) -> Tensor<4> {
    let b = means.dims()[0];
    let at = |k: usize| means.clone().slice([0..b, k..k + 1]);
    // Moment k times x and times y, [B, 2, h, w].
    let pair = |k: usize| Tensor::cat(vec![at(6 + k), at(12 + k)], 1);
    let over_xy = |t: Tensor<4>| t.sum_dim(1);
    let (u, v) = (at(1), at(2));
    let (q, qu, qv, quu, quv, qvv) = (pair(0), pair(1), pair(2), pair(3), pair(4), pair(5));

    // Covariance of P, inverted.
    let suu = at(3) - u.clone() * u.clone() + COVARIANCE_DAMPING;
    let suv = at(4) - u.clone() * v.clone();
    let svv = at(5) - v.clone() * v.clone() + COVARIANCE_DAMPING;
    let determinant = suu.clone() * svv.clone() - suv.clone() * suv.clone();
    let inverse = [svv / determinant.clone(), -suv / determinant.clone(), suu / determinant];
    let times_inverse = |[a, b]: &[Tensor<4>; 2]| {
        let [uu, uv, vv] = inverse.clone();
        [a.clone() * uu + b.clone() * uv.clone(), a.clone() * uv + b.clone() * vv]
    };
    let dot = |[a, b]: &[Tensor<4>; 2], [c, d]: &[Tensor<4>; 2]| a.clone() * c.clone() + b.clone() * d.clone();

    // Covariances of P with q, q U and q V, for x and y side by side.
    let c0 = [qu.clone() - q.clone() * u.clone(), qv.clone() - q.clone() * v.clone()];
    let cu = [quu - qu.clone() * u.clone(), quv.clone() - qu.clone() * v.clone()];
    let cv = [quv - qv.clone() * u.clone(), qvv - qv.clone() * v.clone()];
    let (s0, su, sv) = (times_inverse(&c0), times_inverse(&cu), times_inverse(&cv));

    // Normal equations of g.
    let kuu = at(20) - over_xy(qu.clone() * qu.clone() + dot(&cu, &su)) + SLOPE_DAMPING;
    let kuv = at(21) - over_xy(qu.clone() * qv.clone() + dot(&cu, &sv));
    let kvv = at(22) - over_xy(qv.clone() * qv.clone() + dot(&cv, &sv)) + SLOPE_DAMPING;
    let ru = over_xy(q.clone() * qu.clone() + dot(&cu, &s0)) - at(18);
    let rv = over_xy(q.clone() * qv.clone() + dot(&cv, &s0)) - at(19);
    let determinant = kuu.clone() * kvv.clone() - kuv.clone() * kuv.clone();
    let gu = (kvv * ru.clone() - kuv.clone() * rv.clone()) / determinant.clone();
    let gv = (kuu * rv - kuv * ru) / determinant;

    // A and t, x and y side by side.
    let along = |[a, b]: [Tensor<4>; 2], [c, d]: [Tensor<4>; 2], [e, f]: [Tensor<4>; 2]| {
        [a + gu.clone() * c + gv.clone() * e, b + gu.clone() * d + gv.clone() * f]
    };
    let [a1, a2] = along(s0, su, sv);
    let t = q + gu.clone() * qu + gv.clone() * qv - a1.clone() * u - a2.clone() * v;

    // Normal r1 x r2 of the plane, its scale, and the ray's depth.
    let squared_length = |a: &Tensor<4>, g: &Tensor<4>| over_xy(a.clone() * a.clone()) + g.clone() * g.clone();
    let lengths = squared_length(&a1, &gu) * squared_length(&a2, &gv) + 1e-12;
    let split = |a: Tensor<4>| [a.clone().slice([0..b, 0..1]), a.slice([0..b, 1..2])];
    let ([a1x, a1y], [a2x, a2y]) = (split(a1), split(a2));
    let normal_z = a1x.clone() * a2y.clone() - a1y.clone() * a2x.clone();
    let normal = Tensor::cat(vec![a1y * gv.clone() - gu.clone() * a2y, gu * a2x - a1x * gv], 1);
    let offset = over_xy(normal.clone() * t) + normal_z.clone();
    let facing = over_xy(normal * rays) + normal_z;
    let ratio = offset * facing.clone() / (facing.clone() * facing + 1e-9);
    ratio / lengths.sqrt().sqrt()
}

/// Depth in mm -> normalised log depth, any shape.
pub fn normalise_depth(depth: Tensor<4>, range: DepthRange) -> Tensor<4> {
    let span = (range.far_mm / range.near_mm).ln();
    (depth / range.near_mm).log() / span
}

#[cfg(test)]
mod tests {
    use super::*;
    use deepsft_geometry::training_camera;

    const H: usize = 34;
    const W: usize = 60;

    /// (u, v, d) of a plane seen from `corner` (pixels): the template turned by `turn` in its plane, tilted
    /// by `tilt` about the camera's x axis, its centre at depth `z` on the axis.
    fn plane(config: &NetworkConfig, corner: [f64; 2], turn: f64, tilt: f64, z: f64) -> (Vec<f32>, Vec<f32>) {
        let mut maps = vec![0.0_f32; 3 * H * W];
        let mut truth = vec![0.0_f32; H * W];
        let [cx, cy] = config.principal_point;
        for i in 0..H * W {
            let x = ((i % W) as f64 * 8.0 + 4.0 + corner[0] - cx) / config.focal;
            let y = ((i / W) as f64 * 8.0 + 4.0 + corner[1] - cy) / config.focal;
            // Plane through (0, 0, z) with normal (0, sin tilt, cos tilt).
            let depth = z * tilt.cos() / (y * tilt.sin() + tilt.cos());
            let (px, py) = (x * depth, (y * depth) * tilt.cos() - (depth - z) * tilt.sin());
            let (s, c) = turn.sin_cos();
            let [width, height] = config.template_size_mm;
            maps[i] = ((c * px + s * py) / width + 0.5) as f32;
            maps[H * W + i] = ((c * py - s * px) / height + 0.5) as f32;
            truth[i] = config.depth_range.normalise(depth) as f32;
            // The depth that was there, 4 % off: it must hardly matter.
            maps[2 * H * W + i] = truth[i] + 0.02;
        }
        (maps, truth)
    }

    fn worst(corner: [f64; 2], turn: f64, tilt: f64, z: f64) -> f32 {
        let config = NetworkConfig::compact([297.0, 210.0], &training_camera());
        let device = Device::flex();
        let (maps, truth) = plane(&config, corner, turn, tilt, z);
        let tensor = |values: Vec<f32>, shape: [usize; 3]| -> Tensor<4> {
            Tensor::<1>::from_floats(&values[..], &device).reshape([1, shape[0], shape[1], shape[2]])
        };
        let maps = tensor(maps, [3, H, W]);
        // Only cells on the sheet are seen.
        let off_centre = (maps.clone().narrow(1, 0, 2) - 0.5).abs().max_dim(1);
        let inside = off_centre.lower_elem(0.5).float();
        let corners = tensor(corner.map(|c| c as f32).to_vec(), [2, 1, 1]);
        let cues = planar_depth(&maps, &inside, Some(&corners), &config);
        let error = (cues - tensor(truth, [1, H, W])).abs() * inside;
        error.max().into_scalar::<f32>()
    }

    /// A per cent of depth is 5e-3 in normalised log depth (ln 8 spans one): at the sheet's corners the damping and the
    /// depth that was there leave a part of that.
    #[test]
    fn a_plane_is_measured_wherever_it_lies() {
        for (corner, turn, tilt, z) in [
            ([0.0, 0.0], 0.0, 0.0, 500.0),
            ([0.0, 0.0], 0.4, 0.6, 400.0),
            ([0.0, 0.0], -0.7, -0.9, 550.0),
            ([-60.0, 40.0], 0.3, 0.7, 350.0),
        ] {
            let error = worst(corner, turn, tilt, z);
            assert!(error < 5e-3, "turn {turn}, tilt {tilt}, z {z}: {error}");
        }
    }

    #[test]
    fn nothing_seen_leaves_the_depth_that_was_there() {
        let config = NetworkConfig::compact([297.0, 210.0], &training_camera());
        let device = Device::flex();
        let maps: Tensor<4> = Tensor::full([1, 3, 8, 8], 0.4, &device);
        let cues = planar_depth(&maps, &Tensor::zeros([1, 1, 8, 8], &device), None, &config);
        let off = (cues - 0.4).abs().max().into_scalar::<f32>();
        assert!(off < 1e-6, "{off}");
    }
}
