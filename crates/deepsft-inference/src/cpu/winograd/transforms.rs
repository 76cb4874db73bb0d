//! Maps to points and back.

use super::Winograd;
use crate::cpu::buffer::padded;
use crate::cpu::layer::{Layer, Maps, vector};
use crate::plan::MapShape;
use pulp::{Simd, WithSimd};
use std::ops::Range;

/// Takes what the tiles `tiles` read to the points: `read` [tile, point, channel].
pub(super) struct ToPoints<'a, const TILE: usize, const READ: usize> {
    pub(super) winograd: &'a Winograd,
    pub(super) layer: &'a Layer,
    pub(super) maps: Maps<'a>,
    pub(super) tiles: Range<usize>,
    pub(super) read: &'a mut [f32],
}

impl<const TILE: usize, const READ: usize> WithSimd for ToPoints<'_, TILE, READ> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        let Self {
            winograd,
            layer,
            maps,
            tiles,
            read,
        } = self;
        let zero = simd.splat_f32s(0.0);
        let (across, point_pitch) = (winograd.across, winograd.input_pitch());
        let mut first_channel = 0;
        for input in &layer.convolution.inputs {
            let map = maps.view(input.map);
            let pitch = map.pitch();
            // Where the up-sampling comes later, rows that are cropped are read too.
            let ([height, width], factor, top) = match winograd.factor {
                1 => (input.size(map.shape), input.factor, input.cropped[0]),
                _ => ([map.shape.height, map.shape.width], 1, 0),
            };
            for (tile, read) in tiles.clone().zip(read.chunks_exact_mut(READ * READ * point_pitch)) {
                // Where the tile's numbers lie; the border has none. Its first row and column are before the tile's first.
                let mut places = [[None; READ]; READ];
                for (i, places) in places.iter_mut().enumerate() {
                    let y = (TILE * (tile / across) + i).wrapping_sub(1);
                    for (j, place) in places.iter_mut().enumerate() {
                        let x = (TILE * (tile % across) + j).wrapping_sub(1);
                        if y < height && x < width {
                            *place = Some(((y + top) / factor * map.shape.width + x / factor) * pitch);
                        }
                    }
                }
                for channel in (0..pitch).step_by(S::F32_LANES) {
                    let mut rows = [[zero; READ]; READ];
                    for (row, places) in rows.iter_mut().zip(&places) {
                        for (number, place) in row.iter_mut().zip(places) {
                            if let Some(place) = place {
                                let value = vector::<S>(map.values, place + channel);
                                *number = if input.rectified {
                                    simd.max_f32s(zero, value)
                                } else {
                                    value
                                };
                            }
                        }
                        *row = to_points(simd, *row);
                    }
                    for j in 0..READ {
                        let mut column = [zero; READ];
                        for (number, row) in column.iter_mut().zip(&rows) {
                            *number = row[j];
                        }
                        for (i, value) in to_points(simd, column).into_iter().enumerate() {
                            let at = (i * READ + j) * point_pitch + first_channel + channel;
                            S::as_mut_simd_f32s(&mut read[at..at + S::F32_LANES]).0[0] = value;
                        }
                    }
                }
            }
            first_channel += pitch;
        }
    }
}

/// Takes the sums at the points back to the places of the tiles in the units `units` and finishes them; `products` begin with the
/// tile `first_tile`.
pub(super) struct ToPlaces<'a, const TILE: usize, const READ: usize> {
    pub(super) winograd: &'a Winograd,
    pub(super) layer: &'a Layer,
    pub(super) maps: Maps<'a>,
    pub(super) units: Range<usize>,
    pub(super) first_tile: usize,
    pub(super) products: &'a [f32],
    pub(super) out: &'a mut [f32],
}

impl<const TILE: usize, const READ: usize> WithSimd for ToPlaces<'_, TILE, READ> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        let Self {
            winograd,
            layer,
            maps,
            units,
            first_tile,
            products,
            out,
        } = self;
        let MapShape {
            channels,
            height,
            width,
        } = layer.output;
        let (across, factor, pitch) = (winograd.across, winograd.factor, padded(channels));
        let (outputs, point_pitch) = (winograd.outputs, winograd.point_pitch());
        let (_, top) = winograd.rows_of_unit(&layer.convolution);
        let first_row = winograd.rows_made(layer, units.clone()).start;
        let zero = simd.splat_f32s(0.0);
        for tile in units.start * across..units.end * across {
            let (tile_row, tile_column) = (TILE * (tile / across), TILE * (tile % across));
            for kind in 0..factor * factor {
                for channel in (0..pitch).step_by(S::F32_LANES) {
                    let mut rows = [[zero; READ]; TILE];
                    for j in 0..READ {
                        let mut column = [zero; READ];
                        for (i, number) in column.iter_mut().enumerate() {
                            let place = (tile - first_tile) * outputs + kind * pitch + channel;
                            *number = vector::<S>(products, (i * READ + j) * point_pitch + place);
                        }
                        let column: [S::f32s; TILE] = to_places(simd, column);
                        for (row, value) in rows.iter_mut().zip(column) {
                            row[j] = value;
                        }
                    }
                    for (i, row) in rows.into_iter().enumerate() {
                        let y = (factor * (tile_row + i) + kind / factor).checked_sub(top);
                        let Some(y) = y.filter(|&y| y < height) else {
                            continue;
                        };
                        let row: [S::f32s; TILE] = to_places(simd, row);
                        for (j, sums) in row.into_iter().enumerate() {
                            let x = factor * (tile_column + j) + kind % factor;
                            if x < width {
                                let value = layer.finished(simd, sums, layer.added(&maps, y, x), channel);
                                let at = ((y - first_row) * width + x) * pitch + channel;
                                S::as_mut_simd_f32s(&mut out[at..at + S::F32_LANES]).0[0] = value;
                            }
                        }
                    }
                }
            }
        }
    }
}

/// B^T: a row or column of what a tile reads, at the points.
#[inline(always)]
pub fn to_points<S: Simd, const READ: usize>(simd: S, d: [S::f32s; READ]) -> [S::f32s; READ] {
    let mut points = d;
    if READ == 4 {
        points[0] = simd.sub_f32s(d[0], d[2]);
        points[1] = simd.add_f32s(d[1], d[2]);
        points[2] = simd.sub_f32s(d[2], d[1]);
        points[3] = simd.sub_f32s(d[3], d[1]);
        return points;
    }
    let (a, b) = (plus(simd, d[4], -4.0, d[2]), plus(simd, d[3], -4.0, d[1]));
    let (c, e) = (simd.sub_f32s(d[4], d[2]), simd.sub_f32s(d[3], d[1]));
    points[0] = plus(simd, plus(simd, d[4], -5.0, d[2]), 4.0, d[0]);
    points[1] = simd.add_f32s(a, b);
    points[2] = simd.sub_f32s(a, b);
    points[3] = plus(simd, c, 2.0, e);
    points[4] = plus(simd, c, -2.0, e);
    points[5] = plus(simd, plus(simd, d[5], -5.0, d[3]), 4.0, d[1]);
    points
}

/// A^T: sums at the points of a row or column, at the tile's places.
#[inline(always)]
pub fn to_places<S: Simd, const TILE: usize, const READ: usize>(simd: S, m: [S::f32s; READ]) -> [S::f32s; TILE] {
    let mut places = [m[0]; TILE];
    let (a, b) = (simd.add_f32s(m[1], m[2]), simd.sub_f32s(m[1], m[2]));
    if TILE == 2 {
        places[0] = simd.add_f32s(m[0], a);
        places[1] = simd.add_f32s(b, m[3]);
        return places;
    }
    let (c, d) = (simd.add_f32s(m[3], m[4]), simd.sub_f32s(m[3], m[4]));
    places[0] = simd.add_f32s(simd.add_f32s(m[0], a), c);
    places[1] = plus(simd, b, 2.0, d);
    places[2] = plus(simd, a, 4.0, c);
    places[3] = simd.add_f32s(plus(simd, b, 8.0, d), m[5]);
    places
}

/// a + factor b
#[inline(always)]
fn plus<S: Simd>(simd: S, a: S::f32s, factor: f32, b: S::f32s) -> S::f32s {
    simd.mul_add_e_f32s(simd.splat_f32s(factor), b, a)
}
