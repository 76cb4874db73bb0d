//! The rigid motion that brings one set of points onto another, and the rotation nearest to a matrix.

use glam::{DMat3, DQuat, DVec3, DVec4};

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

/// Steps of Newton's method before the eigenvector is computed instead. From a neighbour's rotation
/// three are usual.
const NEWTON_STEPS: usize = 8;

/// A Newton step below this angle (radians) is the last. At the maximum the trace is an even function of the
/// angle, so a step leaves an error of about its cube: 3e-8.
const LAST_STEP: f64 = 3e-3;

/// Eigenvalues closer to the largest than this fraction of the matrix's norm count as equal to it.
const EQUAL_EIGENVALUES: f64 = 1e-9;

/// The rotation R that maximises the trace of R^T `covariance`, where `covariance` is the sum of
/// w b a^T over vectors a and their images b: the best rotation from the a to the b (Kabsch 1976,
/// Horn 1987). Never a reflection. Where several rotations are equally good (all vectors on one line,
/// or none) it is the one nearest to `guess`.
pub(crate) fn nearest_rotation(covariance: DMat3, guess: DQuat) -> DQuat {
    newton(covariance, guess).unwrap_or_else(|| horn(covariance, guess))
}

/// Newton's method on the group of rotations. Every local maximum of the trace is the global one, so
/// where the Hessian is safely definite and the step tiny the answer is exact.
fn newton(covariance: DMat3, guess: DQuat) -> Option<DQuat> {
    let mut rotation = guess;
    for _ in 0..NEWTON_STEPS {
        let b = covariance * DMat3::from_quat(rotation).transpose();
        let trace = b.x_axis.x + b.y_axis.y + b.z_axis.z;
        // The Hessian: trace times the identity, less the symmetric part.
        let (xx, yy, zz) = (trace - b.x_axis.x, trace - b.y_axis.y, trace - b.z_axis.z);
        let xy = -0.5 * (b.x_axis.y + b.y_axis.x);
        let xz = -0.5 * (b.x_axis.z + b.z_axis.x);
        let yz = -0.5 * (b.y_axis.z + b.z_axis.y);
        // Its adjugate, which is symmetric too.
        let (cxx, cxy, cxz) = (yy * zz - yz * yz, xz * yz - xy * zz, xy * yz - xz * yy);
        let (cyy, cyz, czz) = (xx * zz - xz * xz, xy * xz - xx * yz, xx * yy - xy * xy);
        let determinant = xx * cxx + xy * cxy + xz * cxz;
        // Written so that NaN leaves too.
        if !(trace > 0.0 && xx > 0.0 && czz > 0.0 && determinant > 1e-6 * trace * trace * trace) {
            return None;
        }
        let g = DVec3::new(
            b.y_axis.z - b.z_axis.y,
            b.z_axis.x - b.x_axis.z,
            b.x_axis.y - b.y_axis.x,
        ) / determinant;
        let step = DVec3::new(
            cxx * g.x + cxy * g.y + cxz * g.z,
            cxy * g.x + cyy * g.y + cyz * g.z,
            cxz * g.x + cyz * g.y + czz * g.z,
        );
        let square = step.length_squared();
        if square > 1.0 {
            return None;
        }
        // Cayley's map: the exponential up to the cube of the angle, without sine and cosine.
        rotation = (DQuat::from_xyzw(0.5 * step.x, 0.5 * step.y, 0.5 * step.z, 1.0) * rotation).normalize();
        if square < LAST_STEP * LAST_STEP {
            return Some(rotation);
        }
    }
    None
}

/// Horn's quaternion: the eigenvector of the largest eigenvalue; of several, the combination nearest to
/// `guess`.
fn horn(covariance: DMat3, guess: DQuat) -> DQuat {
    // s[x][y] is the sum of a_x b_y.
    let s = covariance.to_cols_array_2d();
    let (xx, yy, zz) = (s[0][0], s[1][1], s[2][2]);
    let matrix = [
        [xx + yy + zz, s[1][2] - s[2][1], s[2][0] - s[0][2], s[0][1] - s[1][0]],
        [s[1][2] - s[2][1], xx - yy - zz, s[0][1] + s[1][0], s[2][0] + s[0][2]],
        [s[2][0] - s[0][2], s[0][1] + s[1][0], yy - xx - zz, s[1][2] + s[2][1]],
        [s[0][1] - s[1][0], s[2][0] + s[0][2], s[1][2] + s[2][1], zz - xx - yy],
    ];
    let (values, vectors) = eigenvectors(matrix);
    let largest = values.into_iter().fold(f64::NEG_INFINITY, f64::max);
    let norm = values.into_iter().fold(0.0_f64, |n, v| n.max(v.abs()));
    let guess = DVec4::new(guess.w, guess.x, guess.y, guess.z);
    let mut nearest = DVec4::ZERO;
    let mut any = guess;
    for (value, vector) in values.into_iter().zip(vectors) {
        if value >= largest - EQUAL_EIGENVALUES * norm {
            nearest += vector * vector.dot(guess);
            any = vector;
        }
    }
    let q = nearest.try_normalize().unwrap_or(any);
    DQuat::from_xyzw(q.y, q.z, q.w, q.x).normalize()
}

/// Eigenvalues and unit eigenvectors of a symmetric matrix by Jacobi rotations.
fn eigenvectors(mut a: [[f64; 4]; 4]) -> ([f64; 4], [DVec4; 4]) {
    let mut vectors = [DVec4::X, DVec4::Y, DVec4::Z, DVec4::W];
    // Jacobi converges quadratically; ten sweeps are twice what 4 x 4 needs.
    for _ in 0..10 {
        for (p, q) in [(0, 1), (0, 2), (0, 3), (1, 2), (1, 3), (2, 3)] {
            if a[p][q] == 0.0 {
                continue;
            }
            let theta = (a[q][q] - a[p][p]) / (2.0 * a[p][q]);
            let t = theta.signum() / (theta.abs() + theta.hypot(1.0));
            let c = 1.0 / t.hypot(1.0);
            let s = t * c;
            for row in &mut a {
                (row[p], row[q]) = (c * row[p] - s * row[q], s * row[p] + c * row[q]);
            }
            let (upper, lower) = (a[p], a[q]);
            a[p] = std::array::from_fn(|k| c * upper[k] - s * lower[k]);
            a[q] = std::array::from_fn(|k| s * upper[k] + c * lower[k]);
            (vectors[p], vectors[q]) = (c * vectors[p] - s * vectors[q], s * vectors[p] + c * vectors[q]);
        }
    }
    (std::array::from_fn(|k| a[k][k]), vectors)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn covariance(rotation: DQuat, vectors: &[DVec3]) -> DMat3 {
        vectors.iter().fold(DMat3::ZERO, |sum, &a| {
            let b = rotation * a;
            sum + DMat3::from_cols(b * a.x, b * a.y, b * a.z)
        })
    }

    #[test]
    fn any_rotation_is_found_from_any_guess_even_from_vectors_in_a_plane() {
        let solid = [
            DVec3::new(1.0, 0.2, 0.0),
            DVec3::new(-0.3, 2.0, 0.1),
            DVec3::new(0.4, 0.1, -0.7),
        ];
        let flat = [DVec3::new(1.0, 0.2, 0.0), DVec3::new(-0.3, 2.0, 0.0)];
        let axis = DVec3::new(1.0, -2.0, 0.5).normalize();
        for angle in [0.0, 0.1, 1.5, 3.0, std::f64::consts::PI] {
            let rotation = DQuat::from_axis_angle(axis, angle);
            for vectors in [&solid[..], &flat[..]] {
                for guess in [DQuat::IDENTITY, DQuat::from_rotation_x(3.0), rotation] {
                    let found = nearest_rotation(covariance(rotation, vectors), guess);
                    assert!(found.dot(rotation).abs() > 1.0 - 1e-12, "angle {angle}");
                }
            }
        }
    }

    #[test]
    fn newton_and_the_eigenvector_agree_on_a_noisy_matrix() {
        let rotation = DQuat::from_rotation_y(0.7);
        let noisy = covariance(rotation, &[DVec3::X, DVec3::Y * 2.0, DVec3::Z])
            + DMat3::from_cols_array(&[0.1, -0.2, 0.05, 0.0, 0.1, 0.2, -0.1, 0.03, -0.1]);
        let (a, b) = (newton(noisy, DQuat::IDENTITY).unwrap(), horn(noisy, DQuat::IDENTITY));
        assert!(a.dot(b).abs() > 1.0 - 1e-14, "an angle of 1e-7 has this cosine");
        assert!(a.dot(rotation).abs() < 1.0 - 1e-4, "the noise turns it");
    }

    #[test]
    fn a_mirror_image_gets_the_best_rotation_not_the_reflection() {
        let mirror = DMat3::from_diagonal(DVec3::new(3.0, 2.0, -1.0));
        let found = nearest_rotation(mirror, DQuat::from_rotation_z(0.3));
        assert!((found.length() - 1.0).abs() < 1e-12);
        assert!(found.dot(DQuat::IDENTITY).abs() > 1.0 - 1e-12, "{found}");
    }

    #[test]
    fn what_the_vectors_leave_open_is_taken_from_the_guess() {
        let guess = DQuat::from_rotation_x(0.4);
        assert!(nearest_rotation(DMat3::ZERO, guess).dot(guess).abs() > 1.0 - 1e-12);
        // One vector x -> y: the shortest arc from the identity turns about z by a quarter.
        let one = covariance(DQuat::from_rotation_z(std::f64::consts::FRAC_PI_2), &[DVec3::X]);
        let found = nearest_rotation(one, DQuat::IDENTITY);
        let quarter = DQuat::from_rotation_z(std::f64::consts::FRAC_PI_2);
        assert!(found.dot(quarter).abs() > 1.0 - 1e-9, "{found}");
    }
}
