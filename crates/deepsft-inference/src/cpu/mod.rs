//! A plan on the processor.

mod bands;
mod buffer;
mod direct;
mod layer;
mod product;
mod winograd;

use crate::plan::{Added, MapId, MapShape, Operation, Plan};
pub use bands::available_threads;
pub(crate) use bands::awake;
use bands::in_bands;
use buffer::{Buffer, padded};
use layer::{Layer, Maps, Scratch};
use pulp::{Arch, Simd, WithSimd};
use std::ops::Range;

/// More would find nothing to do: the map with most work has nine rows of tiles. Each thread has 2 MB of its own.
const MOST_THREADS: usize = 8;

enum Work {
    Layer(Box<Layer>),
    Add(MapId, Added),
}

/// A plan with packed filters and the memory of its maps. On one thread it runs without allocating; rayon's queues allocate now and then.
pub struct CpuPlan {
    arch: Arch,
    shapes: Vec<MapShape>,
    /// The buffer of each map; maps that are not needed at the same time share one.
    slots: Vec<usize>,
    buffers: Vec<Buffer>,
    work: Vec<(Work, MapId)>,
    /// One for each thread.
    scratches: Vec<Scratch>,
}

impl CpuPlan {
    /// Gets `plan` ready for this processor and `threads` threads (at most 8). The maps `kept` can be read after the last step,
    /// as can those that the caller writes; the others may be overwritten by then.
    pub fn new(plan: Plan, kept: &[MapId], threads: usize) -> Self {
        Self::with_arch(Arch::new(), plan, kept, threads)
    }

    fn with_arch(arch: Arch, plan: Plan, kept: &[MapId], threads: usize) -> Self {
        let lanes = arch.dispatch(Lanes);
        let (slots, sizes) = shared_buffers(&plan, kept);
        let Plan { maps: shapes, steps } = plan;
        let threads = threads.clamp(1, MOST_THREADS);
        let (mut work, mut scratch) = (Vec::new(), [0, 0]);
        for step in steps {
            let output = shapes[step.output.0];
            let done = match step.operation {
                Operation::Add(map, added) => Work::Add(map, added),
                Operation::Convolve(convolution) => {
                    let input = shapes[convolution.inputs[0].map.0];
                    let layer = Layer::new(convolution, output, &shapes, lanes);
                    let units = output.height.div_ceil(layer.rows_of_unit()).div_ceil(threads);
                    let needed = layer.scratch(input, units);
                    scratch = [0, 1].map(|k| needed[k].max(scratch[k]));
                    Work::Layer(Box::new(layer))
                }
            };
            work.push((done, step.output));
        }
        let new_scratch = |_| Scratch {
            read: Buffer::new(scratch[0]),
            products: Buffer::new(scratch[1]),
        };
        Self {
            arch,
            shapes,
            slots,
            buffers: sizes.into_iter().map(Buffer::new).collect(),
            work,
            scratches: (0..threads).map(new_scratch).collect(),
        }
    }

    /// Size of a map.
    pub fn shape(&self, map: MapId) -> MapShape {
        self.shapes[map.0]
    }

    /// Values of one position in [`CpuPlan::values`]: the channels, padded.
    pub fn pitch(&self, map: MapId) -> usize {
        padded(self.shapes[map.0].channels)
    }

    /// A map that the caller wrote or had kept; others may have been overwritten. Rows of positions, the channels of a position side by
    /// side and padded.
    pub fn values(&self, map: MapId) -> &[f32] {
        &self.buffers[self.slots[map.0]].values()[..self.length(map)]
    }

    fn length(&self, map: MapId) -> usize {
        let MapShape { height, width, .. } = self.shapes[map.0];
        height * width * self.pitch(map)
    }

    /// A map to write. The padding of channels is zero and has to stay so.
    pub fn values_mut(&mut self, map: MapId) -> &mut [f32] {
        let length = self.length(map);
        &mut self.buffers[self.slots[map.0]].values_mut()[..length]
    }

    /// Number of threads.
    pub fn threads(&self) -> usize {
        self.scratches.len()
    }

    /// Number of steps.
    pub fn steps(&self) -> usize {
        self.work.len()
    }

    /// Runs the steps `steps`.
    ///
    /// # Panics
    /// When the plan has fewer steps.
    pub fn run(&mut self, steps: Range<usize>) {
        for step in steps {
            let (work, output) = &self.work[step];
            let (output, shape) = (self.slots[output.0], self.shapes[output.0]);
            let mut out = std::mem::take(&mut self.buffers[output]);
            let maps = Maps {
                shapes: &self.shapes,
                slots: &self.slots,
                buffers: &self.buffers,
            };
            let row = shape.width * padded(shape.channels);
            let values = &mut out.values_mut()[..shape.height * row];
            match work {
                Work::Layer(layer) => {
                    let rows = layer.rows_of_unit();
                    let units = 0..shape.height.div_ceil(rows);
                    in_bands(
                        &mut self.scratches,
                        units,
                        values,
                        rows * row,
                        &|scratch, units, out| {
                            layer.run(self.arch, maps, scratch, units, out);
                        },
                    );
                }
                Work::Add(map, added) => add(&maps, *map, *added, values),
            }
            self.buffers[output] = out;
        }
    }
}

/// Numbers in a vector of this processor.
struct Lanes;

impl WithSimd for Lanes {
    type Output = usize;

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) -> usize {
        S::F32_LANES
    }
}

fn add(maps: &Maps<'_>, map: MapId, added: Added, out: &mut [f32]) {
    let map = maps.view(map);
    let (pitch, width) = (map.pitch(), map.shape.width);
    let (added, halves) = match added {
        Added::Same(added) => (maps.view(added), 1),
        Added::Doubled(added) => (maps.view(added), 2),
    };
    for (place, (out, a)) in out
        .chunks_exact_mut(pitch)
        .zip(map.values.chunks_exact(pitch))
        .enumerate()
    {
        let (y, x) = (place / width / halves, place % width / halves);
        let b = &added.values[(y * added.shape.width + x) * pitch..][..pitch];
        for (out, (a, b)) in out.iter_mut().zip(a.iter().zip(b)) {
            *out = a + b;
        }
    }
}

/// For each map its buffer, and the buffers' lengths. Maps that no step makes, and those of `kept`, have buffers of their own.
fn shared_buffers(plan: &Plan, kept: &[MapId]) -> (Vec<usize>, Vec<usize>) {
    let length = |shape: &MapShape| shape.height * shape.width * padded(shape.channels);
    let mut last_read = vec![0; plan.maps.len()];
    for (k, step) in plan.steps.iter().enumerate() {
        step.reads().for_each(|map| last_read[map.0] = k);
    }
    let is_made = |map: usize| plan.steps.iter().any(|step| step.output.0 == map);
    let (mut slots, mut sizes) = (vec![usize::MAX; plan.maps.len()], Vec::new());
    let own: Vec<bool> = (0..plan.maps.len())
        .map(|map| !is_made(map) || kept.contains(&MapId(map)))
        .collect();
    for map in (0..plan.maps.len()).filter(|&map| own[map]) {
        slots[map] = sizes.len();
        sizes.push(length(&plan.maps[map]));
    }
    let mut free: Vec<usize> = Vec::new();
    for (k, step) in plan.steps.iter().enumerate() {
        let map = step.output.0;
        if !own[map] {
            let needed = length(&plan.maps[map]);
            // The free buffer whose size is nearest.
            let best = (0..free.len()).min_by_key(|&f| sizes[free[f]].abs_diff(needed));
            slots[map] = best.map_or_else(
                || {
                    sizes.push(0);
                    sizes.len() - 1
                },
                |f| free.swap_remove(f),
            );
            sizes[slots[map]] = sizes[slots[map]].max(needed);
        }
        let mut read: Vec<usize> = step.reads().map(|map| map.0).chain([map]).collect();
        read.sort_unstable();
        read.dedup();
        let done = read.into_iter().filter(|&map| !own[map] && last_read[map] <= k);
        free.extend(done.map(|map| slots[map]));
    }
    (slots, sizes)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::plan::{Convolution, Filters, Input};

    /// Numbers from -1 to 1 without a pattern.
    struct Numbers(u64);

    impl Numbers {
        fn next(&mut self) -> f32 {
            self.0 = self
                .0
                .wrapping_mul(6_364_136_223_846_793_005)
                .wrapping_add(1_442_695_040_888_963_407);
            (self.0 >> 40) as f32 / (1 << 23) as f32 - 1.0
        }

        fn some(&mut self, count: usize) -> Vec<f32> {
            (0..count).map(|_| self.next()).collect()
        }
    }

    /// A map as it is written down: [channel][row][column].
    #[derive(Clone)]
    struct Plain(MapShape, Vec<f32>);

    impl Plain {
        fn at(&self, channel: usize, row: usize, column: usize) -> f64 {
            let MapShape { height, width, .. } = self.0;
            f64::from(self.1[(channel * height + row) * width + column])
        }
    }

    /// The sum of the definition, in double precision.
    fn expected(convolution: &Convolution, inputs: &[Plain], added: Option<&Plain>, output: MapShape) -> Plain {
        let Filters {
            weights,
            biases,
            kernel,
            ..
        } = &convolution.filters;
        let read: Vec<(bool, &Plain, usize)> = (convolution.inputs.iter().zip(inputs))
            .flat_map(|(input, map)| (0..map.0.channels).map(move |channel| (input.rectified, map, channel)))
            .collect();
        let border = kernel / 2;
        let value = |o: usize, y: usize, x: usize| {
            let mut sum = f64::from(biases[o]);
            for (c, (rectified, map, channel)) in read.iter().enumerate() {
                for i in 0..*kernel {
                    for j in 0..*kernel {
                        let (row, column) = (y * convolution.stride + i, x * convolution.stride + j);
                        let (Some(row), Some(column)) = (row.checked_sub(border), column.checked_sub(border)) else {
                            continue;
                        };
                        if row < map.0.height && column < map.0.width {
                            let number = map.at(*channel, row, column);
                            let number = if *rectified { number.max(0.0) } else { number };
                            let filter = (o * read.len() + c) * kernel * kernel;
                            sum += number * f64::from(weights[filter + i * kernel + j]);
                        }
                    }
                }
            }
            sum += match (added, convolution.added) {
                (Some(map), Some(Added::Doubled(_))) => map.at(o, y / 2, x / 2),
                (Some(map), _) => map.at(o, y, x),
                _ => 0.0,
            };
            sum as f32
        };
        let MapShape {
            channels,
            height,
            width,
        } = output;
        let places = (0..channels).flat_map(|o| (0..height).flat_map(move |y| (0..width).map(move |x| (o, y, x))));
        Plain(output, places.map(|(o, y, x)| value(o, y, x)).collect())
    }

    fn archs() -> Vec<Arch> {
        #[cfg(target_arch = "x86_64")]
        {
            let v3 = pulp::x86::V3::try_new().map(Arch::V3);
            let v4 = pulp::x86::V4::try_new().map(Arch::V4);
            [Some(Arch::Scalar), v3, v4].into_iter().flatten().collect()
        }
        #[cfg(not(target_arch = "x86_64"))]
        vec![Arch::Scalar, Arch::new()]
    }

    fn write(cpu: &mut CpuPlan, map: MapId, plain: &Plain) {
        let pitch = cpu.pitch(map);
        let MapShape { height, width, .. } = plain.0;
        for (index, &value) in plain.1.iter().enumerate() {
            let (channel, place) = (index / (height * width), index % (height * width));
            cpu.values_mut(map)[place * pitch + channel] = value;
        }
    }

    #[test]
    fn convolutions_are_the_sums_of_their_definition_on_every_processor_and_number_of_threads() {
        let mut numbers = Numbers(3);
        // Channels of the inputs, outputs, rows, columns, kernel, stride, what is added.
        let cases: [(&[usize], [usize; 6]); 9] = [
            (&[48], [48, 34, 60, 3, 1, 1]),
            (&[7, 17], [33, 9, 15, 3, 1, 2]),
            (&[5], [3, 1, 1, 3, 1, 0]),
            (&[16], [16, 4, 5, 3, 1, 0]),
            (&[32], [48, 17, 31, 3, 2, 1]),
            (&[20, 4], [10, 6, 7, 3, 2, 0]),
            (&[40], [70, 8, 9, 1, 1, 2]),
            (&[9], [16, 11, 13, 1, 2, 0]),
            (&[3], [20, 23, 21, 7, 2, 1]),
        ];
        for (channels, [outputs, height, width, kernel, stride, added]) in cases {
            let mut plan = Plan::default();
            let mut plain = |plan: &mut Plan, channels: usize, height: usize, width: usize| {
                let shape = MapShape {
                    channels,
                    height,
                    width,
                };
                (plan.input(shape), Plain(shape, numbers.some(channels * height * width)))
            };
            let (maps, inputs): (Vec<MapId>, Vec<Plain>) = channels
                .iter()
                .map(|&channels| plain(&mut plan, channels, height, width))
                .unzip();
            let (rows, columns) = (height.div_ceil(stride), width.div_ceil(stride));
            let added = match added {
                1 => Some((
                    Added::Same as fn(MapId) -> Added,
                    plain(&mut plan, outputs, rows, columns),
                )),
                2 => {
                    let half = plain(&mut plan, outputs, rows.div_ceil(2), columns.div_ceil(2));
                    Some((Added::Doubled as fn(MapId) -> Added, half))
                }
                _ => None,
            };
            let fan_in = channels.iter().sum::<usize>() * kernel * kernel;
            let convolution = Convolution {
                inputs: (maps.iter().enumerate())
                    .map(|(k, &map)| Input {
                        map,
                        rectified: k % 2 == 0,
                    })
                    .collect(),
                filters: Filters {
                    weights: numbers.some(outputs * fan_in),
                    biases: numbers.some(outputs),
                    inputs: channels.iter().sum(),
                    kernel,
                },
                stride,
                added: added.as_ref().map(|(how, (map, _))| how(*map)),
            };
            let output = plan.convolve(convolution.clone()).unwrap();
            let plain_added = added.as_ref().map(|(_, (_, plain))| plain);
            let expected = expected(&convolution, &inputs, plain_added, plan.shape(output));
            for (arch, threads) in archs().into_iter().flat_map(|arch| [(arch, 1), (arch, 3), (arch, 8)]) {
                let mut cpu = CpuPlan::with_arch(arch, plan.clone(), &[output], threads);
                maps.iter()
                    .zip(&inputs)
                    .for_each(|(&map, plain)| write(&mut cpu, map, plain));
                if let Some((_, (map, plain))) = &added {
                    write(&mut cpu, *map, plain);
                }
                cpu.run(0..1);
                let (pitch, places) = (cpu.pitch(output), rows * columns);
                let largest = expected.1.iter().fold(1.0_f32, |most, value| most.max(value.abs()));
                for (index, value) in expected.1.iter().enumerate() {
                    let ours = cpu.values(output)[index % places * pitch + index / places];
                    assert!(
                        (ours - value).abs() < 1e-5 * largest,
                        "{arch:?}, {threads} threads, {kernel} x {kernel} / {stride}, at {index}: {ours} for {value}"
                    );
                }
            }
        }
    }

    #[test]
    fn what_is_no_number_stays_none() {
        for (kernel, stride) in [(3, 1), (3, 2), (1, 1)] {
            for arch in archs().into_iter().filter(|arch| !matches!(arch, Arch::Scalar)) {
                let mut plan = Plan::default();
                let map = plan.input(MapShape {
                    channels: 1,
                    height: 6,
                    width: 6,
                });
                let convolution = Convolution {
                    inputs: vec![Input { map, rectified: true }],
                    filters: Filters {
                        weights: vec![1.0; kernel * kernel],
                        biases: vec![0.0],
                        inputs: 1,
                        kernel,
                    },
                    stride,
                    added: None,
                };
                let output = plan.convolve(convolution).unwrap();
                let mut cpu = CpuPlan::with_arch(arch, plan, &[output], 1);
                cpu.values_mut(map)[0] = f32::NAN;
                cpu.run(0..1);
                assert!(
                    cpu.values(output)[0].is_nan(),
                    "{arch:?}, {kernel} x {kernel} / {stride}"
                );
            }
        }
    }

    #[test]
    fn maps_that_are_needed_at_the_same_time_do_not_share_memory() {
        // x, a = f(x), b = f(a), c = b + a, d = f(c), e = d + a: `a` lives until the end.
        let mut plan = Plan::default();
        let shape = MapShape {
            channels: 3,
            height: 5,
            width: 6,
        };
        let x = plan.input(shape);
        let f = |plan: &mut Plan, map: MapId| {
            let mut weights = vec![0.0; 9];
            (0..3).for_each(|k| weights[4 * k] = 2.0);
            let filters = Filters {
                weights,
                biases: vec![1.0; 3],
                inputs: 3,
                kernel: 1,
            };
            let inputs = vec![Input { map, rectified: false }];
            plan.convolve(Convolution {
                inputs,
                filters,
                stride: 1,
                added: None,
            })
            .unwrap()
        };
        let a = f(&mut plan, x);
        let b = f(&mut plan, a);
        let c = plan.add(b, Added::Same(a)).unwrap();
        let d = f(&mut plan, c);
        let e = plan.add(d, Added::Same(a)).unwrap();
        let mut cpu = CpuPlan::new(plan, &[e], 1);
        assert!(cpu.buffers.len() < 6, "{}", cpu.buffers.len());
        cpu.values_mut(x).fill(0.0);
        cpu.values_mut(x)[0] = 5.0;
        for _ in 0..2 {
            cpu.run(0..cpu.steps());
            // a = 11, b = 23, c = 34, d = 69, e = 80; elsewhere 1, 3, 4, 9, 10.
            assert_eq!(cpu.values(e)[..3], [80.0, 10.0, 10.0]);
        }
    }
}
