//! Max pooling.

use super::layout::MapView;
use crate::plan::{MapShape, MaxPool};
use pulp::{Simd, WithSimd};
use std::ops::Range;

/// Side of a window.
const SIDE: usize = 3;

/// The rows `rows` of a pooling's result, `out`.
pub(crate) struct PooledRows<'a> {
    pub(crate) pool: MaxPool,
    pub(crate) map: MapView<'a>,
    pub(crate) output: MapShape,
    pub(crate) rows: Range<usize>,
    pub(crate) out: &'a mut [f32],
}

impl WithSimd for PooledRows<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        let (pool, map, across) = (self.pool, self.map, self.output.width);
        let (pitch, MapShape { height, width, .. }) = (map.pitch(), map.shape);
        // The part of a window that lies inside.
        let inside = |at: usize, side: usize| {
            let first = pool.stride * at;
            first.saturating_sub(pool.border)..(first + SIDE - pool.border).min(side)
        };
        for (position, out) in self.out.chunks_exact_mut(pitch).enumerate() {
            let (ys, xs) = (
                inside(self.rows.start + position / across, height),
                inside(position % across, width),
            );
            let (out, _) = S::as_mut_simd_f32s(out);
            out.fill(simd.splat_f32s(f32::NEG_INFINITY));
            for y in ys {
                for x in xs.clone() {
                    let (values, _) = S::as_simd_f32s(&map.values[(y * width + x) * pitch..][..pitch]);
                    for (out, &value) in out.iter_mut().zip(values) {
                        *out = simd.max_f32s(*out, value);
                    }
                }
            }
        }
    }
}
