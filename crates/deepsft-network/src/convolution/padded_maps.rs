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
        let Layout {
            channels,
            size: [rows, columns],
            border,
            pitch,
            multiple,
        } = *layout;
        let [all_rows, all_columns] = [rows, columns].map(|side| side.next_multiple_of(multiple) + 2 * border);
        let row = all_columns * pitch;
        let sample = all_rows * row;
        let map = channels * rows * columns;
        let mut values = AlignedBuffer::new(maps.len() / map * sample);
        let samples = values.values_mut().par_chunks_exact_mut(sample);
        samples.zip(maps.par_chunks_exact(map)).for_each(|(to, from)| {
            // Channels that share a cache line of a place together.
            for first in (0..channels).step_by(LINE) {
                let last = channels.min(first + LINE);
                for y in 0..rows {
                    let to = &mut to[(y + border) * row + border * pitch..][..columns * pitch];
                    let line = |channel: usize| &from[(channel * rows + y) * columns..][..columns];
                    let mut channel = first;
                    while channel + SQUARE <= last {
                        let lines: [&[f32]; SQUARE] = std::array::from_fn(|c| line(channel + c));
                        turn_rows(lines, to, pitch, channel, &read);
                        channel += SQUARE;
                    }
                    for channel in channel..last {
                        for (to, &from) in to.chunks_exact_mut(pitch).zip(line(channel)) {
                            to[channel] = read(from);
                        }
                    }
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

/// Puts a row of [`SQUARE`] channels from `channel` on to places of `pitch` numbers each.
#[inline(always)]
fn turn_rows(lines: [&[f32]; SQUARE], to: &mut [f32], pitch: usize, channel: usize, read: impl Fn(f32) -> f32) {
    let [a, b, c, d] = lines.map(|line| line.as_chunks::<SQUARE>().0);
    let whole = a.len() * SQUARE;
    let (squares, rest) = to.split_at_mut(whole * pitch);
    let squares = squares.chunks_exact_mut(SQUARE * pitch);
    for ((((to, a), b), c), d) in squares.zip(a).zip(b).zip(c).zip(d) {
        let mut square = turned([*a, *b, *c, *d]);
        for (to, numbers) in to.chunks_exact_mut(pitch).zip(&mut square) {
            for number in numbers.iter_mut() {
                *number = read(*number);
            }
            to[channel..channel + SQUARE].copy_from_slice(numbers);
        }
    }
    for (x, to) in rest.chunks_exact_mut(pitch).enumerate() {
        for (to, line) in to[channel..].iter_mut().zip(lines) {
            *to = read(line[whole + x]);
        }
    }
}

/// PaddedMaps of `pitch` numbers each -> maps [channels, places], plus a number per channel, if there are any.
pub fn to_maps(places: &[f32], pitch: usize, maps: &mut [f32], added: &[f32]) {
    let count = places.len() / pitch;
    let channels = maps.len() / count;
    let whole = count / SQUARE * SQUARE;
    for start in (0..whole).step_by(SQUARE) {
        let places = &places[start * pitch..][..SQUARE * pitch];
        let mut channel = 0;
        while channel + SQUARE <= channels {
            let mut square = [[0.0; SQUARE]; SQUARE];
            for (numbers, place) in square.iter_mut().zip(places.chunks_exact(pitch)) {
                numbers.copy_from_slice(&place[channel..channel + SQUARE]);
            }
            for (c, numbers) in turned(square).iter_mut().enumerate() {
                let added = added.get(channel + c).copied().unwrap_or_default();
                for number in numbers.iter_mut() {
                    *number += added;
                }
                maps[(channel + c) * count + start..][..SQUARE].copy_from_slice(numbers);
            }
            channel += SQUARE;
        }
    }
    for channel in 0..channels {
        let first = if channel < channels / SQUARE * SQUARE { whole } else { 0 };
        let added = added.get(channel).copied().unwrap_or_default();
        for (to, place) in maps[channel * count..][first..count]
            .iter_mut()
            .zip(places[first * pitch..].chunks_exact(pitch))
        {
            *to = place[channel] + added;
        }
    }
}

/// Columns for rows.
#[inline(always)]
fn turned(square: [[f32; SQUARE]; SQUARE]) -> [[f32; SQUARE]; SQUARE] {
    let mut turned = square;
    for (i, row) in square.iter().enumerate() {
        for (j, &number) in row.iter().enumerate() {
            turned[j][i] = number;
        }
    }
    turned
}
