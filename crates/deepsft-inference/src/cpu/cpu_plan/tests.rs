//! Every step against its definition.

use super::*;
use crate::plan::{Convolution, DenseLayer, Filters, LayerInput};

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
    fn of(shape: MapShape, value: impl Fn(usize, usize, usize) -> f32) -> Self {
        let value = &value;
        let places = (0..shape.height).flat_map(|y| (0..shape.width).map(move |x| (y, x)));
        let values = (0..shape.channels).flat_map(|c| places.clone().map(move |(y, x)| value(c, y, x)));
        Self(shape, values.collect())
    }

    fn at(&self, channel: usize, row: usize, column: usize) -> f64 {
        let MapShape { height, width, .. } = self.0;
        f64::from(self.1[(channel * height + row) * width + column])
    }
}

/// The sum of the definition, in double precision.
fn expected(convolution: &Convolution, inputs: &[Plain], skip: Option<&Plain>, output: MapShape) -> Plain {
    let Filters {
        weights,
        biases,
        kernel,
        ..
    } = &convolution.filters;
    let read: Vec<(&LayerInput, &Plain, usize)> = (convolution.inputs.iter().zip(inputs))
        .flat_map(|(input, map)| (0..map.0.channels).map(move |channel| (input, map, channel)))
        .collect();
    let border = kernel / 2;
    let value = |o: usize, y: usize, x: usize| {
        let mut sum = f64::from(biases[o]);
        for (c, (input, map, channel)) in read.iter().enumerate() {
            let [height, width] = input.size(map.0);
            for i in 0..*kernel {
                for j in 0..*kernel {
                    let (row, column) = (y * convolution.stride + i, x * convolution.stride + j);
                    let (Some(row), Some(column)) = (row.checked_sub(border), column.checked_sub(border)) else {
                        continue;
                    };
                    if row < height && column < width {
                        let row = (row + input.cropped[0]) / input.factor;
                        let number = map.at(*channel, row, column / input.factor);
                        let number = if input.rectified { number.max(0.0) } else { number };
                        let filter = (o * read.len() + c) * kernel * kernel;
                        sum += number * f64::from(weights[filter + i * kernel + j]);
                    }
                }
            }
        }
        if let (Some(map), Some(SkipInput { factor, top, .. })) = (skip, convolution.skip) {
            sum += map.at(o, (y + top) / factor, x / factor);
        }
        (if convolution.rectified { sum.max(0.0) } else { sum }) as f32
    };
    Plain::of(output, value)
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

/// A plan of one step, its inputs' values, and what has to come out.
struct Case {
    plan: Plan,
    given: Vec<(MapId, Plain)>,
    output: MapId,
    expected: Plain,
}

impl Case {
    /// Compares on every processor and number of threads.
    fn check(&self, what: &str) {
        for (arch, threads) in archs().into_iter().flat_map(|arch| [(arch, 1), (arch, 3), (arch, 8)]) {
            let mut cpu = CpuPlan::with_arch(arch, self.plan.clone(), &[self.output], threads);
            self.given.iter().for_each(|(map, plain)| write(&mut cpu, *map, plain));
            cpu.run(0..1);
            assert_eq!(cpu.shape(self.output), self.expected.0, "{what}");
            let pitch = cpu.pitch(self.output);
            let places = self.expected.0.height * self.expected.0.width;
            let largest = self
                .expected
                .1
                .iter()
                .fold(1.0_f32, |most, value| most.max(value.abs()));
            for (index, value) in self.expected.1.iter().enumerate() {
                let ours = cpu.values(self.output)[index % places * pitch + index / places];
                assert!(
                    (ours - value).abs() < 1e-5 * largest,
                    "{arch:?}, {threads} threads, {what}, at {index}: {ours} for {value}"
                );
            }
        }
    }
}

/// A map with any numbers.
fn given(plan: &mut Plan, numbers: &mut Numbers, shape: MapShape) -> (MapId, Plain) {
    let values = numbers.some(shape.channels * shape.area());
    (plan.input(shape), Plain(shape, values))
}

/// Channels of the inputs, their rows and columns, and how they are read (up-sampling, rows cropped); outputs, kernel, stride;
/// up-sampling and first row of the skip input, none for 0.
type Shapes<'a> = (&'a [usize], [usize; 2], (usize, [usize; 2]), [usize; 3], [usize; 2]);

fn convolution((channels, [height, width], (factor, cropped), [outputs, kernel, stride], skip): Shapes<'_>) -> Case {
    let (mut plan, mut numbers) = (Plan::default(), Numbers(3));
    let mut inputs: Vec<(MapId, Plain)> = (channels.iter())
        .map(|&channels| given(&mut plan, &mut numbers, MapShape::new(channels, height, width)))
        .collect();
    let [rows, columns] = [factor * height - cropped[0] - cropped[1], factor * width].map(|side| side.div_ceil(stride));
    let [skip, top] = skip;
    let plain_skip = (skip > 0).then(|| {
        let [rows, columns] = [rows + top, columns].map(|side| side.div_ceil(skip));
        given(&mut plan, &mut numbers, MapShape::new(outputs, rows, columns))
    });
    let fan_in = channels.iter().sum::<usize>() * kernel * kernel;
    let read = |(k, (map, _)): (usize, &(MapId, Plain))| LayerInput {
        map: *map,
        rectified: k % 2 == 0,
        factor,
        cropped,
    };
    let convolution = Convolution {
        inputs: inputs.iter().enumerate().map(read).collect(),
        filters: Filters {
            weights: numbers.some(outputs * fan_in),
            biases: numbers.some(outputs),
            inputs: channels.iter().sum(),
            kernel,
        },
        stride,
        skip: plain_skip.as_ref().map(|(map, _)| SkipInput {
            map: *map,
            factor: skip,
            top,
        }),
        rectified: outputs % 2 == 0,
    };
    let output = plan.convolve(convolution.clone()).unwrap();
    let plains: Vec<Plain> = inputs.iter().map(|(_, plain)| plain.clone()).collect();
    let expected = expected(
        &convolution,
        &plains,
        plain_skip.as_ref().map(|(_, plain)| plain),
        plan.shape(output),
    );
    inputs.extend(plain_skip);
    Case {
        plan,
        given: inputs,
        output,
        expected,
    }
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
    for (channels, height, width, stride, border) in [(20, 9, 13, 3, 0), (33, 8, 7, 2, 1), (5, 7, 8, 3, 1)] {
        let (mut plan, mut numbers) = (Plan::default(), Numbers(5));
        let (map, mut plain) = given(&mut plan, &mut numbers, MapShape::new(channels, height, width));
        // All negative: a border of zeros would win.
        plain.1.iter_mut().for_each(|value| *value -= 2.0);
        let output = plan.pool(MaxPool { map, stride, border }).unwrap();
        let value = |c: usize, y: usize, x: usize| {
            let around = |at: usize, side: usize| {
                (stride * at..stride * at + 3).filter_map(move |k| k.checked_sub(border).filter(|&k| k < side))
            };
            let window = around(y, height).flat_map(|row| around(x, width).map(move |column| (row, column)));
            let values = window.map(|(row, column)| plain.at(c, row, column));
            values.fold(f64::NEG_INFINITY, f64::max) as f32
        };
        let expected = Plain::of(plan.shape(output), value);
        let given = vec![(map, plain)];
        let case = Case {
            plan,
            given,
            output,
            expected,
        };
        case.check("pooling");
    }
}

#[test]
fn dense_layers_read_all_values_of_a_map() {
    for (shape, outputs) in [
        (MapShape::new(20, 3, 5), 50),
        (MapShape::new(200, 1, 1), 300),
        (MapShape::new(3, 2, 1), 4),
    ] {
        let (mut plan, mut numbers) = (Plan::default(), Numbers(7));
        let (map, plain) = given(&mut plan, &mut numbers, shape);
        let dense = DenseLayer {
            map,
            weights: numbers.some(plain.1.len() * outputs),
            biases: numbers.some(outputs),
            rectified: outputs > 200,
        };
        let output = plan.dense(dense.clone()).unwrap();
        let value = |o: usize, _, _| {
            let weights = dense.weights.chunks_exact(outputs).map(|row| f64::from(row[o]));
            let products = weights.zip(&plain.1).map(|(weight, &value)| weight * f64::from(value));
            let sum = f64::from(dense.biases[o]) + products.sum::<f64>();
            (if dense.rectified { sum.max(0.0) } else { sum }) as f32
        };
        let expected = Plain::of(plan.shape(output), value);
        let given = vec![(map, plain.clone())];
        let case = Case {
            plan,
            given,
            output,
            expected,
        };
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
                ..Convolution::new(vec![LayerInput::relu(map)], filters)
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
        let convolution = Convolution::new(vec![LayerInput::plain(map)], filters);
        plan.convolve(convolution).unwrap()
    };
    let a = f(&mut plan, x);
    let b = f(&mut plan, a);
    let c = plan.add(b, SkipInput::same(a)).unwrap();
    let d = f(&mut plan, c);
    let e = plan.add(d, SkipInput::same(a)).unwrap();
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
