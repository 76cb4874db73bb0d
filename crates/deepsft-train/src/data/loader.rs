//! Batches made by worker threads, in an order that depends on nothing but the seed.

use super::map_batch::MapBatch;
use super::sample_source::SampleSource;
use super::window_batch::{Batch, BatchShape};
use crate::error::TrainError;
use deepsft::NetworkConfig;
use deepsft_geometry::RestSurface;
use deepsft_synth::Sample;
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64Mcg;
use std::sync::Arc;
use std::sync::mpsc::{Receiver, SyncSender, sync_channel};

/// Batches a worker may be ahead.
const AHEAD: usize = 2;

/// Sets the random stream of the windows apart from that of the samples.
const WINDOW_STREAM: u64 = 0x7769_6e64;

/// Fraction of the windows that are centred near a pixel of the object.
const CENTRED_FRACTION: f64 = 0.8;

/// A batch as a network is taught.
pub enum TrainingBatch {
    /// Windows with cells and bins.
    Cells(Batch),
    /// Whole frames with maps.
    Maps(MapBatch),
}

/// Endless batches for one seed. Batch b starts at sample `first_sample` and is made whole by worker
/// b mod W; the consumer takes them in turn, so threads never change what comes out.
pub struct Loader {
    requests: Vec<SyncSender<(u64, BatchShape)>>,
    batches: Vec<Receiver<Result<(BatchShape, TrainingBatch), TrainError>>>,
    asked: usize,
    taken: usize,
}

impl Loader {
    /// Starts `workers` threads that make batches for `network`. With `epoch_samples` the same samples come again after so many, in another order.
    pub fn start<S: SampleSource + ?Sized + 'static>(
        source: &Arc<S>,
        network: &NetworkConfig,
        seed: u64,
        epoch_samples: Option<u64>,
        workers: usize,
    ) -> Self {
        let (mut requests, mut batches) = (Vec::new(), Vec::new());
        for _ in 0..workers.max(1) {
            let (request_sender, request_receiver) = sync_channel::<(u64, BatchShape)>(AHEAD + 1);
            let (batch_sender, batch_receiver) = sync_channel(AHEAD + 1);
            let (source, network) = (Arc::clone(source), network.clone());
            std::thread::spawn(move || {
                let surface = network.rest_surface(source.template());
                for request in request_receiver {
                    let batch = make_batch(&*source, &network, surface.as_ref(), (seed, epoch_samples), request);
                    let failed = batch.is_err();
                    if batch_sender.send(batch.map(|batch| (request.1, batch))).is_err() || failed {
                        break;
                    }
                }
            });
            requests.push(request_sender);
            batches.push(batch_receiver);
        }
        Self {
            requests,
            batches,
            asked: 0,
            taken: 0,
        }
    }

    /// Batches that should be asked for before the next one is taken.
    pub fn wanted(&self) -> usize {
        (AHEAD * self.requests.len() + 1).saturating_sub(self.asked - self.taken)
    }

    /// Asks for the batch of `shape` that starts at sample `first_sample`. Of a worker that has stopped [`Loader::take`]
    /// tells why.
    pub fn ask(&mut self, first_sample: u64, shape: BatchShape) {
        let worker = self.asked % self.requests.len();
        self.asked += 1;
        let _ = self.requests[worker].send((first_sample, shape));
    }

    /// The next batch in the order of asking, and its shape.
    ///
    /// # Errors
    /// What the worker met that was to make it; [`TrainError::WorkerStopped`] after that.
    pub fn take(&mut self) -> Result<(BatchShape, TrainingBatch), TrainError> {
        let worker = self.taken % self.batches.len();
        self.taken += 1;
        self.batches[worker].recv().map_err(|_| TrainError::WorkerStopped)?
    }
}

fn make_batch<S: SampleSource + ?Sized>(
    source: &S,
    network: &NetworkConfig,
    surface: Option<&RestSurface>,
    (seed, epoch_samples): (u64, Option<u64>),
    (first_sample, shape): (u64, BatchShape),
) -> Result<TrainingBatch, TrainError> {
    let asked = first_sample..first_sample + shape.frames as u64;
    match network.as_compact() {
        Some(compact) => {
            let mut batch = Batch::new(shape, compact, network.depth_range);
            let mut made: Option<(u64, Sample)> = None;
            for window in asked {
                let index = sample_index(window / shape.windows_per_frame(), epoch_samples, seed);
                let sample = match made.take() {
                    Some((made_index, sample)) if made_index == index => sample,
                    _ => source.sample(seed, index)?,
                };
                let corner = window_corner(&sample, shape, seed, window);
                batch.push(&sample, surface, corner);
                made = Some((index, sample));
            }
            Ok(TrainingBatch::Cells(batch))
        }
        None => {
            let mut batch = MapBatch::new(network.depth_range);
            for position in asked {
                batch.push(&source.sample(seed, sample_index(position, epoch_samples, seed))?);
            }
            Ok(TrainingBatch::Maps(batch))
        }
    }
}

/// Number of the sample that comes as number `position` of a training with `seed`. In epochs every sample comes once per epoch, from a start and in
/// strides of the epoch's own, so that other samples share a batch each time.
fn sample_index(position: u64, epoch_samples: Option<u64>, seed: u64) -> u64 {
    let Some(samples) = epoch_samples else { return position };
    let samples = samples.max(1);
    let (epoch, place) = (position / samples, position % samples);
    let mut rng = Pcg64Mcg::seed_from_u64(seed ^ (epoch + 1).wrapping_mul(0x9e37_79b9_7f4a_7c15));
    let start = rng.random_range(0..samples);
    // Strides that share no divisor with the number of samples step through all of them.
    let stride = loop {
        let stride = rng.random_range(1..=samples);
        if greatest_common_divisor(stride, samples) == 1 {
            break stride;
        }
    };
    ((u128::from(place) * u128::from(stride) + u128::from(start)) % u128::from(samples)) as u64
}

fn greatest_common_divisor(a: u64, b: u64) -> u64 {
    if b == 0 { a } else { greatest_common_divisor(b, a % b) }
}

/// Corner of window number `index` in its sample: mostly around a random pixel of the object, so that
/// little work goes into empty background, sometimes anywhere.
fn window_corner(sample: &Sample, shape: BatchShape, seed: u64, index: u64) -> (usize, usize) {
    let (spare_x, spare_y) = (
        sample.image.width().saturating_sub(shape.width),
        sample.image.height().saturating_sub(shape.height),
    );
    let mut rng = Pcg64Mcg::seed_from_u64(seed ^ index.wrapping_mul(0x9e37_79b9_7f4a_7c15) ^ WINDOW_STREAM);
    let area = sample.truth.area();
    if area > 0 && rng.random_bool(CENTRED_FRACTION) {
        let chosen = rng.random_range(0..area);
        let pixel = (0..sample.truth.depth().len())
            .filter(|&p| sample.truth.inside(p))
            .nth(chosen)
            .unwrap_or(0);
        let (x, y) = (pixel % sample.truth.size().width, pixel / sample.truth.size().width);
        return (
            x.saturating_sub(shape.width / 2).min(spare_x),
            y.saturating_sub(shape.height / 2).min(spare_y),
        );
    }
    (rng.random_range(0..=spare_x), rng.random_range(0..=spare_y))
}

#[cfg(test)]
mod tests {
    use super::super::window_batch::BatchTensors;
    use super::*;
    use crate::StoredSamples;
    use burn::tensor::{Device, Tensor};
    use deepsft_geometry::{Picture, Template, training_camera};
    use deepsft_synth::{DatasetFolder, DatasetPlan, SynthConfig, Synthesizer, UnfinishedDataset};
    use std::path::Path;

    const SEED: u64 = 3;

    /// What makes samples, and the first eleven of them in one shard.
    fn sources(place: &Path) -> (Arc<Synthesizer>, Arc<StoredSamples>) {
        let template = Template::thin_shell(Picture::from_fn(9, 6, |x, _| [20 * x as u8; 3]), 180.0, 120.0).unwrap();
        let synthesizer = Synthesizer::new(&template, SynthConfig::default()).unwrap();
        let unfinished = UnfinishedDataset::open(place, DatasetPlan::new(&synthesizer, SEED, 0..11, 11)).unwrap();
        unfinished.make(&synthesizer, None, || ()).unwrap();
        let stored = StoredSamples::open(&[DatasetFolder::open(place).unwrap()], &template, |_| ()).unwrap();
        (Arc::new(synthesizer), Arc::new(stored))
    }

    #[test]
    fn a_sample_that_cannot_be_read_stops_the_training_by_the_name_of_its_file() {
        let folder = tempfile::tempdir().unwrap();
        let place = folder.path().join("set");
        let (_, stored) = sources(&place);
        std::fs::write(place.join("shard-000000.tar"), "cut").unwrap();
        let network = NetworkConfig::compact([180.0, 120.0], &training_camera());
        let mut loader = Loader::start(&stored, &network, SEED, Some(11), 2);
        loader.ask(0, BatchShape::whole_frames(2));
        assert!(loader.take().err().unwrap().to_string().contains("shard-000000.tar"));
    }

    /// Planes through the pixels of cells go on beyond the object's edge, where the files' rounding grows.
    #[test]
    fn windows_of_stored_samples_are_those_of_the_samples_that_are_made() {
        let folder = tempfile::tempdir().unwrap();
        let (synthesizer, stored) = sources(&folder.path().join("set"));
        let values = |tensor: Tensor<4>| tensor.into_data().try_to_vec::<f32>().unwrap();
        let close = |a: f32, b: f32| (a - b).abs() < 1e-3;
        let mut cells = 0;
        for (made, read) in windows(&synthesizer).into_iter().zip(windows(&stored)) {
            assert_eq!(values(made.images), values(read.images));
            assert_eq!(values(made.mask), values(read.mask));
            assert_eq!(values(made.corners), values(read.corners));
            let weight = values(made.cell_weight);
            let same_weight = weight.iter().zip(values(read.cell_weight)).all(|(&a, b)| close(a, b));
            let pairs = values(made.cells).into_iter().zip(values(read.cells));
            let mut counted = pairs.zip(weight.iter().cycle()).filter(|(_, weight)| **weight > 0.0);
            assert!(same_weight && counted.all(|((a, b), _)| close(a, b)));
            cells += weight.iter().filter(|&&weight| weight > 0.0).count();
        }
        assert!(cells > 200, "{cells}");
    }

    /// Two windows of each of eight samples.
    fn windows<S: SampleSource + 'static>(source: &Arc<S>) -> Vec<BatchTensors> {
        let network = NetworkConfig::compact([180.0, 120.0], &training_camera());
        let shape = BatchShape {
            frames: 1,
            width: 128,
            height: 96,
        };
        let mut loader = Loader::start(source, &network, SEED, None, 2);
        let batch = |first| {
            loader.ask(first, shape);
            match loader.take().unwrap().1 {
                TrainingBatch::Cells(batch) => batch.into_tensors(&Device::flex()),
                TrainingBatch::Maps(_) => panic!("maps for a compact network"),
            }
        };
        (0..16).map(batch).collect()
    }

    #[test]
    fn every_sample_comes_once_per_epoch_in_another_order() {
        for samples in [1, 10, 47, 1000] {
            let epoch = |number: u64| -> Vec<u64> {
                (number * samples..(number + 1) * samples)
                    .map(|position| sample_index(position, Some(samples), SEED))
                    .collect()
            };
            for number in [0, 1, 7] {
                let mut sorted = epoch(number);
                sorted.sort_unstable();
                assert_eq!(sorted, (0..samples).collect::<Vec<_>>());
            }
            // Other neighbours, not only another start.
            let after_zero = |number| {
                let order = epoch(number);
                let at = order.iter().position(|&index| index == 0).unwrap();
                order[(at + 1) % order.len()]
            };
            assert!(samples < 47 || after_zero(0) != after_zero(1), "{samples}");
        }
        assert_eq!(sample_index(123, None, SEED), 123);
    }

    #[test]
    fn the_order_of_an_epoch_depends_on_the_seed() {
        let order = |seed| -> Vec<u64> { (0..47).map(|position| sample_index(position, Some(47), seed)).collect() };
        assert_eq!(order(1), order(1));
        assert!((2..10).all(|seed| order(seed) != order(1)));
    }
}
