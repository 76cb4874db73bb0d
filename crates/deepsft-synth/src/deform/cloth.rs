//! A sheet of cloth or paper as particles under constraints, moved by extended position-based dynamics.
//!
//! XPBD (Macklin, Müller and Chentanez, "XPBD: position-based simulation of compliant constrained dynamics", 2016)
//! with many small steps of one Gauss-Seidel sweep each, which converges faster than few steps of many sweeps
//! (Macklin et al., "Small steps in physics simulation", 2019). The constraints of a rectangular grid of particles:
//!
//! * stretch: the length of every edge of a cell;
//! * shear: the length of both diagonals of every cell, a little softer;
//! * bending: the second differences along rows and columns and the twist of every cell. Where a sheet keeps its
//!   lengths, its second derivatives point along the normal. The sum of their squares is then the squared curvature of
//!   plate theory, in whatever direction the sheet is rolled. This energy is quadratic and needs no angles (isometric
//!   bending, after Bergou et al., "A quadratic bending model for inextensible surfaces", 2006).
//!
//! Lengths are in mm and times in seconds. Areal density is 1, so that a mass is an area (mm^2): only stiffness per
//! density matters.

use crate::deform::xpbd::{Bend, Link};
use deepsft_geometry::catmull_rom;
use deepsft_geometry::glam::{DVec2, DVec3};

/// Acceleration of free fall, mm/s^2.
pub(crate) const FREE_FALL: f64 = 9806.65;

/// Cells along the sheet's diagonal. A bend of paper in a hand is wider than three of them. Twice as many would cost
/// four times as much and need more steps, because a step carries a pull only some cells far.
const CELLS_ALONG_DIAGONAL: f64 = 18.0;

/// Distance on the sheet, in cells, beyond which two parts must not meet.
const APART_CELLS: f64 = 4.0;

/// Strain along the edges of cells when a strip as long as the sheet's diagonal hangs by its own weight. Paper and woven
/// cloth hardly stretch.
const STRETCH_UNDER_WEIGHT: f64 = 1e-4;

/// The same along the diagonals of cells.
const SHEAR_UNDER_WEIGHT: f64 = 1e-3;

/// The sheet in motion.
#[derive(Clone, Debug)]
pub(crate) struct Cloth {
    columns: usize,
    rows: usize,
    rest: Vec<DVec2>,
    /// Area of the sheet that belongs to each particle, mm^2: its mass.
    areas: Vec<f64>,
    /// Inverse masses; 0 where a particle is held.
    inverse_masses: Vec<f64>,
    positions: Vec<DVec3>,
    velocities: Vec<DVec3>,
    before: Vec<DVec3>,
    links: Vec<Link>,
    curvatures: Vec<Bend<3>>,
    twists: Vec<Bend<4>>,
    steps: usize,
}

impl Cloth {
    /// A flat sheet at rest in the plane z = 0, centred on the origin. `bending_length_mm` is (D / (rho g))^(1/3) with
    /// the bending stiffness D and the weight per area rho g (Peirce, "The handle of cloth as a measurable quantity",
    /// 1930): 70 mm for copying paper, 20 mm for a cotton shirt.
    pub(crate) fn new(size_mm: DVec2, bending_length_mm: f64) -> Self {
        let cell = size_mm.length() / CELLS_ALONG_DIAGONAL;
        let [columns, rows] = [size_mm.x, size_mm.y].map(|side| (side / cell).round().max(2.0) as usize + 1);
        let cells = DVec2::new((columns - 1) as f64, (rows - 1) as f64);
        let at = |i: usize, j: usize| (DVec2::new(i as f64, j as f64) / cells - 0.5) * size_mm;
        let rest: Vec<DVec2> = (0..rows * columns).map(|k| at(k % columns, k / columns)).collect();
        let cell_area = (size_mm / cells).element_product();
        let fraction = |i: usize, count: usize| if i == 0 || i == count - 1 { 0.5 } else { 1.0 };
        let areas: Vec<f64> = (0..rows * columns)
            .map(|k| cell_area * fraction(k % columns, columns) * fraction(k / columns, rows))
            .collect();
        let mut cloth = Self {
            columns,
            rows,
            inverse_masses: areas.iter().map(|area| 1.0 / area).collect(),
            positions: rest.iter().map(|p| p.extend(0.0)).collect(),
            before: Vec::new(),
            velocities: vec![DVec3::ZERO; rest.len()],
            areas,
            rest,
            links: Vec::new(),
            curvatures: Vec::new(),
            twists: Vec::new(),
            steps: 0,
        };
        cloth.before.clone_from(&cloth.positions);
        cloth.link(size_mm.length() * FREE_FALL);
        cloth.stiffen(size_mm / cells, bending_length_mm.powi(3) * FREE_FALL);
        cloth
    }

    /// Links all cells. `weight` is the force per length at the upper end of a hanging strip as long as the diagonal.
    fn link(&mut self, weight: f64) {
        let columns = self.columns;
        for k in 0..self.rest.len() {
            let (right, below) = (k % columns + 1 < columns, k / columns + 1 < self.rows);
            let mut link = |a: usize, b: usize, strain: f64| {
                self.links.push(Link {
                    ends: [a, b],
                    rest: self.rest[a].distance(self.rest[b]),
                    // A spring between two particles stands for a strip about as wide as it is long: its
                    // stiffness is the sheet's own (force per length and strain).
                    compliance: strain / weight,
                });
            };
            if right {
                link(k, k + 1, STRETCH_UNDER_WEIGHT);
            }
            if below {
                link(k, k + columns, STRETCH_UNDER_WEIGHT);
            }
            if right && below {
                link(k, k + columns + 1, SHEAR_UNDER_WEIGHT);
                link(k + 1, k + columns, SHEAR_UNDER_WEIGHT);
            }
        }
    }

    /// Makes the sheet resist bending. `stiffness` is the bending stiffness D per areal density, mm^4/s^2. The energy
    /// per area is D / 2 (x_ss^2 + x_tt^2 + 2 x_st^2).
    fn stiffen(&mut self, cell: DVec2, stiffness: f64) {
        let columns = self.columns;
        for k in 0..self.rest.len() {
            let (i, j) = (k % columns, k / columns);
            let mut bend = |step: usize, spacing: f64| {
                // A bend stands for its particle's part of the sheet. The half cell along the outline has no bend across
                // the outline and does not resist one.
                self.curvatures.push(Bend {
                    particles: [k - step, k, k + step],
                    weights: [1.0, -2.0, 1.0],
                    compliance: spacing.powi(4) / (self.areas[k] * stiffness),
                });
            };
            if i > 0 && i + 1 < columns {
                bend(1, cell.x);
            }
            if j > 0 && j + 1 < self.rows {
                bend(columns, cell.y);
            }
            if i + 1 < columns && j + 1 < self.rows {
                self.twists.push(Bend {
                    particles: [k, k + 1, k + columns, k + columns + 1],
                    weights: [1.0, -1.0, -1.0, 1.0],
                    compliance: cell.element_product() / (2.0 * stiffness),
                });
            }
        }
    }

    /// Particles in rest position, mm, row by row.
    pub(crate) fn rest(&self) -> &[DVec2] {
        &self.rest
    }

    pub(crate) fn diagonal(&self) -> f64 {
        self.rest[0].distance(self.rest[self.rest.len() - 1])
    }

    /// Area that belongs to each particle, mm^2.
    pub(crate) fn areas(&self) -> &[f64] {
        &self.areas
    }

    /// Holds a particle: from now on only [`Cloth::place`] moves it.
    pub(crate) fn hold(&mut self, particle: usize) {
        self.inverse_masses[particle] = 0.0;
    }

    /// Puts a held particle somewhere.
    pub(crate) fn place(&mut self, particle: usize, position: DVec3) {
        self.positions[particle] = position;
    }

    /// Unit normals at the particles, on the side of -z when the sheet lies as at the beginning.
    pub(crate) fn normals(&self) -> Vec<DVec3> {
        let (columns, rows) = (self.columns, self.rows);
        let normal = |k: usize| {
            let (i, j) = (k % columns, k / columns);
            let across = self.positions[k + usize::from(i + 1 < columns)] - self.positions[k - usize::from(i > 0)];
            let below = if j + 1 < rows { k + columns } else { k };
            let above = if j > 0 { k - columns } else { k };
            (self.positions[below] - self.positions[above])
                .cross(across)
                .normalize_or_zero()
        };
        (0..self.positions.len()).map(normal).collect()
    }

    /// One step of `seconds` under `accelerations` (mm/s^2, one per particle). Velocities keep the fraction `kept`.
    pub(crate) fn step(&mut self, seconds: f64, accelerations: &[DVec3], kept: f64) {
        for (k, acceleration) in accelerations.iter().enumerate() {
            if self.inverse_masses[k] > 0.0 {
                self.before[k] = self.positions[k];
                self.velocities[k] = (self.velocities[k] + *acceleration * seconds) * kept;
                self.positions[k] += self.velocities[k] * seconds;
            }
        }
        let scale = 1.0 / (seconds * seconds);
        let (positions, inverse_masses) = (&mut self.positions, &self.inverse_masses);
        // Every second sweep runs backwards, so that a pull travels both ways alike.
        let backwards = !self.steps.is_multiple_of(2);
        if backwards {
            sweep(&self.twists, true, |bend| bend.solve(positions, inverse_masses, scale));
        }
        sweep(&self.curvatures, backwards, |bend| {
            bend.solve(positions, inverse_masses, scale)
        });
        if !backwards {
            sweep(&self.twists, false, |bend| bend.solve(positions, inverse_masses, scale));
        }
        sweep(&self.links, backwards, |link| {
            link.solve(positions, inverse_masses, scale)
        });
        self.steps += 1;
        for k in 0..self.positions.len() {
            if self.inverse_masses[k] > 0.0 {
                self.velocities[k] = (self.positions[k] - self.before[k]) / seconds;
            }
        }
    }

    /// Lets go of all particles and takes out the strain that is left, in `sweeps` steps of `seconds` without forces,
    /// each from rest. Lengths recover fastest: the sheet hardly unbends in that time.
    pub(crate) fn settle(&mut self, sweeps: usize, seconds: f64) {
        self.inverse_masses = self.areas.iter().map(|area| 1.0 / area).collect();
        let forces = vec![DVec3::ZERO; self.rest.len()];
        for _ in 0..sweeps {
            self.step(seconds, &forces, 0.0);
        }
    }

    /// Whether two parts more than [`APART_CELLS`] apart on the sheet are within a cell of each other in space. The
    /// simulation does not keep them from passing through each other.
    pub(crate) fn touches_itself(&self) -> bool {
        let cell2 = (self.diagonal() / CELLS_ALONG_DIAGONAL).powi(2);
        (0..self.rest.len()).any(|k| {
            (0..k).any(|other| {
                self.positions[k].distance_squared(self.positions[other]) < cell2
                    && self.rest[k].distance_squared(self.rest[other]) > APART_CELLS * APART_CELLS * cell2
            })
        })
    }

    /// The surface at a point of the texture ((u, v) in the unit square): a Catmull-Rom surface through the particles,
    /// which is smooth whatever mesh is laid on it.
    pub(crate) fn surface(&self, uv: DVec2) -> DVec3 {
        let (i, across) = neighbours(uv.x, self.columns);
        let (j, down) = neighbours(uv.y, self.rows);
        let row = |j: isize| -> DVec3 {
            let at = |i: isize| -> DVec3 {
                let [i, j] = [i as usize, j as usize];
                self.positions[j * self.columns + i]
            };
            weighted(extended(at, i, self.columns), across)
        };
        weighted(extended(row, j, self.rows), down)
    }

    /// Bending energy of the sheet as it is, per areal density.
    #[cfg(test)]
    fn bending_energy(&self) -> f64 {
        let curvature: f64 = self.curvatures.iter().map(|bend| bend.energy(&self.positions)).sum();
        let twist: f64 = self.twists.iter().map(|bend| bend.energy(&self.positions)).sum();
        curvature + twist
    }
}

/// Solves the constraints in turn, the last one first if `backwards`.
fn sweep<C>(constraints: &[C], backwards: bool, solve: impl FnMut(&C)) {
    if backwards {
        constraints.iter().rev().for_each(solve);
    } else {
        constraints.iter().for_each(solve);
    }
}

/// The first of the four neighbours (it may be -1) of a fraction of `count` - 1 intervals, and their weights.
fn neighbours(fraction: f64, count: usize) -> (isize, [f64; 4]) {
    let x = fraction.clamp(0.0, 1.0) * (count - 1) as f64;
    let cell = (x.floor() as usize).min(count - 2);
    (cell as isize - 1, catmull_rom(x - cell as f64))
}

fn weighted(points: [DVec3; 4], weights: [f64; 4]) -> DVec3 {
    points.into_iter().zip(weights).map(|(p, weight)| p * weight).sum()
}

/// The four values from `first` on. Before the first and after the last of `count` values the line goes on straight.
fn extended(at: impl Fn(isize) -> DVec3, first: isize, count: usize) -> [DVec3; 4] {
    let last = count as isize - 1;
    std::array::from_fn(|k| match first + k as isize {
        i if i < 0 => at(0) * 2.0 - at(1),
        i if i > last => at(last) * 2.0 - at(last - 1),
        i => at(i),
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    const A4: DVec2 = DVec2::new(297.0, 210.0);

    /// Rolls the particles up on a cylinder of radius `radius` about an axis along the unit vector `axis`.
    fn rolled(cloth: &mut Cloth, radius: f64, axis: DVec2) {
        let across = axis.perp();
        for k in 0..cloth.rest.len() {
            let (s, t) = (cloth.rest[k].dot(across), cloth.rest[k].dot(axis));
            let plane = across * (radius * (s / radius).sin()) + axis * t;
            cloth.positions[k] = plane.extend(radius * (1.0 - (s / radius).cos()));
        }
    }

    #[test]
    fn a_cylinder_stores_the_bending_energy_of_plate_theory() {
        // Half of D kappa^2 an area; bends see all of the sheet but half a cell along its outline, 3 to 5 % of a side.
        let mut cloth = Cloth::new(A4, 70.0);
        for angle in [0.0, 0.5, 1.0, 1.6] {
            rolled(&mut cloth, 400.0, DVec2::from_angle(angle));
            let expected = 0.5 * 70.0_f64.powi(3) * FREE_FALL / 400.0_f64.powi(2) * A4.element_product();
            let ratio = cloth.bending_energy() / expected;
            assert!((0.85..1.0).contains(&ratio), "{ratio} at {angle} rad");
        }
    }

    #[test]
    fn a_sheet_that_is_left_alone_stays_and_one_that_is_let_go_falls_freely() {
        let mut cloth = Cloth::new(A4, 70.0);
        let (still, falling) = (
            vec![DVec3::ZERO; cloth.rest.len()],
            vec![DVec3::Y * FREE_FALL; cloth.rest.len()],
        );
        for _ in 0..100 {
            cloth.step(0.002, &still, 1.0);
        }
        assert!(
            cloth
                .positions
                .iter()
                .zip(&cloth.rest)
                .all(|(p, rest)| p.distance(rest.extend(0.0)) < 1e-9)
        );
        for _ in 0..100 {
            cloth.step(0.002, &falling, 1.0);
        }
        // g t^2 / 2 = 196.1 mm after 0.2 s; semi-implicit steps are half a step ahead: 1 %.
        for (p, rest) in cloth.positions.iter().zip(&cloth.rest) {
            assert!(
                (p.y - rest.y - FREE_FALL * 0.02 * 1.01).abs() < 0.01 && p.z.abs() < 1e-9,
                "{p}"
            );
        }
    }

    #[test]
    fn a_strip_held_level_at_one_end_sags_as_beam_theory_says() {
        // As long as its bending length: the slope stays below 1/6.
        let length = 200.0;
        let mut cloth = Cloth::new(DVec2::new(length, 20.0), length);
        let last = cloth.columns - 1;
        let held: Vec<usize> = (0..cloth.rest.len()).filter(|k| k % cloth.columns < 2).collect();
        held.into_iter().for_each(|k| cloth.hold(k));
        let gravity = vec![DVec3::Z * FREE_FALL; cloth.rest.len()];
        // Tiny steps: in larger ones a sweep of such stiff bends gives way more than the stiffness says.
        for _ in 0..60_000 {
            cloth.step(0.00003, &gravity, 0.9994);
        }
        // A chain of rigid cells, the moment of the weights beyond each hinge over D a cell: M / (rho g) in mm^2.
        let cell = length / last as f64;
        let weight = |column: usize| if column == last { cell / 2.0 } else { cell };
        let moment = |hinge: usize| {
            (hinge..=last)
                .map(|k| weight(k) * cell * (k - hinge) as f64)
                .sum::<f64>()
        };
        let expected: f64 = (1..last)
            .map(|k| moment(k) * cell / length.powi(3) * cell * (last - k) as f64)
            .sum();
        let tip = cloth.positions[last].z;
        assert!(
            (tip / expected - 1.0).abs() < 0.05,
            "{tip} mm, beam theory {expected} mm"
        );
    }

    #[test]
    fn a_sheet_that_hangs_from_one_edge_is_its_length_again_when_it_is_let_go() {
        let mut cloth = Cloth::new(A4, 70.0);
        for k in 0..cloth.columns {
            cloth.hold(k);
        }
        for step in 0..300 {
            let fraction = (f64::from(step) / 150.0).min(1.0);
            let gravity = vec![DVec3::Y * FREE_FALL * fraction; cloth.rest.len()];
            cloth.step(0.003, &gravity, 0.97);
        }
        let strain = |cloth: &Cloth| {
            let strain = |link: &Link| {
                let [a, b] = link.ends.map(|end| cloth.positions[end]);
                (a.distance(b) / link.rest - 1.0).abs()
            };
            cloth.links.iter().map(strain).fold(0.0, f64::max)
        };
        // In steps this large a sweep does not take back all that the weight of eleven rows draws out.
        let held = strain(&cloth);
        assert!(held > 0.01, "{held}");
        cloth.settle(120, 0.0015);
        assert!(strain(&cloth) < 0.002, "{}", strain(&cloth));
    }

    #[test]
    fn a_sheet_rolled_up_further_than_once_touches_itself() {
        let mut cloth = Cloth::new(A4, 70.0);
        assert!(!cloth.touches_itself());
        // 297 mm around a circumference of 251 and of 503 mm.
        rolled(&mut cloth, 40.0, DVec2::Y);
        assert!(cloth.touches_itself());
        rolled(&mut cloth, 80.0, DVec2::Y);
        assert!(!cloth.touches_itself());
    }

    #[test]
    fn the_surface_passes_through_the_particles_and_is_straight_where_they_are() {
        let mut cloth = Cloth::new(A4, 70.0);
        for uv in [DVec2::ZERO, DVec2::new(0.31, 0.77), DVec2::ONE] {
            assert!(cloth.surface(uv).distance(((uv - 0.5) * A4).extend(0.0)) < 1e-9);
        }
        rolled(&mut cloth, 100.0, DVec2::Y);
        let cells = DVec2::new((cloth.columns - 1) as f64, (cloth.rows - 1) as f64);
        for (i, j) in [(0, 0), (5, 3), (cloth.columns - 1, cloth.rows - 1)] {
            let uv = DVec2::new(i as f64, j as f64) / cells;
            assert!(cloth.surface(uv).distance(cloth.positions[j * cloth.columns + i]) < 1e-9);
        }
        // Between them it follows the cylinder: a chord would be off by the sagitta 20^2 / (8 * 100) = 0.5 mm.
        let middle = cloth.surface(DVec2::new(0.5 + 0.5 / cells.x, 0.5));
        let axis_distance = middle.x.hypot(middle.z - 100.0);
        assert!((axis_distance - 100.0).abs() < 0.05, "{axis_distance}");
    }
}
