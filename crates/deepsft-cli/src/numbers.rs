//! Numbers on the command line that have to lie in a range.

use std::ops::RangeInclusive;

/// The number of `text`, which has to lie in `range`; the error names what was `expected`.
pub fn within(range: RangeInclusive<f64>, expected: &str, text: &str) -> Result<f64, String> {
    let number = text.parse().ok().filter(|number| range.contains(number));
    number.ok_or_else(|| format!("expected {expected}"))
}

/// A number greater than 0.
pub fn positive(text: &str) -> Result<f64, String> {
    within(f64::MIN_POSITIVE..=f64::MAX, "a positive number", text)
}

#[cfg(test)]
mod tests {
    use super::*;

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
