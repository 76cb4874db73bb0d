//! The compact network as a plan.

use super::cells::cells;
use super::patches::PATCH;
use crate::config::{Architecture, CompactConfig, NetworkConfig};
use crate::plan::{MapId, MapShape, Plan, PlanError, SkipInput, misfit};
use crate::weights::{PlanBuilder, Weights};

/// Cues that a refinement block reads beside the features: u, v, d, and how far four measured depths lie from it; behind them z, if
/// the network says rest positions.
pub(super) const CUES: usize = 7;

/// What relu is multiplied by in training (Brock et al. 2021, "Characterizing signal propagation in normalizer-free networks"). Here the
/// filters behind it are.
pub(super) const RELU_GAIN: f32 = 1.713_958_7;

/// The compact network as a plan, and the maps at which the caller reads and writes.
#[derive(Debug)]
pub(crate) struct CompactPlan {
    pub(super) plan: Plan,
    pub(super) layers: CompactConfig,
    /// Patches of the image, 48 numbers each; the caller's.
    pub(super) image: MapId,
    /// Logits of all bins, stride 16.
    pub(super) bins: MapId,
    /// Corrections of the coordinates that bins give, stride 8.
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

impl CompactPlan {
    /// # Errors
    /// [`PlanError`] when `weights` are not those of `config`, when that is of another architecture or out of its limits, and for an
    /// image without pixels.
    pub(crate) fn new(image: [usize; 2], config: &NetworkConfig, weights: &Weights) -> Result<Self, PlanError> {
        let Architecture::Compact(shape) = &config.architecture else {
            return Err(PlanError::Architecture(config.architecture.name()));
        };
        config.check()?;
        if image.contains(&0) {
            return Err(misfit("image", &image, &[1, 1]));
        }
        let mut builder = PlanBuilder::new(weights, RELU_GAIN);
        let [rows, columns] = cells(image);
        let trunk = Trunk::new(&mut builder, image, shape)?;
        let coordinates = shape.bins.len();
        let names = ["main.bins.0", "main.bins.1", "main.bins.2", "main.bins.3"];
        let bins = builder.stacked(&[trunk.at16.relu()], &names[..coordinates], &shape.bins, 1)?;
        let bins = builder.plan.convolve(bins)?;
        let offset = builder.layer(&[trunk.at8.relu()], "main.offset", [coordinates, 1, 1], None)?;

        let width = shape.mask_channels;
        let coarse = builder.layer(&[trunk.at8.relu()], "mask_coarse", [width, 1, 1], None)?;
        let skip = Some(SkipInput::doubled(coarse));
        let mask = builder.layer(&[trunk.patches.plain()], "mask_fine", [width, 1, 1], skip)?;
        let skip = Some(SkipInput::same(mask));
        let mask = builder.layer(&[mask.relu()], "mask_mix", [width, 3, 1], skip)?;
        let mask = builder.layer(&[mask.relu()], "mask", [PATCH * PATCH, 1, 1], None)?;

        let cells = MapShape::new(CUES + coordinates - 3, rows, columns);
        let mut refine = |name: &str, outputs: usize| {
            let (mark, cues) = (builder.plan.steps(), builder.plan.input(cells));
            let shape = [shape.refinement_channels, 3, 1];
            let seen = [trunk.at8.relu(), cues.plain()];
            let entry = builder.relu_layer(&seen, &format!("{name}.entry"), shape, None)?;
            let middle = builder.relu_layer(&[entry.plain()], &format!("{name}.middle"), shape, None)?;
            let shape = [outputs, 1, 1];
            let correction = builder.layer(&[middle.plain()], &format!("{name}.correction"), shape, None)?;
            Ok((mark, cues, correction))
        };
        let depth = refine("depth_refinement", 4)?;
        let registration = refine("registration_refinement", coordinates - 1)?;
        Ok(Self {
            plan: builder.finish()?,
            layers: shape.clone(),
            image: trunk.image,
            bins,
            offset,
            mask,
            cues: [depth.1, registration.1],
            corrections: [depth.2, registration.2],
            marks: [depth.0, registration.0],
        })
    }
}

/// The main block without its heads.
pub(super) struct Trunk {
    /// Patches of the image, 48 numbers each; the caller's.
    pub(super) image: MapId,
    /// The first layer's result, rectified, stride 4.
    pub(super) patches: MapId,
    /// Features at strides 16 and 8.
    pub(super) at16: MapId,
    pub(super) at8: MapId,
}

impl Trunk {
    pub(super) fn new(
        builder: &mut PlanBuilder<'_>,
        image: [usize; 2],
        shape: &CompactConfig,
    ) -> Result<Self, PlanError> {
        let [rows, columns] = cells(image);
        let patches = MapShape::new(3 * PATCH * PATCH, 2 * rows, 2 * columns);
        let image = builder.plan.input(patches);
        let [c4, c8, c16, c32] = shape.channels;
        let patches = builder.relu_layer(&[image.plain()], "main.patch", [c4, 1, 1], None)?;
        let at8 = builder.layer(&[patches.plain()], "main.down8", [c8, 3, 2], None)?;
        let at8 = block(builder, at8, "main.encode8", c8)?;
        let at16 = builder.layer(&[at8.relu()], "main.down16", [c16, 3, 2], None)?;
        let at16 = block(builder, at16, "main.encode16", c16)?;
        let mut at32 = builder.layer(&[at16.relu()], "main.down32", [c32, 3, 2], None)?;
        for k in 0..shape.blocks_at_32 {
            at32 = block(builder, at32, &format!("main.encode32.{k}"), c32)?;
        }
        let lateral = builder.layer(&[at32.relu()], "main.lateral16", [c16, 1, 1], None)?;
        let at16 = builder.plan.add(at16, SkipInput::doubled(lateral));
        let at16 = block(builder, at16, "main.decode16", c16)?;
        let lateral = builder.layer(&[at16.relu()], "main.lateral8", [c8, 1, 1], None)?;
        let at8 = builder.plan.add(at8, SkipInput::doubled(lateral));
        let at8 = block(builder, at8, "main.decode8", c8)?;
        Ok(Self {
            image,
            patches,
            at16,
            at8,
        })
    }
}

/// x + conv(relu(conv(relu(x)))).
fn block(builder: &mut PlanBuilder<'_>, x: MapId, name: &str, channels: usize) -> Result<MapId, PlanError> {
    let shape = [channels, 3, 1];
    let branch = builder.relu_layer(&[x.relu()], &format!("{name}.first"), shape, None)?;
    let skip = Some(SkipInput::same(x));
    builder.layer(&[branch.plain()], &format!("{name}.second"), shape, skip)
}
