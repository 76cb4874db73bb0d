use super::*;
use std::path::Path;
use std::sync::OnceLock;

/// Pixels per mm of the texture.
const SCALE: usize = 5;

/// The artwork inside the margins: left, top, right, bottom in mm.
const ART: [usize; 4] = [6, 6, 291, 204];

fn poster() -> &'static Picture {
    static POSTER: OnceLock<Picture> = OnceLock::new();
    POSTER.get_or_init(|| poster_a4_picture().unwrap())
}

/// Luminance (BT.601) from 0 to 255.
fn grey([r, g, b]: [u8; 3]) -> f64 {
    0.299 * f64::from(r) + 0.587 * f64::from(g) + 0.114 * f64::from(b)
}

/// Mean luminance of blocks of `side` x `side` pixels, row-major, with the number of columns.
fn grey_blocks(picture: &Picture, side: usize) -> (Vec<f64>, usize) {
    let (columns, rows) = (picture.width() / side, picture.height() / side);
    let block = |row: usize, column: usize| {
        let pixels = (0..side * side).map(|i| picture.pixel(column * side + i % side, row * side + i / side));
        pixels.map(grey).sum::<f64>() / (side * side) as f64
    };
    (
        (0..rows * columns).map(|i| block(i / columns, i % columns)).collect(),
        columns,
    )
}

fn standard_deviation(values: &[f64]) -> f64 {
    let mean = values.iter().sum::<f64>() / values.len() as f64;
    (values.iter().map(|v| (v - mean).powi(2)).sum::<f64>() / values.len() as f64).sqrt()
}

/// The least standard deviation of grey over all squares of `side` mm of the artwork, `step` mm apart.
fn min_contrast(side: usize, step: usize) -> f64 {
    let [left, top, right, bottom] = ART;
    let mut least = f64::INFINITY;
    for y in (top..=bottom - side).step_by(step) {
        for x in (left..=right - side).step_by(step) {
            let n = side * SCALE;
            let cell: Vec<f64> = (0..n * n)
                .map(|i| grey(poster().pixel(x * SCALE + i % n, y * SCALE + i / n)))
                .collect();
            least = least.min(standard_deviation(&cell));
        }
    }
    least
}

#[test]
fn the_shipped_texture_is_what_the_code_draws() {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../models/poster-a4/template/texture.png");
    let shipped = image::open(path).unwrap().to_rgb8();
    assert_eq!(
        (shipped.width() as usize, shipped.height() as usize),
        (poster().width(), poster().height())
    );
    // Sines differ in their last bit between platforms, which may move a few edges by a grey level.
    let different = shipped
        .as_raw()
        .iter()
        .zip(poster().rgb())
        .filter(|(a, b)| a.abs_diff(**b) > 2)
        .count();
    assert!(different * 1000 < poster().rgb().len(), "{different} bytes differ");
}

#[test]
fn the_margins_are_white_but_for_the_scale_bar() {
    let [left, top, right, bottom] = ART.map(|mm| mm * SCALE);
    for y in 0..poster().height() {
        for x in 0..poster().width() {
            let art = (left..right).contains(&x) && (top..bottom).contains(&y);
            let bar = (19 * SCALE..161 * SCALE).contains(&x) && (bottom..207 * SCALE).contains(&y);
            assert!(
                art || bar || poster().pixel(x, y) == [255; 3],
                "ink in the margin at ({x}, {y})"
            );
        }
    }
}

#[test]
fn the_scale_bar_is_100_mm_long() {
    // The line, 205.6 mm from the top and 0.25 mm wide, darkens pixel row 1027 or 1028; its round caps add
    // half its width at both ends: 100.25 mm are 501 pixels, give or take the two partly covered ones.
    let longest = (204 * SCALE..206 * SCALE)
        .map(|y| {
            (19 * SCALE..121 * SCALE)
                .filter(|&x| grey(poster().pixel(x, y)) < 200.0)
                .count()
        })
        .max()
        .unwrap();
    assert!((500..=503).contains(&longest), "{longest} pixels");
}

#[test]
fn every_20_mm_cell_and_every_7_mm_cell_has_contrast_in_grey() {
    // Sensor noise of a dim frame is a few grey levels.
    assert!(min_contrast(20, 5) > 30.0, "{}", min_contrast(20, 5));
    assert!(min_contrast(7, 4) > 12.0, "{}", min_contrast(7, 4));
}

#[test]
fn the_layout_is_readable_in_grey_from_far() {
    // Blocks of 5 mm: 57 x 40 pixels for the artwork, less than a poster 2 m away.
    let (blocks, columns) = grey_blocks(poster(), 5 * SCALE);
    let art: Vec<f64> = (2..40)
        .flat_map(|row| (2..58).map(move |column| row * columns + column))
        .map(|i| blocks[i])
        .collect();
    assert!(standard_deviation(&art) > 30.0, "{}", standard_deviation(&art));
    let mut fine: Vec<f64> = grey_blocks(poster(), 2).0;
    fine.sort_by(f64::total_cmp);
    let [dark, light] = [0.05, 0.8].map(|fraction| fine[(fraction * fine.len() as f64) as usize]);
    assert!(light - dark > 150.0, "from {dark} to {light}");
}

#[test]
fn no_two_distant_places_look_alike_upright_or_turned() {
    // Patches of 24 mm as a camera sees them from far: 12 x 12 pixels of 2 mm, every 6 mm.
    const PATCH: usize = 12;
    let (blocks, columns) = grey_blocks(poster(), 2 * SCALE);
    let mut patches: Vec<([f64; 2], Vec<f64>)> = Vec::new();
    for row in (3..=102 - PATCH).step_by(3) {
        for column in (3..=145 - PATCH).step_by(3) {
            let patch: Vec<f64> = (0..PATCH * PATCH)
                .map(|i| blocks[(row + i / PATCH) * columns + column + i % PATCH])
                .collect();
            let mean = patch.iter().sum::<f64>() / patch.len() as f64;
            let norm = standard_deviation(&patch) * (patch.len() as f64).sqrt();
            let place = [2.0 * column as f64, 2.0 * row as f64];
            patches.push((place, patch.into_iter().map(|v| (v - mean) / norm).collect()));
        }
    }
    assert!(patches.len() > 1000);
    let mut most = 0.0_f64;
    for (i, (place, patch)) in patches.iter().enumerate() {
        for (other_place, other) in &patches[i + 1..] {
            if (place[0] - other_place[0]).hypot(place[1] - other_place[1]) >= 24.0 {
                let upright: f64 = patch.iter().zip(other).map(|(a, b)| a * b).sum();
                let turned: f64 = patch.iter().zip(other.iter().rev()).map(|(a, b)| a * b).sum();
                most = most.max(upright).max(turned);
            }
        }
    }
    // A repeated motif would give 1; a matcher still tells the best from the second best at 0.85.
    assert!(most < 0.85, "{most}");
}

#[test]
fn the_drawing_is_the_same_at_every_resolution() {
    let coarse = grey_blocks(&poster_a4_picture_at(2.0).unwrap(), 2).0;
    let fine = grey_blocks(poster(), SCALE).0;
    let mean = coarse.iter().zip(&fine).map(|(a, b)| (a - b).abs()).sum::<f64>() / fine.len() as f64;
    // Anti-aliasing at 2 pixels a millimetre rounds coverage; another drawing would differ by 60 levels.
    assert!(mean < 5.0, "{mean} grey levels");
}

#[test]
fn a_resolution_out_of_range_is_refused() {
    for pixels_per_mm in [0.0, 0.4, 25.0, f64::NAN] {
        let error = poster_a4_picture_at(pixels_per_mm).unwrap_err().to_string();
        assert!(error.contains("expected 0.5 to 24"), "{error}");
    }
}
