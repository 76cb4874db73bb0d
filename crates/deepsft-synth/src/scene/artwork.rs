//! Procedural artworks for printed sheets that are not the template. They teach a network that a sheet with some art on
//! it need not be the template.

use crate::random::{draw_or, uniform, unit_vector};
use crate::render::{Figure, Frame, ValueNoise, any_color, vivid_color};
use deepsft_geometry::Picture;
use deepsft_geometry::glam::{DVec2, Vec2, Vec3};
use rand::{Rng, RngExt};

/// Longest side of an artwork, pixels.
const LONG_SIDE: f64 = 560.0;

type Painter<R> = fn(&mut Frame, Vec2, Vec2, &mut R);

/// The kinds of artworks and their painters; number 10 is of the first kind again.
fn painter<R: Rng + ?Sized>(number: usize) -> (&'static str, Painter<R>) {
    let painters: [(&'static str, Painter<R>); 10] = [
        ("collage", collage),
        ("mosaic", mosaic),
        ("geometric", geometric_poster),
        ("collage", collage),
        ("rings", rings),
        ("text", text_page),
        ("triangles", triangles),
        ("scribble", scribble),
        ("landscape", landscape),
        ("noise", colored_noise),
    ];
    painters[number % painters.len()]
}

/// A painted print and its kind, such as "collage". `number` chooses the kind, the generator everything else.
pub fn artwork<R: Rng + ?Sized>(number: usize, rng: &mut R) -> (&'static str, Picture) {
    let (kind, paint) = painter(number);
    let ratio = uniform(rng, [0.6, 1.0]);
    let (long, short) = (LONG_SIDE as usize, (LONG_SIDE as f32 * ratio) as usize);
    let (width, height) = if rng.random_bool(0.6) {
        (long, short)
    } else {
        (short, long)
    };
    let paper = Vec3::splat(uniform(rng, [0.8, 1.0]));
    let mut frame = Frame::filled(width, height, paper);
    let side = Vec2::new(width as f32, height as f32);
    let margin = draw_or(rng, 0.75, 0.0, |rng| uniform(rng, [0.02, 0.09]) * side.min_element());
    let (low, high) = (Vec2::splat(margin), side - margin);
    paint(&mut frame, low, high, rng);
    if rng.random_bool(0.5) {
        title(&mut frame, low, high, rng);
    }
    (kind, frame.to_picture())
}

fn point<R: Rng + ?Sized>(low: Vec2, high: Vec2, rng: &mut R) -> Vec2 {
    low + (high - low) * Vec2::new(rng.random(), rng.random())
}

fn palette<R: Rng + ?Sized>(rng: &mut R) -> Vec<Vec3> {
    let saturation = uniform(rng, [0.3, 1.0]);
    (0..rng.random_range(3..8))
        .map(|_| {
            let value = uniform(rng, [0.05, 1.0]);
            vivid_color(rng, saturation, value)
        })
        .collect()
}

fn pick<R: Rng + ?Sized>(colors: &[Vec3], rng: &mut R) -> Vec3 {
    colors[rng.random_range(0..colors.len())]
}

/// Paints the margins in the paper's colour again, over whatever reached into them.
fn restore_margins(frame: &mut Frame, low: Vec2, high: Vec2) {
    let paper = frame.color(0);
    let side = Vec2::new(frame.width as f32, frame.height as f32);
    for (a, b) in [
        (Vec2::ZERO, Vec2::new(low.x, side.y)),
        (Vec2::new(high.x, 0.0), side),
        (Vec2::ZERO, Vec2::new(side.x, low.y)),
        (Vec2::new(0.0, high.y), side),
    ] {
        frame.fill(&Figure::upright(a, b), paper);
    }
}

/// Cells around random seeds with dark joints.
fn mosaic<R: Rng + ?Sized>(frame: &mut Frame, low: Vec2, high: Vec2, rng: &mut R) {
    let colors = palette(rng);
    let seeds: Vec<(Vec2, Vec3)> = (0..rng.random_range(25..80))
        .map(|_| (point(low, high, rng), pick(&colors, rng)))
        .collect();
    let joint = uniform(rng, [0.5, 4.0]);
    let joint_color = any_color(rng) * 0.3;
    let area = Figure::upright(low, high);
    frame.paint(&area, |p| {
        let (mut nearest, mut second) = ((f32::INFINITY, Vec3::ZERO), f32::INFINITY);
        for (seed, color) in &seeds {
            let distance = p.distance(*seed);
            if distance < nearest.0 {
                second = nearest.0;
                nearest = (distance, *color);
            } else if distance < second {
                second = distance;
            }
        }
        let in_joint = second - nearest.0 < joint;
        (if in_joint { joint_color } else { nearest.1 }, 1.0)
    });
}

/// A poster of discs, bars, rings and wedges on a coloured ground.
fn geometric_poster<R: Rng + ?Sized>(frame: &mut Frame, low: Vec2, high: Vec2, rng: &mut R) {
    let colors = palette(rng);
    frame.fill(&Figure::upright(low, high), pick(&colors, rng));
    for _ in 0..rng.random_range(20..90) {
        let centre = point(low, high, rng);
        let size = uniform(rng, [3.0, 70.0]) * uniform(rng, [0.2, 1.0]);
        let axis = if rng.random_bool(0.5) {
            Vec2::X
        } else {
            unit_vector(rng)
        };
        let shape = match rng.random_range(0..4) {
            0 => Figure::disc(centre, size),
            1 => Figure::Rectangle(centre, axis, Vec2::new(size, uniform(rng, [2.0, 20.0]))),
            2 => Figure::Polygon((0..3).map(|_| centre + unit_vector(rng) * size).collect()),
            _ => Figure::Capsule([centre, centre + axis * size * 2.0], [uniform(rng, [1.0, 9.0]); 2]),
        };
        frame.fill(&shape, pick(&colors, rng));
        if rng.random_bool(0.3) {
            frame.fill(&Figure::disc(centre, size * 0.4), pick(&colors, rng));
        }
    }
    restore_margins(frame, low, high);
}

/// A sheet crowded with small outlined figures in bands, like an illustrated map: as rich as a good template.
fn collage<R: Rng + ?Sized>(frame: &mut Frame, low: Vec2, high: Vec2, rng: &mut R) {
    let grounds = palette(rng);
    let colors = [palette(rng), palette(rng)].concat();
    let outline = any_color(rng) * 0.1;
    let wave = ValueNoise::new(rng);
    let bands = uniform(rng, [2.0, 6.0]);
    frame.paint(&Figure::upright(low, high), |p| {
        let band = bands * (p.y - low.y) / (high.y - low.y) + wave.fractal(p * 0.01, 3);
        (grounds[(band.max(0.0) as usize) % grounds.len()], 1.0)
    });
    let smallest = uniform(rng, [2.0, 5.0]);
    for _ in 0..rng.random_range(200..900) {
        let centre = point(low, high, rng);
        let size = smallest * 2.0_f32.powf(uniform(rng, [0.0, 1.0]) * uniform(rng, [0.0, 4.0]));
        let axis = if rng.random_bool(0.4) {
            Vec2::X
        } else {
            unit_vector(rng)
        };
        let edge = uniform(rng, [0.6, 2.0]);
        let figure = |grown: f32, kind: u32, slim: f32| match kind {
            0 => Figure::disc(centre, size + grown),
            1 => Figure::Rectangle(centre, axis, Vec2::new(size, size * slim) + grown),
            2 => Figure::Ellipse(centre, axis, Vec2::new(size, size * slim) + grown),
            3 => Figure::Capsule([centre, centre + axis * size * 3.0], [size * 0.3 + grown; 2]),
            _ => {
                let reach = size * 1.2 + grown * 2.0;
                let corner = |k: f32| centre + Vec2::from_angle(k * 2.094).rotate(axis) * reach;
                Figure::Polygon(vec![corner(0.0), corner(1.0), corner(2.0)])
            }
        };
        let (kind, slim) = (rng.random_range(0..5), uniform(rng, [0.3, 1.0]));
        if rng.random_bool(0.7) {
            frame.fill(&figure(edge, kind, slim), outline);
        }
        frame.fill(&figure(0.0, kind, slim), pick(&colors, rng));
        if size > 6.0 {
            let inner = figure(-size * slim * uniform(rng, [0.3, 0.7]), kind, slim);
            frame.fill(&inner, pick(&colors, rng));
        }
    }
    restore_margins(frame, low, high);
}

/// Concentric rings about a few centres.
fn rings<R: Rng + ?Sized>(frame: &mut Frame, low: Vec2, high: Vec2, rng: &mut R) {
    let colors = palette(rng);
    frame.fill(&Figure::upright(low, high), pick(&colors, rng));
    for _ in 0..rng.random_range(2..9) {
        let centre = point(low, high, rng);
        let step = uniform(rng, [3.0, 16.0]);
        for ring in (1..rng.random_range(4..14)).rev() {
            frame.fill(&Figure::disc(centre, step * ring as f32), pick(&colors, rng));
        }
    }
    restore_margins(frame, low, high);
}

/// A page of text: words as rows of small marks, with a heading and perhaps a picture.
fn text_page<R: Rng + ?Sized>(frame: &mut Frame, low: Vec2, high: Vec2, rng: &mut R) {
    let ink = any_color(rng) * 0.15;
    let line = uniform(rng, [8.0, 20.0]);
    let margin = line * 1.5;
    let mut y = low.y + margin;
    while y < high.y - margin {
        let heading = rng.random_bool(0.08);
        let height = if heading { line * 1.4 } else { line * 0.55 };
        let end = draw_or(rng, 0.15, 1.0, |rng| uniform(rng, [0.2, 0.9]));
        let mut x = low.x + margin;
        while x < low.x + (high.x - low.x) * end - margin {
            x = letter(frame, Vec2::new(x, y), height, ink, rng);
            if rng.random_bool(0.18) {
                x += height * 0.7;
            }
        }
        y += height + line * 0.5;
    }
    if rng.random_bool(0.6) {
        let corner = point(low, (low + high) / 2.0, rng);
        let size = (high - low) * uniform(rng, [0.2, 0.5]);
        let (a, b) = (any_color(rng), any_color(rng));
        frame.paint(&Figure::upright(corner, corner + size), |p| {
            (a.lerp(b, (p.y - corner.y) / size.y), 1.0)
        });
    }
    restore_margins(frame, low, high);
}

/// A letter-like mark of two or three strokes with its upper left corner at `at`; returns where the next begins.
fn letter<R: Rng + ?Sized>(frame: &mut Frame, at: Vec2, height: f32, ink: Vec3, rng: &mut R) -> f32 {
    let width = height * uniform(rng, [0.35, 0.75]);
    let mut halves = |side: f32| side * rng.random_range(0..3) as f32 / 2.0;
    let mut corner = || at + Vec2::new(halves(width), halves(height));
    let strokes = [[corner(), corner()], [corner(), corner()], [corner(), corner()]];
    for ends in strokes {
        frame.fill(&Figure::Capsule(ends, [(height * 0.08).max(0.5); 2]), ink);
    }
    at.x + width + height * 0.22
}

/// Large letters on a band.
fn title<R: Rng + ?Sized>(frame: &mut Frame, low: Vec2, high: Vec2, rng: &mut R) {
    let height = (high.y - low.y) * uniform(rng, [0.07, 0.16]);
    let y = low.y + (high.y - low.y - height * 1.4) * rng.random::<f32>();
    let ink = any_color(rng);
    if rng.random_bool(0.5) {
        let band = Figure::upright(Vec2::new(low.x, y), Vec2::new(high.x, y + height * 1.4));
        frame.fill(&band, Vec3::ONE - ink);
    }
    let mut x = low.x + height * 0.4;
    while x < high.x - height {
        x = letter(frame, Vec2::new(x, y + height * 0.2), height, ink, rng);
    }
}

/// A net of triangles shaded by a smooth colour field.
fn triangles<R: Rng + ?Sized>(frame: &mut Frame, low: Vec2, high: Vec2, rng: &mut R) {
    let colors = palette(rng);
    let columns = rng.random_range(4..13);
    let cell = (high - low) / columns as f32;
    let jitter = uniform(rng, [0.0, 0.45]);
    let nodes: Vec<Vec2> = (0..=columns * (columns + 2))
        .map(|k| {
            let node = Vec2::new((k % (columns + 1)) as f32, (k / (columns + 1)) as f32);
            low + (node + unit_vector(rng) * jitter * rng.random::<f32>()) * cell
        })
        .collect();
    for k in 0..nodes.len() - columns - 2 {
        if k % (columns + 1) == columns {
            continue;
        }
        for corners in [[k, k + 1, k + columns + 1], [k + 1, k + columns + 1, k + columns + 2]] {
            let color = pick(&colors, rng) * uniform(rng, [0.6, 1.0]);
            frame.fill(&Figure::Polygon(corners.iter().map(|&c| nodes[c]).collect()), color);
        }
    }
    restore_margins(frame, low, high);
}

/// Random walks of a pen.
fn scribble<R: Rng + ?Sized>(frame: &mut Frame, low: Vec2, high: Vec2, rng: &mut R) {
    let colors = palette(rng);
    for _ in 0..rng.random_range(6..20) {
        let mut p = point(low, high, rng);
        let mut direction = unit_vector(rng);
        let color = pick(&colors, rng) * 0.6;
        let radius = uniform(rng, [0.7, 4.0]);
        for _ in 0..rng.random_range(10..60) {
            direction = Vec2::from_angle(uniform(rng, [-0.9, 0.9])).rotate(direction);
            let next = (p + direction * uniform(rng, [4.0, 24.0])).clamp(low, high);
            frame.fill(&Figure::Capsule([p, next], [radius; 2]), color);
            p = next;
        }
    }
}

/// Hills in layers under a graded sky with a sun, like a travel poster.
fn landscape<R: Rng + ?Sized>(frame: &mut Frame, low: Vec2, high: Vec2, rng: &mut R) {
    let colors = palette(rng);
    let (sky, horizon) = (pick(&colors, rng), any_color(rng));
    let size = high - low;
    let (sun, radius) = (point(low, high, rng), uniform(rng, [10.0, 60.0]));
    let shine = vivid_color(rng, 0.6, 1.0);
    let layers: Vec<(ValueNoise, f32, f32, f32, Vec3)> = (0..rng.random_range(2..7))
        .map(|k| {
            let base = low.y + size.y * (0.35 + 0.1 * k as f32);
            let (height, scale) = (uniform(rng, [10.0, 90.0]), uniform(rng, [0.006, 0.04]));
            let noise = ValueNoise::new(rng);
            let hill = pick(&colors, rng) * uniform(rng, [0.3, 1.0]);
            (noise, base, height, scale, hill)
        })
        .collect();
    frame.paint(&Figure::upright(low, high), |p| {
        let mut color = sky.lerp(horizon, (p.y - low.y) / size.y);
        if p.distance(sun) < radius {
            color = shine;
        }
        for (noise, base, height, scale, hill) in &layers {
            if p.y > base + height * noise.fractal(Vec2::new(p.x * scale, 0.5), 3) {
                color = *hill;
            }
        }
        (color, 1.0)
    });
}

/// A smooth random colour field, half the time posterised: like a photograph of nothing in particular.
fn colored_noise<R: Rng + ?Sized>(frame: &mut Frame, low: Vec2, high: Vec2, rng: &mut R) {
    let noises = [ValueNoise::new(rng), ValueNoise::new(rng), ValueNoise::new(rng)];
    let scale = uniform(rng, [0.008, 0.05]);
    let octaves = rng.random_range(2..6);
    let steps = draw_or(rng, 0.5, 0.0, |rng| rng.random_range(3..7) as f32);
    frame.paint(&Figure::upright(low, high), |p| {
        let value = |k: usize| {
            let value = 0.5 + 0.6 * noises[k].fractal(p * scale, octaves);
            let posterised = if steps > 0.0 {
                (value * steps).round() / steps
            } else {
                value
            };
            posterised.clamp(0.0, 1.0).powi(2)
        };
        (Vec3::new(value(0), value(1), value(2)), 1.0)
    });
}

/// Art made from a photograph: a piece of it with its colours exchanged, sometimes cut into tiles in random order.
pub(crate) fn photograph_sheet<R: Rng + ?Sized>(photograph: &Picture, rng: &mut R) -> Picture {
    let whole = photograph.size().as_dvec2();
    let size = whole * uniform(rng, [0.4, 1.0]) as f64;
    let corner = (whole - size) * DVec2::new(rng.random(), rng.random());
    let sheet = (size * (LONG_SIDE / size.max_element())).ceil();
    let (columns, rows) = (sheet.x as usize, sheet.y as usize);
    let margin = (LONG_SIDE as f32 * uniform(rng, [0.0, 0.06])) as usize;
    let turn = rng.random_range(0..3);
    let negative = rng.random_bool(0.15);
    let tiles = draw_or(rng, 0.4, 1, |rng| rng.random_range(2..6));
    let order: Vec<usize> = (0..tiles * tiles).map(|_| rng.random_range(0..tiles * tiles)).collect();
    Picture::from_fn(columns, rows, |x, y| {
        if x < margin || y < margin || x + margin >= columns || y + margin >= rows {
            return [250; 3];
        }
        let place = DVec2::new(x as f64, y as f64) / sheet * tiles as f64;
        let tile = order[place.y as usize * tiles + place.x as usize];
        let from = DVec2::new((tile % tiles) as f64, (tile / tiles) as f64);
        let at = corner + (place.fract() + from) / tiles as f64 * size;
        let color = photograph.sample(at.x, at.y);
        let color: [u8; 3] = std::array::from_fn(|k| color[(k + turn) % 3] as u8);
        if negative { color.map(|c| 255 - c) } else { color }
    })
}
