//! The compact network as a plan.

use super::positions::cells;
use crate::config::{Architecture, CompactConfig, NetworkConfig};
use crate::cpu::{CpuPlan, MAX_THREADS, Units, in_bands};
use crate::plan::{Added, MapId, MapShape, Plan, PlanError, plain, relu};
use crate::weights::{Builder, Weights};
use deepsft_geometry::Picture;
use pulp::{Arch, Simd, WithSimd};
use std::ops::Range;

/// Side of a patch, pixels.
pub(super) const PATCH: usize = 4;

/// Cues that a refinement block reads beside the features: u, v, d, and how far four measured depths lie from it.
pub(super) const CUES: usize = 7;

/// What relu is multiplied by in training (Brock et al. 2021, "Characterizing signal propagation in normalizer-free networks"). Here the
/// filters behind it are.
pub(super) const RELU_GAIN: f32 = 1.713_958_7;

/// The plan and the maps at which the caller reads and writes.
pub(crate) struct CompactPlan {
    pub(super) plan: Plan,
    pub(super) layers: CompactConfig,
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

impl CompactPlan {
    /// # Errors
    /// [`PlanError`] when `weights` are not those of `config`, when that is of another architecture, for an image without
    /// pixels, and for fewer than 2 bins.
    pub(crate) fn new(image: [usize; 2], config: &NetworkConfig, weights: &Weights) -> Result<Self, PlanError> {
        let Architecture::Compact(shape) = &config.architecture else {
            return Err(PlanError::Architecture(config.architecture.name()));
        };
        for (what, sides, least) in [("image", &image[..], 1), ("bins", &shape.bins, 2)] {
            if sides.iter().any(|&side| side < least) {
                return Err(PlanError::Shape {
                    what: what.to_owned(),
                    actual: sides.to_vec(),
                    expected: vec![least; sides.len()],
                });
            }
        }
        let mut builder = Builder::new(weights, RELU_GAIN);
        let [rows, columns] = cells(image);
        let Trunk {
            image,
            patches,
            at16,
            at8,
        } = Trunk::new(&mut builder, image, shape)?;
        let bins = builder.stacked(
            &[relu(at16)],
            &["main.bins.0", "main.bins.1", "main.bins.2"],
            &shape.bins,
        )?;
        let offset = builder.layer(&[relu(at8)], "main.offset", [3, 1, 1], None)?;

        let width = shape.mask_channels;
        let coarse = builder.layer(&[relu(at8)], "mask_coarse", [width, 1, 1], None)?;
        let mask = builder.layer(
            &[plain(patches)],
            "mask_fine",
            [width, 1, 1],
            Some(Added::doubled(coarse)),
        )?;
        let mask = builder.layer(&[relu(mask)], "mask_mix", [width, 3, 1], Some(Added::same(mask)))?;
        let mask = builder.layer(&[relu(mask)], "mask", [PATCH * PATCH, 1, 1], None)?;

        let cells = MapShape {
            channels: CUES,
            height: rows,
            width: columns,
        };
        let mut refine = |name: &str, outputs: usize| {
            let (mark, cues) = (builder.plan.steps(), builder.plan.input(cells));
            let width = shape.refinement_channels;
            let entry = builder.relu_layer(&[relu(at8), plain(cues)], &format!("{name}.entry"), [width, 3, 1], None)?;
            let middle = builder.relu_layer(&[plain(entry)], &format!("{name}.middle"), [width, 3, 1], None)?;
            let correction = builder.layer(&[plain(middle)], &format!("{name}.correction"), [outputs, 1, 1], None)?;
            Ok((mark, cues, correction))
        };
        let depth = refine("depth_refinement", 4)?;
        let registration = refine("registration_refinement", 2)?;
        Ok(Self {
            plan: builder.finish()?,
            layers: shape.clone(),
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
    pub(super) fn new(builder: &mut Builder<'_>, image: [usize; 2], shape: &CompactConfig) -> Result<Self, PlanError> {
        let [rows, columns] = cells(image);
        let image = builder.plan.input(MapShape {
            channels: 3 * PATCH * PATCH,
            height: 2 * rows,
            width: 2 * columns,
        });
        let [c4, c8, c16, c32] = shape.channels;
        let patches = builder.relu_layer(&[plain(image)], "main.patch", [c4, 1, 1], None)?;
        let at8 = builder.layer(&[plain(patches)], "main.down8", [c8, 3, 2], None)?;
        let at8 = block(builder, at8, "main.encode8", c8)?;
        let at16 = builder.layer(&[relu(at8)], "main.down16", [c16, 3, 2], None)?;
        let at16 = block(builder, at16, "main.encode16", c16)?;
        let mut at32 = builder.layer(&[relu(at16)], "main.down32", [c32, 3, 2], None)?;
        for k in 0..shape.blocks_at_32 {
            at32 = block(builder, at32, &format!("main.encode32.{k}"), c32)?;
        }
        let lateral = builder.layer(&[relu(at32)], "main.lateral16", [c16, 1, 1], None)?;
        let at16 = builder.plan.add(at16, Added::doubled(lateral))?;
        let at16 = block(builder, at16, "main.decode16", c16)?;
        let lateral = builder.layer(&[relu(at16)], "main.lateral8", [c8, 1, 1], None)?;
        let at8 = builder.plan.add(at8, Added::doubled(lateral))?;
        let at8 = block(builder, at8, "main.decode8", c8)?;
        Ok(Self {
            image,
            patches,
            at16,
            at8,
        })
    }
}

/// Patches of 4 x 4 pixels, the channels of the image one after another, values -2..=2; black where the image is padded.
pub(super) fn write_patches(cpu: &mut CpuPlan, map: MapId, image: &Picture) {
    let (MapShape { width, height, .. }, pitch) = (cpu.shape(map), cpu.pitch(map));
    let (arch, mut team) = (Arch::new(), [(); MAX_THREADS]);
    let threads = cpu.threads();
    let out = Units::whole(cpu.values_mut(map), width * pitch);
    in_bands(
        &mut team[..threads],
        0..height,
        out,
        &|(), rows, Units { values: out, .. }| {
            arch.dispatch(Patches {
                image,
                width,
                pitch,
                rows,
                out,
            });
        },
    );
}

/// The rows `rows` of patches.
struct Patches<'a> {
    image: &'a Picture,
    width: usize,
    pitch: usize,
    rows: Range<usize>,
    out: &'a mut [f32],
}

impl WithSimd for Patches<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) {
        let Self {
            image,
            width,
            pitch,
            rows,
            out,
        } = self;
        let line = 3 * image.width();
        for (y, out) in rows.zip(out.chunks_exact_mut(width * pitch)) {
            for row in 0..PATCH {
                let known = image.rgb().get((PATCH * y + row) * line..).unwrap_or_default();
                let known = &known[..known.len().min(line)];
                for (x, patch) in out.chunks_exact_mut(pitch).enumerate() {
                    let known = known.get(3 * PATCH * x..).unwrap_or_default();
                    let mut pixels = [0; 3 * PATCH];
                    match known.first_chunk() {
                        Some(known) => pixels = *known,
                        None => pixels[..known.len()].copy_from_slice(known),
                    }
                    for channel in 0..3 {
                        let values = &mut patch[(channel * PATCH + row) * PATCH..][..PATCH];
                        for (column, value) in values.iter_mut().enumerate() {
                            *value = f32::from(pixels[3 * column + channel]) * (4.0 / 255.0) - 2.0;
                        }
                    }
                }
            }
        }
    }
}

/// x + conv(relu(conv(relu(x)))).
fn block(builder: &mut Builder<'_>, x: MapId, name: &str, channels: usize) -> Result<MapId, PlanError> {
    let shape = [channels, 3, 1];
    let branch = builder.relu_layer(&[relu(x)], &format!("{name}.first"), shape, None)?;
    builder.layer(&[plain(branch)], &format!("{name}.second"), shape, Some(Added::same(x)))
}
