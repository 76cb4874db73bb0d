//! The compact network as a plan.

use super::shape::{Weights, cells};
use crate::config::CompactConfig;
use crate::plan::{Added, Convolution, Filters, Input, MapId, MapShape, Plan, PlanError, plain, relu};

/// Side of a patch, pixels.
pub(super) const PATCH: usize = 4;

/// Cues that a refinement block reads beside the features: u, v, d, and how far four measured depths lie from it.
pub(super) const CUES: usize = 7;

/// What relu is multiplied by in training (Brock et al. 2021, "Characterizing signal propagation in normalizer-free networks"). Here the
/// filters behind it are.
const RELU_GAIN: f32 = 1.713_958_7;

/// The plan and the maps at which the caller reads and writes.
pub(super) struct CompactPlan {
    pub(super) plan: Plan,
    /// Patches of the image, 48 numbers each; the caller's.
    pub(super) image: MapId,
    /// Logits of all bins, stride 16.
    pub(super) bins: MapId,
    /// Corrections of u, v and d that bins give, stride 8.
    pub(super) offset: MapId,
    /// Logits of the mask, 16 for each patch.
    pub(super) mask: MapId,
    /// Cues of the two refinement blocks, stride 8; the caller's.
    pub(super) cues: [MapId; 2],
    /// What the refinement blocks say, stride 8.
    pub(super) corrections: [MapId; 2],
    /// The steps after which the caller writes the cues of each block.
    pub(super) marks: [usize; 2],
}

struct Builder<'a> {
    plan: Plan,
    weights: &'a Weights,
}

impl CompactPlan {
    pub(super) fn new(image: [usize; 2], shape: &CompactConfig, weights: &Weights) -> Result<Self, PlanError> {
        let mut builder = Builder {
            plan: Plan::default(),
            weights,
        };
        let [rows, columns] = cells(image);
        let patches = MapShape {
            channels: 3 * PATCH * PATCH,
            height: 2 * rows,
            width: 2 * columns,
        };
        let image = builder.plan.input(patches);
        let [c4, c8, c16, c32] = shape.channels;

        let patches = builder.layer(&[plain(image)], "main.patch", c4, 1, 1, None)?;
        let at8 = builder.layer(&[relu(patches)], "main.down8", c8, 3, 2, None)?;
        let at8 = builder.block(at8, "main.encode8", c8)?;
        let at16 = builder.layer(&[relu(at8)], "main.down16", c16, 3, 2, None)?;
        let at16 = builder.block(at16, "main.encode16", c16)?;
        let mut at32 = builder.layer(&[relu(at16)], "main.down32", c32, 3, 2, None)?;
        for k in 0..shape.blocks_at_32 {
            at32 = builder.block(at32, &format!("main.encode32.{k}"), c32)?;
        }
        let lateral = builder.layer(&[relu(at32)], "main.lateral16", c16, 1, 1, None)?;
        let at16 = builder.plan.add(at16, Added::doubled(lateral))?;
        let at16 = builder.block(at16, "main.decode16", c16)?;
        let bins = builder.stacked(
            &[relu(at16)],
            &["main.bins.0", "main.bins.1", "main.bins.2"],
            &shape.bins,
        )?;
        let lateral = builder.layer(&[relu(at16)], "main.lateral8", c8, 1, 1, None)?;
        let at8 = builder.plan.add(at8, Added::doubled(lateral))?;
        let at8 = builder.block(at8, "main.decode8", c8)?;
        let offset = builder.layer(&[relu(at8)], "main.offset", 3, 1, 1, None)?;

        let width = shape.mask_channels;
        let coarse = builder.layer(&[relu(at8)], "mask_coarse", width, 1, 1, None)?;
        let mask = builder.layer(&[relu(patches)], "mask_fine", width, 1, 1, Some(Added::doubled(coarse)))?;
        let mask = builder.layer(&[relu(mask)], "mask_mix", width, 3, 1, Some(Added::same(mask)))?;
        let mask = builder.layer(&[relu(mask)], "mask", PATCH * PATCH, 1, 1, None)?;

        let cells = MapShape {
            channels: CUES,
            height: rows,
            width: columns,
        };
        let mut refine = |name: &str, outputs: usize| {
            let (mark, cues) = (builder.plan.steps(), builder.plan.input(cells));
            let width = shape.refinement_channels;
            let entry = builder.layer(&[relu(at8), plain(cues)], &format!("{name}.entry"), width, 3, 1, None)?;
            let middle = builder.layer(&[relu(entry)], &format!("{name}.middle"), width, 3, 1, None)?;
            let correction = builder.layer(&[relu(middle)], &format!("{name}.correction"), outputs, 1, 1, None)?;
            Ok((mark, cues, correction))
        };
        let depth = refine("depth_refinement", 4)?;
        let registration = refine("registration_refinement", 2)?;
        Ok(Self {
            plan: builder.plan,
            image,
            bins,
            offset,
            mask,
            cues: [depth.1, registration.1],
            corrections: [depth.2, registration.2],
            marks: [depth.0, registration.0],
        })
    }
}

impl Builder<'_> {
    fn array(&self, name: &str, length: usize) -> Result<&[f32], PlanError> {
        let values = self
            .weights
            .get(name)
            .ok_or_else(|| PlanError::Missing(name.to_owned()))?;
        if values.len() != length {
            return Err(PlanError::Shape {
                what: name.to_owned(),
                actual: vec![values.len()],
                expected: vec![length],
            });
        }
        Ok(values)
    }

    fn layer(
        &mut self,
        inputs: &[Input],
        name: &str,
        outputs: usize,
        kernel: usize,
        stride: usize,
        added: Option<Added>,
    ) -> Result<MapId, PlanError> {
        let filters = self.filters(inputs, &[name], &[outputs], kernel)?;
        self.plan.convolve(Convolution {
            inputs: inputs.to_vec(),
            filters,
            stride,
            added,
            rectified: false,
        })
    }

    /// Several 1 x 1 convolutions of the same maps as one.
    fn stacked(&mut self, inputs: &[Input], names: &[&str], outputs: &[usize]) -> Result<MapId, PlanError> {
        let filters = self.filters(inputs, names, outputs, 1)?;
        self.plan.convolve(Convolution {
            inputs: inputs.to_vec(),
            filters,
            stride: 1,
            added: None,
            rectified: false,
        })
    }

    fn filters(
        &self,
        inputs: &[Input],
        names: &[&str],
        outputs: &[usize],
        kernel: usize,
    ) -> Result<Filters, PlanError> {
        let channels = inputs.iter().map(|input| self.plan.shape(input.map).channels);
        let fan_in: usize = channels.clone().sum::<usize>() * kernel * kernel;
        // The factor of each of a filter's values.
        let factors: Vec<f32> = inputs
            .iter()
            .zip(channels)
            .flat_map(|(input, channels)| {
                let factor = if input.rectified { RELU_GAIN } else { 1.0 };
                std::iter::repeat_n(factor, channels * kernel * kernel)
            })
            .collect();
        let (mut weights, mut biases) = (Vec::new(), Vec::new());
        for (name, &outputs) in names.iter().zip(outputs) {
            let values = self.array(&format!("{name}.weight"), outputs * fan_in)?;
            weights.extend(
                values
                    .iter()
                    .zip(factors.iter().cycle())
                    .map(|(value, factor)| value * factor),
            );
            biases.extend(self.array(&format!("{name}.bias"), outputs)?);
        }
        Ok(Filters {
            weights,
            biases,
            inputs: fan_in / (kernel * kernel),
            kernel,
        })
    }

    /// x + conv(relu(conv(relu(x)))).
    fn block(&mut self, x: MapId, name: &str, channels: usize) -> Result<MapId, PlanError> {
        let branch = self.layer(&[relu(x)], &format!("{name}.first"), channels, 3, 1, None)?;
        self.layer(
            &[relu(branch)],
            &format!("{name}.second"),
            channels,
            3,
            1,
            Some(Added::same(x)),
        )
    }
}
