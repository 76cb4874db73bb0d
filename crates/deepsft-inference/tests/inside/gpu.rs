//! Plans on a GPU against the same plans on the processor.
//!
//! Where no GPU can be started these tests end early and say so, unless the environment has `DEEPSFT_GPU_TESTS=required`. Without a GPU,
//! a Vulkan driver that plays one does: lavapipe (Debian: `mesa-vulkan-drivers`), which has numbers of 16 bits, or that of Debian's
//! Chromium with `VK_ICD_FILENAMES=/usr/lib/chromium/vk_swiftshader_icd.json`, which has none. Both need `libvulkan1`.

use crate::cpu::CpuPlan;
use crate::gpu::GpuPlan;
use crate::gpu::shader::quads;
use crate::plan::{Convolution, Filters, LayerInput, MapId, MapShape, MaxPool, Plan, SkipInput};
use crate::{
    Architecture, CompactConfig, Executor, Gpu, GpuError, GpuExecutor, NetworkConfig, PaperConfig, PlanError, Stage,
    WeightArray, Weights,
};
use deepsft_geometry::{Maps, Picture, RestSurface, Template, training_camera};

/// The GPU, if there is one.
fn gpu() -> Option<Gpu> {
    match pollster::block_on(Gpu::start()) {
        Ok(gpu) => {
            eprintln!("{gpu:?}");
            Some(gpu)
        }
        Err(error) => {
            let required = std::env::var("DEEPSFT_GPU_TESTS").is_ok_and(|value| value == "required");
            assert!(!required, "{error}");
            eprintln!("SKIPPED: {error}");
            None
        }
    }
}

/// Numbers from -1 to 1 without a pattern.
struct Numbers(u64);

impl Numbers {
    fn some(&mut self, count: usize) -> Vec<f32> {
        let next = |_| {
            self.0 = self
                .0
                .wrapping_mul(6_364_136_223_846_793_005)
                .wrapping_add(1_442_695_040_888_963_407);
            (self.0 >> 40) as f32 / (1 << 23) as f32 - 1.0
        };
        (0..count).map(next).collect()
    }

    fn below(&mut self, count: usize) -> usize {
        ((self.some(1)[0] + 1.0) / 2.0 * count as f32) as usize % count
    }
}

/// A plan of random layers of every kind but the dense, its inputs, and its last map.
fn random_plan(numbers: &mut Numbers) -> (Plan, Vec<MapId>, MapId) {
    let mut plan = Plan::default();
    let [height, width] = [0; 2].map(|_| 5 + numbers.below(20));
    let mut inputs = Vec::new();
    let mut maps = Vec::new();
    for channels in [3, 8, 5] {
        let map = plan.input(MapShape::new(channels, height, width));
        inputs.push(map);
        maps.push(map);
    }
    for layer in 0..10 {
        let first = maps[numbers.below(maps.len())];
        let from = plan.shape(first);
        let map = match layer % 5 {
            3 if from.height > 2 && from.width > 2 => {
                let (stride, border) = (2 + numbers.below(2), numbers.below(2));
                plan.pool(MaxPool {
                    map: first,
                    stride,
                    border,
                })
            }
            4 => plan.add(first, SkipInput::same(first)),
            _ => {
                let (factor, cropped) = match numbers.below(3) {
                    0 if from.height > 2 => (1 + numbers.below(3), [numbers.below(2), numbers.below(2)]),
                    _ => (1, [0, 0]),
                };
                let alike = |map: &MapId| {
                    *map != first && (plan.shape(*map).height, plan.shape(*map).width) == (from.height, from.width)
                };
                let read: Vec<MapId> = std::iter::once(first)
                    .chain(maps.iter().copied().filter(alike).take(numbers.below(3)))
                    .collect();
                let channels: usize = read.iter().map(|&map| plan.shape(map).channels).sum();
                let (kernel, stride, outputs) = (
                    [1, 3, 3, 5][numbers.below(4)],
                    1 + numbers.below(2),
                    1 + numbers.below(21),
                );
                let rows = (factor * from.height - cropped[0] - cropped[1]).div_ceil(stride);
                let columns = (factor * from.width).div_ceil(stride);
                let skip = match numbers.below(4) {
                    0 => None,
                    1 => Some((1, 0)),
                    2 => Some((2, 0)),
                    _ => Some((2, 1)),
                };
                let skip = skip.map(|(factor, top)| {
                    let map = plan.input(MapShape::new(
                        outputs,
                        (rows + top).div_ceil(factor),
                        columns.div_ceil(factor),
                    ));
                    inputs.push(map);
                    SkipInput { map, factor, top }
                });
                let scale = ((channels * kernel * kernel) as f32).sqrt();
                let reads = |map| LayerInput {
                    map,
                    rectified: numbers.below(2) == 0,
                    factor,
                    cropped,
                };
                let inputs = read.into_iter().map(reads).collect();
                let filters = Filters {
                    weights: numbers
                        .some(outputs * channels * kernel * kernel)
                        .iter()
                        .map(|w| w / scale)
                        .collect(),
                    biases: numbers.some(outputs),
                    inputs: channels,
                    kernel,
                };
                let rectified = numbers.below(3) == 0;
                plan.convolve(Convolution {
                    inputs,
                    filters,
                    stride,
                    skip,
                    rectified,
                })
                .unwrap()
            }
        };
        maps.push(map);
    }
    (plan, inputs, maps[maps.len() - 1])
}

/// A map of a plan on the processor: [channel, row, column].
fn on_processor(cpu: &CpuPlan, map: MapId) -> Vec<f32> {
    let MapShape {
        channels,
        height,
        width,
    } = cpu.shape(map);
    let (area, pitch) = (height * width, cpu.pitch(map));
    (0..channels * area)
        .map(|index| cpu.values(map)[index % area * pitch + index / area])
        .collect()
}

/// Where the number `index` of [channel][row][column] lies in quads of `area` positions.
fn packed_at(index: usize, area: usize) -> usize {
    let (channel, at) = (index / area, index % area);
    (channel / 4 * area + at) * 4 + channel % 4
}

/// Writes a map of a plan on a GPU: [channel, row, column].
fn write(gpu: &Gpu, plan: &GpuPlan, map: MapId, values: &[f32]) {
    let shape = plan.shape(map);
    let mut packed = vec![0.0_f32; 4 * quads(shape.channels) * shape.area()];
    for (index, &value) in values.iter().enumerate() {
        packed[packed_at(index, shape.area())] = value;
    }
    let bytes: Vec<u8> = packed.iter().flat_map(|value| value.to_le_bytes()).collect();
    gpu.queue.write_buffer(plan.buffer(map), 0, &bytes);
}

/// Runs all steps and reads a map: [channel, row, column].
fn run(gpu: &Gpu, plan: &GpuPlan, map: MapId) -> Result<Vec<f32>, GpuError> {
    gpu.check()?;
    let (shape, size) = (plan.shape(map), plan.buffer(map).size());
    let read = gpu.readable(size);
    let mut encoder = gpu.device.create_command_encoder(&Default::default());
    let mut pass = encoder.begin_compute_pass(&Default::default());
    let kernels = plan.kernels(0..plan.steps());
    kernels.iter().for_each(|kernel| kernel.run(&mut pass));
    drop(pass);
    encoder.copy_buffer_to_buffer(plan.buffer(map), 0, &read, 0, size);
    gpu.submit(encoder);
    let packed: Vec<f32> = pollster::block_on(gpu.mapped(&read, |values| values.collect()))?;
    let values = 0..shape.channels * shape.area();
    Ok(values.map(|index| packed[packed_at(index, shape.area())]).collect())
}

#[test]
fn a_gpu_and_the_processor_run_random_plans_alike() {
    let Some(gpu) = gpu() else { return };
    run_random_plans(&gpu.in_f32(), 1e-5);
    if gpu.has_f16() {
        run_random_plans(&gpu, 1e-2);
    }
}

/// Compares results to this part of the largest.
fn run_random_plans(gpu: &Gpu, bound: f32) {
    let mut numbers = Numbers(5);
    for round in 0..6 {
        let (plan, inputs, last) = random_plan(&mut numbers);
        // Only the last map is kept: the others share memory.
        let mut cpu = CpuPlan::new(plan.clone(), &[last], 1);
        let on_gpu = GpuPlan::new(gpu, plan.clone(), &[last]);
        for map in inputs {
            let MapShape {
                channels,
                height,
                width,
            } = plan.shape(map);
            let (values, area, pitch) = (numbers.some(channels * height * width), height * width, cpu.pitch(map));
            for (index, &value) in values.iter().enumerate() {
                cpu.values_mut(map)[index % area * pitch + index / area] = value;
            }
            write(gpu, &on_gpu, map, &values);
        }
        cpu.run(0..cpu.steps());
        // Twice: nothing of the first run is left.
        run(gpu, &on_gpu, last).unwrap();
        let (values, expected) = (run(gpu, &on_gpu, last).unwrap(), on_processor(&cpu, last));
        assert_eq!(values.len(), expected.len());
        let largest = expected.iter().fold(1.0_f32, |most, value| most.max(value.abs()));
        for (index, (value, expected)) in values.iter().zip(&expected).enumerate() {
            assert!(
                (value - expected).abs() < bound * largest,
                "round {round}, {index}: {value} for {expected}"
            );
        }
    }
}

#[test]
fn a_lost_gpu_says_so() {
    let Some(gpu) = gpu() else { return };
    let mut plan = Plan::default();
    let map = plan.input(MapShape::new(2, 3, 4));
    let sum = plan.add(map, SkipInput::same(map));
    let plan = GpuPlan::new(&gpu, plan, &[sum]);
    write(&gpu, &plan, map, &[1.5; 24]);
    assert_eq!(run(&gpu, &plan, sum), Ok(vec![3.0; 24]));
    assert_eq!(gpu.check(), Ok(()));
    gpu.stop();
    let error = run(&gpu, &plan, sum).unwrap_err();
    assert!(matches!(error, GpuError::Lost(_)), "{error}");
    assert!(matches!(gpu.check(), Err(GpuError::Lost(_))));
}

/// Numbers for a network, as many as the executor asks for.
fn weights(config: &NetworkConfig, image: (usize, usize), numbers: &mut Numbers) -> Weights {
    let mut weights = Weights::new();
    loop {
        let (name, shape) = match Executor::new(config, image, &weights, 1) {
            Ok(_) => return weights,
            Err(PlanError::Missing(name)) => (name, vec![0]),
            Err(PlanError::Shape { what, expected, .. }) => (what, expected),
            Err(other) => panic!("{other}"),
        };
        // Logits of bins that differ, and small corrections.
        let scale = if name.starts_with("main.bins") {
            1.0
        } else if name.contains("correction") || name.contains("offset") {
            0.02
        } else {
            0.2
        };
        let values = numbers.some(shape.iter().product());
        let values = values.iter().map(|w| w * scale).collect();
        weights.insert(name, WeightArray { shape, values });
    }
}

/// Weights with which u and v are the image's red and green.
fn sheet(weights: &Weights, [patch_channels, channels]: [usize; 2]) -> Weights {
    let mut weights = weights.clone();
    weights.values_mut().for_each(|array| array.values.fill(0.0));
    let mut set = |name: &str, indices: &mut dyn Iterator<Item = usize>, value: f32| {
        let array = weights.get_mut(name).unwrap();
        indices.for_each(|index| array.values[index] = value);
    };
    for k in 0..2 {
        // The mean of the channel k of a patch's pixels, positive; the centre of a filter; the coordinate.
        set(
            "main.patch.weight",
            &mut (0..16).map(|pixel| k * 48 + k * 16 + pixel),
            1.0 / 16.0,
        );
        set("main.patch.bias", &mut std::iter::once(k), 2.0);
        set(
            "main.down8.weight",
            &mut std::iter::once((k * patch_channels + k) * 9 + 4),
            1.0,
        );
        set("main.offset.weight", &mut std::iter::once(k * channels + k), 0.085);
    }
    set("main.offset.bias", &mut std::iter::once(2), 0.6);
    set("mask.bias", &mut (0..16), 3.0);
    weights
}

fn compact(bins: &[usize]) -> NetworkConfig {
    let layers = CompactConfig {
        channels: [8, 12, 16, 20],
        blocks_at_32: 1,
        bins: bins.to_vec(),
        refinement_channels: 9,
        mask_channels: 5,
    };
    NetworkConfig::new(Architecture::Compact(layers), [200.0, 150.0], &training_camera())
}

/// A surface that stands for that of a template: a sheet, as a mesh.
fn rest_surface() -> RestSurface {
    let picture = Picture::from_fn(2, 2, |_, _| [0; 3]);
    RestSurface::new(&Template::thin_shell(picture, 200.0, 150.0).unwrap())
}

#[test]
fn a_gpu_and_the_processor_say_the_same_of_an_image() {
    let Some(gpu) = gpu() else { return };
    run_compact(&gpu.in_f32(), None);
    if gpu.has_f16() {
        run_compact(&gpu, Some(3e-3));
    }
}

/// With `half`, the bound of numbers of 16 bits, only a sheet is compared: what nothing was taught multiplies rounding errors.
fn run_compact(gpu: &Gpu, half: Option<f32>) {
    let mut numbers = Numbers(9);
    let ([small, odd], flat) = ([(100, 70), (129, 97)], compact(&[6, 7, 9]));
    // Rest positions.
    let solid = compact(&[6, 7, 9, 5]);
    let rest = rest_surface();
    let some = weights(&flat, small, &mut numbers);
    let cases = [
        (small, &flat, sheet(&some, [8, 12]), 1e-4),
        // What is no surface has no planes: measuring them multiplies rounding errors.
        (small, &flat, some, 5e-3),
        (odd, &solid, weights(&solid, odd, &mut numbers), 5e-3),
    ];
    let count = if half.is_some() { 1 } else { cases.len() };
    for (image, config, weights, bound) in cases.into_iter().take(count) {
        let mut cpu = Executor::new(config, image, &weights, 1).unwrap();
        let mut on_gpu = GpuExecutor::new(gpu, config, image, &weights).unwrap();
        let (width, height) = image;
        // The second image leaves nothing of the first.
        for frame in 0..2 {
            let picture = Picture::from_fn(width, height, |x, y| {
                [
                    (250 * x / width) as u8,
                    (200 * y / height) as u8,
                    (x * y + 90 * frame) as u8,
                ]
            });
            cpu.run(&picture).unwrap();
            let before = gpu.submissions();
            pollster::block_on(on_gpu.run(&picture)).unwrap();
            assert_eq!(gpu.submissions(), before + 1, "a frame is one list of work");
            for stage in [Stage::Main, Stage::DepthRefinement, Stage::RegistrationRefinement] {
                let bound = half.unwrap_or(if stage == Stage::Main { 1e-4 } else { bound });
                for (k, (ours, theirs)) in on_gpu
                    .cells(stage)
                    .unwrap()
                    .into_iter()
                    .zip(cpu.cells(stage).unwrap())
                    .enumerate()
                {
                    for (cell, (ours, theirs)) in ours.iter().zip(theirs).enumerate() {
                        assert!(
                            (ours - theirs).abs() < bound,
                            "{stage:?}, {k}, cell {cell}: {ours} for {theirs}"
                        );
                    }
                }
                let (mut expected, mut maps) = (Maps::empty((width, height)), Maps::empty((width, height)));
                cpu.read(stage, None, Some(&rest), &mut expected).unwrap();
                on_gpu.read(stage, None, Some(&rest), &mut maps).unwrap();
                assert!(maps.area() > 0 && maps.area().abs_diff(expected.area()) < 3);
            }
            for (x, y) in [(0, 0), (width - 1, height - 1), (width / 2, height / 3)] {
                assert!(
                    (on_gpu.mask_logit(x, y).unwrap() - cpu.mask_logit(x, y).unwrap()).abs() < half.unwrap_or(1e-3)
                );
            }
        }
        let other = pollster::block_on(on_gpu.run(&Picture::from_fn(width, 3, |_, _| [0; 3]))).unwrap_err();
        assert!(matches!(other, GpuError::Image(_)), "{other}");
    }
}

#[test]
fn the_papers_network_says_the_same_on_a_gpu() {
    let Some(gpu) = gpu() else { return };
    let config = NetworkConfig::new(
        Architecture::Paper(PaperConfig::narrow(32)),
        [200.0, 150.0],
        &training_camera(),
    );
    let (image, mut numbers) = ((480, 270), Numbers(4));
    let weights = weights(&config, image, &mut numbers);
    let picture = Picture::from_fn(480, 270, |x, y| [(x * y % 251) as u8, (3 * x) as u8, (2 * y) as u8]);
    let mut cpu = Executor::new(&config, image, &weights, 1).unwrap();
    let mut on_gpu = GpuExecutor::new(&gpu.in_f32(), &config, image, &weights).unwrap();
    cpu.run(&picture).unwrap();
    let before = gpu.submissions();
    pollster::block_on(on_gpu.run(&picture)).unwrap();
    assert_eq!(gpu.submissions(), before + 1, "a frame is one list of work");
    let (mut expected, mut maps) = (Maps::empty((480, 270)), Maps::empty((480, 270)));
    let all = vec![true; 480 * 270];
    for stage in [Stage::Main, Stage::DepthRefinement, Stage::RegistrationRefinement] {
        cpu.read(stage, Some(&all), None, &mut expected).unwrap();
        on_gpu.read(stage, Some(&all), None, &mut maps).unwrap();
        let off = |ours: &[f32], theirs: &[f32]| {
            let largest = theirs.iter().fold(1.0_f32, |most, value| most.max(value.abs()));
            let off = ours.iter().zip(theirs).map(|(a, b)| (a - b).abs() / largest);
            off.fold(0.0, f32::max)
        };
        let registration = off(
            maps.registration().as_flattened(),
            expected.registration().as_flattened(),
        );
        let depth = off(maps.depth(), expected.depth());
        assert!(depth < 1e-4 && registration < 1e-4, "{stage:?}: {depth} {registration}");
    }
}
