//! A picture to compose on: rectangles, other pictures, lines of text.

use deepsft_geometry::Picture;
use font8x8::UnicodeFonts;

/// Side of a character of text at scale 1, pixels.
pub const CHARACTER: usize = 8;

/// An RGB picture in the making. What lies outside is cut off.
pub struct Canvas {
    width: usize,
    height: usize,
    pixels: Vec<[u8; 3]>,
}

impl Canvas {
    /// A canvas of one colour.
    pub fn new(width: usize, height: usize, color: [u8; 3]) -> Self {
        Self {
            width,
            height,
            pixels: vec![color; width * height],
        }
    }

    /// Sets the pixel at column `x`, row `y`.
    pub fn set(&mut self, x: usize, y: usize, color: [u8; 3]) {
        if x < self.width && y < self.height {
            self.pixels[y * self.width + x] = color;
        }
    }

    /// Puts `picture` with its top left corner at (`left`, `top`).
    pub fn draw(&mut self, picture: &Picture, left: usize, top: usize) {
        for y in 0..picture.height() {
            for x in 0..picture.width() {
                self.set(left + x, top + y, picture.pixel(x, y));
            }
        }
    }

    /// Draws a straight line, one pixel wide; (0, 0) is the middle of the first pixel.
    pub fn line(&mut self, from: (f64, f64), to: (f64, f64), color: [u8; 3]) {
        let steps = (to.0 - from.0).abs().max((to.1 - from.1).abs()).ceil().max(1.0);
        for i in 0..=steps as usize {
            let t = i as f64 / steps;
            let (x, y) = (from.0 + t * (to.0 - from.0), from.1 + t * (to.1 - from.1));
            if x.round() >= 0.0 && y.round() >= 0.0 {
                self.set(x.round() as usize, y.round() as usize, color);
            }
        }
    }

    /// Writes `text` (ASCII; other characters become `?`) with its top left corner at (`left`, `top`), each dot of
    /// the 8 x 8 font a square of `scale` pixels.
    pub fn write(&mut self, text: &str, left: usize, top: usize, scale: usize, color: [u8; 3]) {
        for (i, character) in text.chars().enumerate() {
            let glyph = font8x8::BASIC_FONTS
                .get(character)
                .or_else(|| font8x8::BASIC_FONTS.get('?'));
            for (row, bits) in glyph.unwrap_or_default().into_iter().enumerate() {
                for column in (0..CHARACTER).filter(|column| bits >> column & 1 == 1) {
                    for dot in 0..scale * scale {
                        let x = left + (i * CHARACTER + column) * scale + dot % scale;
                        self.set(x, top + row * scale + dot / scale, color);
                    }
                }
            }
        }
    }

    /// The finished picture.
    pub fn into_picture(self) -> Picture {
        Picture::from_fn(self.width, self.height, |x, y| self.pixels[y * self.width + x])
    }
}

/// Width in pixels of `text` at `scale`.
pub fn text_width(text: &str, scale: usize) -> usize {
    text.chars().count() * CHARACTER * scale
}

#[cfg(test)]
mod tests {
    use super::*;

    fn dots(text: &str, scale: usize) -> Vec<String> {
        let mut canvas = Canvas::new(text_width(text, scale), CHARACTER * scale, [0; 3]);
        canvas.write(text, 0, 0, scale, [255; 3]);
        let picture = canvas.into_picture();
        let dot = |x, y| if picture.pixel(x, y)[0] > 0 { '#' } else { '.' };
        (0..picture.height())
            .map(|y| (0..picture.width()).map(|x| dot(x, y)).collect())
            .collect()
    }

    #[test]
    fn a_letter_stands_upright_and_unmirrored() {
        let l = dots("L", 1);
        assert!(
            l[6].matches('#').count() > l[1].matches('#').count(),
            "its foot is below: {l:#?}"
        );
        assert!(
            l[1][..4].contains('#') && !l[1][5..].contains('#'),
            "its stem is on the left: {l:#?}"
        );
    }

    #[test]
    fn scale_2_doubles_every_dot_and_what_is_outside_is_cut() {
        let (once, twice) = (dots("g", 1), dots("g", 2));
        for (y, row) in twice.iter().enumerate() {
            assert_eq!(*row, once[y / 2].chars().flat_map(|c| [c, c]).collect::<String>());
        }
        let mut canvas = Canvas::new(4, 4, [1; 3]);
        canvas.write("WWW", 2, 3, 3, [9; 3]);
        canvas.draw(&Picture::from_fn(10, 10, |_, _| [5; 3]), 3, 3);
        assert_eq!([canvas.into_picture().pixel(3, 3)], [[5; 3]]);
    }
}
