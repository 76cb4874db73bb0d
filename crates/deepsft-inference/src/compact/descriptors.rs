//! The descriptor network: the trunk of a compact network with one head.

use super::cells::cells;
use super::network::{RELU_GAIN, Trunk};
use super::patches::write_patches;
use crate::config::CompactConfig;
use crate::cpu::{CpuPlan, with_team};
use crate::plan::{MapId, MapShape, Plan, PlanError};
use crate::weights::{PlanBuilder, Weights};
use deepsft_geometry::{GeometryError, ImageSize, Picture, check_size};

/// Length of a descriptor, in numbers.
pub const DESCRIPTOR_LENGTH: usize = 64;

/// Keeps the division by a descriptor's length finite.
const LENGTH_FLOOR: f32 = 1e-12;

/// Computes a descriptor for each cell of an image, for images of one size, on the processor.
#[derive(Debug)]
pub struct DescriptorExecutor {
    cpu: CpuPlan,
    image: MapId,
    descriptors: MapId,
    size: ImageSize,
}

impl DescriptorExecutor {
    /// Gets the network ready for images of `size`, see [`crate::Executor::new`].
    ///
    /// # Errors
    /// [`PlanError`] when `weights` are not those of such a network.
    pub fn new(size: impl Into<ImageSize>, weights: &Weights, threads: usize) -> Result<Self, PlanError> {
        let size = size.into();
        let mut builder = PlanBuilder::new(weights, RELU_GAIN);
        let trunk = Trunk::new(&mut builder, [size.width, size.height], &CompactConfig::default())?;
        let descriptors = builder.layer(&[trunk.at8.relu()], "head", [DESCRIPTOR_LENGTH, 1, 1], None)?;
        Ok(Self {
            // Its file also has the heads of a main block, which nothing reads.
            cpu: CpuPlan::new(builder.plan, &[descriptors], threads),
            image: trunk.image,
            descriptors,
            size,
        })
    }

    /// Returns the size of the images.
    pub fn size(&self) -> ImageSize {
        self.size
    }

    /// Returns the columns and rows of cells of 8 pixels; the image is padded to an even number of them.
    pub fn cells(&self) -> (usize, usize) {
        let [rows, columns] = cells([self.size.width, self.size.height]);
        (columns, rows)
    }

    /// Computes the unit vectors of all cells, row after row, [`DESCRIPTOR_LENGTH`] numbers each.
    ///
    /// # Errors
    /// [`GeometryError`] when the image has another size.
    pub fn describe(&mut self, image: &Picture) -> Result<Vec<f32>, GeometryError> {
        check_size(image.size(), self.size)?;
        let steps = 0..self.cpu.steps();
        with_team(self.cpu.threads(), || {
            write_patches(&mut self.cpu, self.image, image);
            self.cpu.run(steps);
        });
        let cells = self.cpu.shape(self.descriptors).area();
        let mut descriptors = Vec::with_capacity(cells * DESCRIPTOR_LENGTH);
        for descriptor in self.cpu.positions(self.descriptors) {
            let square: f32 = descriptor.iter().map(|value| value * value).sum();
            let length = (square + LENGTH_FLOOR).sqrt();
            descriptors.extend(descriptor.iter().map(|value| value / length));
        }
        Ok(descriptors)
    }
}

/// Computes the similarities (dot products) of descriptors with many others, a batch at a time.
#[derive(Debug)]
pub struct DescriptorSimilarities {
    cpu: CpuPlan,
    vectors: MapId,
    products: MapId,
}

impl DescriptorSimilarities {
    /// Prepares products with `others`, vectors of [`DESCRIPTOR_LENGTH`] numbers one after another, of `batch` vectors at a time.
    ///
    /// # Errors
    /// [`PlanError::Shape`] when `others` are no such vectors, or none.
    pub fn new(others: Vec<f32>, batch: usize, threads: usize) -> Result<Self, PlanError> {
        let mut plan = Plan::default();
        // Rows are shared among threads.
        let rows = threads.max(1);
        let vectors = plan.input(MapShape::new(DESCRIPTOR_LENGTH, rows, batch.div_ceil(rows)));
        let products = plan.multiply(vectors, others)?;
        Ok(Self {
            cpu: CpuPlan::new(plan, &[products], threads),
            vectors,
            products,
        })
    }

    /// Computes for each vector of `vectors`, at most as many as a batch has, its products with all others.
    pub fn of<'a>(&'a mut self, vectors: &[f32]) -> impl Iterator<Item = &'a [f32]> {
        let (count, pitch) = (vectors.len() / DESCRIPTOR_LENGTH, self.cpu.pitch(self.vectors));
        let positions = self.cpu.values_mut(self.vectors).chunks_exact_mut(pitch);
        for (position, vector) in positions.zip(vectors.chunks_exact(DESCRIPTOR_LENGTH)) {
            position[..DESCRIPTOR_LENGTH].copy_from_slice(vector);
        }
        self.cpu.run(0..1);
        self.cpu.positions(self.products).take(count)
    }
}
