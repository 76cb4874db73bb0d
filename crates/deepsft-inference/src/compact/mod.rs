//! The compact network: its plan, and the arithmetic between its convolutions.

mod depths;
mod network;
mod positions;

use crate::config::{Architecture, NetworkConfig};
use crate::cpu::{CpuPlan, awake};
use crate::plan::{MapShape, PlanError};
use crate::stage::Stage;
use crate::weights::Weights;
use deepsft_geometry::{GeometryError, Maps, Picture, check_size};
use depths::{DepthMeasure, MEASURED, PIXELS_PER_CELL, departures, weighed};
use network::{CompactPlan, PATCH};
use positions::{Between, cells, expected_coordinate, interpolated, upsampled};
use pulp::Arch;
use std::fmt;

/// Cells beside one another whose u or v differ by more than this belong to different charts.
const SEAM_JUMP: f32 = 0.12;

/// A compact network on the processor, for images of one size. On one thread it allocates nothing after it was made.
pub struct CompactExecutor {
    network: CompactPlan,
    cpu: CpuPlan,
    arch: Arch,
    config: NetworkConfig,
    image: [usize; 2],
    bins: [usize; 3],
    seams: bool,
    measure: DepthMeasure,
    /// Probability that a cell shows the object.
    seen: Vec<f32>,
    measured: Vec<[f32; MEASURED]>,
    /// (u, v, d) of the main block and after refinement, d in normalised log depth, for each cell.
    main: [Vec<f32>; 3],
    refined: [Vec<f32>; 3],
    /// u, v and d of bins.
    coarse: [Vec<f32>; 3],
    /// Cells from bins, then pixels from cells; rows and columns.
    cells_from_bins: [Vec<Between>; 2],
    pixels_from_cells: [Vec<Between>; 2],
    /// u, v and d of the cells' columns at one row of pixels.
    line: [Vec<f32>; 3],
}

impl fmt::Debug for CompactExecutor {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("CompactExecutor")
            .field("config", &self.config)
            .finish_non_exhaustive()
    }
}

impl CompactExecutor {
    /// Gets a network ready for images of `image` (columns, rows) pixels and `threads` threads, see [`crate::available_threads`].
    ///
    /// # Errors
    /// [`PlanError`] when `weights` are not those of `config`, when that is of another architecture, for an image without
    /// pixels, and for fewer than 2 bins.
    pub fn new(
        config: &NetworkConfig,
        image: [usize; 2],
        weights: &Weights,
        threads: usize,
    ) -> Result<Self, PlanError> {
        let Architecture::Compact(layers) = &config.architecture else {
            return Err(PlanError::Architecture(config.architecture.name()));
        };
        for (what, sides, least) in [("image", &image[..], 1), ("bins", &layers.bins, 2)] {
            if sides.iter().any(|&side| side < least) {
                return Err(PlanError::Shape {
                    what: what.to_owned(),
                    actual: sides.to_vec(),
                    expected: vec![least; sides.len()],
                });
            }
        }
        let mut network = CompactPlan::new(image, layers, weights)?;
        let kept = [&[network.bins, network.offset, network.mask][..], &network.corrections].concat();
        let cpu = CpuPlan::new(std::mem::take(&mut network.plan), &kept, threads);
        let [rows, columns] = cells(image);
        let three = || [(); 3].map(|()| vec![0.0; rows * columns]);
        Ok(Self {
            measure: DepthMeasure::new(image, config),
            seen: vec![0.0; rows * columns],
            measured: vec![[0.0; MEASURED]; rows * columns],
            main: three(),
            refined: three(),
            coarse: [(); 3].map(|()| vec![0.0; rows * columns / 4]),
            cells_from_bins: [rows / 2, columns / 2].map(|length| upsampled(length, 2)),
            pixels_from_cells: [rows, columns].map(|length| upsampled(length, PIXELS_PER_CELL)),
            line: [(); 3].map(|()| vec![0.0; columns]),
            arch: Arch::new(),
            network,
            cpu,
            image,
            bins: layers.bins,
            seams: layers.seams,
            config: config.clone(),
        })
    }

    /// Takes an image of the training camera through the network.
    ///
    /// # Errors
    /// [`GeometryError`] when the image has another size.
    pub fn run(&mut self, image: &Picture) -> Result<(), GeometryError> {
        let [width, height] = self.image;
        check_size(image.size(), (width, height))?;
        awake(self.cpu.threads(), || self.run_through(image));
        Ok(())
    }

    fn run_through(&mut self, image: &Picture) {
        self.write_patches(image);
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

    /// (u, v, d) of all cells of 8 pixels, d in normalised log depth: row after row.
    pub fn cells(&self, stage: Stage) -> [&[f32]; 3] {
        let ([u, v, d], [fine_u, fine_v, fine_d]) = (&self.main, &self.refined);
        match stage {
            Stage::Main => [u, v, d],
            Stage::DepthRefinement => [u, v, fine_d],
            Stage::RegistrationRefinement => [fine_u, fine_v, fine_d],
        }
    }

    /// Logit of "the object is seen here" at a pixel of the last image.
    ///
    /// # Panics
    /// May panic for a pixel outside of the image.
    pub fn mask_logit(&self, x: usize, y: usize) -> f32 {
        let columns = self.pixels_from_cells[1].len() / PATCH;
        let patch = y / PATCH * columns + x / PATCH;
        let within = y % PATCH * PATCH + x % PATCH;
        self.cpu.values(self.network.mask)[patch * self.cpu.pitch(self.network.mask) + within]
    }

    /// Writes the maps of the last image: depth (mm) and registration at the pixels of `seen` (row-major) if given, else where the
    /// mask's probability is at least one half.
    ///
    /// # Errors
    /// [`GeometryError::MapSize`] when `maps` or `seen` have another size than the image.
    pub fn read(&mut self, stage: Stage, seen: Option<&[bool]>, maps: &mut Maps) -> Result<(), GeometryError> {
        let [width, height] = self.image;
        check_size(maps.size(), (width, height))?;
        if let Some(seen) = seen {
            check_size((seen.len(), 1), (width * height, 1))?;
        }
        let mut line = std::mem::take(&mut self.line);
        let range = self.config.depth_range;
        let (near, span) = (range.near_mm as f32, (range.far_mm / range.near_mm).ln() as f32);
        let cells = self.cells(stage);
        let columns = self.pixels_from_cells[1].len() / PIXELS_PER_CELL;
        for y in 0..height {
            let row = self.pixels_from_cells[0][y];
            for (line, cells) in line.iter_mut().zip(cells) {
                let [above, below] = row.cells.map(|r| &cells[r * columns..][..columns]);
                for (value, (a, b)) in line.iter_mut().zip(above.iter().zip(below)) {
                    *value = a + (b - a) * row.fraction;
                }
            }
            for (x, &column) in self.pixels_from_cells[1].iter().enumerate().take(width) {
                let pixel = y * width + x;
                if !seen.map_or_else(|| self.mask_logit(x, y) >= 0.0, |seen| seen[pixel]) {
                    maps.clear(pixel);
                    continue;
                }
                let [mut u, mut v, d] = [0, 1, 2].map(|k| {
                    let [a, b] = column.cells.map(|c| line[k][c]);
                    a + (b - a) * column.fraction
                });
                if self.seams && cells[..2].iter().any(|map| jumps(map, columns, row, column)) {
                    let cell = y / PIXELS_PER_CELL * columns + x / PIXELS_PER_CELL;
                    (u, v) = (cells[0][cell], cells[1][cell]);
                }
                maps.set(pixel, near * (d * span).exp(), [u, v]);
            }
        }
        self.line = line;
        Ok(())
    }

    /// Patches of 4 x 4 pixels, the channels of the image one after another, values -2..=2; black where the image is padded.
    fn write_patches(&mut self, image: &Picture) {
        let (MapShape { width, .. }, pitch) = (self.cpu.shape(self.network.image), self.cpu.pitch(self.network.image));
        let values = self.cpu.values_mut(self.network.image);
        let line = 3 * image.width();
        for (index, patch) in values.chunks_exact_mut(pitch).enumerate() {
            let (left, top) = (PATCH * (index % width), PATCH * (index / width));
            for row in 0..PATCH {
                let known = image.rgb().get((top + row) * line..).unwrap_or_default();
                let known = &known[..known.len().min(line)];
                let known = known.get(3 * left..).unwrap_or_default();
                for column in 0..PATCH {
                    for channel in 0..3 {
                        let value = known.get(3 * column + channel).copied().unwrap_or_default();
                        patch[(channel * PATCH + row) * PATCH + column] = f32::from(value) * (4.0 / 255.0) - 2.0;
                    }
                }
            }
        }
    }

    /// Coordinates of cells from bins and offsets, and how much the mask shows of each.
    fn read_main(&mut self) {
        let (cpu, network) = (&self.cpu, &self.network);
        let (logits, pitch) = (cpu.values(network.bins), cpu.pitch(network.bins));
        let mut first = 0;
        for (coarse, bins) in self.coarse.iter_mut().zip(self.bins) {
            for (coordinate, logits) in coarse.iter_mut().zip(logits.chunks_exact(pitch)) {
                *coordinate = expected_coordinate(&logits[first..first + bins]);
            }
            first += bins;
        }
        let (offsets, pitch) = (cpu.values(network.offset), cpu.pitch(network.offset));
        let [rows, columns] = &self.cells_from_bins;
        for (cell, seen) in self.seen.iter_mut().enumerate() {
            let (row, column) = (cell / columns.len(), cell % columns.len());
            for (k, (main, coarse)) in self.main.iter_mut().zip(&self.coarse).enumerate() {
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
        let [u, v, d] = &self.main;
        if self.seams {
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
        let depth = if block == 0 { &self.main[2] } else { &self.refined[2] };
        for (cell, cues) in values.chunks_exact_mut(pitch).take(depth.len()).enumerate() {
            (cues[0], cues[1], cues[2]) = (self.main[0][cell], self.main[1][cell], depth[cell]);
            cues[3..3 + MEASURED].copy_from_slice(&departures(&self.measured[cell], depth[cell]));
        }
    }

    fn refine_depth(&mut self) {
        let map = self.network.corrections[0];
        let (said, pitch) = (self.cpu.values(map), self.cpu.pitch(map));
        for (cell, depth) in self.refined[2].iter_mut().enumerate() {
            let said = &said[cell * pitch..][..4];
            let [_, _, narrow, wide] = self.measured[cell];
            *depth = weighed([self.main[2][cell], narrow, wide], &said[1..]) + said[0];
        }
    }

    fn refine_registration(&mut self) {
        let map = self.network.corrections[1];
        let (said, pitch) = (self.cpu.values(map), self.cpu.pitch(map));
        for k in 0..2 {
            for (cell, refined) in self.refined[k].iter_mut().enumerate() {
                *refined = self.main[k][cell] + said[cell * pitch + k];
            }
        }
    }
}

/// Whether the four cells around a sample are of different charts.
fn jumps(map: &[f32], columns: usize, row: Between, column: Between) -> bool {
    let (mut least, mut most) = (f32::MAX, f32::MIN);
    for r in row.cells {
        for c in column.cells {
            let value = map[r * columns + c];
            (least, most) = (least.min(value), most.max(value));
        }
    }
    most - least > SEAM_JUMP
}
