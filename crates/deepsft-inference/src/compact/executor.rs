//! The compact network on the processor.

use super::cell_maps::CellMaps;
use super::cells::{LinearSample, cells, expected_coordinate, interpolated, upsampled};
use super::depths::{DepthMeasure, MEASURED, departures, weighed};
use super::network::CompactPlan;
use super::patches::{PATCH, write_patches};
use crate::config::NetworkConfig;
use crate::cpu::{CpuPlan, with_team};
use crate::plan::PlanError;
use crate::stage::Stage;
use crate::weights::Weights;
use deepsft_geometry::{GeometryError, ImageSize, Maps, Picture, check_size};
use pulp::Arch;

/// A compact network on the processor, for images of one size. On one thread it allocates nothing after it was made.
#[derive(Debug)]
pub(crate) struct CompactExecutor {
    network: CompactPlan,
    cpu: CpuPlan,
    arch: Arch,
    image: [usize; 2],
    measure: DepthMeasure,
    /// Probability that a cell shows the object.
    seen: Vec<f32>,
    measured: Vec<[f32; MEASURED]>,
    cell_maps: CellMaps,
    /// u, v and d of bins.
    coarse: [Vec<f32>; 3],
    /// Cells from bins: rows and columns.
    cells_from_bins: [Vec<LinearSample>; 2],
}

impl CompactExecutor {
    /// # Errors
    /// [`PlanError`] when `weights` are not those of `config`, when that is of another architecture, for an image without
    /// pixels, and for fewer than 2 bins.
    pub(crate) fn new(
        config: &NetworkConfig,
        image: ImageSize,
        weights: &Weights,
        threads: usize,
    ) -> Result<Self, PlanError> {
        let image = [image.width, image.height];
        let mut network = CompactPlan::new(image, config, weights)?;
        let kept = [&[network.bins, network.offset, network.mask][..], &network.corrections].concat();
        let cpu = CpuPlan::new(std::mem::take(&mut network.plan), &kept, threads);
        let [rows, columns] = cells(image);
        Ok(Self {
            measure: DepthMeasure::new(image, config),
            seen: vec![0.0; rows * columns],
            measured: vec![[0.0; MEASURED]; rows * columns],
            cell_maps: CellMaps::new(image, config, cpu.threads()),
            coarse: [(); 3].map(|()| vec![0.0; rows * columns / 4]),
            cells_from_bins: [rows / 2, columns / 2].map(|length| upsampled(length, 2)),
            arch: Arch::new(),
            network,
            cpu,
            image,
        })
    }

    /// See [`crate::Executor::run`].
    pub(crate) fn run(&mut self, image: &Picture) -> Result<(), GeometryError> {
        let [width, height] = self.image;
        check_size(image.size(), (width, height))?;
        with_team(self.cpu.threads(), || self.run_through(image));
        Ok(())
    }

    fn run_through(&mut self, image: &Picture) {
        write_patches(&mut self.cpu, self.network.image, image);
        let [depth, registration] = self.network.marks;
        self.cpu.run(0..depth);
        self.read_main();
        self.write_cues(0);
        self.cpu.run(depth..registration);
        self.refine_depth();
        self.write_cues(1);
        let last = self.cpu.steps();
        self.cpu.run(registration..last);
        self.refine_registration();
    }

    /// See [`crate::Executor::cells`].
    pub(crate) fn cells(&self, stage: Stage) -> [&[f32]; 3] {
        self.cell_maps.cells(stage)
    }

    /// See [`crate::Executor::mask_logit`].
    pub(crate) fn mask_logit(&self, x: usize, y: usize) -> f32 {
        let (patch, within) = self.cell_maps.index_in_mask(x, y);
        self.cpu.values(self.network.mask)[patch * self.cpu.pitch(self.network.mask) + within]
    }

    /// See [`crate::Executor::read`].
    pub(crate) fn read(&mut self, stage: Stage, seen: Option<&[bool]>, maps: &mut Maps) -> Result<(), GeometryError> {
        let (logits, pitch) = (self.cpu.values(self.network.mask), self.cpu.pitch(self.network.mask));
        self.cell_maps
            .read(stage, seen, |patch, within| logits[patch * pitch + within], maps)
    }

    /// Coordinates of cells from bins and offsets, and how much the mask shows of each.
    fn read_main(&mut self) {
        let (cpu, network) = (&self.cpu, &self.network);
        let (logits, pitch) = (cpu.values(network.bins), cpu.pitch(network.bins));
        let mut first = 0;
        for (coarse, bins) in self.coarse.iter_mut().zip(self.network.layers.bins) {
            for (coordinate, logits) in coarse.iter_mut().zip(logits.chunks_exact(pitch)) {
                *coordinate = expected_coordinate(&logits[first..first + bins]);
            }
            first += bins;
        }
        let (offsets, pitch) = (cpu.values(network.offset), cpu.pitch(network.offset));
        let [rows, columns] = &self.cells_from_bins;
        for (cell, seen) in self.seen.iter_mut().enumerate() {
            let (row, column) = (cell / columns.len(), cell % columns.len());
            for (k, (main, coarse)) in self.cell_maps.main.iter_mut().zip(&self.coarse).enumerate() {
                let position = interpolated(coarse, columns.len() / 2, rows[row], columns[column]);
                main[cell] = position + offsets[cell * pitch + k];
            }
            let (mask, pitch) = (cpu.values(network.mask), cpu.pitch(network.mask));
            let patches = [0, 1].map(|r| (2 * row + r) * 2 * columns.len() + 2 * column);
            let sum: f32 = patches
                .iter()
                .flat_map(|&patch| [patch, patch + 1])
                .map(|patch| mask[patch * pitch..][..PATCH * PATCH].iter().sum::<f32>())
                .sum();
            let logit = sum / (4 * PATCH * PATCH) as f32;
            *seen = 1.0 / (1.0 + (-logit).exp());
        }
        let [u, v, d] = &self.cell_maps.main;
        if self.network.layers.seams {
            // Nothing is measured: what was found stands in its place.
            self.measured
                .iter_mut()
                .zip(d)
                .for_each(|(measured, &d)| measured.fill(d));
        } else {
            self.measure
                .measure(self.arch, [u, v, d], &self.seen, &mut self.measured);
        }
    }

    /// The cues of the depth refinement (0) or the registration refinement (1), which reads the refined depth.
    fn write_cues(&mut self, block: usize) {
        let pitch = self.cpu.pitch(self.network.cues[block]);
        let values = self.cpu.values_mut(self.network.cues[block]);
        let depth = if block == 0 {
            &self.cell_maps.main[2]
        } else {
            &self.cell_maps.refined[2]
        };
        for (cell, cues) in values.chunks_exact_mut(pitch).take(depth.len()).enumerate() {
            (cues[0], cues[1], cues[2]) = (self.cell_maps.main[0][cell], self.cell_maps.main[1][cell], depth[cell]);
            cues[3..3 + MEASURED].copy_from_slice(&departures(&self.measured[cell], depth[cell]));
        }
    }

    fn refine_depth(&mut self) {
        let map = self.network.corrections[0];
        let (said, pitch) = (self.cpu.values(map), self.cpu.pitch(map));
        for (cell, depth) in self.cell_maps.refined[2].iter_mut().enumerate() {
            let said = &said[cell * pitch..][..4];
            let [_, _, narrow, wide] = self.measured[cell];
            *depth = weighed([self.cell_maps.main[2][cell], narrow, wide], &said[1..]) + said[0];
        }
    }

    fn refine_registration(&mut self) {
        let map = self.network.corrections[1];
        let (said, pitch) = (self.cpu.values(map), self.cpu.pitch(map));
        for k in 0..2 {
            for (cell, refined) in self.cell_maps.refined[k].iter_mut().enumerate() {
                *refined = self.cell_maps.main[k][cell] + said[cell * pitch + k];
            }
        }
    }
}
