//! A method like ROBUSfT: matches, the vote of their neighbours, a warp, and a mesh of particles.
//!
//! M. Shetab-Bushehri, M. Aranda, Y. Mezouar, A. Bartoli, E. Ozgur, *ROBUSfT: Robust Real-Time Shape-from-Template, a C++ Library*, 2023,
//! with the particles of E. Ozgur, A. Bartoli, *Particle-SfT: a Provably-Convergent, Fast Shape-from-Template Algorithm*, IJCV 123, 2017.
//!
//! # Steps
//!
//! 1. A match is kept when enough of its nearest neighbours on the template are also among its nearest neighbours in the image: wrong ones
//!    have other neighbours there. Twice, the second time among those that are left.
//! 2. A B-spline warp is fitted to them; matches far from it go, and it is fitted again.
//! 3. The warp gives the sightlines of the vertices that matches surround. Particles at the vertices are put in turn onto the nearest points
//!    of their sightlines and at the lengths of their edges from one another, until they rest.
//!
//! # Where we had to decide
//!
//! * Matches are those of our features, where the article has SIFT on a GPU. Its first step also triangulates both sets; ours is the vote alone.
//! * It begins where the last frame ended. Every frame of ours is the first: particles start on their sightlines, at the depth at which the
//!   edges have their lengths on average.

use crate::frame::Correspondence;
use crate::spline::{Spline, SplineFit, SplineGrid};
use anyhow::{Result, ensure};
use deepsft_geometry::fitting::GridInterpolation;
use deepsft_geometry::glam::{DVec2, DVec3};
use deepsft_geometry::{Camera, Template};

/// How much larger cells are than those of the template's mesh.
const COARSER: usize = 2;

/// Nearest neighbours that vote, and the least share of common ones in both rounds.
const NEIGHBOURS: usize = 12;
const SHARES: [f64; 2] = [0.25, 0.5];

/// Cells of the warp, the weight of its bending, and the pixels from it beyond which matches go.
const CELLS: usize = 8;
const BENDING: f64 = 1e-7;
const NEAR_PX: [f64; 2] = [12.0, 6.0];

const FEWEST: usize = 20;

/// A vertex has a sightline when a match is as near as this, edges.
const SURROUNDED: f64 = 1.5;

/// Rounds of the particles, and how far edges are brought to their lengths in one.
const ROUNDS: usize = 400;
const STIFFNESS: f64 = 0.9;

/// The method for one sheet.
#[derive(Debug)]
pub struct Robusft {
    coarse: Template,
    to_template: GridInterpolation,
    /// Ends and length of each edge.
    edges: Vec<([usize; 2], f64)>,
}

impl Robusft {
    /// Prepares what does not depend on the frame.
    ///
    /// # Errors
    /// For a template that is no sheet.
    pub fn new(template: &Template) -> Result<Self> {
        let coarse = template.coarser(COARSER)?;
        let rest = coarse.mesh().vertices();
        let edge = |[a, b]: [usize; 2]| ([a, b], rest[a].distance(rest[b]));
        Ok(Self {
            edges: coarse.mesh().edges().into_iter().map(edge).collect(),
            to_template: GridInterpolation::cubic(&coarse, template.mesh())?,
            coarse,
        })
    }

    /// Reconstructs the vertices of the template's mesh (mm, camera frame) from `matches`, right and wrong ones.
    ///
    /// # Errors
    /// When fewer than 20 matches agree.
    pub fn reconstruct(&self, matches: &[Correspondence], camera: &Camera) -> Result<Vec<DVec3>> {
        let mut kept = matches.to_vec();
        for share in SHARES {
            kept = confirmed(&kept, share);
        }
        let mut warp = self.warp(&kept)?;
        for near in NEAR_PX {
            let is_near = |m: &Correspondence| {
                let warped = camera.pixel_from_ray(warp.value(m.place).into());
                warped.is_some_and(|pixel| pixel.distance(m.pixel) < near)
            };
            kept.retain(is_near);
            warp = self.warp(&kept)?;
        }
        Ok(self.to_template.apply(&self.particles(&warp, &kept)))
    }

    fn warp(&self, matches: &[Correspondence]) -> Result<Spline<2>> {
        ensure!(
            matches.len() >= FEWEST,
            "{} matches agree, expected at least {FEWEST}",
            matches.len()
        );
        let mut fit = SplineFit::<2>::new(SplineGrid::new(self.coarse.size_mm(), CELLS));
        for m in matches {
            fit.add_value(m.place, 1.0 / matches.len() as f64, m.ray.to_array());
        }
        fit.add_bending(BENDING);
        fit.solve()
    }

    /// Step 3: the particles at rest.
    fn particles(&self, warp: &Spline<2>, matches: &[Correspondence]) -> Vec<DVec3> {
        let places: Vec<DVec2> = (self.coarse.mesh().texture_coordinates().iter())
            .map(|uv| *uv * self.coarse.size_mm())
            .collect();
        let rays: Vec<DVec3> = places
            .iter()
            .map(|&place| DVec2::from(warp.value(place)).extend(1.0))
            .collect();
        let reach = SURROUNDED * self.edges.iter().map(|edge| edge.1).sum::<f64>() / self.edges.len() as f64;
        let is_surrounded = |place: &DVec2| matches.iter().any(|m| m.place.distance(*place) < reach);
        let sightlines: Vec<Option<DVec3>> = places
            .iter()
            .zip(&rays)
            .map(|(place, ray)| is_surrounded(place).then(|| ray.normalize()))
            .collect();
        let on_sightlines = |[a, b]: &[usize; 2]| sightlines[*a].is_some() && sightlines[*b].is_some();
        let (mut rest, mut seen) = (0.0, 0.0);
        for (ends, length) in self.edges.iter().filter(|(ends, _)| on_sightlines(ends)) {
            rest += length;
            seen += rays[ends[0]].distance(rays[ends[1]]);
        }
        let depth = if seen > 0.0 { rest / seen } else { 1.0 };
        let mut particles: Vec<DVec3> = rays.iter().map(|ray| *ray * depth).collect();
        for _ in 0..ROUNDS {
            for &([a, b], length) in &self.edges {
                let edge = particles[b] - particles[a];
                let pull = edge.normalize_or_zero() * (STIFFNESS * (edge.length() - length) / 2.0);
                particles[a] += pull;
                particles[b] -= pull;
            }
            for (particle, sightline) in particles.iter_mut().zip(&sightlines) {
                if let Some(sightline) = sightline {
                    *particle = particle.project_onto_normalized(*sightline);
                }
            }
        }
        particles
    }
}

/// The matches of whose nearest neighbours on the template at least `share` are among the nearest in the image.
fn confirmed(matches: &[Correspondence], share: f64) -> Vec<Correspondence> {
    let nearest = |of: &dyn Fn(&Correspondence) -> DVec2, k: usize| {
        let from = of(&matches[k]);
        let mut others: Vec<(f64, usize)> = (matches.iter().enumerate())
            .filter(|(other, _)| *other != k)
            .map(|(other, m)| (of(m).distance_squared(from), other))
            .collect();
        let count = NEIGHBOURS.min(others.len());
        if count < others.len() {
            others.select_nth_unstable_by(count, |a, b| a.0.total_cmp(&b.0));
        }
        others[..count].iter().map(|other| other.1).collect::<Vec<usize>>()
    };
    let is_confirmed = |k: &usize| {
        let (template, image) = (nearest(&|m| m.place, *k), nearest(&|m| m.pixel, *k));
        let common = template.iter().filter(|other| image.contains(other)).count();
        common as f64 >= share * NEIGHBOURS as f64
    };
    (0..matches.len()).filter(is_confirmed).map(|k| matches[k]).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::frame::tests::{SIZE_MM, correspondences, cylinder};
    use deepsft_geometry::{Picture, training_camera};

    #[test]
    fn a_bent_sheet_is_recovered_from_matches_of_which_a_third_is_wrong() {
        let template = Template::thin_shell(Picture::from_fn(1, 1, |_, _| [0; 3]), SIZE_MM.x, SIZE_MM.y).unwrap();
        let truth = |place: DVec2| cylinder(place, 130.0, 0.5) + DVec3::Z * 500.0;
        let mut matches = correspondences(&truth, 20);
        let places: Vec<DVec2> = matches.iter().map(|m| m.place).collect();
        for k in (0..matches.len()).step_by(3) {
            matches[k].place = places[(k * 97 + 31) % places.len()];
        }
        let vertices = Robusft::new(&template)
            .unwrap()
            .reconstruct(&matches, &training_camera())
            .unwrap();
        let errors = template.mesh().texture_coordinates().iter().zip(&vertices);
        let errors = errors.map(|(uv, p)| p.distance(truth(*uv * SIZE_MM)));
        let mean = errors.sum::<f64>() / vertices.len() as f64;
        // Half a per cent of the distance: the particles stop where the sum of their constraints rests.
        assert!(mean < 2.5, "{mean} mm");
    }
}
