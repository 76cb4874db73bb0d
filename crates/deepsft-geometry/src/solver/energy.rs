//! What a mesh can be asked to minimise.

use glam::DVec3;

/// One term of the energy that the mesh solver minimises: a weighted sum of squared residuals of the
/// vertex positions, possibly under a robust function.
///
/// Every residual is without unit (lengths are divided by the template's mean edge length, see
/// [`LengthScale`](super::LengthScale), or by a standard deviation), so that weights mean the same in
/// any unit of length.
pub trait Energy {
    /// The term's name in the report.
    fn name(&self) -> &'static str;

    /// Shows every set of vertices that one residual depends on.
    fn stencils(&self, visit: &mut dyn FnMut(&[usize]));

    /// The energy of `vertices`: the sum of rho(residual^2). Infinite where it is not defined (a
    /// measured point at or behind the camera).
    fn energy(&self, vertices: &[DVec3]) -> f64;

    /// Gives `sink` every residual with its Jacobian at `vertices`. The gradients of the residuals,
    /// weighted and summed, are half the energy's gradient.
    fn linearize(&self, vertices: &[DVec3], sink: &mut dyn ResidualSink);

    /// Adds J^T W r'' to `gradient`, with r'' the second derivative of the residuals at `vertices` along the straight
    /// path with `velocity`. With it a step follows the valley that the term leaves open instead of its tangent. Terms
    /// whose residuals are nearly linear over a step need none (the default).
    fn add_curvature(&self, vertices: &[DVec3], velocity: &[DVec3], gradient: &mut [DVec3]) {
        let _ = (vertices, velocity, gradient);
    }
}

/// What takes the linearised residuals: the normal equations, or a test.
pub trait ResidualSink {
    /// A residual that is a number, its weight (the robust one included), and its gradient with respect
    /// to each vertex it depends on. No vertex stands twice.
    fn scalar(&mut self, residual: f64, weight: f64, gradient: &[(usize, DVec3)]);

    /// A residual that is a vector and its weight: the sum of coefficient times position over vertices,
    /// less something constant. No vertex stands twice.
    fn vector(&mut self, residual: DVec3, weight: f64, coefficients: &[(usize, f64)]);
}

/// How much a large residual counts (an M-estimator). The scale has the residual's unit and is where a
/// residual starts to count as an outlier.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum Robust {
    /// Squares: rho(s) = s.
    #[default]
    Squares,
    /// Squares up to the scale, linear beyond (Huber 1964).
    Huber(f64),
    /// c^2 ln(1 + s / c^2): a far outlier counts for next to nothing (the paper's M-estimator).
    Cauchy(f64),
}

impl Robust {
    /// rho of a squared residual.
    pub fn rho(self, square: f64) -> f64 {
        match self {
            Self::Squares => square,
            Self::Huber(scale) if square <= scale * scale => square,
            Self::Huber(scale) => 2.0 * scale * square.sqrt() - scale * scale,
            Self::Cauchy(scale) => scale * scale * (square / (scale * scale)).ln_1p(),
        }
    }

    /// The derivative of rho: the weight of the residual in iteratively re-weighted least squares.
    pub fn weight(self, square: f64) -> f64 {
        match self {
            Self::Squares => 1.0,
            Self::Huber(scale) if square <= scale * scale => 1.0,
            Self::Huber(scale) => scale / square.sqrt(),
            Self::Cauchy(scale) => 1.0 / (1.0 + square / (scale * scale)),
        }
    }

    /// The scale, if there is one.
    pub(crate) fn scale(self) -> Option<f64> {
        match self {
            Self::Squares => None,
            Self::Huber(scale) | Self::Cauchy(scale) => Some(scale),
        }
    }
}

#[cfg(test)]
pub(crate) mod check {
    //! Finite differences for every term.

    use super::*;

    /// Residual, weight, and derivatives by vertex.
    type Row<R, D> = (R, f64, Vec<(usize, D)>);

    #[derive(Default)]
    pub(crate) struct Recorder {
        pub scalars: Vec<Row<f64, DVec3>>,
        pub vectors: Vec<Row<DVec3, f64>>,
    }

    impl ResidualSink for Recorder {
        fn scalar(&mut self, residual: f64, weight: f64, gradient: &[(usize, DVec3)]) {
            self.scalars.push((residual, weight, gradient.to_vec()));
        }
        fn vector(&mut self, residual: DVec3, weight: f64, coefficients: &[(usize, f64)]) {
            self.vectors.push((residual, weight, coefficients.to_vec()));
        }
    }

    impl Recorder {
        pub(crate) fn of(energy: &dyn Energy, vertices: &[DVec3]) -> Self {
            let mut recorder = Self::default();
            energy.linearize(vertices, &mut recorder);
            recorder
        }

        /// The gradient of the energy.
        fn gradient(&self, vertices: usize) -> Vec<DVec3> {
            let mut sum = vec![DVec3::ZERO; vertices];
            for (residual, weight, gradient) in &self.scalars {
                for &(i, g) in gradient {
                    sum[i] += 2.0 * weight * residual * g;
                }
            }
            for (residual, weight, coefficients) in &self.vectors {
                for &(i, c) in coefficients {
                    sum[i] += 2.0 * weight * c * residual;
                }
            }
            sum
        }
    }

    /// Central differences have an error of h^2 times the third derivative plus rounding / h: with
    /// h = 1e-5 of the length scale, 1e-6 of the largest entry leaves a decade.
    const TOLERANCE: f64 = 1e-6;

    /// Checks the gradient of the energy and, where the residuals are smooth functions of the vertices
    /// (`jacobian`), every residual's own derivatives. `step` is in the vertices' unit.
    pub(crate) fn finite_differences(energy: &dyn Energy, vertices: &[DVec3], step: f64, jacobian: bool) {
        let here = Recorder::of(energy, vertices);
        assert!(
            here.scalars.len() + here.vectors.len() > 0,
            "{} has no residual",
            energy.name()
        );
        let gradient = here.gradient(vertices.len());
        let largest = gradient.iter().fold(0.0_f64, |m, g| m.max(g.abs().max_element()));
        assert!(largest > 0.0, "{}: a gradient of zero tests nothing", energy.name());
        for (i, axis) in (0..vertices.len()).flat_map(|i| DVec3::AXES.map(|a| (i, a))) {
            let moved = |by: f64| {
                let mut moved = vertices.to_vec();
                moved[i] += by * axis;
                moved
            };
            let (plus, minus) = (moved(step), moved(-step));
            let numeric = (energy.energy(&plus) - energy.energy(&minus)) / (2.0 * step);
            assert!(
                (numeric - gradient[i].dot(axis)).abs() <= TOLERANCE * largest,
                "{}: vertex {i} {axis}: {numeric} numerically, {} claimed",
                energy.name(),
                gradient[i].dot(axis)
            );
            if jacobian {
                let (plus, minus) = (Recorder::of(energy, &plus), Recorder::of(energy, &minus));
                for (k, (_, _, row)) in here.scalars.iter().enumerate() {
                    let claimed = row.iter().find(|g| g.0 == i).map_or(0.0, |g| g.1.dot(axis));
                    let size = row.iter().fold(0.0_f64, |m, g| m.max(g.1.length()));
                    let numeric = (plus.scalars[k].0 - minus.scalars[k].0) / (2.0 * step);
                    assert!((numeric - claimed).abs() <= TOLERANCE * size, "{}", energy.name());
                }
                for (k, (_, _, row)) in here.vectors.iter().enumerate() {
                    let claimed = row.iter().find(|c| c.0 == i).map_or(0.0, |c| c.1);
                    let size = row.iter().fold(0.0_f64, |m, c| m.max(c.1.abs()));
                    let numeric = (plus.vectors[k].0 - minus.vectors[k].0) / (2.0 * step);
                    assert!(
                        (numeric - claimed * axis).length() <= TOLERANCE * size,
                        "{}",
                        energy.name()
                    );
                }
            }
        }
        // Energy and residuals tell the same story where nothing is robust.
        let sum = here.scalars.iter().map(|(r, w, _)| w * r * r).sum::<f64>()
            + here.vectors.iter().map(|(r, w, _)| w * r.length_squared()).sum::<f64>();
        assert!(sum >= 0.0 && energy.energy(vertices) >= sum * (1.0 - 1e-9));
    }

    #[test]
    fn the_weight_of_a_robust_function_is_its_derivative() {
        for robust in [Robust::Squares, Robust::Huber(2.0), Robust::Cauchy(2.0)] {
            for square in [0.5, 3.9, 4.1, 100.0] {
                let h = 1e-6;
                let numeric = (robust.rho(square + h) - robust.rho(square - h)) / (2.0 * h);
                assert!((numeric - robust.weight(square)).abs() < 1e-8, "{robust:?} at {square}");
            }
        }
    }
}
