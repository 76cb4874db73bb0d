//! Weights of networks.

use crate::files::{is_one_of, patched};
use anyhow::{Context, Result, anyhow, bail};
use deepsft::{
    CompactConfig, Executor, FoldedNetwork, NetworkConfig, PlanError, WeightArray, Weights, weights_from_burnpack,
    weights_to_burnpack,
};
use deepsft_geometry::glam::DVec2;
use deepsft_geometry::{Camera, Maps, RestSurface, Template};
use std::collections::BTreeMap;
use std::sync::LazyLock;

/// One of so many networks looks at a picture, which takes much longer than reading it.
pub(crate) const RUN: u32 = 8;

/// A file, or changes of the file of a small network.
pub(crate) fn read(input: &[u8]) -> Result<()> {
    let weights = weights_from_burnpack(&patched(input, small_file()?)).map_err(|error| anyhow!(error))?;
    for array in weights.values() {
        let count = array.shape.iter().product::<usize>();
        assert_eq!(array.values.len(), count, "values that no shape has");
    }
    if let Ok(file) = weights_to_burnpack(&weights) {
        let again = weights_from_burnpack(&file).expect("weights that were written can be read");
        let shapes = |weights: &Weights| -> Vec<_> {
            let shapes = weights.iter().map(|(name, array)| (name.clone(), array.shape.clone()));
            shapes.collect()
        };
        assert_eq!(shapes(&again), shapes(&weights));
    }
    let network = FoldedNetwork {
        config: small_config()?,
        weights,
    };
    if network.check().is_ok() && is_one_of(RUN, input) {
        run(&network)?;
    }
    Ok(())
}

/// Looks at a picture through a network, whatever its weights are.
pub(crate) fn run(network: &FoldedNetwork) -> Result<()> {
    const SIZE: (usize, usize) = (32, 16);
    // The other architectures are for larger images.
    let Ok(mut executor) = Executor::new(&network.config, SIZE, &network.weights, 1) else {
        return Ok(());
    };
    let picture = crate::picture::small(SIZE.0, SIZE.1);
    // Where rest positions, if it says such, are looked up.
    let surface = RestSurface::new(&Template::thin_shell(picture.clone(), 40.0, 30.0)?);
    let mut maps = Maps::empty((SIZE.0, SIZE.1));
    let read = executor
        .run(&picture)
        .and_then(|()| executor.read(deepsft::Stage::Main, None, Some(&surface), &mut maps));
    assert!(read.is_ok(), "a network that was checked does not run: {read:?}");
    Ok(())
}

/// The camera of a small network.
pub(crate) fn small_camera() -> Result<Camera> {
    Ok(Camera::pinhole((16, 9), DVec2::new(12.0, 12.0), DVec2::new(8.0, 4.5))?)
}

/// The least compact network.
pub(crate) fn small_config() -> Result<NetworkConfig> {
    let layers = CompactConfig {
        channels: [1; 4],
        blocks_at_32: 0,
        bins: vec![2; 3],
        refinement_channels: 1,
        mask_channels: 1,
    };
    let architecture = deepsft::Architecture::Compact(layers);
    Ok(NetworkConfig::new(architecture, [40.0, 30.0], &small_camera()?))
}

/// A network of [`small_config`]. The weights are those that its plan asks for, one after another.
pub(crate) fn small_network() -> Result<FoldedNetwork> {
    let mut network = FoldedNetwork {
        config: small_config()?,
        weights: BTreeMap::new(),
    };
    loop {
        let (name, shape) = match network.check() {
            Ok(()) => return Ok(network),
            Err(PlanError::Missing(name)) => (name, Vec::new()),
            Err(PlanError::Shape { what, expected, .. }) if network.weights.contains_key(&what) => (what, expected),
            Err(error) => bail!("what it asks for is not understood: {error}"),
        };
        let count: usize = shape.iter().product();
        let values = (0..count).map(|k| 0.1 * (k % 7) as f32 - 0.2).collect();
        network.weights.insert(name, WeightArray { shape, values });
    }
}

/// The file of [`small_network`]'s weights.
pub(crate) fn small_file() -> Result<&'static [u8]> {
    static FILE: LazyLock<Option<Vec<u8>>> = LazyLock::new(|| weights_to_burnpack(&small_network().ok()?.weights).ok());
    FILE.as_deref().context("a small network cannot be made")
}

pub(crate) fn seeds() -> Result<Vec<Vec<u8>>> {
    let array = |shape: &[usize]| WeightArray {
        shape: shape.to_vec(),
        values: vec![0.5; shape.iter().product()],
    };
    let few = Weights::from([
        ("a.weight".to_owned(), array(&[2, 3, 1, 1])),
        ("a.bias".to_owned(), array(&[2])),
    ]);
    Ok(vec![
        weights_to_burnpack(&few).map_err(|error| anyhow!(error))?,
        b"~".to_vec(),
        // The sign of a weight near the end.
        b"~\xf0\xff\x00\x80".to_vec(),
    ])
}
