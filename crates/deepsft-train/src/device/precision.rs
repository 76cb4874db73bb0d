//! Mixed precision: which floating-point format the network computes in, and the scale of its loss.
//!
//! The usual recipe (Micikevicius et al. 2018, "Mixed Precision Training"): weights, optimiser, batch normalisation, what
//! the network hands out and the loss stay in single precision; the layers between compute and keep their activations in
//! half precision, since a layer of [`deepsft_network::Network`] computes in the precision of what comes in and the images are cast.
//! Gradients that would vanish in [`Precision::F16`] are kept by a scale on the loss.

use crate::error::TrainError;
use burn::module::{Module, ModuleVisitor, Param};
use burn::optim::GradientsParams;
use burn::tensor::{Device, FloatDType, Tensor};
use serde::{Deserialize, Serialize};
use std::{fmt, str::FromStr};

/// Floating-point format of a network's layers while it is trained.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
#[non_exhaustive]
pub enum Precision {
    /// Single precision throughout.
    #[default]
    F32,
    /// Half precision, IEEE 754: 11 bits of fraction, up to 65,504; with a loss scale.
    F16,
    /// Half precision with the range of single precision: 8 bits of fraction.
    BF16,
}

impl Precision {
    /// The name people type and read: `f32`, `f16`, `bf16`.
    pub fn name(self) -> &'static str {
        match self {
            Self::F32 => "f32",
            Self::F16 => "f16",
            Self::BF16 => "bf16",
        }
    }

    /// burn's name of it.
    pub(crate) fn dtype(self) -> FloatDType {
        match self {
            Self::F32 => FloatDType::F32,
            Self::F16 => FloatDType::F16,
            Self::BF16 => FloatDType::BF16,
        }
    }

    /// Whether `device` stores, converts and computes in it.
    ///
    /// # Errors
    /// [`TrainError::Precision`] when it does not.
    pub fn check(self, device: &Device) -> Result<(), TrainError> {
        if device.supports_dtype(self.dtype()) {
            return Ok(());
        }
        let others = [Self::F32, Self::F16, Self::BF16].into_iter();
        let there_are: Vec<&str> = others
            .filter(|other| device.supports_dtype(other.dtype()))
            .map(Self::name)
            .collect();
        Err(TrainError::Precision {
            precision: self.name(),
            there_are: there_are.join(", "),
        })
    }
}

impl fmt::Display for Precision {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}

impl FromStr for Precision {
    type Err = TrainError;

    /// # Errors
    /// [`TrainError::PrecisionUnknown`] for another name than those of [`Precision::name`].
    fn from_str(name: &str) -> Result<Self, TrainError> {
        let mut known = [Self::F32, Self::F16, Self::BF16].into_iter();
        known
            .find(|precision| precision.name() == name)
            .ok_or_else(|| TrainError::PrecisionUnknown { name: name.to_owned() })
    }
}

/// Scale of the loss before it is differentiated, and what became of the steps so far: a part of a checkpoint.
///
/// In [`Precision::F16`] it starts at 65,536, doubles after 2,000 finite steps in a row and halves after every step that
/// was not finite, which is not made. In the other precisions it stays 1.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct LossScale {
    /// Precision that it is for.
    pub precision: Precision,
    /// Factor on the loss, a power of two.
    pub scale: f64,
    /// Finite steps since the scale changed.
    pub finite_steps: u64,
    /// Steps that were not made since their gradients were not finite.
    pub skipped_steps: u64,
}

const FIRST_SCALE: f64 = 65_536.0;
/// Finite steps after which the scale doubles.
const GROWTH_STEPS: u64 = 2_000;
/// Where doubling ends: 2^24, by which the smallest gradient that half precision knows becomes one.
const LARGEST_SCALE: f64 = 16_777_216.0;
/// Where halving ends: with 2^-24 a gradient of one is the smallest that half precision knows, and what still overflows
/// is no matter of scale.
const SMALLEST_SCALE: f64 = 1.0 / LARGEST_SCALE;

impl LossScale {
    /// The scale that a training in `precision` begins with.
    pub fn new(precision: Precision) -> Self {
        Self {
            precision,
            scale: if precision == Precision::F16 { FIRST_SCALE } else { 1.0 },
            finite_steps: 0,
            skipped_steps: 0,
        }
    }

    /// Takes in that a step was made.
    pub(crate) fn step_made(&mut self) {
        self.finite_steps += 1;
        if self.precision == Precision::F16 && self.finite_steps >= GROWTH_STEPS {
            self.scale = (2.0 * self.scale).min(LARGEST_SCALE);
            self.finite_steps = 0;
        }
    }

    /// Takes in that a step was not finite; `false` when the scale cannot fall any more.
    pub(crate) fn step_skipped(&mut self) -> bool {
        if self.precision != Precision::F16 || self.scale <= SMALLEST_SCALE {
            return false;
        }
        self.scale /= 2.0;
        self.finite_steps = 0;
        self.skipped_steps += 1;
        true
    }
}

/// `gradients` of `module` divided by `scale`; `None` when one of them is not finite.
pub(crate) fn unscaled<M: Module>(mut gradients: GradientsParams, module: &M, scale: f64) -> Option<GradientsParams> {
    let mut check = Unscale {
        gradients: &mut gradients,
        factor: 1.0 / scale,
        zero: None,
    };
    module.visit(&mut check);
    let zero = check.zero.map_or(0.0, |zero| zero.into_scalar::<f32>());
    zero.is_finite().then_some(gradients)
}

struct Unscale<'a> {
    gradients: &'a mut GradientsParams,
    factor: f64,
    /// Zero times all gradients, summed: not a number if one of them is not finite. Read once.
    zero: Option<Tensor<1>>,
}

impl ModuleVisitor for Unscale<'_> {
    fn visit_float<const D: usize>(&mut self, param: &Param<Tensor<D>>) {
        let Some(gradient) = self.gradients.remove::<D>(param.id) else {
            return;
        };
        let gradient = gradient * self.factor;
        let zero = (gradient.clone() * 0.0).sum();
        self.zero = Some(match self.zero.take() {
            Some(sum) => sum + zero,
            None => zero,
        });
        self.gradients.register(param.id, gradient);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[derive(Module, Debug)]
    struct Weight {
        value: Param<Tensor<1>>,
    }

    #[test]
    fn the_scale_halves_after_what_is_not_finite_and_doubles_after_two_thousand_finite_steps() {
        let mut scale = LossScale::new(Precision::F16);
        assert_eq!(scale.scale, 65_536.0);
        (0..1_999).for_each(|_| scale.step_made());
        assert_eq!(scale.scale, 65_536.0);
        scale.step_made();
        assert_eq!((scale.scale, scale.finite_steps), (131_072.0, 0));
        scale.step_made();
        assert!(scale.step_skipped());
        assert_eq!((scale.scale, scale.finite_steps, scale.skipped_steps), (65_536.0, 0, 1));
        // From 2^16 to 2^-24, where there is nothing left to halve.
        assert!((0..40).all(|_| scale.step_skipped()));
        assert_eq!(scale.scale, 0.5_f64.powi(24));
        assert!(!scale.step_skipped());
        assert_eq!(scale.skipped_steps, 41);
        // Where nothing vanishes nothing is scaled.
        let mut scale = LossScale::new(Precision::BF16);
        (0..5_000).for_each(|_| scale.step_made());
        assert_eq!(scale.scale, 1.0);
        assert!(!scale.step_skipped());
    }

    #[test]
    fn gradients_are_divided_by_the_scale_and_one_that_is_not_finite_is_seen() {
        let device = Device::flex().autodiff();
        let weight = Weight {
            value: Param::from_tensor(Tensor::from_floats([1.0, -2.0], &device)),
        };
        // A scaled loss of 8 * 3 * sum.
        let gradients = |factor: f64| {
            let loss = (weight.value.val() * factor).sum();
            GradientsParams::from_grads(loss.backward(), &weight)
        };
        let divided = unscaled(gradients(24.0), &weight, 8.0).unwrap();
        let values = divided.get::<1>(weight.value.id).unwrap().into_data();
        assert_eq!(values.try_to_vec::<f32>().unwrap(), [3.0, 3.0]);
        for broken in [f64::INFINITY, f64::NAN] {
            assert!(unscaled(gradients(broken), &weight, 8.0).is_none());
        }
    }
}
