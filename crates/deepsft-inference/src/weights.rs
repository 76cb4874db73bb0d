//! From a network's weights to the layers of a plan.

use crate::plan::{Convolution, Filters, LayerInput, MapId, Plan, PlanError, SkipInput, misfit};
use std::cell::RefCell;
use std::collections::{BTreeMap, BTreeSet};

/// An array of weights.
#[derive(Clone, Debug, PartialEq)]
pub struct WeightArray {
    /// [out, in, kernel, kernel] for filters, [in, out] for matrices of dense layers, [out] for biases.
    pub shape: Vec<usize>,
    /// Its values, the last axis fastest.
    pub values: Vec<f32>,
}

/// Maps the paths of folded weights to their arrays (`main.encode8.first.weight`, `main.bins.0.bias`).
pub type Weights = BTreeMap<String, WeightArray>;

/// A convolution's outputs, the side of its kernel, and its stride.
pub(crate) type LayerShape = [usize; 3];

/// A plan that grows by named layers.
pub(crate) struct PlanBuilder<'a> {
    pub(crate) plan: Plan,
    weights: &'a Weights,
    used: RefCell<BTreeSet<&'a str>>,
    /// What relu is multiplied by; here the weights beside it are.
    gain: f32,
}

impl<'a> PlanBuilder<'a> {
    pub(crate) fn new(weights: &'a Weights, gain: f32) -> Self {
        Self {
            plan: Plan::default(),
            weights,
            used: RefCell::default(),
            gain,
        }
    }

    /// The plan, when all weights have found their place.
    pub(crate) fn finish(self) -> Result<Plan, PlanError> {
        let used = self.used.into_inner();
        match self.weights.keys().find(|name| !used.contains(name.as_str())) {
            Some(name) => Err(PlanError::NoPlace(name.clone())),
            None => Ok(self.plan),
        }
    }

    /// The array `name`, which has the shape `shape`.
    pub(crate) fn array(&self, name: &str, shape: &[usize]) -> Result<&'a [f32], PlanError> {
        let (name, array) = (self.weights)
            .get_key_value(name)
            .ok_or_else(|| PlanError::Missing(name.to_owned()))?;
        self.used.borrow_mut().insert(name);
        if array.shape != shape {
            return Err(misfit(name, &array.shape, shape));
        }
        let length = shape.iter().product();
        if array.values.len() != length {
            return Err(misfit(name, &[array.values.len()], &[length]));
        }
        Ok(&array.values)
    }

    /// Adds the convolution `name` of `inputs`.
    pub(crate) fn layer(
        &mut self,
        inputs: &[LayerInput],
        name: &str,
        [outputs, kernel, stride]: LayerShape,
        skip: Option<SkipInput>,
    ) -> Result<MapId, PlanError> {
        self.plan.convolve(Convolution {
            stride,
            skip,
            ..self.stacked(inputs, &[name], &[outputs], kernel)?
        })
    }

    /// Adds the same with relu.
    pub(crate) fn relu_layer(
        &mut self,
        inputs: &[LayerInput],
        name: &str,
        [outputs, kernel, stride]: LayerShape,
        skip: Option<SkipInput>,
    ) -> Result<MapId, PlanError> {
        let mut convolution = self.stacked(inputs, &[name], &[outputs], kernel)?;
        let Filters { weights, biases, .. } = &mut convolution.filters;
        weights.iter_mut().chain(biases).for_each(|value| *value *= self.gain);
        self.plan.convolve(Convolution {
            stride,
            skip,
            rectified: true,
            ..convolution
        })
    }

    /// Makes one convolution of several of the same maps.
    pub(crate) fn stacked(
        &self,
        inputs: &[LayerInput],
        names: &[&str],
        outputs: &[usize],
        kernel: usize,
    ) -> Result<Convolution, PlanError> {
        let channels = inputs.iter().map(|input| self.plan.shape(input.map).channels);
        let count: usize = channels.clone().sum();
        // The factor of each of a filter's values.
        let factors: Vec<f32> = inputs
            .iter()
            .zip(channels)
            .flat_map(|(input, channels)| {
                let factor = if input.rectified { self.gain } else { 1.0 };
                std::iter::repeat_n(factor, channels * kernel * kernel)
            })
            .collect();
        let (mut weights, mut biases) = (Vec::new(), Vec::new());
        for (name, &outputs) in names.iter().zip(outputs) {
            let values = self.array(&format!("{name}.weight"), &[outputs, count, kernel, kernel])?;
            let scaled = values.iter().zip(factors.iter().cycle());
            weights.extend(scaled.map(|(value, factor)| value * factor));
            biases.extend(self.array(&format!("{name}.bias"), &[outputs])?);
        }
        let filters = Filters {
            weights,
            biases,
            inputs: count,
            kernel,
        };
        Ok(Convolution::new(inputs.to_vec(), filters))
    }
}
