//! What is minimised: the cross-entropy of window cells over view cells.

use super::pairs::{CELL, Pair, VIEW, WINDOW};
use burn::module::{Module, Param};
use burn::tensor::{Device, Int, Tensor, TensorData, activation};
use deepsft_geometry::glam::DVec2;
use deepsft_network::DescriptorNetwork;

/// Cells of a view in a row, of a view, and of a window.
const SIDE: usize = VIEW[0] / CELL;
const VIEW_CELLS: usize = SIDE * SIDE;
const WINDOW_CELLS: usize = (WINDOW[0] / CELL) * (WINDOW[1] / CELL);

/// Weight of the same seen from the view, and of cells that match nothing.
const FROM_VIEW: f32 = 0.5;
const NOTHING: f32 = 0.15;

/// What a cell beside the print is put behind by.
const NEVER: f32 = 1e4;

/// Distance, cells, within which the best cell counts as right.
const RIGHT_CELLS: f64 = 1.5;

/// The network with the two numbers that make similarities odds.
#[derive(Module, Debug)]
pub struct Matcher {
    pub network: DescriptorNetwork,
    /// Logarithm of the factor from a similarity to logarithmic odds.
    log_sharpness: Param<Tensor<1>>,
    /// The similarity at which a cell matches as likely nothing.
    nothing: Param<Tensor<1>>,
}

/// Pairs as tensors. B pairs, N cells of a window, M of a view.
pub struct Batch {
    /// [B, 3, height, width]
    windows: Tensor<4>,
    views: Tensor<4>,
    /// [B, N, 4]: the four cells around where a cell of the window lies in the view, and their weights.
    corners: Tensor<3, Int>,
    weights: Tensor<3>,
    /// [B, N, 1]: 1 where a cell lies in the view, and where it shows no print.
    matched: Tensor<3>,
    beside: Tensor<3>,
    /// [B, 1, M]: [`NEVER`] where the view shows no print.
    hidden: Tensor<3>,
    places: Vec<Option<DVec2>>,
}

impl Batch {
    /// `pairs`, two and two of one print, on `device`.
    pub fn new(pairs: &[&Pair], device: &Device) -> Self {
        let count = pairs.len();
        let image = |of: for<'a> fn(&'a Pair) -> &'a Vec<f32>, [width, height]: [usize; 2]| {
            let values: Vec<f32> = pairs.iter().flat_map(|pair| of(pair)).copied().collect();
            Tensor::<4>::from_data(TensorData::new(values, [count, 3, height, width]), device)
        };
        let (mut corners, mut weights) = (Vec::new(), Vec::new());
        let (mut matched, mut beside, mut places) = (Vec::new(), Vec::new(), Vec::new());
        for pair in pairs {
            for &place in &pair.place {
                let inside = place.filter(|place| {
                    place.cmpgt(DVec2::splat(-0.4)).all() && place.cmplt(DVec2::splat(SIDE as f64 - 0.6)).all()
                });
                let around = inside.map(|place| around(place, &pair.is_print));
                let found = around.filter(|around| around.iter().any(|(_, weight)| *weight > 0.0));
                matched.push(f32::from(u8::from(found.is_some())));
                beside.push(f32::from(u8::from(place.is_none())));
                places.push(inside.filter(|_| found.is_some()));
                for (cell, weight) in found.unwrap_or_default() {
                    corners.push(cell as i64);
                    weights.push(weight);
                }
            }
        }
        let hidden = pairs.iter().flat_map(|pair| &pair.is_print);
        let hidden: Vec<f32> = hidden.map(|&is_print| if is_print { 0.0 } else { NEVER }).collect();
        let per_cell = |values: Vec<f32>, width: usize| {
            Tensor::<3>::from_data(TensorData::new(values, [count, WINDOW_CELLS, width]), device)
        };
        Self {
            windows: image(|pair| &pair.window, WINDOW),
            views: image(|pair| &pair.view, VIEW),
            corners: Tensor::from_data(TensorData::new(corners, [count, WINDOW_CELLS, 4]), device),
            weights: per_cell(weights, 4),
            matched: per_cell(matched, 1),
            beside: per_cell(beside, 1),
            hidden: Tensor::from_data(TensorData::new(hidden, [count, 1, VIEW_CELLS]), device),
            places,
        }
    }
}

/// The four cells of the view around `place`, bilinear weights over those that show the print.
fn around(place: DVec2, is_print: &[bool]) -> [(usize, f32); 4] {
    let place = place.clamp(DVec2::ZERO, DVec2::splat(SIDE as f64 - 1.001));
    let (low, part) = (place.floor(), place.fract());
    let mut cells = [(0, 0), (1, 0), (0, 1), (1, 1)].map(|(dx, dy)| {
        let cell = (low.y as usize + dy) * SIDE + low.x as usize + dx;
        let along = |d: usize, part: f64| if d == 1 { part } else { 1.0 - part };
        let weight = along(dx, part.x) * along(dy, part.y);
        (cell, if is_print[cell] { weight as f32 } else { 0.0 })
    });
    let sum: f32 = cells.iter().map(|(_, weight)| weight).sum();
    if sum > 0.0 {
        cells.iter_mut().for_each(|(_, weight)| *weight /= sum);
    }
    cells
}

impl Matcher {
    /// With random weights.
    pub fn new(device: &Device) -> Self {
        Self {
            network: DescriptorNetwork::new(device),
            log_sharpness: Param::from_tensor(Tensor::full([1], 2.7, device)),
            nothing: Param::from_tensor(Tensor::full([1], 0.3, device)),
        }
    }

    /// Descriptors of images, [B, cells, D].
    fn describe(&self, images: Tensor<4>) -> Tensor<3> {
        let descriptors = self.network.forward(images);
        let [count, length, rows, columns] = descriptors.dims();
        descriptors.reshape([count, length, rows * columns]).swap_dims(1, 2)
    }

    /// The loss, [1], and the fraction of the cells whose best match is right.
    pub fn loss(&self, batch: &Batch) -> (Tensor<1>, f64) {
        let windows = self.describe(batch.windows.clone());
        let views = self.describe(batch.views.clone()).swap_dims(1, 2);
        let count = windows.dims()[0];
        let sharpness = self.log_sharpness.val().exp().reshape([1, 1, 1]);
        let nothing = (self.nothing.val().reshape([1, 1, 1]) * sharpness.clone()).expand([count, WINDOW_CELLS, 1]);
        let odds = |views: Tensor<3>, hidden: Tensor<3>| windows.clone().matmul(views) * sharpness.clone() - hidden;
        let own = odds(views.clone(), batch.hidden.clone());
        let right = right_fraction(&own, &batch.places);
        let with_nothing = |odds: Tensor<3>| activation::log_softmax(Tensor::cat(vec![odds, nothing.clone()], 2), 2);
        let mean = |values: Tensor<3>, of: &Tensor<3>| (values * of.clone()).sum() / (of.clone().sum() + 1.0);
        let at_match =
            |logarithms: Tensor<3>| (logarithms.gather(2, batch.corners.clone()) * batch.weights.clone()).sum_dim(2);
        let of_nothing = |logarithms: Tensor<3>| logarithms.narrow(2, VIEW_CELLS, 1);
        let logarithms = with_nothing(own.clone());
        let matched = mean(at_match(logarithms.clone()), &batch.matched);
        let beside = mean(of_nothing(logarithms), &batch.beside);
        let from_view = mean(at_match(activation::log_softmax(own, 1)), &batch.matched);
        // Another print's view shows nothing of it.
        let others = |tensor: Tensor<3>| {
            let pair = 2.min(count);
            Tensor::cat(
                vec![tensor.clone().narrow(0, pair, count - pair), tensor.narrow(0, 0, pair)],
                0,
            )
        };
        let elsewhere = of_nothing(with_nothing(odds(others(views), others(batch.hidden.clone())))).mean();
        (
            -(matched + from_view * FROM_VIEW + (beside + elsewhere) * NOTHING),
            right,
        )
    }
}

/// The fraction of the cells with a place whose best cell is near it.
fn right_fraction(odds: &Tensor<3>, places: &[Option<DVec2>]) -> f64 {
    let best = odds.clone().detach().argmax(2).into_data().convert::<i64>();
    let Ok(best) = best.try_to_vec::<i64>() else { return 0.0 };
    let (mut right, mut all) = (0, 0_usize);
    for (best, place) in best.into_iter().zip(places) {
        let Some(place) = place else { continue };
        let cell = DVec2::new((best as usize % SIDE) as f64, (best as usize / SIDE) as f64);
        right += usize::from(cell.distance(*place) < RIGHT_CELLS);
        all += 1;
    }
    right as f64 / all.max(1) as f64
}
