//! Plans: the layers of a network in their order, and the maps between them.

/// Identifies a map of a plan.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub(crate) struct MapId(pub(crate) usize);

impl MapId {
    /// Reads the map as it is.
    pub(crate) fn plain(self) -> LayerInput {
        LayerInput {
            map: self,
            rectified: false,
            factor: 1,
            cropped: [0, 0],
        }
    }

    pub(crate) fn relu(self) -> LayerInput {
        LayerInput {
            rectified: true,
            ..self.plain()
        }
    }
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct MapShape {
    /// Values per position.
    pub(crate) channels: usize,
    pub(crate) height: usize,
    pub(crate) width: usize,
}

impl MapShape {
    pub(crate) fn new(channels: usize, height: usize, width: usize) -> Self {
        Self {
            channels,
            height,
            width,
        }
    }

    pub(crate) fn area(&self) -> usize {
        self.height * self.width
    }
}

/// Weights and biases of a convolution.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Filters {
    /// Filters, row-major [out, in, kernel, kernel].
    pub(crate) weights: Vec<f32>,
    /// One per output channel.
    pub(crate) biases: Vec<f32>,
    /// Channels that are read, those of all input maps together.
    pub(crate) inputs: usize,
    /// Side of the square kernel, odd; the border is padded with kernel / 2 zeros.
    pub(crate) kernel: usize,
}

/// A map that a skip connection adds to a result: position (y, x) gets the map's ((y + top) / factor, x / factor).
///
/// What the map has beyond the result is not read.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct SkipInput {
    pub(crate) map: MapId,
    /// How often each of its positions counts, across and down (nearest up-sampling).
    pub(crate) factor: usize,
    /// Rows of the up-sampled map above the result's first.
    pub(crate) top: usize,
}

impl SkipInput {
    /// Adds a map of the same size.
    pub(crate) fn same(map: MapId) -> Self {
        let (factor, top) = (1, 0);
        Self { map, factor, top }
    }

    /// Adds a map of half the size, rounded up, twice up-sampled.
    pub(crate) fn doubled(map: MapId) -> Self {
        let (factor, top) = (2, 0);
        Self { map, factor, top }
    }
}

/// A map that a convolution reads.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct LayerInput {
    pub(crate) map: MapId,
    /// Whether its negative values are read as zero (relu).
    pub(crate) rectified: bool,
    /// How often each of its positions is read, across and down (nearest up-sampling).
    pub(crate) factor: usize,
    /// Rows of the up-sampled map that are left out: at the top and at the bottom.
    pub(crate) cropped: [usize; 2],
}

impl LayerInput {
    /// Rows and columns that are read of a map of this size.
    pub(crate) fn size(&self, shape: MapShape) -> [usize; 2] {
        let [top, bottom] = self.cropped;
        let rows = (self.factor * shape.height).saturating_sub(top + bottom);
        [rows, self.factor * shape.width]
    }
}

#[derive(Clone, Debug)]
pub(crate) struct Convolution {
    /// What it reads, one after another along the channels.
    pub(crate) inputs: Vec<LayerInput>,
    pub(crate) filters: Filters,
    /// Distance of the positions where it is applied.
    pub(crate) stride: usize,
    pub(crate) skip: Option<SkipInput>,
    /// Whether negative sums are written as zero (relu).
    pub(crate) rectified: bool,
}

impl Convolution {
    /// Makes a convolution of stride 1 without relu or skip connection.
    pub(crate) fn new(inputs: Vec<LayerInput>, filters: Filters) -> Self {
        Self {
            inputs,
            filters,
            stride: 1,
            skip: None,
            rectified: false,
        }
    }

    /// Returns the padded channel of each of a filter's channels, and the number of padded channels: inputs are padded map by map.
    pub(crate) fn input_channels(&self, shapes: &[MapShape], padded: fn(usize) -> usize) -> (Vec<usize>, usize) {
        let (mut all, mut first) = (Vec::new(), 0);
        for input in &self.inputs {
            let channels = shapes[input.map.0].channels;
            all.extend(first..first + channels);
            first += padded(channels);
        }
        (all, first)
    }
}

/// A pooling: the largest values of windows of 3 x 3 positions.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct MaxPool {
    pub(crate) map: MapId,
    /// Distance of the windows.
    pub(crate) stride: usize,
    /// Positions by which the first window lies outside, above and to the left: 0 or 1. They never win.
    pub(crate) border: usize,
}

/// A dense layer: every output from all values of a map.
#[derive(Clone, Debug)]
pub(crate) struct DenseLayer {
    pub(crate) map: MapId,
    /// Row-major [channel, row, column, output].
    pub(crate) weights: Vec<f32>,
    /// One per output.
    pub(crate) biases: Vec<f32>,
    /// Whether negative sums are written as zero (relu).
    pub(crate) rectified: bool,
}

/// The layer of a step.
#[derive(Clone, Debug)]
pub(crate) enum Operation {
    Convolve(Convolution),
    Add(MapId, SkipInput),
    Pool(MaxPool),
    Dense(DenseLayer),
}

/// A step of a plan: makes a map.
#[derive(Clone, Debug)]
pub(crate) struct Step {
    pub(crate) operation: Operation,
    pub(crate) output: MapId,
}

impl Step {
    pub(crate) fn reads(&self) -> Vec<MapId> {
        match &self.operation {
            Operation::Convolve(Convolution { inputs, skip, .. }) => {
                let skipped = skip.map(|skip| skip.map);
                inputs.iter().map(|input| input.map).chain(skipped).collect()
            }
            Operation::Add(map, skip) => vec![*map, skip.map],
            Operation::Pool(MaxPool { map, .. }) | Operation::Dense(DenseLayer { map, .. }) => vec![*map],
        }
    }
}

/// Reports why a network or a layer cannot be planned.
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

/// The layers of a network in their order, and the maps between them. The caller writes the maps that no layer makes.
#[derive(Clone, Debug, Default)]
pub(crate) struct Plan {
    pub(crate) maps: Vec<MapShape>,
    pub(crate) steps: Vec<Step>,
}

impl Plan {
    /// Adds a map that the caller writes.
    pub(crate) fn input(&mut self, shape: MapShape) -> MapId {
        self.maps.push(shape);
        MapId(self.maps.len() - 1)
    }

    pub(crate) fn shape(&self, map: MapId) -> MapShape {
        self.maps[map.0]
    }

    /// Number of steps so far: marks where the caller takes over.
    pub(crate) fn steps(&self) -> usize {
        self.steps.len()
    }

    /// Adds a convolution; its result is a new map of ceil(size / stride).
    pub(crate) fn convolve(&mut self, convolution: Convolution) -> Result<MapId, PlanError> {
        let filters = &convolution.filters;
        let (kernel, outputs) = (filters.kernel, filters.biases.len());
        let shapes = convolution.inputs.iter().map(|input| self.shape(input.map));
        let fan_in = filters.inputs * kernel * kernel;
        if filters.weights.len() != outputs * fan_in || outputs == 0 {
            return Err(misfit("filters", &[filters.weights.len()], &[outputs, fan_in]));
        }
        let sizes: Vec<[usize; 2]> = convolution.inputs.iter().zip(shapes).map(|(i, s)| i.size(s)).collect();
        if let Some(other) = sizes.iter().find(|size| **size != sizes[0] || size.contains(&0)) {
            return Err(misfit("an input", other, &sizes[0]));
        }
        let [height, width] = sizes[0].map(|side| side.div_ceil(convolution.stride));
        let output = MapShape::new(outputs, height, width);
        Ok(self.step(Operation::Convolve(convolution), output))
    }

    /// Adds the product of each position's channels with a matrix, row-major [out, in].
    pub(crate) fn multiply(&mut self, map: MapId, weights: Vec<f32>) -> Result<MapId, PlanError> {
        let inputs = self.shape(map).channels;
        let filters = Filters {
            biases: vec![0.0; weights.len() / inputs],
            weights,
            inputs,
            kernel: 1,
        };
        self.convolve(Convolution::new(vec![map.plain()], filters))
    }

    /// Adds a sum of two maps.
    pub(crate) fn add(&mut self, map: MapId, skip: SkipInput) -> MapId {
        self.step(Operation::Add(map, skip), self.shape(map))
    }

    /// For each map its buffer, and the buffers' lengths, when maps have `padded` channels. Maps that no step makes, and those of
    /// `kept`, have buffers of their own.
    pub(crate) fn shared_buffers(&self, kept: &[MapId], padded: fn(usize) -> usize) -> (Vec<usize>, Vec<usize>) {
        let length = |shape: &MapShape| shape.area() * padded(shape.channels);
        let mut last_read = vec![0; self.maps.len()];
        for (k, step) in self.steps.iter().enumerate() {
            step.reads().into_iter().for_each(|map| last_read[map.0] = k);
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
                slots[map] = best.map_or(sizes.len(), |f| free.swap_remove(f));
                sizes.resize(sizes.len().max(slots[map] + 1), 0);
                sizes[slots[map]] = sizes[slots[map]].max(needed);
            }
            let mut read: Vec<usize> = step.reads().into_iter().map(|map| map.0).chain([map]).collect();
            read.sort_unstable();
            read.dedup();
            let done = read.into_iter().filter(|&map| !own[map] && last_read[map] <= k);
            free.extend(done.map(|map| slots[map]));
        }
        (slots, sizes)
    }

    /// Adds a pooling; its result is a new map of floor((size + 2 border - 3) / stride) + 1.
    pub(crate) fn pool(&mut self, pool: MaxPool) -> MapId {
        let shape = self.shape(pool.map);
        let [height, width] = [shape.height, shape.width].map(|side| (side + 2 * pool.border - 3) / pool.stride + 1);
        self.step(Operation::Pool(pool), MapShape { height, width, ..shape })
    }

    /// Adds a dense layer; its result is a new map of one position.
    pub(crate) fn dense(&mut self, dense: DenseLayer) -> Result<MapId, PlanError> {
        let shape = self.shape(dense.map);
        let inputs = shape.channels * shape.area();
        let channels = dense.biases.len();
        if dense.weights.len() != inputs * channels || dense.weights.is_empty() {
            return Err(misfit("dense weights", &[dense.weights.len()], &[inputs, channels]));
        }
        Ok(self.step(Operation::Dense(dense), MapShape::new(channels, 1, 1)))
    }

    fn step(&mut self, operation: Operation, output: MapShape) -> MapId {
        let output = self.input(output);
        self.steps.push(Step { operation, output });
        output
    }
}

pub(crate) fn misfit(what: &str, actual: &[usize], expected: &[usize]) -> PlanError {
    PlanError::Shape {
        what: what.to_owned(),
        actual: actual.to_vec(),
        expected: expected.to_vec(),
    }
}
