//! Lines of text in Inter, the font that is built in.

use ab_glyph::{Font, FontRef, Glyph, PxScale, ScaleFont, point};

const REGULAR: &[u8] = include_bytes!("../../fonts/Inter-Regular.ttf");
const SEMIBOLD: &[u8] = include_bytes!("../../fonts/Inter-SemiBold.ttf");

/// Height of the font's capitals over its em.
const CAPITAL_HEIGHT: f64 = 0.727;

/// How a line of text looks.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Lettering {
    /// Height of an em, pixels; capitals are 0.73 of it.
    pub size: f64,
    /// Whether it is semibold, for titles; else regular.
    pub is_semibold: bool,
    /// Its colour.
    pub color: [u8; 3],
}

/// The point of a line of text that lies at a given x.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Align {
    /// Its left end.
    Left,
    /// Its middle.
    Centre,
    /// Its right end.
    Right,
}

impl Lettering {
    /// Regular text.
    pub fn regular(size: f64, color: [u8; 3]) -> Self {
        Self {
            size,
            is_semibold: false,
            color,
        }
    }

    /// A title.
    pub fn semibold(size: f64, color: [u8; 3]) -> Self {
        Self {
            is_semibold: true,
            ..Self::regular(size, color)
        }
    }

    /// The same, smaller if that is needed to make `text` at most `width` pixels wide.
    pub fn fitting(self, text: &str, width: f64) -> Self {
        Self {
            size: self.size * (width / self.width(text).max(1.0)).min(1.0),
            ..self
        }
    }

    /// Width of `text`, pixels.
    pub fn width(&self, text: &str) -> f64 {
        self.glyphs(text).1
    }

    /// Calls `paint` with the column and row of each pixel that `text` covers and the covered fraction of it. The middle of
    /// its capitals is at height `middle`.
    pub(super) fn rasterise(
        &self,
        text: &str,
        x: f64,
        middle: f64,
        align: Align,
        mut paint: impl FnMut(i64, i64, f32),
    ) {
        let Some(font) = self.font() else { return };
        let (glyphs, width) = self.glyphs(text);
        let left = match align {
            Align::Left => x,
            Align::Centre => x - width / 2.0,
            Align::Right => x - width,
        };
        // Letters are sharpest when they stand on a whole row.
        let baseline = (middle + CAPITAL_HEIGHT * self.size / 2.0).round();
        for mut glyph in glyphs {
            glyph.position.x += left as f32;
            glyph.position.y = baseline as f32;
            if let Some(outline) = font.outline_glyph(glyph) {
                let corner = outline.px_bounds().min;
                outline.draw(|column, row, covered| {
                    paint(
                        corner.x as i64 + i64::from(column),
                        corner.y as i64 + i64::from(row),
                        covered,
                    );
                });
            }
        }
    }

    /// The glyphs of `text` from x = 0 on, and how far they reach. A character that the font lacks becomes a question mark.
    fn glyphs(&self, text: &str) -> (Vec<Glyph>, f64) {
        let Some(font) = self.font() else {
            return (Vec::new(), 0.0);
        };
        // ab_glyph's scale is the height from ascender to descender.
        let em = font.units_per_em().unwrap_or(1000.0);
        let scale = PxScale::from(self.size as f32 * font.height_unscaled() / em);
        let scaled = font.as_scaled(scale);
        let mut x = 0.0;
        let glyph = |character: char| {
            let id = match font.glyph_id(character) {
                missing if missing.0 == 0 => font.glyph_id('?'),
                known => known,
            };
            let glyph = id.with_scale_and_position(scale, point(x, 0.0));
            x += scaled.h_advance(id);
            glyph
        };
        (text.chars().map(glyph).collect(), f64::from(x))
    }

    /// The font; a test shows that both weights can be read.
    fn font(&self) -> Option<FontRef<'static>> {
        FontRef::try_from_slice(if self.is_semibold { SEMIBOLD } else { REGULAR }).ok()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Covered area, pixels, and the bounds (left, top, right, bottom) of all that is covered by half or more.
    fn measured(lettering: Lettering, text: &str, align: Align) -> (f32, [i64; 4]) {
        let (mut area, mut bounds) = (0.0, [i64::MAX, i64::MAX, i64::MIN, i64::MIN]);
        lettering.rasterise(text, 200.0, 100.0, align, |x, y, covered| {
            area += covered;
            if covered >= 0.5 {
                let [left, top, right, bottom] = bounds;
                bounds = [left.min(x), top.min(y), right.max(x + 1), bottom.max(y + 1)];
            }
        });
        (area, bounds)
    }

    #[test]
    fn capitals_are_as_high_as_the_font_says_and_stand_about_the_middle() {
        for lettering in [Lettering::regular(100.0, [0; 3]), Lettering::semibold(100.0, [0; 3])] {
            let (area, [left, top, right, bottom]) = measured(lettering, "H", Align::Centre);
            assert!(
                ((bottom - top) as f64 - 100.0 * CAPITAL_HEIGHT).abs() <= 1.0,
                "{top} to {bottom}"
            );
            assert!((top + bottom - 200).abs() <= 2 && (left + right - 400).abs() <= 2);
            assert!(area > 1000.0);
        }
        let area = |lettering| measured(lettering, "depth", Align::Left).0;
        assert!(area(Lettering::semibold(40.0, [0; 3])) > 1.2 * area(Lettering::regular(40.0, [0; 3])));
    }

    #[test]
    fn text_reaches_from_its_x_as_far_as_its_width() {
        let lettering = Lettering::regular(40.0, [0; 3]);
        let width = lettering.width("HHHH") as i64;
        let [left, _, right, _] = measured(lettering, "HHHH", Align::Left).1;
        assert!((200..206).contains(&left) && (right - 200 - width).abs() < 6);
        let [left, _, right, _] = measured(lettering, "HHHH", Align::Right).1;
        assert!((194..=200).contains(&right) && (200 - left - width).abs() < 6);
        let half = lettering.fitting("HHHH", lettering.width("HHHH") / 2.0);
        assert!((half.size - 20.0).abs() < 1e-3);
        assert_eq!(lettering.fitting("H", 1000.0).size, 40.0);
    }

    #[test]
    fn a_character_that_the_font_lacks_is_a_question_mark() {
        let lettering = Lettering::regular(30.0, [0; 3]);
        assert_eq!(
            measured(lettering, "\u{4e2d}", Align::Left),
            measured(lettering, "?", Align::Left)
        );
        assert!(lettering.width("é") != lettering.width("?"));
    }
}
