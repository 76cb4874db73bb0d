//! Every step against its definition.

use super::*;
use crate::plan::{Convolution, DenseLayer, Filters, LayerInput};

/// Numbers from -1 to 1 without a pattern.
fn numbers(state: &mut u64, count: usize) -> Vec<f32> {
    let next = |_| {
        *state = state
            .wrapping_mul(6_364_136_223_846_793_005)
            .wrapping_add(1_442_695_040_888_963_407);
        (*state >> 40) as f32 / (1 << 23) as f32 - 1.0
    };
    (0..count).map(next).collect()
}

/// A plan of one step, and the values of the maps that it reads: [channel][row][column].
struct Case {
    plan: Plan,
    values: Vec<Vec<f32>>,
    state: u64,
}

impl Case {
    fn new(state: u64) -> Self {
        let (plan, values) = (Plan::default(), Vec::new());
        Self { plan, values, state }
    }

    /// A map with any numbers.
    fn map(&mut self, channels: usize, [height, width]: [usize; 2]) -> MapId {
        let shape = MapShape::new(channels, height, width);
        self.values.push(numbers(&mut self.state, channels * shape.area()));
        self.plan.input(shape)
    }

    /// A value of a map, `None` outside.
    fn at(&self, map: MapId, channel: usize, row: usize, column: usize) -> Option<f64> {
        let MapShape { height, width, .. } = self.plan.shape(map);
        let inside = row < height && column < width;
        inside.then(|| f64::from(self.values[map.0][(channel * height + row) * width + column]))
    }

    /// A value of the step's result by its definition, in double precision.
    fn defined(&self, o: usize, y: usize, x: usize) -> f64 {
        let relu = |sum: f64, rectified| if rectified { sum.max(0.0) } else { sum };
        match &self.plan.steps[0].operation {
            Operation::Convolve(convolution) => {
                let Filters {
                    weights,
                    biases,
                    kernel,
                    ..
                } = &convolution.filters;
                let mut weights = weights[weights.len() / biases.len() * o..].iter();
                let mut sum = f64::from(biases[o]);
                for input in &convolution.inputs {
                    let shape = self.plan.shape(input.map);
                    let [height, width] = input.size(shape);
                    for (channel, tap) in
                        (0..shape.channels).flat_map(|c| (0..kernel * kernel).map(move |tap| (c, tap)))
                    {
                        let weight = f64::from(*weights.next().unwrap());
                        let [row, column] = [(y, tap / kernel), (x, tap % kernel)]
                            .map(|(at, k)| (at * convolution.stride + k).wrapping_sub(kernel / 2));
                        if row < height && column < width {
                            let row = (row + input.cropped[0]) / input.factor;
                            let number = self.at(input.map, channel, row, column / input.factor).unwrap();
                            sum += weight * relu(number, input.rectified);
                        }
                    }
                }
                if let Some(SkipInput { map, factor, top }) = convolution.skip {
                    sum += self.at(map, o, (y + top) / factor, x / factor).unwrap();
                }
                relu(sum, convolution.rectified)
            }
            Operation::Pool(MaxPool { map, stride, border }) => {
                let window = (0..9).filter_map(|k| {
                    let [row, column] = [(y, k / 3), (x, k % 3)].map(|(at, k)| (stride * at + k).wrapping_sub(*border));
                    self.at(*map, o, row, column)
                });
                window.fold(f64::NEG_INFINITY, f64::max)
            }
            Operation::Dense(dense) => {
                let weights = dense.weights.chunks_exact(dense.biases.len());
                let products = weights.zip(&self.values[dense.map.0]);
                let sum: f64 = products.map(|(row, &value)| f64::from(row[o]) * f64::from(value)).sum();
                relu(f64::from(dense.biases[o]) + sum, dense.rectified)
            }
            Operation::Add(..) => unreachable!(),
        }
    }

    /// Compares on every processor and number of threads.
    fn check(&self, what: &str) {
        let output = self.plan.steps[0].output;
        let MapShape {
            channels,
            height,
            width,
        } = self.plan.shape(output);
        let (values, area) = (0..channels * height * width, height * width);
        let expected: Vec<f32> = (values.clone())
            .map(|index| self.defined(index / area, index % area / width, index % width) as f32)
            .collect();
        let largest = expected.iter().fold(1.0_f32, |most, value| most.max(value.abs()));
        for (arch, threads) in archs().into_iter().flat_map(|arch| [(arch, 1), (arch, 3), (arch, 8)]) {
            let mut cpu = CpuPlan::with_arch(arch, self.plan.clone(), &[output], threads);
            for (map, values) in self.values.iter().enumerate() {
                let (pitch, area) = (cpu.pitch(MapId(map)), self.plan.shape(MapId(map)).area());
                for (index, &value) in values.iter().enumerate() {
                    cpu.values_mut(MapId(map))[index % area * pitch + index / area] = value;
                }
            }
            cpu.run(0..1);
            let (pitch, ours) = (cpu.pitch(output), cpu.values(output));
            for index in values.clone() {
                let (ours, value) = (ours[index % area * pitch + index / area], expected[index]);
                assert!(
                    (ours - value).abs() < 1e-5 * largest,
                    "{arch:?}, {threads} threads, {what}, at {index}: {ours} for {value}"
                );
            }
        }
    }
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

/// Channels of the inputs, their rows and columns, and how they are read (up-sampling, rows cropped); outputs, kernel, stride;
/// up-sampling and first row of the skip input, none for 0.
type Shapes<'a> = (&'a [usize], [usize; 2], (usize, [usize; 2]), [usize; 3], [usize; 2]);

fn convolution((channels, size, (factor, cropped), [outputs, kernel, stride], [skip, top]): Shapes<'_>) -> Case {
    let mut case = Case::new(3);
    let read = |(k, &channels): (usize, &usize)| LayerInput {
        map: case.map(channels, size),
        rectified: k % 2 == 0,
        factor,
        cropped,
    };
    let inputs: Vec<LayerInput> = channels.iter().enumerate().map(read).collect();
    let [rows, columns] = inputs[0]
        .size(case.plan.shape(inputs[0].map))
        .map(|side| side.div_ceil(stride));
    let skip = (skip > 0).then(|| SkipInput {
        map: case.map(outputs, [rows + top, columns].map(|side| side.div_ceil(skip))),
        factor: skip,
        top,
    });
    let fan_in = channels.iter().sum::<usize>() * kernel * kernel;
    let filters = Filters {
        weights: numbers(&mut case.state, outputs * fan_in),
        biases: numbers(&mut case.state, outputs),
        inputs: channels.iter().sum(),
        kernel,
    };
    let convolution = Convolution {
        inputs,
        filters,
        stride,
        skip,
        rectified: outputs % 2 == 0,
    };
    case.plan.convolve(convolution).unwrap();
    case
}

#[test]
fn convolutions_are_the_sums_of_their_definition_on_every_processor_and_number_of_threads() {
    let as_it_is = (1, [0, 0]);
    let cases: &[Shapes<'_>] = &[
        (&[48], [34, 60], as_it_is, [48, 3, 1], [1, 0]),
        (&[7, 17], [9, 15], as_it_is, [33, 3, 1], [2, 0]),
        (&[5], [1, 1], as_it_is, [3, 3, 1], [0, 0]),
        (&[16], [4, 5], as_it_is, [16, 3, 1], [0, 0]),
        (&[32], [17, 31], as_it_is, [48, 3, 2], [1, 0]),
        (&[20, 4], [6, 7], as_it_is, [10, 3, 2], [0, 0]),
        (&[40], [8, 9], as_it_is, [70, 1, 1], [2, 0]),
        (&[9], [11, 13], as_it_is, [16, 1, 2], [0, 0]),
        (&[3], [23, 21], as_it_is, [20, 7, 2], [1, 0]),
        (&[3, 3], [15, 17], as_it_is, [17, 7, 2], [0, 0]),
        // Read up-sampled: before the products where the filters are many, after them where they are few.
        (&[130], [6, 5], (2, [0, 0]), [130, 3, 1], [1, 0]),
        (&[130], [6, 5], (2, [1, 2]), [130, 3, 1], [2, 1]),
        (&[20], [6, 5], (2, [0, 0]), [19, 3, 1], [1, 0]),
        (&[20, 3], [26, 7], (2, [1, 1]), [3, 3, 1], [2, 1]),
        (&[18], [17, 6], (3, [1, 1]), [20, 7, 1], [0, 0]),
        (&[5], [4, 6], (3, [0, 2]), [3, 3, 1], [1, 4]),
        (&[5], [5, 4], (2, [0, 1]), [9, 7, 1], [0, 0]),
        (&[5], [5, 4], (2, [1, 1]), [10, 1, 1], [2, 1]),
        (&[5], [8, 4], (1, [1, 2]), [10, 1, 1], [1, 1]),
    ];
    for &shapes in cases {
        convolution(shapes).check(&format!("{shapes:?}"));
    }
}

#[test]
fn poolings_are_the_largest_values_and_never_those_outside() {
    for (channels, size, stride, border) in [(20, [9, 13], 3, 0), (33, [8, 7], 2, 1), (5, [7, 8], 3, 1)] {
        let mut case = Case::new(5);
        let map = case.map(channels, size);
        // All negative: a border of zeros would win.
        case.values[0].iter_mut().for_each(|value| *value -= 2.0);
        case.plan.pool(MaxPool { map, stride, border });
        case.check("pooling");
    }
}

#[test]
fn dense_layers_read_all_values_of_a_map() {
    for (channels, size, outputs) in [(20, [3, 5], 50), (200, [1, 1], 300), (3, [2, 1], 4)] {
        let mut case = Case::new(7);
        let map = case.map(channels, size);
        let dense = DenseLayer {
            map,
            weights: numbers(&mut case.state, case.values[0].len() * outputs),
            biases: numbers(&mut case.state, outputs),
            rectified: outputs > 200,
        };
        case.plan.dense(dense).unwrap();
        case.check("dense layer");
    }
}

#[test]
fn what_is_no_number_stays_none() {
    for (kernel, stride) in [(3, 1), (3, 2), (1, 1)] {
        for arch in archs().into_iter().filter(|arch| !matches!(arch, Arch::Scalar)) {
            let mut plan = Plan::default();
            let map = plan.input(MapShape::new(1, 6, 6));
            let filters = Filters {
                weights: vec![1.0; kernel * kernel],
                biases: vec![0.0],
                inputs: 1,
                kernel,
            };
            let convolution = Convolution {
                stride,
                ..Convolution::new(vec![map.relu()], filters)
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
    let shape = MapShape::new(3, 5, 6);
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
        let convolution = Convolution::new(vec![map.plain()], filters);
        plan.convolve(convolution).unwrap()
    };
    let a = f(&mut plan, x);
    let b = f(&mut plan, a);
    let c = plan.add(b, SkipInput::same(a));
    let d = f(&mut plan, c);
    let e = plan.add(d, SkipInput::same(a));
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
