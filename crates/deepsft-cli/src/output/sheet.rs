//! Picture sheets: rows of titled panels with colour bars.

use super::canvas::Canvas;
use super::color_map::ColorMap;
use super::lettering::{Align, Lettering};
use deepsft_geometry::Picture;

const PAPER: [u8; 3] = [24, 24, 28];
const INK: [u8; 3] = [236, 236, 236];

/// Colour of titles and numbers; captions are in `INK`.
const FAINT_INK: [u8; 3] = [190, 192, 200];

/// Measures of a sheet, pixels. Text is to be legible beside a panel of full size and to fit beside a small one.
struct Layout {
    /// Between panels, and above and below rows.
    gap: usize,
    /// Height of a line of text.
    line: usize,
    /// Height of an em of text.
    text: f64,
    /// Thickness of a colour bar.
    bar: usize,
}

const LARGE: Layout = Layout {
    gap: 10,
    line: 26,
    text: 17.0,
    bar: 12,
};

const SMALL: Layout = Layout {
    gap: 6,
    line: 18,
    text: 12.0,
    bar: 8,
};

/// Width of a panel from which on the layout is the large one, pixels.
const LARGE_PANEL: usize = 400;

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

    /// The label of the value at `fraction` (0 to 1) of the bar.
    fn label(&self, fraction: f64) -> String {
        let [low, high] = self.range;
        let decimals = if high - low < 10.0 { 1 } else { 0 };
        let number = format!("{:.decimals$} {}", low + (high - low) * fraction, self.unit);
        number.trim_end().to_owned()
    }
}

/// One picture of a sheet.
#[derive(Debug)]
pub struct Panel {
    /// What it shows: a line above the picture.
    pub title: String,
    /// The picture. All of a sheet have one size.
    pub picture: Picture,
    /// The bar below the picture, where its colours are values.
    pub bar: Option<ColorBar>,
}

impl Panel {
    /// The same at half the size, so that many rows fit on a screen.
    #[must_use]
    pub fn halved(self) -> Self {
        Self {
            picture: self.picture.halved(),
            ..self
        }
    }
}

/// A row of panels under a line of text.
#[derive(Debug)]
pub struct Row {
    /// The line of text; none when empty.
    pub caption: String,
    /// The panels, left to right.
    pub panels: Vec<Panel>,
}

impl Row {
    /// A row under a `caption`.
    pub fn new(caption: impl Into<String>, panels: impl IntoIterator<Item = Panel>) -> Self {
        Self {
            caption: caption.into(),
            panels: panels.into_iter().collect(),
        }
    }
}

/// Composes a sheet. `None` when it has no panel.
pub fn sheet(rows: &[Row]) -> Option<Picture> {
    let first = rows.iter().find_map(|row| row.panels.first())?;
    let (panel_width, panel_height) = (first.picture.width(), first.picture.height());
    let columns = rows.iter().map(|row| row.panels.len()).max()?;
    let layout = if panel_width >= LARGE_PANEL { LARGE } else { SMALL };
    let Layout { gap, line, text, bar } = layout;
    let bar_height = |row: &Row| {
        let any = row.panels.iter().any(|panel| panel.bar.is_some());
        if any { gap / 2 + bar + line } else { 0 }
    };
    let caption_height = |row: &Row| if row.caption.is_empty() { 0 } else { line + gap / 2 };
    let row_height = |row: &Row| caption_height(row) + line + panel_height + bar_height(row) + 2 * gap;

    let width = columns * (panel_width + gap) + gap;
    let height = rows.iter().map(row_height).sum::<usize>() + gap;
    let mut canvas = Canvas::new(width, height, PAPER);
    let middle = |line_top: usize| line_top as f64 + line as f64 / 2.0;
    let mut top = gap;
    for row in rows {
        let caption = Lettering::semibold(text, INK).fitting(&row.caption, (width - 2 * gap) as f64);
        canvas.write(&row.caption, (gap as f64, middle(top)), Align::Left, caption);
        let panel_top = top + caption_height(row) + line;
        for (i, panel) in row.panels.iter().enumerate() {
            let left = gap + i * (panel_width + gap);
            let title = Lettering::regular(text, FAINT_INK).fitting(&panel.title, panel_width as f64);
            let above = (left as f64, middle(panel_top - line));
            canvas.write(&panel.title, above, Align::Left, title);
            canvas.draw(&panel.picture, left, panel_top);
            if let Some(bar) = &panel.bar {
                let below = panel_top + panel_height + gap / 2;
                draw_bar(&mut canvas, bar, (left, below), panel_width, &layout);
            }
        }
        top += row_height(row);
    }
    Some(canvas.into_picture())
}

fn draw_bar(canvas: &mut Canvas, bar: &ColorBar, (left, top): (usize, usize), width: usize, layout: &Layout) {
    let ramp = Picture::from_fn(width, layout.bar, |x, _| {
        bar.colors.color(x as f64 / (width - 1).max(1) as f64)
    });
    canvas.draw(&ramp, left, top);
    let middle = (top + layout.bar) as f64 + layout.line as f64 / 2.0;
    for (fraction, align) in [(0.0, Align::Left), (0.5, Align::Centre), (1.0, Align::Right)] {
        let x = left as f64 + width as f64 * fraction;
        let lettering = Lettering::regular(layout.text, FAINT_INK);
        canvas.write(&bar.label(fraction), (x, middle), align, lettering);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

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
