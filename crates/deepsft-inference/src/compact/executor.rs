//! The compact network on the processor.

use super::cell_maps::CellMaps;
use super::cells::{LinearSample, cells, expected_coordinate, interpolated, upsampled};
use super::depths::{DepthMeasure, MEASURED, departures, weighed};
use super::network::{CUES, CompactPlan};
use super::patches::{PATCH, write_patches};
use crate::config::NetworkConfig;
use crate::cpu::CpuPlan;
use crate::plan::PlanError;
use crate::weights::Weights;
use deepsft_geometry::Picture;
use pulp::Arch;

/// What the compact network computes around its plan on the processor, for images of one size.
#[derive(Debug)]
pub(crate) struct CompactFrame {
    network: CompactPlan,
    arch: Arch,
    measure: DepthMeasure,
    /// Probability that a cell shows the object.
    seen: Vec<f32>,
    measured: Vec<[f32; MEASURED]>,
    pub(crate) cell_maps: CellMaps,
    /// The coordinates of bins.
    coarse: [Vec<f32>; 4],
    /// Cells from bins: rows and columns.
    cells_from_bins: [Vec<LinearSample>; 2],
}

impl CompactFrame {
    /// The plan, and what is computed around it.
    pub(crate) fn new(
        config: &NetworkConfig,
        image: [usize; 2],
        weights: &Weights,
        threads: usize,
    ) -> Result<(CpuPlan, Self), PlanError> {
        let mut network = CompactPlan::new(image, config, weights)?;
        let kept = [&[network.bins, network.offset, network.mask][..], &network.corrections].concat();
        let cpu = CpuPlan::new(std::mem::take(&mut network.plan), &kept, threads);
        let [rows, columns] = cells(image);
        let frame = Self {
            measure: DepthMeasure::new(image, config),
            seen: vec![0.0; rows * columns],
            measured: vec![[0.0; MEASURED]; rows * columns],
            cell_maps: CellMaps::new(image, config, cpu.threads()),
            coarse: [(); 4].map(|()| vec![0.0; rows * columns / 4]),
            cells_from_bins: [rows / 2, columns / 2].map(|length| upsampled(length, 2)),
            arch: Arch::new(),
            network,
        };
        Ok((cpu, frame))
    }

    /// Takes an image of the right size through the network.
    pub(crate) fn run(&mut self, cpu: &mut CpuPlan, image: &Picture) {
        write_patches(cpu, self.network.image, image);
        let [depth, registration] = self.network.marks;
        cpu.run(0..depth);
        self.read_main(cpu);
        self.write_cues(cpu, 0);
        cpu.run(depth..registration);
        self.refine_depth(cpu);
        self.write_cues(cpu, 1);
        cpu.run(registration..cpu.steps());
        self.refine_registration(cpu);
    }

    /// The mask's logits of the last image, by the patch and the place within it.
    pub(crate) fn mask<'a>(&self, cpu: &'a CpuPlan) -> impl Fn(usize, usize) -> f32 + Sync + use<'a> {
        let (logits, pitch) = (cpu.values(self.network.mask), cpu.pitch(self.network.mask));
        move |patch, within| logits[patch * pitch + within]
    }

    /// Coordinates of cells from bins and offsets, and how much the mask shows of each.
    fn read_main(&mut self, cpu: &CpuPlan) {
        let network = &self.network;
        let mut first = 0;
        for (coarse, &bins) in self.coarse.iter_mut().zip(&self.network.layers.bins) {
            for (coordinate, logits) in coarse.iter_mut().zip(cpu.positions(network.bins)) {
                *coordinate = expected_coordinate(&logits[first..first + bins]);
            }
            first += bins;
        }
        let [rows, columns] = &self.cells_from_bins;
        let cells = self.seen.iter_mut().zip(cpu.positions(network.offset)).enumerate();
        for (cell, (seen, offset)) in cells {
            let (row, column) = (cell / columns.len(), cell % columns.len());
            let said = self.cell_maps.main.iter_mut().zip(&self.coarse).zip(offset);
            for ((main, coarse), offset) in said.take(network.layers.bins.len()) {
                let position = interpolated(coarse, columns.len() / 2, rows[row], columns[column]);
                main[cell] = position + offset;
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
        let main = self.cell_maps.main.each_ref().map(Vec::as_slice);
        self.measure.measure(self.arch, main, &self.seen, &mut self.measured);
    }

    /// The cues of the depth refinement (0) or the registration refinement (1), which reads the refined depth.
    fn write_cues(&self, cpu: &mut CpuPlan, block: usize) {
        let pitch = cpu.pitch(self.network.cues[block]);
        let values = cpu.values_mut(self.network.cues[block]);
        let CellMaps { main, refined, .. } = &self.cell_maps;
        let depth = &[main, refined][block][2];
        for (cell, cues) in values.chunks_exact_mut(pitch).take(depth.len()).enumerate() {
            (cues[0], cues[1], cues[2]) = (main[0][cell], main[1][cell], depth[cell]);
            cues[3..3 + MEASURED].copy_from_slice(&departures(&self.measured[cell], depth[cell]));
            if let Some(&z) = main[3].get(cell) {
                cues[CUES] = z;
            }
        }
    }

    fn refine_depth(&mut self, cpu: &CpuPlan) {
        let said = cpu.positions(self.network.corrections[0]);
        for (cell, (depth, said)) in self.cell_maps.refined[2].iter_mut().zip(said).enumerate() {
            let [_, _, narrow, wide] = self.measured[cell];
            *depth = weighed([self.cell_maps.main[2][cell], narrow, wide], &said[1..]) + said[0];
        }
    }

    fn refine_registration(&mut self, cpu: &CpuPlan) {
        for (cell, said) in cpu.positions(self.network.corrections[1]).enumerate() {
            // The third coordinate is the depth.
            for (k, said) in [0, 1, 3].into_iter().zip(said).take(self.network.layers.bins.len() - 1) {
                self.cell_maps.refined[k][cell] = self.cell_maps.main[k][cell] + said;
            }
        }
    }
}
