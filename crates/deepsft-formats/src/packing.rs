//! Where rectangles lie in a common texture.

/// Lays rectangles (width, height) into a strip of `width` texels without overlap, `gap` texels between them and around
/// them: the corner (x, y) of each, and the height that is used. Shelves, the highest rectangles first (next fit by
/// decreasing height). `None` when one is too wide.
///
/// ```
/// use deepsft_formats::pack_rectangles;
/// let (corners, height) = pack_rectangles(&[(30, 10), (30, 20), (50, 10)], 64, 1).unwrap();
/// assert_eq!(corners, [(32, 1), (1, 1), (1, 22)]);
/// assert_eq!(height, 33);
/// ```
pub fn pack_rectangles(sizes: &[(usize, usize)], width: usize, gap: usize) -> Option<(Vec<(usize, usize)>, usize)> {
    let mut order: Vec<usize> = (0..sizes.len()).collect();
    order.sort_by_key(|&i| std::cmp::Reverse(sizes[i].1));
    let mut corners = vec![(0, 0); sizes.len()];
    let (mut x, mut y, mut shelf) = (gap, gap, 0);
    for i in order {
        let (w, h) = sizes[i];
        if w + 2 * gap > width {
            return None;
        }
        if x + w + gap > width {
            (x, y, shelf) = (gap, y + shelf + gap, 0);
        }
        corners[i] = (x, y);
        x += w + gap;
        shelf = shelf.max(h);
    }
    Some((corners, y + shelf + gap))
}
