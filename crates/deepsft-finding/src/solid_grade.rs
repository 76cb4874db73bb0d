//! The grade of a solid: from which of its sides features find it, before anybody films it.
//!
//! The finder looks for the solid in drawings of it, from six sides, near and far, tilted to and fro. Nothing but its own texture tells from
//! which sides it has enough to hold on to.

use crate::features::Features;
use crate::finder::FeatureFinder;
use crate::grade::GradeLevel;
use deepsft_geometry::glam::{DQuat, DVec2, DVec3};
use deepsft_geometry::raster::VisibleSurface;
use deepsft_geometry::{Camera, GeometryError, TRAINING_FOCAL, draw_template};
use std::f64::consts::{FRAC_PI_2, PI};

/// Columns and rows of a view, and its focal length in those of the training camera: as a finder sees a photograph.
const VIEW: (usize, usize) = (960, 540);
const ZOOM: f64 = 2.0;

/// The views of a side: turned about x and about y, radians, and how much of the view's height the solid fills.
const VIEWS: [(f64, f64, f64); 4] = [(0.3, 0.1, 0.9), (-0.3, -0.1, 0.45), (0.1, -0.3, 0.45), (-0.1, 0.3, 0.9)];

/// Nothing nearer is drawn, mm, with room.
const NEAR_MM: f64 = 60.0;

/// Mean error of its vertices up to which a pose is right, as a fraction of the solid's radius.
const RIGHT: f64 = 0.15;

/// Least share of views in which it is found, from grade to grade.
const FOUND: [f64; 3] = [0.1, 0.4, 0.75];

/// The six sides of a solid by name, each with the rotation that turns it to the viewer.
pub fn solid_sides() -> [(&'static str, DQuat); 6] {
    [
        ("the front", DQuat::IDENTITY),
        ("its left", DQuat::from_rotation_y(FRAC_PI_2)),
        ("the back", DQuat::from_rotation_y(PI)),
        ("its right", DQuat::from_rotation_y(-FRAC_PI_2)),
        ("above", DQuat::from_rotation_x(FRAC_PI_2)),
        ("below", DQuat::from_rotation_x(-FRAC_PI_2)),
    ]
}

/// How well features will find a solid without training, side by side.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct SolidGrade {
    /// The verdict over all sides.
    pub level: GradeLevel,
    /// Each side with the fraction of its views in which the solid is found: the front, its left, the back, its right, above, below.
    pub sides: [(&'static str, f64); 6],
    /// What that means, in a sentence for people; `None` where all sides are found.
    pub advice: Option<String>,
}

impl FeatureFinder {
    /// Grades a solid by looking for it in 24 drawings of it; takes some seconds.
    ///
    /// # Errors
    /// As [`FeatureFinder::find`].
    pub fn grade_solid(&mut self) -> Result<SolidGrade, GeometryError> {
        let mut found = [0.0; 6];
        for (count, (_, turn)) in found.iter_mut().zip(solid_sides()) {
            for view in VIEWS {
                *count += f64::from(u8::from(self.finds(turn, view)?)) / VIEWS.len() as f64;
            }
        }
        let names = solid_sides().map(|(name, _)| name);
        Ok(SolidGrade::of(std::array::from_fn(|k| (names[k], found[k]))))
    }

    /// Whether it is found where it is in a view from the side that `turn` turns to the viewer.
    fn finds(&mut self, turn: DQuat, (about_x, about_y, filled): (f64, f64, f64)) -> Result<bool, GeometryError> {
        let template = self.template();
        let radius = template.extent_mm().length() / 2.0;
        let size = DVec2::new(VIEW.0 as f64, VIEW.1 as f64);
        let focal = ZOOM * TRAINING_FOCAL;
        let camera = Camera::pinhole(VIEW, DVec2::splat(focal), size / 2.0)?;
        let distance = (focal * 2.0 * radius / (filled * size.y)).max(radius + NEAR_MM);
        let turn = DQuat::from_rotation_x(about_x) * DQuat::from_rotation_y(about_y) * turn;
        let place = |p: &DVec3| turn * *p + distance * DVec3::Z;
        let truth: Vec<DVec3> = template.mesh().vertices().iter().map(place).collect();
        let maps = VisibleSurface::new(template.mesh(), &truth, &camera).maps();
        let drawn = draw_template(template.texture(), &maps);
        let (features, camera) = Features::of(&drawn, &camera)?;
        let Some(found) = self.find(&features, &camera)? else {
            return Ok(false);
        };
        let off = truth.iter().zip(&found.vertices_camera).map(|(p, q)| p.distance(*q));
        Ok(off.sum::<f64>() < RIGHT * radius * truth.len() as f64)
    }
}

impl SolidGrade {
    fn of(sides: [(&'static str, f64); 6]) -> Self {
        let level = GradeLevel::of(sides.iter().map(|(_, found)| found).sum::<f64>() / 6.0, FOUND);
        let lost = sides.iter().filter(|(_, found)| *found < 0.5);
        let lost: Vec<&str> = lost.map(|(name, _)| *name).collect();
        let advice = match lost.as_slice() {
            [] => None,
            _ if level == GradeLevel::Hopeless => {
                Some("Without training it is not found: train its own network.".to_owned())
            }
            [one] => Some(format!(
                "Without training it is hardly found from {one}: there its own network finds it."
            )),
            [first @ .., last] => Some(format!(
                "Without training it is hardly found from {} and {last}: there its own network finds it.",
                first.join(", ")
            )),
        };
        Self { level, sides, advice }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::grade::GradeLevel::{Fair, Hopeless};

    #[test]
    fn sides_that_are_lost_are_named() {
        let grade = |found: [f64; 6]| SolidGrade::of(std::array::from_fn(|k| (solid_sides()[k].0, found[k])));
        assert_eq!(grade([1.0, 1.0, 0.75, 1.0, 0.5, 0.5]).advice, None);
        let some = grade([1.0, 1.0, 0.25, 1.0, 0.5, 0.0]);
        assert_eq!(some.level, Fair);
        assert!(some.advice.unwrap().contains("from the back and below:"));
        assert_eq!(grade([0.25, 0.0, 0.0, 0.0, 0.0, 0.0]).level, Hopeless);
    }
}
