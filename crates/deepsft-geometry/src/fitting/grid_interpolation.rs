//! Interpolation between two grids on one sheet.

use crate::error::GeometryError;
use crate::mesh::{Template, TriangleMesh};
use glam::{DVec2, DVec3};

/// The interpolation of values from the vertices of one grid on the sheet to those of another, with fixed weights.
#[derive(Debug)]
pub struct GridInterpolation {
    weights: Vec<Vec<(usize, f64)>>,
}

impl GridInterpolation {
    /// Prepares cubic interpolation (Catmull and Rom 1974) from the grid of `from` to the vertices of `to`: a bent sheet stays smooth.
    /// Beyond the border the curvature is zero.
    ///
    /// # Errors
    /// [`GeometryError::NotASheet`] for a template without a grid.
    pub fn cubic(from: &Template, to: &TriangleMesh) -> Result<Self, GeometryError> {
        Self::by(from, to, catmull_rom)
    }

    /// Prepares linear interpolation along both sides.
    pub(crate) fn linear(from: &Template, to: &TriangleMesh) -> Result<Self, GeometryError> {
        Self::by(from, to, |t| [0.0, 1.0 - t, t, 0.0])
    }

    fn by(from: &Template, to: &TriangleMesh, kernel: impl Fn(f64) -> [f64; 4]) -> Result<Self, GeometryError> {
        let (columns, rows) = from.expect_sheet("interpolation between grids")?;
        let along = |t: f64, count: usize| -> Vec<(usize, f64)> {
            let at = t.clamp(0.0, 1.0) * (count - 1) as f64;
            let cell = (at as usize).min(count - 2);
            let mut weights = vec![0.0; count];
            for (k, weight) in kernel(at - cell as f64).into_iter().enumerate() {
                // Beyond the border the last two values are continued in a line: 2 a - b.
                match (cell + k).checked_sub(1) {
                    Some(i) if i < count => weights[i] += weight,
                    Some(_) => {
                        weights[count - 1] += 2.0 * weight;
                        weights[count - 2] -= weight;
                    }
                    None => {
                        weights[0] += 2.0 * weight;
                        weights[1] -= weight;
                    }
                }
            }
            weights.into_iter().enumerate().filter(|w| w.1 != 0.0).collect()
        };
        let weights = |uv: &DVec2| {
            let (across, down) = (along(uv.x, columns), along(uv.y, rows));
            let row = |&(j, b): &(usize, f64)| {
                let weights = across.iter().map(move |&(i, a)| (j * columns + i, a * b));
                weights.collect::<Vec<_>>()
            };
            down.iter().flat_map(row).collect()
        };
        Ok(Self {
            weights: to.texture_coordinates().iter().map(weights).collect(),
        })
    }

    /// Interpolates to the vertices of the second grid.
    pub fn apply(&self, values: &[DVec3]) -> Vec<DVec3> {
        let sum = |weights: &Vec<(usize, f64)>| weights.iter().map(|&(i, w)| w * values[i]).sum();
        self.weights.iter().map(sum).collect()
    }

    pub(crate) fn apply_scalars(&self, values: &[f32]) -> Vec<f32> {
        let sum = |weights: &Vec<(usize, f64)>| weights.iter().map(|&(i, w)| w as f32 * values[i]).sum::<f32>();
        self.weights.iter().map(sum).collect()
    }
}

/// Weights of a Catmull-Rom spline (1974) for the values at -1, 0, 1 and 2. They give the value at `t`, 0 to 1; the
/// slope at each value is that of the line through its two neighbours.
pub fn catmull_rom(t: f64) -> [f64; 4] {
    let (t2, t3) = (t * t, t * t * t);
    [
        0.5 * (-t3 + 2.0 * t2 - t),
        0.5 * (3.0 * t3 - 5.0 * t2 + 2.0),
        0.5 * (-3.0 * t3 + 4.0 * t2 + t),
        0.5 * (t3 - t2),
    ]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::image::Picture;

    #[test]
    fn a_bent_sheet_is_kept_to_a_tenth_of_a_millimetre_by_the_cubic_and_a_plane_exactly_by_both() {
        let fine = Template::thin_shell(Picture::from_fn(1, 1, |_, _| [0; 3]), 297.0, 210.0).unwrap();
        let coarse = fine.coarser(2).unwrap();
        assert!(coarse.mesh().vertices().len() * 3 < fine.mesh().vertices().len());
        let bend = |p: &DVec3| {
            let angle = p.x / 100.0;
            DVec3::new(100.0 * angle.sin(), p.y, 500.0 - 100.0 * angle.cos())
        };
        let tilt = |p: &DVec3| DVec3::new(p.x, 0.8 * p.y, 300.0 + 0.6 * p.y);
        let worst = |interpolation: &GridInterpolation, shape: &dyn Fn(&DVec3) -> DVec3| {
            let values: Vec<DVec3> = coarse.mesh().vertices().iter().map(shape).collect();
            let got = interpolation.apply(&values);
            let truth = fine.mesh().vertices().iter().map(shape);
            got.iter().zip(truth).map(|(a, b)| a.distance(b)).fold(0.0, f64::max)
        };
        let cubic = GridInterpolation::cubic(&coarse, fine.mesh()).unwrap();
        let linear = GridInterpolation::linear(&coarse, fine.mesh()).unwrap();
        assert!(worst(&cubic, &tilt) < 1e-9 && worst(&linear, &tilt) < 1e-9);
        // A chord of 20 mm on a radius of 100 mm is 20^2 / 800 = 0.5 mm off; next to the border the cubic is half as good.
        assert!(worst(&cubic, &bend) < 0.25, "{}", worst(&cubic, &bend));
        assert!(worst(&linear, &bend) > 0.3, "{}", worst(&linear, &bend));
    }
}
