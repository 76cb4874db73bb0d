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

/// What is added to a convolution's result.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Added {
    /// A map of the same size.
    Same(MapId),
    /// A map of half the size, rounded up; each of its places counts for two by two.
    Doubled(MapId),
}

/// A map that a convolution reads.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Input {
    /// The map.
    pub map: MapId,
    /// Whether its negative values are read as zero (relu).
    pub rectified: bool,
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
}

/// What a step does.
#[derive(Clone, Debug)]
pub(crate) enum Operation {
    Convolve(Convolution),
    Add(MapId, Added),
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
        };
        let added = added.map(|(Added::Same(map) | Added::Doubled(map))| map);
        inputs.iter().map(|input| input.map).chain(map).chain(added)
    }
}

/// Why something cannot be planned.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum PlanError {
    /// A network of another architecture.
    #[error("no plan is made of a network of the architecture {0}")]
    Architecture(&'static str),
    /// Weights are absent.
    #[error("the network has no weights {0}")]
    Missing(String),
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
        let shapes: Vec<MapShape> = convolution.inputs.iter().map(|input| self.shape(input.map)).collect();
        let channels: usize = shapes.iter().map(|shape| shape.channels).sum();
        if channels != *inputs || channels == 0 || kernel % 2 == 0 || convolution.stride == 0 {
            return Err(misfit("a convolution's input", vec![channels], vec![*inputs]));
        }
        let fan_in = inputs * kernel * kernel;
        if weights.len() != biases.len() * fan_in || biases.is_empty() {
            return Err(misfit("filters", vec![weights.len()], vec![biases.len(), fan_in]));
        }
        let MapShape { height, width, .. } = shapes[0];
        if let Some(other) = shapes.iter().find(|s| (s.height, s.width) != (height, width)) {
            return Err(misfit(
                "a second input",
                vec![other.height, other.width],
                vec![height, width],
            ));
        }
        let output = MapShape {
            channels: biases.len(),
            height: height.div_ceil(convolution.stride),
            width: width.div_ceil(convolution.stride),
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

    fn step(&mut self, operation: Operation, output: MapShape) -> MapId {
        let output = self.input(output);
        self.steps.push(Step { operation, output });
        output
    }

    fn check_added(&self, added: Option<Added>, output: MapShape) -> Result<(), PlanError> {
        let (actual, expected) = match added {
            None => return Ok(()),
            Some(Added::Same(map)) => (self.shape(map), output),
            Some(Added::Doubled(map)) => {
                let (height, width) = (output.height.div_ceil(2), output.width.div_ceil(2));
                (
                    self.shape(map),
                    MapShape {
                        height,
                        width,
                        ..output
                    },
                )
            }
        };
        let sizes = |s: MapShape| vec![s.channels, s.height, s.width];
        if actual == expected {
            return Ok(());
        }
        Err(misfit("what is added", sizes(actual), sizes(expected)))
    }
}

fn misfit(what: &str, actual: Vec<usize>, expected: Vec<usize>) -> PlanError {
    PlanError::Shape {
        what: what.to_owned(),
        actual,
        expected,
    }
}
