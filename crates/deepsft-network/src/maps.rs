//! What every architecture says of an image, at every pixel.

use burn::tensor::Tensor;
use deepsft_inference::DepthRange;

/// Full-resolution maps of B images of H x W pixels, differentiable with respect to all weights that are trained.
///
/// Depths are *normalised depths* of [`DepthRange`]: (z - near) / (far - near), 0 to 1 inside the range;
/// [`NetworkMaps::millimetres`] converts. Registrations are (u, v) in the unit square of the texture, or rest positions (x, y, z) in
/// the unit cube ([`deepsft_geometry::RestSurface`]): C numbers.
///
/// Outside the object the paper's network and R50F learn to say -1 in all three (as in the paper, in these units),
/// see [`super::Network::says_outside`]; the compact network continues the surface there and says with the mask
/// alone where it ends. Whatever the architecture, [`deepsft_geometry::Maps`] read from them are -1 outside.
#[derive(Clone, Debug)]
pub struct NetworkMaps {
    /// Main block's depth, [B, 1, H, W].
    pub main_depth: Tensor<4>,
    /// Main block's registration, [B, C, H, W].
    pub main_registration: Tensor<4>,
    /// Refined depth, [B, 1, H, W]; the main block's where there is no refinement (R50F).
    pub depth: Tensor<4>,
    /// Refined registration, [B, C, H, W]; the main block's where there is no refinement (R50F).
    pub registration: Tensor<4>,
    /// Logit of "the object is seen here", [B, 1, H, W]: positive where it is.
    pub mask_logits: Tensor<4>,
}

/// What the paper's network and R50F say outside the object, in each map.
pub const OUTSIDE: f64 = -1.0;

/// Slope of the mask's logit over the normalised depth of a network that says -1 outside: at the near end of the
/// range the logit is 4 (a probability of 0.98), outside -4. Our choice; where the mask ends does not depend on it.
const MASK_SLOPE: f64 = 8.0;

impl NetworkMaps {
    /// Probability that the object is seen, [B, 1, H, W].
    pub fn mask(&self) -> Tensor<4> {
        burn::tensor::activation::sigmoid(self.mask_logits.clone())
    }

    /// Normalised depths of any shape in mm: 0 is `range.near_mm`, 1 `range.far_mm`. The slope is
    /// [`DepthRange::span_mm`] everywhere.
    pub fn millimetres(depth: Tensor<4>, range: DepthRange) -> Tensor<4> {
        depth * range.span_mm() + range.near_mm
    }

    /// The mask of a depth map that is [`OUTSIDE`] where nothing is seen: the paper's depth > -1, with the threshold
    /// halfway between outside and the near end of the range (a network never says exactly -1).
    pub(super) fn mask_logits_of_depth(depth: Tensor<4>) -> Tensor<4> {
        (depth - OUTSIDE / 2.0) * MASK_SLOPE
    }
}
