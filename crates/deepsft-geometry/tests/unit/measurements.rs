//! What the maps give to a fit.

use deepsft_geometry::fitting::measurements;
use deepsft_geometry::{Maps, Picture, Template};

/// Nothing is measured nearer to an edge or a break.
const MARGIN_PX: f64 = 4.0;

#[test]
fn edges_and_breaks_give_no_measurement() {
    let template = Template::thin_shell(Picture::from_fn(1, 1, |_, _| [0; 3]), 300.0, 200.0).unwrap();
    let mut maps = Maps::empty((120, 60));
    for y in 10..50 {
        for x in 10..110 {
            // The registration jumps by 60 mm at column 60.
            let u = x as f32 / 300.0 + if x < 60 { 0.0 } else { 0.2 };
            maps.set(y * 120 + x, 500.0, [u, y as f32 / 200.0]);
        }
    }
    let found = measurements(&maps, &template);
    assert!(found.len() > 50);
    for m in &found {
        assert!(m.pixel.x > 14.0 && m.pixel.x < 106.0 && m.pixel.y > 14.0 && m.pixel.y < 46.0);
        assert!((m.pixel.x - 60.0).abs() > MARGIN_PX, "{m:?}");
        assert_eq!(m.depth_mm, 500.0);
    }
}
