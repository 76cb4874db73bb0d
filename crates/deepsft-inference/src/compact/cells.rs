//! Cells of the image: coordinates from classified bins, and interpolation between cells.

/// Side of a cell, pixels.
pub(super) const PIXELS_PER_CELL: usize = 8;

/// Rows and columns of cells of an image of `width` x `height` pixels, which is padded to an even number of them.
pub(super) fn cells([width, height]: [usize; 2]) -> [usize; 2] {
    [height, width].map(|side| 2 * side.div_ceil(2 * PIXELS_PER_CELL))
}

/// Bins on each side of the most likely one that the expectation runs over.
pub(super) const NEIGHBOURS: usize = 2;

/// The expected coordinate in 0..=1 of a cell: the mean of the bins' centres k / (K - 1) around the most likely one, weighed by their
/// softmax.
pub(super) fn expected_coordinate(logits: &[f32]) -> f32 {
    let mut best = 0;
    for (k, logit) in logits.iter().enumerate() {
        if *logit > logits[best] {
            best = k;
        }
    }
    let near = best.saturating_sub(NEIGHBOURS)..(best + NEIGHBOURS + 1).min(logits.len());
    let (mut sum, mut weights) = (0.0, 0.0);
    for k in near {
        let weight = (logits[k] - logits[best]).exp();
        sum += weight * k as f32;
        weights += weight;
    }
    sum / weights / (logits.len() - 1) as f32
}

/// A sample of an up-sampled signal: the two cells that it lies between, and how far towards the second.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct LinearSample {
    pub(super) cells: [usize; 2],
    pub(super) fraction: f32,
}

/// The samples of `length` cells up-sampled `factor` times: linear between the cells' centres, edges repeated.
pub(super) fn upsampled(length: usize, factor: usize) -> Vec<LinearSample> {
    let sample = |i: usize| {
        let at = ((i as f32 + 0.5) / factor as f32 - 0.5).clamp(0.0, (length - 1) as f32);
        let low = at as usize;
        LinearSample {
            // Beyond the outermost centres there is one cell, not two.
            cells: [low, low + usize::from(at > low as f32)],
            fraction: at - low as f32,
        }
    };
    (0..factor * length).map(sample).collect()
}

/// `values` of cells in rows of `columns`, at a sample.
pub(super) fn interpolated(values: &[f32], columns: usize, row: LinearSample, column: LinearSample) -> f32 {
    let along = |r: usize| {
        let [a, b] = column.cells.map(|c| values[row.cells[r] * columns + c]);
        a + (b - a) * column.fraction
    };
    let [a, b] = [along(0), along(1)];
    a + (b - a) * row.fraction
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn two_equal_neighbouring_bins_give_the_point_between_them_and_a_far_peak_does_not_pull() {
        let mut logits = vec![0.0_f32; 11];
        (logits[4], logits[5]) = (30.0, 30.0);
        assert!((expected_coordinate(&logits) - 0.45).abs() < 1e-6);
        (logits[4], logits[5], logits[10]) = (-20.0, 30.0, 29.9);
        assert!((expected_coordinate(&logits) - 0.5).abs() < 1e-6);
    }

    #[test]
    fn a_ramp_stays_a_ramp_between_the_cells_centres() {
        let columns = upsampled(4, 2);
        let row: Vec<f32> = columns
            .iter()
            .map(|&column| interpolated(&[0.0, 1.0, 2.0, 3.0], 4, LinearSample::default(), column))
            .collect();
        assert_eq!(row, [0.0, 0.25, 0.75, 1.25, 1.75, 2.25, 2.75, 3.0]);
    }
}
