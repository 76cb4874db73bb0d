//! Numbers on the command line that have to lie in a range, and sizes of prints.

use deepsft_geometry::Picture;
use std::ops::RangeInclusive;
use std::str::FromStr;

/// The number of `text`, which has to lie in `range`; the error names what was `expected`.
pub fn within(range: RangeInclusive<f64>, expected: &str, text: &str) -> Result<f64, String> {
    let number = text.parse().ok().filter(|number| range.contains(number));
    number.ok_or_else(|| format!("expected {expected}"))
}

/// A number greater than 0.
pub fn positive(text: &str) -> Result<f64, String> {
    within(f64::MIN_POSITIVE..=f64::MAX, "a positive number", text)
}

/// The printed size of a picture in mm, typed as `297x210`, or `297` for the width alone.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SizeMm {
    width: f64,
    height: Option<f64>,
}

impl SizeMm {
    /// Width and height of `picture`; a height that was not given follows from its pixels, in whole
    /// micrometres: it comes back from a file as it is.
    pub fn of(self, picture: &Picture) -> [f64; 2] {
        let ratio = picture.height() as f64 / picture.width() as f64;
        let height = || (1000.0 * self.width * ratio).round() / 1000.0;
        [self.width, self.height.unwrap_or_else(height)]
    }
}

impl FromStr for SizeMm {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let side = |side: &str| positive(side.trim());
        let size = || match text.split_once(['x', 'X', '×']) {
            Some((width, height)) => Ok((side(width)?, Some(side(height)?))),
            None => Ok((side(text)?, None)),
        };
        let (width, height) = size()
            .map_err(|_: String| "expected positive lengths in mm, such as 297x210, or 297 for the width alone")?;
        Ok(Self { width, height })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_size_is_two_positive_lengths_or_a_width() {
        let picture = Picture::from_fn(40, 30, |_, _| [0; 3]);
        for (text, size) in [
            ("297x210.5", [297.0, 210.5]),
            ("297X210.5", [297.0, 210.5]),
            ("297 × 210.5", [297.0, 210.5]),
            ("100", [100.0, 75.0]),
        ] {
            assert_eq!(text.parse::<SizeMm>().unwrap().of(&picture), size, "{text}");
        }
        for text in ",297x,x210,0x210,-1x2,NaNx2,infx2,297x210x3,A4,0,-3".split(',') {
            assert!(text.parse::<SizeMm>().unwrap_err().contains("297x210"), "{text}");
        }
    }

    #[test]
    fn what_is_no_number_or_outside_of_the_range_is_refused() {
        assert_eq!(positive("0.5"), Ok(0.5));
        for text in ["0", "-1", "NaN", "inf", "ten"] {
            assert_eq!(positive(text), Err("expected a positive number".to_owned()), "{text}");
        }
        let angle = |text| within(0.0..=180.0, "an angle", text);
        assert_eq!((angle("0"), angle("180")), (Ok(0.0), Ok(180.0)));
        assert!(["-1", "181", "NaN", "half"].iter().all(|text| angle(text).is_err()));
    }
}
