//! The toy's texture: every piece of cloth with its print, its seam, and what is embroidered on it.

use super::body::Limb;
use super::fabric::{Fabric, Print};
use super::sewing::{Piece, Side};
use deepsft_geometry::Picture;
use deepsft_geometry::glam::{DVec2, DVec3, Vec2, Vec3};
use deepsft_synth::random::mix;
use rayon::prelude::*;
use std::collections::HashMap;

/// Texels around a piece that continue its colours, so that filters do not mix pieces.
const GUTTER: usize = 10;

/// Colour between the pieces.
const GROUND: Vec3 = Vec3::new(0.62, 0.56, 0.50);

/// Sewing thread.
const THREAD: Vec3 = Vec3::new(0.97, 0.93, 0.83);

/// Half the width of a seam, and from where to where stitches lie beside it, mm.
const SEAM_MM: f64 = 0.8;
const STITCHES_MM: [f64; 2] = [1.5, 2.3];

/// Length of a stitch with the gap after it, mm.
const STITCH_MM: f64 = 3.4;

fn rgb(hex: u32) -> Vec3 {
    Vec3::new((hex >> 16 & 255) as f32, (hex >> 8 & 255) as f32, (hex & 255) as f32) / 255.0
}

fn inks(hex: &[u32]) -> Vec<Vec3> {
    hex.iter().map(|&h| rgb(h)).collect()
}

/// The cloth of each piece. No two are alike, and left differs from right.
fn fabric(limb: Limb, side: Side) -> Fabric {
    let dots = |ground, colors: &[u32], pitch| Print::Dots {
        ground: rgb(ground),
        inks: inks(colors),
        pitch,
    };
    let stripes = |colors: &[u32], pitch, angle| Print::Stripes {
        inks: inks(colors),
        pitch,
        angle,
    };
    let plaid = |colors: &[u32], pitch| Print::Plaid {
        inks: inks(colors),
        pitch,
    };
    let flowers = |ground, colors: &[u32], pitch, petals, depth| Print::Flowers {
        ground: rgb(ground),
        inks: inks(colors),
        pitch,
        petals,
        depth,
    };
    let plush = |color| Print::Plush { color: rgb(color) };
    let patches = vec![
        flowers(0x2f4b7c, &[0xf4d35e, 0xee964b, 0xf95738], 9.0, 5.0, 0.45),
        dots(0xe9e1cc, &[0xc8553d, 0x2a7f86, 0xe0a458], 7.0),
        plaid(&[0x8fb339, 0x4b7f52, 0xdde6c8, 0x315c42], 6.5),
        stripes(&[0xd1495b, 0xf3e9d2, 0x8d2b3a], 5.0, 0.3),
        flowers(0xf0cf65, &[0xffffff, 0xd7816a, 0x93748a], 8.0, 6.0, 0.5),
        dots(0x3d5a80, &[0x98c1d9, 0xe0fbfc, 0xee6c4d], 6.0),
        plaid(&[0xbd4f6c, 0xf0cf65, 0xd7816a, 0x5d3a52], 7.5),
    ];
    let print = match (limb, side) {
        (Limb::Head, Side::Front) => plush(0xe8d5b7),
        (Limb::Head, _) => dots(0xc99b6a, &[0xe8d5b7, 0xa8763e, 0x8a5a2b], 8.0),
        (Limb::LeftEar, Side::Front) => flowers(0xf2b8b5, &[0xffffff, 0xd5606b, 0xf6e27f, 0x7fa66a], 8.5, 5.0, 0.5),
        (Limb::LeftEar, _) => stripes(&[0x2f6690, 0xd9dcd6, 0x81c3d7, 0x16425b], 8.0, 0.9),
        (Limb::RightEar, Side::Front) => dots(0xf7e3c4, &[0xd1495b, 0xedae49, 0x66a182, 0x2e4057], 7.0),
        (Limb::RightEar, _) => plaid(&[0x3f784c, 0xe8e9c9, 0x9bc184, 0x1e4d2b], 8.0),
        (Limb::Body, Side::Front) => Print::Patchwork { prints: patches },
        (Limb::Body, Side::BackRight) => flowers(0x27476e, &[0xf4d35e, 0xfdf0d5, 0xe07a5f], 11.0, 5.0, 0.6),
        (Limb::Body, _) => flowers(0xd9a441, &[0x5f7a3a, 0x8a4b2a, 0xf3e5b5], 10.0, 2.0, 0.75),
        (Limb::LeftArm, Side::Front) => stripes(&[0xb23a48, 0xfcf1e3, 0xdb7f67, 0x8c2f39], 9.0, 0.7),
        (Limb::LeftArm, _) => dots(0x6d597a, &[0xe8c5b0, 0xb56576, 0xeaac8b], 6.5),
        (Limb::RightArm, Side::Front) => dots(0x2a9d8f, &[0xf4f1de, 0xe9c46a, 0x1d5c63, 0xe76f51], 7.5),
        (Limb::RightArm, _) => plaid(&[0xe07a5f, 0x3d405b, 0xf2cc8f, 0x81b29a], 7.0),
        (Limb::LeftLeg, Side::Front) => plaid(&[0x33658a, 0xf6ae2d, 0x86bbd8, 0xf5f1e3], 8.5),
        (Limb::LeftLeg, _) => flowers(0x7d8c3b, &[0xf7f4d4, 0xf2a65a, 0xa23b3b], 9.0, 6.0, 0.5),
        (Limb::RightLeg, Side::Front) => flowers(0xd76a5c, &[0xfdf3dc, 0xf5c05a, 0x5b2e48], 9.5, 5.0, 0.55),
        (Limb::RightLeg, _) => stripes(&[0x5f7470, 0xe0e2db, 0xb8bdb5, 0x889696], 7.5, 1.2),
        (Limb::Tail, _) => plush(0xfaf4e8),
    };
    Fabric::new(print, mix(limb as u64 * 16 + side as u64))
}

/// A place on the surface of the toy at rest.
#[derive(Clone, Copy)]
struct Place {
    p: DVec3,
    limb: Limb,
    side: Side,
}

/// The texture: `side` texels a side, each piece's corner at `corners` (texels), `scale` texels a millimetre.
pub(crate) fn paint(pieces: &[Piece], vertices: &[DVec3], corners: &[DVec2], scale: f64, side: usize) -> Picture {
    let painted: Vec<Vec<(usize, Vec3)>> = pieces
        .par_iter()
        .zip(corners)
        .map(|(piece, corner)| paint_piece(piece, vertices, *corner, scale, side))
        .collect();
    let mut texels: Vec<Option<Vec3>> = vec![None; side * side];
    for (texel, color) in painted.into_iter().flatten() {
        texels[texel] = Some(color);
    }
    for _ in 0..GUTTER {
        grow(&mut texels, side);
    }
    Picture::from_fn(side, side, |x, y| {
        let color = texels[y * side + x].unwrap_or(GROUND) * 255.0;
        color.to_array().map(|c| c.round() as u8)
    })
}

/// Texels without a colour get the mean of those beside them that have one.
fn grow(texels: &mut [Option<Vec3>], side: usize) {
    let before = texels.to_vec();
    for (i, texel) in texels.iter_mut().enumerate().filter(|(_, texel)| texel.is_none()) {
        let (x, y) = (i % side, i / side);
        let beside = [
            (x > 0).then(|| i - 1),
            (x + 1 < side).then_some(i + 1),
            (y > 0).then(|| i.saturating_sub(side)),
            (y + 1 < side).then_some(i + side),
        ];
        let colors: Vec<Vec3> = beside.into_iter().flatten().filter_map(|j| before[j]).collect();
        if !colors.is_empty() {
            *texel = Some(colors.iter().sum::<Vec3>() / colors.len() as f32);
        }
    }
}

/// Texels of a piece with their colours.
fn paint_piece(piece: &Piece, vertices: &[DVec3], corner: DVec2, scale: f64, side: usize) -> Vec<(usize, Vec3)> {
    let fabric = fabric(piece.limb, piece.side);
    let border = Border::of(piece);
    let mut painted = Vec::new();
    for face in &piece.faces {
        let [a, b, c] = face.map(|v| corner + piece.flat_mm[v] * scale);
        let area = (b - a).perp_dot(c - a);
        if area == 0.0 {
            continue;
        }
        let (low, high) = (a.min(b).min(c), a.max(b).max(c));
        let texels =
            |low: f64, high: f64| (low - 0.5).ceil().max(0.0) as usize..((high + 0.5).max(0.0) as usize).min(side);
        for row in texels(low.y, high.y) {
            for column in texels(low.x, high.x) {
                let at = DVec2::new(column as f64 + 0.5, row as f64 + 0.5);
                let second = (at - a).perp_dot(c - a) / area;
                let third = (b - a).perp_dot(at - a) / area;
                let weights = [1.0 - second - third, second, third];
                if weights.iter().any(|w| *w < 0.0) {
                    continue;
                }
                let place = Place {
                    p: (face.iter().zip(weights))
                        .map(|(&v, w)| w * vertices[piece.vertices[v]])
                        .sum(),
                    limb: piece.limb,
                    side: piece.side,
                };
                let flat = (at - corner) / scale;
                let cloth = fabric.color(flat.as_vec2());
                painted.push((
                    row * side + column,
                    sewn(embroidered(cloth, place), border.nearest(flat)),
                ));
            }
        }
    }
    painted
}

/// The outline of a piece: its segments, and how far along it each begins, mm.
struct Border {
    segments: Vec<(DVec2, DVec2, f64)>,
}

impl Border {
    fn of(piece: &Piece) -> Self {
        let mut next: HashMap<usize, usize> = HashMap::new();
        for face in &piece.faces {
            for k in 0..3 {
                next.insert(face[k] << 32 | face[(k + 1) % 3], 0);
            }
        }
        let outer = |key: &&usize| !next.contains_key(&((**key & 0xffff_ffff) << 32 | **key >> 32));
        let follow: HashMap<usize, usize> = next
            .keys()
            .filter(outer)
            .map(|key| (key >> 32, key & 0xffff_ffff))
            .collect();
        let (mut segments, mut along) = (Vec::new(), 0.0);
        let Some(&start) = follow.keys().min() else {
            return Self { segments };
        };
        let mut from = start;
        while let Some(&to) = follow.get(&from) {
            let (a, b) = (piece.flat_mm[from], piece.flat_mm[to]);
            segments.push((a, b, along));
            along += a.distance(b);
            from = to;
            if from == start {
                break;
            }
        }
        Self { segments }
    }

    /// Distance from the outline, and how far along it that is, mm.
    fn nearest(&self, p: DVec2) -> (f64, f64) {
        let nearest = self.segments.iter().map(|&(a, b, along)| {
            let fraction = ((p - a).dot(b - a) / (b - a).length_squared().max(1e-12)).clamp(0.0, 1.0);
            (
                p.distance_squared(a.lerp(b, fraction)),
                along + fraction * a.distance(b),
            )
        });
        let (square, along) = nearest.min_by(|a, b| a.0.total_cmp(&b.0)).unwrap_or((1e9, 0.0));
        (square.sqrt(), along)
    }
}

/// The colour beside a seam: the cloth bends down into it, stitches hold it.
fn sewn(color: Vec3, (distance, along): (f64, f64)) -> Vec3 {
    let fold = 1.0 - 0.55 * (-(distance / SEAM_MM).powi(2)).exp() as f32;
    let stitch = (STITCHES_MM[0]..STITCHES_MM[1]).contains(&distance) && (along / STITCH_MM).fract() < 0.6;
    if stitch { THREAD } else { color * fold }
}

/// The cloth with what is embroidered at this place: the face, a heart, buttons, the soles of the feet.
fn embroidered(cloth: Vec3, place: Place) -> Vec3 {
    if place.side != Side::Front {
        return cloth;
    }
    let q = Vec2::new(place.p.x as f32, place.p.y as f32);
    match place.limb {
        Limb::Head => face(cloth, q),
        Limb::Body => buttons_and_heart(cloth, q),
        Limb::LeftLeg | Limb::RightLeg => sole(cloth, place),
        _ => cloth,
    }
}

/// `over` with this opacity, 0 to 1, on `under`.
fn mixed(under: Vec3, over: Vec3, opacity: f32) -> Vec3 {
    under.lerp(over, opacity.clamp(0.0, 1.0))
}

/// 1 inside an edge at `distance` 0, 0 outside, over half a millimetre.
fn inside(distance: f32) -> f32 {
    (0.5 - distance * 2.0).clamp(0.0, 1.0)
}

/// Distance from a segment.
fn segment(p: Vec2, a: Vec2, b: Vec2) -> f32 {
    let fraction = ((p - a).dot(b - a) / (b - a).length_squared()).clamp(0.0, 1.0);
    p.distance(a.lerp(b, fraction))
}

fn face(cloth: Vec3, q: Vec2) -> Vec3 {
    let mut color = cloth;
    // Rosy cheeks.
    for x in [-26.0, 26.0] {
        let near = 1.0 - q.distance(Vec2::new(x, -37.0)) / 9.5;
        color = mixed(color, rgb(0xe58a84), 0.75 * near.max(0.0).sqrt());
    }
    // A felt patch around the right eye, sewn on.
    let patch = (q - Vec2::new(-17.0, -57.0)) / Vec2::new(1.0, 1.15);
    let bump = 1.3 * (3.0 * patch.to_angle() + 0.6).sin();
    let edge = patch.length() - 13.5 - bump;
    color = mixed(
        color,
        rgb(0x9a6a43) * (color / cloth.max(Vec3::splat(0.1))),
        inside(edge),
    );
    let dash = (patch.to_angle() * 6.5).sin() > -0.3;
    if dash && (edge + 1.8).abs() < 0.45 {
        color = THREAD;
    }
    color = button(color, q, Vec2::new(16.0, -55.0), 7.4, rgb(0x5b2333));
    color = bead(color, q, Vec2::new(-16.0, -55.5), 6.4);
    // Nose and mouth.
    let nose = (q - Vec2::new(0.0, -43.5)) / Vec2::new(6.6, 4.6);
    let nose = nose.length() + 0.25 * nose.y * (1.0 - nose.x.abs()) - 1.0;
    color = mixed(color, rgb(0xc65d63), inside(nose * 4.6));
    let shine = (q - Vec2::new(1.8, -45.3)).length() - 1.1;
    color = mixed(color, rgb(0xf5c9c9), inside(shine));
    let thread = rgb(0x4a2c2a);
    let mut line = segment(q, Vec2::new(0.0, -39.5), Vec2::new(0.0, -35.5));
    for x in [-4.6, 4.6] {
        let centre = Vec2::new(x, -35.5);
        if q.y > centre.y {
            line = line.min((q.distance(centre) - 4.6).abs());
        }
    }
    color = mixed(color, thread, inside(line - 0.55));
    // Whiskers: three to the toy's left, two to its right.
    let whiskers = [
        (11.0, -41.0, 27.0, -44.5),
        (11.5, -38.0, 29.0, -37.5),
        (11.0, -35.0, 26.0, -31.0),
    ]
    .into_iter()
    .chain([(-11.0, -40.0, -28.0, -42.0), (-11.0, -36.0, -27.0, -33.0)]);
    for (x0, y0, x1, y1) in whiskers {
        let distance = segment(q, Vec2::new(x0, y0), Vec2::new(x1, y1));
        color = mixed(color, thread, inside(distance - 0.3));
    }
    // A little star on the forehead.
    let star = q - Vec2::new(5.0, -74.0);
    let edge = star.length() - 4.2 * (0.72 + 0.28 * (5.0 * (star.to_angle() + 1.2)).cos());
    mixed(color, rgb(0xe9b44c), inside(edge))
}

/// A sewn-on button with four holes and crossed thread.
fn button(color: Vec3, q: Vec2, centre: Vec2, radius: f32, ink: Vec3) -> Vec3 {
    let offset = q - centre;
    let distance = offset.length();
    // Its shadow on the cloth, the disc, a raised rim.
    let color = color * (1.0 - 0.45 * inside((offset - Vec2::new(0.3, 0.8)).length() - radius - 0.6));
    let light = 1.0 + 0.25 * (-(offset.x + offset.y) / radius) * 0.5;
    let mut disc = ink * light;
    if (distance - 0.78 * radius).abs() < 0.11 * radius {
        disc = (ink * 1.7 + 0.08).clamp(Vec3::ZERO, Vec3::ONE) * light;
    }
    let hole = 0.27 * radius;
    for (x, y) in [(-1.0, -1.0), (1.0, -1.0), (-1.0, 1.0), (1.0, 1.0)] {
        disc = mixed(
            disc,
            rgb(0x1c1012),
            inside((offset.distance(Vec2::new(x, y) * hole)) - 0.15 * radius),
        );
    }
    let (a, b) = (Vec2::splat(hole), Vec2::new(hole, -hole));
    let cross = segment(offset, -a, a).min(segment(offset, -b, b));
    disc = mixed(disc, THREAD, inside(cross - 0.07 * radius));
    mixed(color, disc, inside(distance - radius))
}

/// A black glass eye in a ring of white felt.
fn bead(color: Vec3, q: Vec2, centre: Vec2, radius: f32) -> Vec3 {
    let offset = q - centre;
    let color = mixed(color, rgb(0xfbf7ee), inside(offset.length() - radius - 1.7));
    let color = mixed(color, rgb(0x15141a), inside(offset.length() - radius));
    let color = mixed(
        color,
        rgb(0x3d4c6b),
        inside((offset - Vec2::new(0.8, 1.4)).length() - 0.55 * radius) * 0.5,
    );
    let color = mixed(
        color,
        Vec3::ONE,
        inside((offset - Vec2::new(-1.9, -2.2)).length() - 1.6),
    );
    mixed(
        color,
        rgb(0xcdd7e6),
        inside((offset - Vec2::new(2.0, 2.4)).length() - 0.8),
    )
}

fn buttons_and_heart(cloth: Vec3, q: Vec2) -> Vec3 {
    let mut color = cloth;
    // The heart: x^2 + (y - |x|^(2/3))^2 = 1, upside down because y points down.
    let h = (q - Vec2::new(15.0, 20.0)) / 8.5;
    let height = -h.y - 0.75 * h.x.abs().powf(0.67) + 0.2;
    let edge = (h.x * h.x + height * height).sqrt() - 1.0;
    color = mixed(
        color,
        rgb(0xc1121f) * (0.9 + 0.1 * (9.0 * h.y).sin()),
        inside(edge * 6.0),
    );
    if (edge + 0.22).abs() < 0.05 && ((12.0 * h.x).sin() * (12.0 * h.y).cos()) > -0.3 {
        color = THREAD;
    }
    for (y, ink) in [(4.0, 0xf2a541), (20.0, 0x2d7dd2), (36.0, 0x97cc04)] {
        color = button(color, q, Vec2::new(-2.0, y), 4.3, rgb(ink));
    }
    color
}

/// Toes and ball on the sole, which faces the viewer.
fn sole(cloth: Vec3, place: Place) -> Vec3 {
    if place.p.z > -34.0 {
        return cloth;
    }
    let left = place.limb == Limb::LeftLeg;
    let q = Vec2::new(place.p.x.abs() as f32 - 41.0, place.p.y as f32 - 128.0);
    let ink = if left { rgb(0xf4d9c6) } else { rgb(0x4f2d3f) };
    let ball = (q / Vec2::new(7.5, 5.2) - Vec2::new(0.0, 0.65)).length() - 1.0;
    let toes = [(-6.8, -3.4), (-2.3, -6.4), (2.7, -6.3), (6.9, -3.0)];
    let toes = toes.into_iter().map(|(x, y)| q.distance(Vec2::new(x, y)) - 2.0);
    mixed(cloth, ink, inside(toes.fold(5.0 * ball, f32::min)))
}
