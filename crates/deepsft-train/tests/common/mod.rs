//! What several tests of training share: a small template, a small network, frames of a recording, weights, checkpoints.
#![allow(dead_code)] // Each test file uses a part of it.

pub mod charts;

use burn::module::{Module, ModuleVisitor, Param};
use burn::tensor::Tensor;
use deepsft::{Architecture, CompactConfig, NetworkConfig};
use deepsft_geometry::{Camera, Maps, Picture, Template, draw_template, training_camera};
use deepsft_network::Network;
use deepsft_train::TrainingFrame;
use std::path::Path;
use std::sync::{Mutex, MutexGuard, PoisonError};

/// Size of the small frames, pixels.
pub const SIZE: [usize; 2] = [96, 64];

/// burn's random numbers are one stream for all threads: a test at a time, so that each starts from the same weights.
pub fn alone() -> MutexGuard<'static, ()> {
    static ALONE: Mutex<()> = Mutex::new(());
    ALONE.lock().unwrap_or_else(PoisonError::into_inner)
}

/// The training camera, reduced to [`SIZE`].
pub fn small_camera() -> Camera {
    training_camera().resized((SIZE[0], SIZE[1])).unwrap()
}

/// A texture whose red tells u and whose green tells v: photo-consistency has one minimum.
pub fn template() -> Template {
    let texture = Picture::from_fn(90, 60, |x, y| [(20 + 2 * x) as u8, (20 + 3 * y) as u8, 128]);
    Template::thin_shell(texture, 180.0, 120.0).unwrap()
}

/// A compact network so small that a step takes milliseconds.
pub fn small_compact(camera: &Camera) -> NetworkConfig {
    let shape = CompactConfig {
        channels: [8, 8, 8, 8],
        blocks_at_32: 1,
        bins: vec![8, 8, 8],
        refinement_channels: 16,
        mask_channels: 8,
    };
    NetworkConfig::new(Architecture::Compact(shape), [180.0, 120.0], camera)
}

/// Maps of a tilted plane, `shift` off in u, that ends `cut` pixels (right, below) before it might.
pub fn plane(shift: f32, cut: [usize; 2]) -> Maps {
    let [width, height] = SIZE;
    let mut maps = Maps::empty((width, height));
    for y in 8..height - 8 - cut[1] {
        for x in 10..width - 10 - cut[0] {
            let uv = [0.2 + shift + x as f32 / 200.0, 0.3 + y as f32 / 160.0];
            maps.set(y * width + x, 500.0 + x as f32, uv);
        }
    }
    maps
}

/// A frame of a recording in which the template is seen as `maps` say, measured without errors.
pub fn frame_of(index: usize, maps: &Maps) -> TrainingFrame {
    TrainingFrame {
        index,
        image: draw_template(template().texture(), maps),
        depth_mm: maps.depth().iter().map(|&depth| depth.max(0.0)).collect(),
        object: maps.mask(),
        inside: maps.mask(),
        depth_counts: maps.mask(),
        level: 0,
    }
}

/// All weights one after the other, in the module's order (their identities are drawn anew when a network is folded).
pub fn weights(network: &Network) -> Vec<f32> {
    struct Weights(Vec<f32>);
    impl ModuleVisitor for Weights {
        fn visit_float<const D: usize>(&mut self, param: &Param<Tensor<D>>) {
            self.0.extend(param.val().into_data().try_to_vec::<f32>().unwrap());
        }
    }
    let mut weights = Weights(Vec::new());
    network.visit(&mut weights);
    assert!(weights.0.len() > 1000, "the network's weights were not visited");
    weights.0
}

/// Copies a checkpoint as a kill would leave it.
pub fn copy(from: &Path, to: &Path) {
    std::fs::create_dir_all(to).unwrap();
    for entry in std::fs::read_dir(from).unwrap() {
        let entry = entry.unwrap();
        std::fs::copy(entry.path(), to.join(entry.file_name())).unwrap();
    }
}
