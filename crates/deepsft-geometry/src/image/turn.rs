//! Quarter turns of row-major pixels.

/// Pixels in rows of `width`, turned by a quarter clockwise: the first row becomes the last column.
pub fn turned_clockwise<T: Copy>(pixels: &[T], width: usize) -> Vec<T> {
    let column = |x: usize| pixels[x..].iter().step_by(width).rev();
    (0..width.min(pixels.len())).flat_map(column).copied().collect()
}

/// Pixels in rows of `width`, turned by a quarter anticlockwise: the first row becomes the first column, read upwards.
pub fn turned_anticlockwise<T: Copy>(pixels: &[T], width: usize) -> Vec<T> {
    let column = |x: usize| pixels[x..].iter().step_by(width);
    (0..width.min(pixels.len())).rev().flat_map(column).copied().collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_quarter_turn_moves_the_corners_and_the_opposite_one_undoes_it() {
        let pixels = [1, 2, 3, 4, 5, 6];
        assert_eq!(turned_clockwise(&pixels, 3), [4, 1, 5, 2, 6, 3]);
        assert_eq!(turned_anticlockwise(&pixels, 3), [3, 6, 2, 5, 1, 4]);
        assert_eq!(turned_anticlockwise(&turned_clockwise(&pixels, 3), 2), pixels);
        assert_eq!(turned_clockwise::<u8>(&[], 3), []);
    }
}
