//! Pictures at halving sizes.

use deepsft_geometry::{GreyMipmap, ImageSize, MipLevel, Picture};

#[test]
fn an_edge_stays_where_it_is_on_every_level_also_of_an_odd_size() {
    // Black up to u = 0.8. A level of 46.4 texels that is taken for one of 46 has its edge 0.3 texels off.
    let picture = Picture::from_fn(1485, 1050, |x, _| [if x < 1188 { 0 } else { 255 }; 3]);
    let mipmap = GreyMipmap::new(&picture, 8);
    for level in (0..6).map(|number| mipmap.level(number)) {
        let columns = level.extent()[0];
        let mut u = 0.0;
        while level.sample([u, 0.5]) < 127.5 {
            u += 1e-4;
        }
        let off = (u - 0.8) * columns;
        // An edge within a texel makes it grey: interpolation finds the edge to a quarter of a texel.
        assert!(off.abs() < 0.26, "{off} texels of {columns}");
    }
}

#[test]
fn the_levels_end_at_the_shortest_side_or_at_a_single_pixel() {
    let picture = Picture::from_fn(40, 9, |_, _| [7; 3]);
    let levels = std::iter::successors(Some(MipLevel::finest(picture.clone())), MipLevel::coarser);
    let sizes: Vec<_> = levels.map(|level| level.picture.size()).collect();
    assert_eq!(
        sizes,
        [(40, 9), (20, 4), (10, 2), (5, 1), (2, 1), (1, 1)].map(ImageSize::from)
    );
    for (shortest, last) in [(9, 0), (8, 1), (0, 5)] {
        let mipmap = GreyMipmap::new(&picture, shortest);
        // Beyond the last level comes the last again.
        for number in 0..8 {
            let halved = 2.0_f32.powi(number.min(last));
            let extent = mipmap.level(number as usize).extent();
            assert_eq!(extent, [40.0 / halved, 9.0 / halved], "{shortest}, {number}");
        }
    }
}
