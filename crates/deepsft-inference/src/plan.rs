//! Plans: the convolutions of a network in their order, and the maps between them.

/// A map of a plan.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct MapId(pub(crate) usize);

/// Size of a map.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct MapShape {
    /// Values per position.
    pub channels: usize,
    /// Rows.
    pub height: usize,
    /// Columns.
    pub width: usize,
}

/// Weights of a convolution.
#[derive(Clone, Debug, PartialEq)]
pub struct Filters {
    /// Filters, row-major [out, in, kernel, kernel].
    pub weights: Vec<f32>,
    /// One per output channel.
    pub biases: Vec<f32>,
    /// Channels that are read, those of all input maps together.
    pub inputs: usize,
    /// Side of the square kernel, odd; the border is padded with kernel / 2 zeros.
    pub kernel: usize,
}

/// What is added to a result: its place (y, x) gets the map's ((y + top) / factor, x / factor). What the map has beyond the result
/// is not read.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Added {
    /// The map.
    pub map: MapId,
    /// How often each of its places counts, across and down.
    pub factor: usize,
    /// Rows of the map, taken so often, above the result's first.
    pub top: usize,
}

impl Added {
    /// A map of the same size.
    pub fn same(map: MapId) -> Self {
        let (factor, top) = (1, 0);
        Self { map, factor, top }
    }

    /// A map of half the size, rounded up.
    pub fn doubled(map: MapId) -> Self {
        let (factor, top) = (2, 0);
        Self { map, factor, top }
    }
}

/// A map that a convolution reads.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Input {
    /// The map.
    pub map: MapId,
    /// Whether its negative values are read as zero (relu).
    pub rectified: bool,
    /// How often each of its places is read, across and down (nearest up-sampling).
    pub factor: usize,
    /// Rows of what is read so that are left out: at the top and at the bottom.
    pub cropped: [usize; 2],
}

impl Input {
    /// Rows and columns that are read of a map of this size.
    pub(crate) fn size(&self, shape: MapShape) -> [usize; 2] {
        let [top, bottom] = self.cropped;
        [
            (self.factor * shape.height).saturating_sub(top + bottom),
            self.factor * shape.width,
        ]
    }
}

/// `map` as it is.
pub(crate) fn plain(map: MapId) -> Input {
    Input {
        map,
        rectified: false,
        factor: 1,
        cropped: [0, 0],
    }
}

/// `map` with relu.
pub(crate) fn relu(map: MapId) -> Input {
    let rectified = true;
    Input {
        rectified,
        ..plain(map)
    }
}

/// A convolution.
#[derive(Clone, Debug)]
pub struct Convolution {
    /// What it reads, one after another along the channels.
    pub inputs: Vec<Input>,
    /// Its weights.
    pub filters: Filters,
    /// Distance of the places where it is applied.
    pub stride: usize,
    /// What is added to the result.
    pub added: Option<Added>,
    /// Whether negative sums are written as zero (relu).
    pub rectified: bool,
}

/// The largest values of windows of 3 x 3 places.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Pool {
    /// What it reads.
    pub map: MapId,
    /// Distance of the windows.
    pub stride: usize,
    /// Places by which the first window lies outside, above and to the left: 0 or 1. They never win.
    pub border: usize,
}

/// Every output from all values of a map.
#[derive(Clone, Debug)]
pub struct Dense {
    /// What it reads.
    pub map: MapId,
    /// Row-major [channel, row, column, output].
    pub weights: Vec<f32>,
    /// One per output.
    pub biases: Vec<f32>,
    /// Whether negative sums are written as zero (relu).
    pub rectified: bool,
}

/// What a step does.
#[derive(Clone, Debug)]
pub(crate) enum Operation {
    Convolve(Convolution),
    Add(MapId, Added),
    Pool(Pool),
    Dense(Dense),
}

/// A step of a plan: makes a map.
#[derive(Clone, Debug)]
pub(crate) struct Step {
    pub(crate) operation: Operation,
    pub(crate) output: MapId,
}

impl Step {
    /// The maps that it reads.
    pub(crate) fn reads(&self) -> impl Iterator<Item = MapId> {
        let (inputs, map, added) = match &self.operation {
            Operation::Convolve(convolution) => (convolution.inputs.as_slice(), None, convolution.added),
            Operation::Add(map, added) => (&[][..], Some(*map), Some(*added)),
            Operation::Pool(Pool { map, .. }) | Operation::Dense(Dense { map, .. }) => (&[][..], Some(*map), None),
        };
        let added = added.map(|added| added.map);
        inputs.iter().map(|input| input.map).chain(map).chain(added)
    }
}

/// Why something cannot be planned.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum PlanError {
    /// A network of another architecture.
    #[error("no plan is made of a network of the architecture {0}")]
    Architecture(&'static str),
    /// A network's description has a number that no network has, or is for another template or camera.
    #[error("{0}")]
    Config(String),
    /// Weights are absent.
    #[error("the network has no weights {0}")]
    Missing(String),
    /// Weights that no layer reads.
    #[error("the network has no place for the weights {0}")]
    NoPlace(String),
    /// Weights or maps do not fit each other.
    #[error("{what}: {actual:?} does not fit {expected:?}")]
    Shape {
        /// What does not fit.
        what: String,
        /// Its shape.
        actual: Vec<usize>,
        /// The shape that fits.
        expected: Vec<usize>,
    },
}

/// The convolutions of a network and the maps between them. Maps that no convolution writes are the caller's to write.
#[derive(Clone, Debug, Default)]
pub struct Plan {
    pub(crate) maps: Vec<MapShape>,
    pub(crate) steps: Vec<Step>,
}

impl Plan {
    /// A map that the caller writes.
    pub fn input(&mut self, shape: MapShape) -> MapId {
        self.maps.push(shape);
        MapId(self.maps.len() - 1)
    }

    /// Size of a map.
    ///
    /// # Panics
    /// May panic for a map of another plan.
    pub fn shape(&self, map: MapId) -> MapShape {
        self.maps[map.0]
    }

    /// Steps so far: marks where the caller takes over.
    pub fn steps(&self) -> usize {
        self.steps.len()
    }

    /// Adds a convolution; its result is a new map of ceil(size / stride).
    ///
    /// # Errors
    /// [`PlanError::Shape`] when maps and filters do not fit each other.
    pub fn convolve(&mut self, convolution: Convolution) -> Result<MapId, PlanError> {
        let Filters {
            weights,
            biases,
            inputs,
            kernel,
        } = &convolution.filters;
        let shapes = convolution.inputs.iter().map(|input| self.shape(input.map));
        let channels: usize = shapes.clone().map(|shape| shape.channels).sum();
        if channels != *inputs || channels == 0 || kernel % 2 == 0 || convolution.stride == 0 {
            return Err(misfit("a convolution's input", vec![channels], vec![*inputs]));
        }
        let fan_in = inputs * kernel * kernel;
        if weights.len() != biases.len() * fan_in || biases.is_empty() {
            return Err(misfit("filters", vec![weights.len()], vec![biases.len(), fan_in]));
        }
        let sizes: Vec<[usize; 2]> = convolution.inputs.iter().zip(shapes).map(|(i, s)| i.size(s)).collect();
        if let Some(other) = sizes.iter().find(|size| **size != sizes[0] || size.contains(&0)) {
            return Err(misfit("an input", other.to_vec(), sizes[0].to_vec()));
        }
        let [height, width] = sizes[0].map(|side| side.div_ceil(convolution.stride));
        let output = MapShape {
            channels: biases.len(),
            height,
            width,
        };
        self.check_added(convolution.added, output)?;
        Ok(self.step(Operation::Convolve(convolution), output))
    }

    /// Adds a sum of two maps.
    ///
    /// # Errors
    /// [`PlanError::Shape`] when their sizes do not fit.
    pub fn add(&mut self, map: MapId, added: Added) -> Result<MapId, PlanError> {
        let shape = self.shape(map);
        self.check_added(Some(added), shape)?;
        Ok(self.step(Operation::Add(map, added), shape))
    }

    /// For each map its buffer, and the buffers' lengths, when maps have `padded` channels. Maps that no step makes, and those of
    /// `kept`, have buffers of their own.
    pub(crate) fn shared_buffers(&self, kept: &[MapId], padded: fn(usize) -> usize) -> (Vec<usize>, Vec<usize>) {
        let length = |shape: &MapShape| shape.height * shape.width * padded(shape.channels);
        let mut last_read = vec![0; self.maps.len()];
        for (k, step) in self.steps.iter().enumerate() {
            step.reads().for_each(|map| last_read[map.0] = k);
        }
        let is_made = |map: usize| self.steps.iter().any(|step| step.output.0 == map);
        let (mut slots, mut sizes) = (vec![usize::MAX; self.maps.len()], Vec::new());
        let own: Vec<bool> = (0..self.maps.len())
            .map(|map| !is_made(map) || kept.contains(&MapId(map)))
            .collect();
        for map in (0..self.maps.len()).filter(|&map| own[map]) {
            slots[map] = sizes.len();
            sizes.push(length(&self.maps[map]));
        }
        let mut free: Vec<usize> = Vec::new();
        for (k, step) in self.steps.iter().enumerate() {
            let map = step.output.0;
            if !own[map] {
                let needed = length(&self.maps[map]);
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

    /// Adds a pooling; its result is a new map of floor((size + 2 border - 3) / stride) + 1.
    ///
    /// # Errors
    /// [`PlanError::Shape`] for a map that is smaller than a window, and for a border of more than 1.
    pub fn pool(&mut self, pool: Pool) -> Result<MapId, PlanError> {
        let shape = self.shape(pool.map);
        let sides = [shape.height, shape.width].map(|side| side + 2 * pool.border);
        if sides.iter().any(|&side| side < 3) || pool.border > 1 || pool.stride == 0 {
            return Err(misfit("what is pooled", sides.to_vec(), vec![3, 3]));
        }
        let [height, width] = sides.map(|side| (side - 3) / pool.stride + 1);
        Ok(self.step(Operation::Pool(pool), MapShape { height, width, ..shape }))
    }

    /// Adds a dense layer; its result is a new map of one place.
    ///
    /// # Errors
    /// [`PlanError::Shape`] when map and weights do not fit each other.
    pub fn dense(&mut self, dense: Dense) -> Result<MapId, PlanError> {
        let shape = self.shape(dense.map);
        let inputs = shape.channels * shape.height * shape.width;
        let channels = dense.biases.len();
        if dense.weights.len() != inputs * channels || dense.weights.is_empty() {
            return Err(misfit(
                "dense weights",
                vec![dense.weights.len()],
                vec![inputs, channels],
            ));
        }
        let (height, width) = (1, 1);
        let output = MapShape {
            channels,
            height,
            width,
        };
        Ok(self.step(Operation::Dense(dense), output))
    }

    fn step(&mut self, operation: Operation, output: MapShape) -> MapId {
        let output = self.input(output);
        self.steps.push(Step { operation, output });
        output
    }

    fn check_added(&self, added: Option<Added>, output: MapShape) -> Result<(), PlanError> {
        let Some(Added { map, factor, top }) = added else {
            return Ok(());
        };
        let map = self.shape(map);
        let fits = factor > 0 && factor * map.height >= output.height + top;
        if fits && map.width == output.width.div_ceil(factor) && map.channels == output.channels {
            return Ok(());
        }
        let sizes = |s: MapShape| vec![s.channels, s.height, s.width];
        Err(misfit("what is added", sizes(map), sizes(output)))
    }
}

fn misfit(what: &str, actual: Vec<usize>, expected: Vec<usize>) -> PlanError {
    PlanError::Shape {
        what: what.to_owned(),
        actual,
        expected,
    }
}
