//! Limits of what a description of a network may ask for.

/// Whether `value` of the field `field` lies within `least..=most`.
pub(super) fn within(field: &str, value: usize, least: usize, most: usize) -> Result<(), String> {
    if (least..=most).contains(&value) {
        Ok(())
    } else {
        Err(format!("{field} is {value}, expected {least} to {most}"))
    }
}

/// Whether `momentum` is a fraction.
pub(super) fn check_momentum(momentum: f64) -> Result<(), String> {
    if (0.0..=1.0).contains(&momentum) {
        Ok(())
    } else {
        Err(format!("momentum is {momentum}, expected 0 to 1"))
    }
}
