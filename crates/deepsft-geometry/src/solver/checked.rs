//! What every term checks of its measurements.

use super::energy::Robust;
use crate::error::GeometryError;

pub(crate) fn check_weight(term: &'static str, weight: f64) -> Result<(), GeometryError> {
    if weight.is_finite() && weight >= 0.0 {
        Ok(())
    } else {
        Err(GeometryError::Weight { term, actual: weight })
    }
}

/// The scale of a robust function, if it has one.
pub(crate) fn check_robust(term: &'static str, robust: Robust) -> Result<(), GeometryError> {
    match robust {
        Robust::Squares => Ok(()),
        Robust::Cauchy(scale) => check_scale(term, scale),
    }
}

pub(crate) fn check_scale(term: &'static str, scale: f64) -> Result<(), GeometryError> {
    if scale.is_finite() && scale > 0.0 {
        Ok(())
    } else {
        Err(GeometryError::Weight { term, actual: scale })
    }
}
