//! What of a mask is away from its edge.

/// Clears every pixel of a 0-or-1 mask (rows of `width`) within `margin` pixels, along rows and columns, of one that is
/// clear. The image's border does not count: an object that it cuts off goes on beyond.
pub(crate) fn erode(mask: &mut [f32], width: usize, margin: usize) {
    if margin == 0 || width == 0 {
        return;
    }
    let height = mask.len() / width;
    let mut line = Vec::new();
    for row in mask.chunks_exact_mut(width) {
        line.clear();
        line.extend_from_slice(row);
        erode_line(&line, margin, |x| row[x] = 0.0);
    }
    for x in 0..width {
        line.clear();
        line.extend((0..height).map(|y| mask[y * width + x]));
        erode_line(&line, margin, |y| mask[y * width + x] = 0.0);
    }
}

/// Calls `clear` with every place of `line` within `margin` of a 0.
fn erode_line(line: &[f32], margin: usize, mut clear: impl FnMut(usize)) {
    for ends in [false, true] {
        let mut since = margin;
        for k in 0..line.len() {
            let at = if ends { line.len() - 1 - k } else { k };
            since = if line[at] > 0.0 { since + 1 } else { 0 };
            if since <= margin && line[at] > 0.0 {
                clear(at);
            }
        }
    }
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
