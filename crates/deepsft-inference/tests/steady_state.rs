//! A frame allocates nothing.

#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic)]

use deepsft_geometry::{Maps, Picture, training_camera};
use deepsft_inference::{
    Architecture, CompactConfig, Executor, NetworkConfig, PaperConfig, PlanError, R50FConfig, Stage, WeightArray,
    Weights,
};

fn config(architecture: Architecture) -> NetworkConfig {
    NetworkConfig::new(architecture, [200.0, 150.0], &training_camera())
}

/// A compact network.
fn compact() -> NetworkConfig {
    config(Architecture::Compact(CompactConfig {
        channels: [8, 12, 16, 20],
        blocks_at_32: 1,
        bins: vec![6, 7, 8],
        refinement_channels: 9,
        mask_channels: 5,
    }))
}

/// Small numbers without a pattern, as many as the executor asks for.
fn weights(config: &NetworkConfig, image: (usize, usize)) -> Weights {
    let (mut weights, mut state) = (Weights::new(), 1_u64);
    loop {
        let (name, shape) = match Executor::new(config, image, &weights, 1) {
            Ok(_) => return weights,
            Err(PlanError::Missing(name)) => (name, vec![0]),
            Err(PlanError::Shape { what, expected, .. }) => (what, expected),
            Err(other) => panic!("{other}"),
        };
        let next = |_| {
            state = state
                .wrapping_mul(6_364_136_223_846_793_005)
                .wrapping_add(1_442_695_040_888_963_407);
            ((state >> 40) as f32 / (1 << 23) as f32 - 1.0) * 0.1
        };
        let values = (0..shape.iter().product()).map(next).collect();
        let before = weights.insert(name, WeightArray { shape, values });
        assert!(before.is_none_or(|before| before.values.is_empty()));
    }
}

#[test]
fn a_frame_allocates_nothing() {
    let paper = config(Architecture::Paper(PaperConfig::narrow(32)));
    let r50f = config(Architecture::R50F(R50FConfig::narrow(64)));
    for (config, image) in [(compact(), (100, 70)), (paper, (480, 270)), (r50f, (480, 270))] {
        let (width, height) = image;
        let picture = Picture::from_fn(width, height, |x, y| {
            [(x * y % 251) as u8, (3 * x) as u8, (2 * y) as u8]
        });
        let mut executor = Executor::new(&config, image, &weights(&config, image), 1).unwrap();
        let mut maps = Maps::empty((width, height));
        let counted = allocation_counter::measure(|| {
            executor.run(&picture).unwrap();
            executor
                .read(Stage::RegistrationRefinement, None, None, &mut maps)
                .unwrap();
        });
        assert_eq!(
            (counted.count_total, counted.bytes_total),
            (0, 0),
            "{}",
            config.architecture.name()
        );
        let everything = vec![true; width * height];
        executor.read(Stage::Main, Some(&everything), None, &mut maps).unwrap();
        assert_eq!(maps.area(), width * height);
    }
}

/// A server calls from its pool's threads, whose other jobs may last for seconds.
#[test]
fn a_frame_waits_for_no_other_job_of_the_callers_pool() {
    use std::thread::sleep;
    use std::time::{Duration, Instant};
    let pool = rayon::ThreadPoolBuilder::new().num_threads(2).build().unwrap();
    let image = (480, 270);
    let picture = Picture::from_fn(480, 270, |x, y| [(x * y % 251) as u8, (3 * x) as u8, (2 * y) as u8]);
    let mut executor = Executor::new(&compact(), image, &weights(&compact(), image), 2).unwrap();
    let longest = std::thread::scope(|scope| {
        // They arrive while frames are made.
        scope.spawn(|| {
            for _ in 0..3 {
                sleep(Duration::from_millis(20));
                pool.spawn(|| sleep(Duration::from_secs(4)));
            }
        });
        pool.install(|| {
            let frame = |_| {
                let start = Instant::now();
                executor.run(&picture).unwrap();
                start.elapsed()
            };
            (0..100).map(frame).max().unwrap()
        })
    });
    assert!(longest < Duration::from_secs(3), "{longest:?}");
}

#[test]
fn weights_that_are_absent_or_of_another_shape_are_refused_by_name() {
    let all = weights(&compact(), (100, 70));
    let made = |change: &dyn Fn(&mut Weights)| {
        let mut weights = all.clone();
        change(&mut weights);
        Executor::new(&compact(), (100, 70), &weights, 1).err().unwrap()
    };
    let absent = made(&|weights| drop(weights.remove("mask_mix.bias")));
    assert_eq!(absent, PlanError::Missing("mask_mix.bias".to_owned()));
    let short = made(&|weights| weights.get_mut("main.down8.weight").unwrap().values.truncate(7));
    assert!(short.to_string().contains("main.down8.weight"), "{short}");
    let turned = made(&|weights| weights.get_mut("main.down8.weight").unwrap().shape.swap(0, 1));
    let expected = "main.down8.weight: [8, 12, 3, 3] does not fit [12, 8, 3, 3]";
    assert_eq!(turned.to_string(), expected);
    let more = made(&|weights| drop(weights.insert("spare".to_owned(), weights["mask.bias"].clone())));
    assert_eq!(more, PlanError::NoPlace("spare".to_owned()));
}

#[test]
fn images_of_another_size_are_refused_where_the_network_knows_one() {
    let config = config(Architecture::R50F(R50FConfig::narrow(64)));
    let error = Executor::new(&config, (480, 272), &Weights::new(), 1).err().unwrap();
    assert_eq!(error.to_string(), "the image: [480, 272] does not fit [480, 270]");
}
