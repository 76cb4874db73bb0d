//! A frame allocates nothing.

#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic)]

use deepsft_geometry::{Maps, Picture};
use deepsft_inference::{
    Architecture, CompactConfig, CompactExecutor, DepthRange, NetworkConfig, PlanError, Stage, Weights,
};

const IMAGE: [usize; 2] = [100, 70];

fn config() -> NetworkConfig {
    NetworkConfig {
        architecture: Architecture::Compact(CompactConfig {
            channels: [8, 12, 16, 20],
            blocks_at_32: 1,
            bins: [6, 7, 8],
            refinement_channels: 9,
            mask_channels: 5,
            seams: false,
        }),
        template_size_mm: [200.0, 150.0],
        focal: 380.0,
        principal_point: [50.0, 35.0],
        depth_range: DepthRange::default(),
    }
}

/// Weights of [`config`]: small numbers without a pattern.
fn weights() -> Weights {
    let mut state = 1_u64;
    let mut some = |count: usize| -> Vec<f32> {
        let next = |_| {
            state = state
                .wrapping_mul(6_364_136_223_846_793_005)
                .wrapping_add(1_442_695_040_888_963_407);
            ((state >> 40) as f32 / (1 << 23) as f32 - 1.0) * 0.2
        };
        (0..count).map(next).collect()
    };
    let mut layers = vec![
        ("main.patch".to_owned(), 48, 8, 1),
        ("main.down8".to_owned(), 8, 12, 3),
        ("main.down16".to_owned(), 12, 16, 3),
        ("main.down32".to_owned(), 16, 20, 3),
        ("main.lateral16".to_owned(), 20, 16, 1),
        ("main.lateral8".to_owned(), 16, 12, 1),
        ("main.offset".to_owned(), 12, 3, 1),
        ("mask_coarse".to_owned(), 12, 5, 1),
        ("mask_fine".to_owned(), 8, 5, 1),
        ("mask_mix".to_owned(), 5, 5, 3),
        ("mask".to_owned(), 5, 16, 1),
    ];
    layers.extend(
        [6, 7, 8]
            .iter()
            .enumerate()
            .map(|(k, &bins)| (format!("main.bins.{k}"), 16, bins, 1)),
    );
    for (block, channels) in [
        ("encode8", 12),
        ("encode16", 16),
        ("encode32.0", 20),
        ("decode16", 16),
        ("decode8", 12),
    ] {
        layers.extend(["first", "second"].map(|part| (format!("main.{block}.{part}"), channels, channels, 3)));
    }
    for (block, outputs) in [("depth_refinement", 4), ("registration_refinement", 2)] {
        layers.push((format!("{block}.entry"), 12 + 7, 9, 3));
        layers.push((format!("{block}.middle"), 9, 9, 3));
        layers.push((format!("{block}.correction"), 9, outputs, 1));
    }
    let arrays = layers.into_iter().flat_map(|(name, inputs, outputs, kernel)| {
        let filters = some(outputs * inputs * kernel * kernel);
        [
            (format!("{name}.weight"), filters),
            (format!("{name}.bias"), some(outputs)),
        ]
    });
    arrays.collect()
}

#[test]
fn a_frame_allocates_nothing() {
    let image = Picture::from_fn(100, 70, |x, y| [(x * y % 251) as u8, (3 * x) as u8, (2 * y) as u8]);
    let mut executor = CompactExecutor::new(&config(), IMAGE, &weights(), 1).unwrap();
    let mut maps = Maps::empty(100, 70);
    let counted = allocation_counter::measure(|| {
        executor.run(&image).unwrap();
        executor.read(Stage::RegistrationRefinement, None, &mut maps).unwrap();
    });
    assert_eq!((counted.count_total, counted.bytes_total), (0, 0));
    let everything = vec![true; 100 * 70];
    executor.read(Stage::Main, Some(&everything), &mut maps).unwrap();
    assert_eq!(maps.area(), 100 * 70);
}

#[test]
fn weights_that_are_absent_or_of_another_shape_are_refused_by_name() {
    let made = |change: &dyn Fn(&mut Weights)| {
        let mut weights = weights();
        change(&mut weights);
        CompactExecutor::new(&config(), IMAGE, &weights, 1).err().unwrap()
    };
    let absent = made(&|weights| drop(weights.remove("mask_mix.bias")));
    assert_eq!(absent, PlanError::Missing("mask_mix.bias".to_owned()));
    let short = made(&|weights| weights.get_mut("main.down8.weight").unwrap().truncate(7));
    assert!(short.to_string().contains("main.down8.weight"), "{short}");
}
