//! How a batch is cut into parts, one per device, whose losses sum to the loss of the whole.

use burn::tensor::Tensor;

/// Sizes of at most `parts` parts of `count` things: as even as can be, the larger ones first, none empty.
pub fn part_sizes(count: usize, parts: usize) -> Vec<usize> {
    let parts = parts.clamp(1, count.max(1));
    (0..parts)
        .map(|part| count / parts + usize::from(part < count % parts))
        .collect()
}

/// `loss` times `weight`: untouched where that is 1.
pub fn weighed(loss: Tensor<1>, weight: f64) -> Tensor<1> {
    if weight == 1.0 { loss } else { loss * weight }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn parts_are_as_even_as_can_be_and_never_empty() {
        assert_eq!(part_sizes(7, 2), [4, 3]);
        assert_eq!(part_sizes(6, 3), [2, 2, 2]);
        assert_eq!(part_sizes(2, 3), [1, 1]);
        assert_eq!(part_sizes(5, 1), [5]);
        assert_eq!(part_sizes(0, 4), [0]);
    }
}
