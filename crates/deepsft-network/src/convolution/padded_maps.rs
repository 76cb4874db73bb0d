//! The maps of a batch in the padded layout (NHWC) that matrix products read, and back.

use deepsft_inference::gemm::AlignedBuffer;
use rayon::prelude::*;

/// Side of the squares in which channels and places change their order.
const SQUARE: usize = 4;

/// Numbers of a cache line.
const LINE: usize = 16;

/// Maps of a batch in the padded layout: rows of places with a border of zeros, the channels of a place side by side and padded with zeros.
#[derive(Debug)]
pub struct PaddedMaps {
    pub values: AlignedBuffer,
    /// Numbers of a sample.
    pub sample: usize,
    /// Numbers of a row.
    pub row: usize,
    /// Numbers of a place.
    pub pitch: usize,
    /// Places around the maps.
    pub border: usize,
}

/// How maps lie in [`PaddedMaps`].
pub struct Layout {
    pub channels: usize,
    /// Rows and columns.
    pub size: [usize; 2],
    /// Places around the maps.
    pub border: usize,
    /// Numbers of a place.
    pub pitch: usize,
    /// Rows and columns without the border are padded to multiples of this.
    pub multiple: usize,
}

impl PaddedMaps {
    /// What `read` makes of maps [N, channels, rows, columns].
    pub fn new(maps: &[f32], layout: &Layout, read: impl Fn(f32) -> f32 + Sync) -> Self {
        let (channels, border, pitch) = (layout.channels, layout.border, layout.pitch);
        let [rows, columns] = layout.size;
        let [all_rows, all_columns] = layout
            .size
            .map(|side| side.next_multiple_of(layout.multiple) + 2 * border);
        let row = all_columns * pitch;
        let sample = all_rows * row;
        let map = channels * rows * columns;
        let mut values = AlignedBuffer::new(maps.len() / map * sample);
        let samples = values.values_mut().par_chunks_exact_mut(sample);
        samples.zip(maps.par_chunks_exact(map)).for_each(|(to, from)| {
            // Channels that share a cache line of a place together.
            for first in (0..channels).step_by(LINE) {
                let together = LINE.min(channels - first);
                for y in 0..rows {
                    let to = &mut to[(y + border) * row + border * pitch + first..];
                    let from = &from[(first * rows + y) * columns..];
                    transpose(from, to, [rows * columns, pitch], [together, columns], |_, value| {
                        read(value)
                    });
                }
            }
        });
        Self {
            values,
            sample,
            row,
            pitch,
            border,
        }
    }

    /// Number of samples.
    pub fn samples(&self) -> usize {
        self.values.values().len() / self.sample
    }

    /// A sample with its border.
    pub fn of_sample(&self, sample: usize) -> &[f32] {
        &self.values.values()[sample * self.sample..][..self.sample]
    }

    /// A sample from its first place within the border on.
    pub fn within(&self, sample: usize) -> &[f32] {
        &self.of_sample(sample)[self.border * (self.row + self.pitch)..]
    }
}

/// Writes places of `pitch` numbers each as maps [channels, places], plus a number per channel, if there are any.
pub fn to_maps(places: &[f32], pitch: usize, maps: &mut [f32], added: &[f32]) {
    let count = places.len() / pitch;
    let channels = maps.len() / count;
    transpose(places, maps, [pitch, count], [count, channels], |channel, value| {
        value + added.get(channel).copied().unwrap_or_default()
    });
}

/// Makes columns of rows: `to` [column, row] of `from` [row, column], whose lines lie `pitches` apart; `each` gets a column's number
/// and a value.
#[inline(always)]
fn transpose(
    from: &[f32],
    to: &mut [f32],
    pitches: [usize; 2],
    [rows, columns]: [usize; 2],
    each: impl Fn(usize, f32) -> f32,
) {
    let [from_pitch, to_pitch] = pitches;
    for row in (0..rows).step_by(SQUARE) {
        for column in (0..columns).step_by(SQUARE) {
            if row + SQUARE > rows || column + SQUARE > columns {
                for row in row..rows.min(row + SQUARE) {
                    for column in column..columns.min(column + SQUARE) {
                        to[column * to_pitch + row] = each(column, from[row * from_pitch + column]);
                    }
                }
                continue;
            }
            let mut square = [[0.0; SQUARE]; SQUARE];
            for (i, line) in square.iter_mut().enumerate() {
                line.copy_from_slice(&from[(row + i) * from_pitch + column..][..SQUARE]);
            }
            for j in 0..SQUARE {
                let line = square.map(|line| each(column + j, line[j]));
                to[(column + j) * to_pitch + row..][..SQUARE].copy_from_slice(&line);
            }
        }
    }
}
