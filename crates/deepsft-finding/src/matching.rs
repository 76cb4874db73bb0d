//! Matches between the features of an image and those of a target.

use crate::descriptor::BITS;
use crate::features::Features;
use crate::target::PictureTarget;

/// Matches whose descriptors differ in more than this fraction of their bits are none.
const MOST_DIFFERENT: f32 = 0.33;

/// The best match must be this much nearer than the best one elsewhere on the target.
const MOST_RATIO: f32 = 0.95;

/// Elsewhere: farther than this, mm. Several corners of one spot must not reject one another.
const ELSEWHERE_MM: f32 = 6.0;

/// A feature of the image and one of the target that look alike.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Match {
    /// Position in the image, pixels.
    pub pixel: [f32; 2],
    /// Place on the sheet, mm.
    pub place: [f32; 2],
    /// The similarity that takes directions and lengths of the image (pixels) to those of the sheet (mm): its angle and the
    /// logarithm of its scale.
    pub angle: f32,
    pub log_scale: f32,
    /// Differing bits of the best match by those of the best elsewhere.
    pub ratio: f32,
}

/// For each feature of the image the most similar of the target, where it stands out; the clearest first.
pub(crate) fn matches(image: &Features, target: &PictureTarget) -> Vec<Match> {
    let others = &target.features().all;
    let mut distances = vec![0_u32; others.len()];
    let most = (MOST_DIFFERENT * BITS as f32) as u32;
    let mut found = Vec::new();
    for feature in &image.all {
        let (mut best, mut least) = (0, u32::MAX);
        for (i, (other, distance)) in others.iter().zip(&mut distances).enumerate() {
            *distance = feature.descriptor.distance(&other.descriptor);
            if *distance < least {
                (best, least) = (i, *distance);
            }
        }
        if least > most {
            continue;
        }
        let place = target.places[best];
        let limit = (least as f32 / MOST_RATIO) as u32 + 1;
        let elsewhere = |p: [f32; 2]| (p[0] - place[0]).hypot(p[1] - place[1]) > ELSEWHERE_MM;
        let rivals = distances.iter().zip(&target.places).filter(|(d, p)| **d < limit && elsewhere(**p));
        let rival = rivals.map(|(d, _)| *d).min().unwrap_or(limit);
        let ratio = least as f32 / rival.max(1) as f32;
        if ratio > MOST_RATIO {
            continue;
        }
        found.push(Match {
            pixel: feature.position,
            place,
            angle: others[best].angle - feature.angle,
            log_scale: (others[best].scale * target.mm_per_pixel / feature.scale).ln(),
            ratio,
        });
    }
    found.sort_by(|a, b| a.ratio.total_cmp(&b.ratio));
    found
}
