//! Picture sheets: rows of titled panels with colour bars.

use super::canvas::{CHARACTER, Canvas, text_width};
use super::color_map::ColorMap;
use deepsft_geometry::Picture;

const PAPER: [u8; 3] = [24, 24, 28];
const INK: [u8; 3] = [236, 236, 236];

/// Pixels between panels and around lines of text, at text scale 1.
const GAP: usize = 4;

/// What the colours of a panel stand for.
#[derive(Clone, Debug, PartialEq)]
pub struct ColorBar {
    /// The colours.
    pub colors: ColorMap,
    /// Value of the first and of the last colour.
    pub range: [f64; 2],
    /// Unit of the values; empty for a plain number.
    pub unit: &'static str,
}

impl ColorBar {
    /// The colour of a value.
    pub fn color(&self, value: f64) -> [u8; 3] {
        let [low, high] = self.range;
        self.colors.color((value - low) / (high - low))
    }

    /// The label of the value at `share` (0 to 1) of the bar.
    fn label(&self, share: f64) -> String {
        let [low, high] = self.range;
        let decimals = if high - low < 10.0 { 1 } else { 0 };
        let number = format!("{:.decimals$} {}", low + (high - low) * share, self.unit);
        number.trim_end().to_owned()
    }
}

/// One picture of a sheet.
pub struct Panel {
    /// What it shows: a line above the picture.
    pub title: String,
    /// The picture. All of a sheet have one size.
    pub picture: Picture,
    /// The bar below the picture, where its colours are values.
    pub bar: Option<ColorBar>,
}

/// A row of panels under a line of text.
pub struct Row {
    /// The line of text; none when empty.
    pub caption: String,
    /// The panels, left to right.
    pub panels: Vec<Panel>,
}

/// Composes a sheet. `None` when it has no panel.
pub fn sheet(rows: &[Row]) -> Option<Picture> {
    let first = rows.iter().find_map(|row| row.panels.first())?;
    let (panel_width, panel_height) = (first.picture.width(), first.picture.height());
    let columns = rows.iter().map(|row| row.panels.len()).max()?;
    // Text is to be legible beside a panel of full size and to fit beside a small one.
    let scale = if panel_width >= 400 { 2 } else { 1 };
    let (line, gap) = ((CHARACTER + GAP) * scale, GAP * scale);
    let bar_height = |row: &Row| {
        let any = row.panels.iter().any(|panel| panel.bar.is_some());
        if any { line + CHARACTER * scale + gap } else { 0 }
    };
    let caption_height = |row: &Row| if row.caption.is_empty() { 0 } else { line };
    let row_height = |row: &Row| caption_height(row) + line + panel_height + bar_height(row) + 2 * gap;

    let width = columns * (panel_width + gap) + gap;
    let height = rows.iter().map(row_height).sum::<usize>() + gap;
    let mut canvas = Canvas::new(width, height, PAPER);
    let mut top = gap;
    for row in rows {
        canvas.write(&row.caption, gap, top, scale, INK);
        let panel_top = top + caption_height(row) + line;
        for (i, panel) in row.panels.iter().enumerate() {
            let left = gap + i * (panel_width + gap);
            canvas.write(&panel.title, left, panel_top - line, scale, INK);
            canvas.draw(&panel.picture, left, panel_top);
            if let Some(bar) = &panel.bar {
                draw_bar(
                    &mut canvas,
                    bar,
                    left,
                    panel_top + panel_height + gap,
                    panel_width,
                    scale,
                );
            }
        }
        top += row_height(row);
    }
    Some(canvas.into_picture())
}

fn draw_bar(canvas: &mut Canvas, bar: &ColorBar, left: usize, top: usize, width: usize, scale: usize) {
    let thickness = CHARACTER * scale;
    for x in 0..width {
        let color = bar.colors.color(x as f64 / (width - 1).max(1) as f64);
        for y in 0..thickness {
            canvas.set(left + x, top + y, color);
        }
    }
    for share in [0.0, 0.5, 1.0] {
        let label = bar.label(share);
        let room = width.saturating_sub(text_width(&label, scale));
        canvas.write(
            &label,
            left + (room as f64 * share) as usize,
            top + thickness + GAP * scale / 2,
            scale,
            INK,
        );
    }
}

#[cfg(test)]
mod tests {
    use super::*;

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
        assert_eq!(picture.width(), 2 * 104 + 4);
        // The last colour of the map is on the last column of the bar and nowhere else: 8 pixels.
        assert_eq!(count(&picture, [0xfd, 0xe7, 0x25]), 8);
        assert!(count(&picture, INK) > 100);
        assert!(sheet(&[]).is_none());
    }

    #[test]
    fn labels_carry_their_unit_and_as_many_decimals_as_they_need() {
        let bar = |range| ColorBar {
            colors: ColorMap::Inferno,
            range,
            unit: "mm",
        };
        assert_eq!(bar([300.0, 501.0]).label(0.5), "400 mm");
        assert_eq!(bar([0.0, 5.0]).label(0.5), "2.5 mm");
        let plain = ColorBar {
            unit: "",
            ..bar([0.0, 1.0])
        };
        assert_eq!(plain.label(0.5), "0.5");
        assert_eq!(bar([0.0, 4.0]).color(4.0), ColorMap::Inferno.color(1.0));
    }
}
