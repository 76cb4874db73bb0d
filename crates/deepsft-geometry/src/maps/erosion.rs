//! What of a mask is away from its edge.

/// Clears every pixel of a 0-or-1 mask (rows of `width`) within `margin` pixels, along rows and columns, of one that is
/// clear. The image's border does not count: an object that it cuts off goes on beyond.
pub(crate) fn erode(mask: &mut [f32], width: usize, margin: usize) {
    if margin == 0 || width == 0 {
        return;
    }
    let mut padded = vec![1.0; width + 2 * margin];
    for row in mask.chunks_exact_mut(width) {
        padded[margin..margin + width].copy_from_slice(row);
        (0..=2 * margin).for_each(|shift| clear_where_clear(row, &padded[shift..]));
    }
    let across = mask.to_vec();
    for (y, row) in mask.chunks_exact_mut(width).enumerate() {
        let near = across.chunks_exact(width).take(y + margin + 1);
        let near = near.skip(y.saturating_sub(margin));
        near.for_each(|other| clear_where_clear(row, other));
    }
}

/// Products: compilers make vector instructions of them.
fn clear_where_clear(row: &mut [f32], other: &[f32]) {
    row.iter_mut().zip(other).for_each(|(mask, other)| *mask *= other);
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn erosion_takes_the_margin_away_but_not_at_the_images_border() {
        // Columns 2 to 9 of 10, all 6 rows but the last.
        let mut mask: Vec<f32> = (0..60).map(|i| f32::from(u8::from(i % 10 >= 2 && i < 50))).collect();
        erode(&mut mask, 10, 2);
        for (i, &m) in mask.iter().enumerate() {
            let kept = i % 10 >= 4 && i < 30;
            assert_eq!(m > 0.0, kept, "column {}, row {}", i % 10, i / 10);
        }
    }
}
