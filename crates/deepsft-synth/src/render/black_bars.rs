//! Black bars: what the canonical warp leaves where a narrower or upright camera saw nothing.

use crate::random::uniform;
use deepsft_geometry::{Camera, Maps, Picture};
use rand::{Rng, RngExt};

/// Aspect ratios (width / height) of phone and web cameras, both ways up.
const ASPECTS: [f32; 6] = [4.0 / 3.0, 3.0 / 2.0, 16.0 / 9.0, 1.0, 3.0 / 4.0, 9.0 / 16.0];

/// Focal length as a fraction of the long side: phones' main cameras (0.73 to 1.01 holds 80 % of them) and longer lenses.
const FOCAL_FRACTION: [f64; 2] = [0.73, 1.2];

/// Least part of the canonical image's sides that a camera must see to be of use.
const MIN_SIDE: f32 = 0.45;

/// Draws until a camera leaves bars.
const TRIES: usize = 30;

/// The part of the image that the camera saw: columns and rows, the ends exclusive.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Bars {
    columns: [usize; 2],
    rows: [usize; 2],
}

impl Bars {
    /// Draws a camera that does not fill the image of `canonical`.
    pub(crate) fn sample<R: Rng + ?Sized>(canonical: &Camera, rng: &mut R) -> Self {
        let side = [canonical.size().width as f32, canonical.size().height as f32];
        let principal = canonical.principal_point().as_vec2();
        let mut bars = Self {
            columns: [0, canonical.size().width],
            rows: [0, canonical.size().height],
        };
        for _ in 0..TRIES {
            let aspect = ASPECTS[rng.random_range(0..ASPECTS.len())];
            let long = canonical.focal().x as f32 / uniform(rng, FOCAL_FRACTION);
            let seen = [long * aspect.min(1.0), long / aspect.max(1.0)];
            // Principal points are off the middle by a percent or so.
            let mut span = |k: usize, centre: f32| {
                let centre = centre + long * uniform(rng, [-0.015, 0.015]);
                [
                    (centre - seen[k] / 2.0).max(0.0) as usize,
                    (centre + seen[k] / 2.0).min(side[k]) as usize,
                ]
            };
            bars = Self {
                columns: span(0, principal.x),
                rows: span(1, principal.y),
            };
            let [width, height] = [bars.columns, bars.rows].map(|[low, high]| (high - low) as f32);
            let wide_enough = width > MIN_SIDE * side[0] && height > MIN_SIDE * side[1];
            if wide_enough && (width < side[0] - 4.0 || height < side[1] - 4.0) {
                break;
            }
        }
        bars
    }

    /// Whether the camera saw a pixel.
    pub(crate) fn shows(&self, column: usize, row: usize) -> bool {
        (self.columns[0]..self.columns[1]).contains(&column) && (self.rows[0]..self.rows[1]).contains(&row)
    }

    /// The picture, black in the bars.
    pub(crate) fn blacken(&self, picture: Picture) -> Picture {
        Picture::from_fn(picture.width(), picture.height(), |x, y| {
            if self.shows(x, y) { picture.pixel(x, y) } else { [0; 3] }
        })
    }

    /// Takes the bars out of the truth.
    pub(crate) fn clear(&self, truth: &mut Maps) {
        let width = truth.size().width;
        for pixel in 0..width * truth.size().height {
            if !self.shows(pixel % width, pixel / width) {
                truth.clear(pixel);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::random::{Stream, generator};
    use deepsft_geometry::training_camera;

    #[test]
    fn bars_leave_a_useful_part_and_are_black_and_outside_the_object() {
        let mut kinds = [0; 3];
        for index in 0..200 {
            let bars = Bars::sample(&training_camera(), &mut generator(3, index, Stream::Scene));
            let (w, h) = (bars.columns[1] - bars.columns[0], bars.rows[1] - bars.rows[0]);
            assert!(w > 215 && h > 120 && (w < 480 || h < 270), "{bars:?}");
            kinds[usize::from(w == 480) + 2 * usize::from(h == 270)] += 1;
            let picture = bars.blacken(Picture::from_fn(480, 270, |_, _| [9; 3]));
            let mut truth = Maps::new(480, 270, vec![1.0; 480 * 270], vec![[0.5; 2]; 480 * 270]).unwrap();
            bars.clear(&mut truth);
            assert_eq!(truth.area(), w * h);
            assert!((0..480 * 270).all(|p| (picture.pixel(p % 480, p / 480) == [9; 3]) == truth.inside(p)));
        }
        // Bars on all sides and at the left and right only both occur.
        assert!(kinds[0] > 10 && kinds[2] > 10, "{kinds:?}");
    }
}
