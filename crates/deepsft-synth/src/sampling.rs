//! Small draws shared by the random models.

use rand::{Rng, RngExt};

/// A number drawn uniformly between the two ends.
pub(crate) fn between<R: Rng + ?Sized>([low, high]: [f64; 2], rng: &mut R) -> f64 {
    low + (high - low) * rng.random::<f64>()
}

/// True with the given probability.
pub(crate) fn chance<R: Rng + ?Sized>(probability: f64, rng: &mut R) -> bool {
    rng.random::<f64>() < probability
}

/// -1 or 1, equally often.
pub(crate) fn sign<R: Rng + ?Sized>(rng: &mut R) -> f64 {
    if chance(0.5, rng) { -1.0 } else { 1.0 }
}
