//! What every term checks of its measurements.

use super::energy::Robust;
use crate::error::GeometryError;

pub(crate) fn check_weight(term: &'static str, weight: f64) -> Result<(), GeometryError> {
    check(term, weight, weight >= 0.0)
}

/// The scale of a robust function, if it has one.
pub(crate) fn check_robust(term: &'static str, robust: Robust) -> Result<(), GeometryError> {
    match robust {
        Robust::Squares => Ok(()),
        Robust::Cauchy(scale) => check_scale(term, scale),
    }
}

pub(crate) fn check_scale(term: &'static str, scale: f64) -> Result<(), GeometryError> {
    check(term, scale, scale > 0.0)
}

fn check(term: &'static str, actual: f64, is_in_range: bool) -> Result<(), GeometryError> {
    match actual.is_finite() && is_in_range {
        true => Ok(()),
        false => Err(GeometryError::Weight { term, actual }),
    }
}
