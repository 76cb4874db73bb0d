//! The rigid motion that brings one set of points onto another.

use super::rotation::nearest_rotation;
use glam::{DMat3, DQuat, DVec3};

/// A rotation followed by a translation.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RigidMotion {
    /// The rotation.
    pub rotation: DQuat,
    /// The translation, in the points' unit.
    pub translation: DVec3,
}

impl RigidMotion {
    /// The motion that leaves everything where it is.
    pub const IDENTITY: Self = Self {
        rotation: DQuat::IDENTITY,
        translation: DVec3::ZERO,
    };

    /// The moved point.
    pub fn apply(&self, p: DVec3) -> DVec3 {
        self.rotation * p + self.translation
    }

    /// One step of orthogonal iteration (Lu, Hager and Mjolsness 2000) towards the motion that brings points onto the rays in which a camera
    /// sees them: each is to go to the nearest point of its ray. `points` are (point, a place on its ray before the camera, weight).
    pub fn towards_rays(self, points: impl Iterator<Item = (DVec3, DVec3, f64)> + Clone) -> Self {
        let nearest = |(p, on_ray, weight): (DVec3, DVec3, f64)| (p, self.apply(p).project_onto(on_ray), weight);
        Self::align(points.map(nearest), self)
    }

    /// Aligns the sources with the targets by weighted least squares, without scale (Kabsch 1976, Umeyama 1991).
    /// `pairs` are (source, target, weight), weights not negative. What the points leave open is taken from `guess`:
    /// with points on one line the turn about it, with one point the whole rotation, with none everything.
    pub fn align(pairs: impl Iterator<Item = (DVec3, DVec3, f64)> + Clone, guess: Self) -> Self {
        let (mut source, mut target, mut total) = (DVec3::ZERO, DVec3::ZERO, 0.0);
        for (a, b, weight) in pairs.clone() {
            source += weight * a;
            target += weight * b;
            total += weight;
        }
        if total <= 0.0 {
            return guess;
        }
        let (source, target) = (source / total, target / total);
        let (mut covariance, mut spread) = (DMat3::ZERO, 0.0_f64);
        for (a, b, weight) in pairs {
            let (centred, image) = (a - source, weight * (b - target));
            covariance += DMat3::from_cols(image * centred.x, image * centred.y, image * centred.z);
            spread = spread.max(weight * centred.length_squared().max((b - target).length_squared()));
        }
        // What rounding leaves of a single point must not choose a rotation.
        let size = (source.length_squared() + target.length_squared()) * total;
        let rotation = if spread <= 1e-24 * size {
            guess.rotation
        } else {
            nearest_rotation(covariance, guess.rotation)
        };
        Self {
            rotation,
            translation: target - rotation * source,
        }
    }
}
