//! Picture sheets.

use crate::output::color_map::ColorMap;
use crate::output::sheet::{ColorBar, Panel, Row, sheet};
use deepsft_geometry::Picture;

fn panel(width: usize, height: usize, bar: Option<ColorBar>) -> Panel {
    Panel {
        title: "depth".to_owned(),
        picture: Picture::from_fn(width, height, |_, _| [7, 8, 9]),
        bar,
    }
}

fn count(picture: &Picture, color: [u8; 3]) -> usize {
    picture.rgb().chunks_exact(3).filter(|&pixel| pixel == color).count()
}

#[test]
fn every_panel_is_whole_and_has_its_bar() {
    let bar = ColorBar {
        colors: ColorMap::Viridis,
        range: [300.0, 500.0],
        unit: "mm",
    };
    let rows = [
        Row {
            caption: "frame 3".to_owned(),
            panels: vec![panel(100, 50, None), panel(100, 50, Some(bar))],
        },
        Row {
            caption: String::new(),
            panels: vec![panel(100, 50, None)],
        },
    ];
    let picture = sheet(&rows).unwrap();
    assert_eq!(count(&picture, [7, 8, 9]), 3 * 100 * 50);
    assert_eq!(picture.width(), 2 * 106 + 6);
    // The last colour of the map is on the last column of the bar and nowhere else: 8 pixels.
    assert_eq!(count(&picture, [0xfd, 0xe7, 0x25]), 8);
    // Neither paper nor panels nor the ramp have light grey: that is lettering.
    let light = picture
        .rgb()
        .chunks_exact(3)
        .filter(|pixel| pixel.iter().all(|&c| c > 120));
    assert!(light.count() > 100);
    assert!(sheet(&[]).is_none());
}
