//! The network's input: patches of the image.

use crate::cpu::{Chunks, CpuPlan, MAX_THREADS, in_parallel};
use crate::plan::{MapId, MapShape};
use deepsft_geometry::Picture;
use pulp::{Arch, Simd, WithSimd};
use std::ops::Range;

/// Side of a patch, pixels.
pub(super) const PATCH: usize = 4;

/// Writes patches of 4 x 4 pixels, the channels of the image one after another, values -2..=2; black where the image is padded.
pub(super) fn write_patches(cpu: &mut CpuPlan, map: MapId, image: &Picture) {
    let (MapShape { width, height, .. }, pitch) = (cpu.shape(map), cpu.pitch(map));
    let (arch, mut team) = (Arch::new(), [(); MAX_THREADS]);
    let threads = cpu.threads();
    let out = Chunks::whole(cpu.values_mut(map), width * pitch);
    in_parallel(&mut team[..threads], 0..height, out, &|(), rows, out| {
        arch.dispatch(PatchRows {
            image,
            width,
            pitch,
            rows,
            out: out.values,
        });
    });
}

/// The rows `rows` of patches.
struct PatchRows<'a> {
    image: &'a Picture,
    width: usize,
    pitch: usize,
    rows: Range<usize>,
    out: &'a mut [f32],
}

impl WithSimd for PatchRows<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) {
        let (image, pitch) = (self.image, self.pitch);
        let line = 3 * image.width();
        for (y, out) in self.rows.zip(self.out.chunks_exact_mut(self.width * pitch)) {
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
