//! Matches between the features of an image and those of a target.

use crate::descriptor::BITS;
use crate::features::Features;
use crate::hamming::distances;
use crate::target::PictureTarget;
use deepsft_geometry::glam::Vec2;

/// Matches whose descriptors differ in more than this fraction of their bits are none.
const MAX_DIFFERENT: f32 = 0.33;

/// The best match must be this much nearer than the best one elsewhere on the target.
const MAX_RATIO: f32 = 0.95;

/// Elsewhere: farther than this, pixels of the target's picture (6 mm on an A4 sheet). Several corners of one spot must not
/// reject one another.
pub(crate) const ELSEWHERE_PX: f32 = 13.0;

/// A match: a point of the image and one of the sheet that look alike.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Match {
    /// Position in the image, pixels.
    pub pixel: Vec2,
    /// Place on the sheet, mm from its upper left corner.
    pub place: Vec2,
    /// Angle by which directions of the image turn into those of the sheet, radians.
    pub angle: f32,
    /// Length on the sheet per length in the image, mm per pixel.
    pub scale: f32,
}

impl Match {
    /// The match of feature `image` of `features` with feature `other` of `target`.
    pub(crate) fn of(features: &Features, image: usize, target: &PictureTarget, other: usize) -> Self {
        let feature = &features.all[image];
        Self {
            pixel: feature.position,
            place: target.places[other],
            angle: target.features.all[other].angle - feature.angle,
            scale: target.scale_mm(other) / feature.scale,
        }
    }
}

/// For each feature of the image the most similar of the target, where it stands out; the clearest first.
pub(crate) fn matches(features: &Features, target: &PictureTarget) -> Vec<Match> {
    let elsewhere_mm = ELSEWHERE_PX * target.mm_per_pixel;
    let most = (MAX_DIFFERENT * BITS as f32) as u16;
    let (mut of_one, mut found) = (Vec::new(), Vec::new());
    for (image, descriptor) in features.descriptors.iter().enumerate() {
        let (best, least) = distances(descriptor, &target.features.descriptors, &mut of_one);
        if least > most {
            continue;
        }
        let place = target.places[best];
        // One bit more for all: two exact copies are rivals too. A rival at the limit is far enough.
        let limit = (f32::from(least + 1) / MAX_RATIO) as u16 + 1;
        let rivals = of_one.iter().zip(&target.places);
        let rivals = rivals.filter(|(distance, other)| **distance < limit && other.distance(place) > elsewhere_mm);
        let rival = rivals.map(|(distance, _)| *distance).min().unwrap_or(limit);
        let ratio = f32::from(least + 1) / f32::from(rival + 1);
        if ratio <= MAX_RATIO {
            found.push((ratio, Match::of(features, image, target, best)));
        }
    }
    found.sort_unstable_by(|a, b| a.0.total_cmp(&b.0));
    found.into_iter().map(|(_, found)| found).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::descriptor::xorshift;
    use crate::features::{FeatureOptions, IMAGE};
    use deepsft_geometry::{Picture, Template};

    /// Rectangles of random grey on random grey: many corners, none like the other.
    fn print() -> Picture {
        let mut random = xorshift(0x9e37_79b9_7f4a_7c15);
        let mut random = move |below: u64| (random() >> 33) % below;
        let mut grey = vec![120_u8; 400 * 300];
        for _ in 0..250 {
            let (left, top) = (random(400) as usize, random(300) as usize);
            let (right, bottom) = (left + 6 + random(50) as usize, top + 6 + random(50) as usize);
            let value = random(256) as u8;
            for y in top..bottom.min(300) {
                grey[400 * y + left..400 * y + right.min(400)].fill(value);
            }
        }
        Picture::from_fn(400, 300, |x, y| [grey[400 * y + x]; 3])
    }

    fn target(width_mm: f64, picture: Picture) -> PictureTarget {
        PictureTarget::new(Template::thin_shell(picture, width_mm, 0.75 * width_mm).unwrap()).unwrap()
    }

    #[test]
    fn a_print_turned_by_a_quarter_is_matched_with_angle_scale_and_place() {
        let print = print();
        let target = target(400.0, print.clone());
        let found = matches(&Features::search(&print.turned_clockwise(), IMAGE), &target);
        assert!(found.len() > 300, "{}", found.len());
        let right = found.iter().filter(|m| {
            let expected = Vec2::new(m.pixel.y, 300.0 - m.pixel.x);
            let turn = (m.angle + std::f32::consts::FRAC_PI_2).rem_euclid(std::f32::consts::TAU);
            m.place.distance(expected) < 3.0
                && turn.min(std::f32::consts::TAU - turn) < 0.2
                && (0.75..1.34).contains(&m.scale)
        });
        let right = right.count();
        // Most of the others are corners of coarse levels, whose pixels are larger than 3 mm.
        assert!(right * 5 > found.len() * 4, "{right} of {}", found.len());
    }

    #[test]
    fn the_size_of_the_sheet_changes_nothing_but_lengths() {
        let print = print();
        // A tenth smaller, so that corners look alike and not equal.
        let shown = Picture::from_fn(360, 270, |x, y| {
            let color = print.sample((x as f64 + 0.5) / 0.9, (y as f64 + 0.5) / 0.9);
            color.map(|c| c as u8)
        });
        let features = Features::search(&shown, IMAGE);
        let found = [30.0, 300.0, 5000.0].map(|width_mm| {
            let target = target(width_mm, print.clone());
            let relative = |m: &Match| (m.pixel, m.place / width_mm as f32);
            matches(&features, &target).iter().map(relative).collect::<Vec<_>>()
        });
        assert!(found[0].len() > 300 && found[0].len() == found[1].len() && found[1].len() == found[2].len());
        for (a, others) in found[0].iter().zip(found[1].iter().zip(&found[2])) {
            for b in [others.0, others.1] {
                assert!(a.0 == b.0 && a.1.distance(b.1) < 1e-5);
            }
        }
    }

    #[test]
    fn a_print_of_equal_motifs_gives_no_match_inside() {
        let motif = print();
        let print = Picture::from_fn(400, 300, |x, y| motif.pixel(100 + x % 100, 100 + y % 100));
        let target = target(400.0, print.clone());
        let features = Features::search(
            &print,
            FeatureOptions {
                levels: 1,
                longest_side: 0,
                ..IMAGE
            },
        );
        let found = matches(&features, &target);
        // Only the border and what a level of the pyramid makes of it is like nothing else.
        let inside =
            |m: &&Match| m.place.cmpge(Vec2::splat(40.0)).all() && m.place.cmple(Vec2::new(360.0, 260.0)).all();
        let (inside, all) = (found.iter().filter(inside).count(), features.all.len());
        assert!(all > 500 && inside * 50 < all, "{inside} of {all}");
    }
}
