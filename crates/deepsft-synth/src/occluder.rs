//! What covers parts of the sheet: hands, things, and the paper's discs.

use crate::OccluderKind;
use crate::background::color_jitter;
use crate::figure::Figure;
use crate::frame::Frame;
use crate::hand::{Hand, skin_color};
use crate::noise::{ValueNoise, any_color, uniform, unit_vector};
use crate::shading::Lighting;
use deepsft_geometry::glam::{DVec3, Vec2, Vec3};
use deepsft_geometry::{Camera, Maps};
use rand::{Rng, RngExt};

/// How much light skin loses towards its outline.
const RIM_DARKENING: f32 = 0.35;

/// Most discs among hands and things and their radii in pixels; the paper's own discs have half the size.
const MOST_DISCS: usize = 4;
const DISC_RADIUS_PX: [f64; 2] = [1.0, 10.0];

/// The surface of a part.
#[derive(Clone, Debug)]
pub(crate) enum Surface {
    /// Shaded as a rounded body, mottled.
    Skin(Vec3),
    /// A finger nail.
    Nail(Vec3),
    /// A sleeve or any rounded thing.
    Cloth(Vec3),
    /// Flat, with a change of colour across it.
    Flat(Vec3, Vec3),
}

/// A body in the plane of an anchor on the sheet: x along a direction, y across it, in mm.
#[derive(Clone, Debug)]
pub(crate) struct Part {
    pub(crate) figure: Figure,
    pub(crate) surface: Surface,
}

/// Where an occluder sits on the sheet.
#[derive(Clone, Debug)]
enum Anchor {
    /// On outline vertex number `share` of the outline; x points inwards, turned by `turn` radians.
    Outline { share: f32, turn: f32 },
    /// At a place of the image, shares of its width and height.
    Image(Vec2),
    /// On any vertex, by its number's share of all; x points along `direction`.
    Inside { share: f32, direction: Vec2 },
}

/// Something in front of the sheet, with what it has behind it (the hand of a thumb). It moves with the sheet.
#[derive(Clone, Debug)]
pub(crate) struct Occluder {
    anchor: Anchor,
    behind: Vec<Part>,
    front: Vec<Part>,
    noise: ValueNoise,
    /// Displacement in mm, softness in mm and strength of its shadow.
    shadow: (Vec2, f32, f32),
    /// Discs have their size in pixels, all else in mm.
    in_pixels: bool,
}

/// Draws the occluders of a scene: `share` of the scenes have any.
pub(crate) fn sample_occluders<R: Rng + ?Sized>(share: f64, kind: OccluderKind, rng: &mut R) -> Vec<Occluder> {
    if !rng.random_bool(share) {
        return Vec::new();
    }
    if let OccluderKind::Discs { most, diameter_px } = kind {
        let radius_px = diameter_px.map(|diameter| diameter / 2.0);
        let place = |rng: &mut R| Anchor::Image(Vec2::new(rng.random(), rng.random()));
        return (0..rng.random_range(0..=most))
            .map(|_| {
                let color = any_color(rng);
                let radius_px = uniform(rng, radius_px);
                disc(color, radius_px, place(rng), rng)
            })
            .collect();
    }
    let mut occluders = Vec::new();
    let skin = skin_color(rng);
    let sleeve = any_color(rng);
    if rng.random_bool(0.75) {
        // One or two hands of the same person, at random places of the outline; two hold opposite sides.
        let place: f32 = rng.random();
        occluders.push(hand(place, skin, sleeve, rng));
        if rng.random_bool(0.5) {
            let other = place + 0.5 + uniform(rng, [-0.12, 0.12]);
            occluders.push(hand(other.fract(), skin, sleeve, rng));
        }
    }
    if rng.random_bool(0.3) {
        for _ in 0..rng.random_range(1..4) {
            occluders.push(thing(rng));
        }
    }
    if rng.random_bool(0.35) || occluders.is_empty() {
        for _ in 0..rng.random_range(1..=MOST_DISCS) {
            occluders.push(disc_on_sheet(rng));
        }
    }
    occluders
}

/// A hand at `place` of the outline.
fn hand<R: Rng + ?Sized>(place: f32, skin: Vec3, sleeve: Vec3, rng: &mut R) -> Occluder {
    let Hand { behind, front } = Hand::sample(skin, sleeve, rng);
    Occluder {
        anchor: Anchor::Outline {
            share: place,
            turn: uniform(rng, [-0.7, 0.7]),
        },
        behind,
        front,
        noise: ValueNoise::new(rng),
        shadow: shadow(rng),
        in_pixels: false,
    }
}

/// A shadow's displacement and softness in mm and its strength, often none.
fn shadow<R: Rng + ?Sized>(rng: &mut R) -> (Vec2, f32, f32) {
    let strength = if rng.random_bool(0.7) {
        uniform(rng, [0.15, 0.65])
    } else {
        0.0
    };
    (
        unit_vector(rng) * uniform(rng, [2.0, 18.0]),
        uniform(rng, [2.0, 14.0]),
        strength,
    )
}

/// A flat or rounded thing before the sheet.
fn thing<R: Rng + ?Sized>(rng: &mut R) -> Occluder {
    let size = uniform(rng, [8.0, 55.0]);
    let (a, b) = (any_color(rng), any_color(rng));
    let long = size * uniform(rng, [1.0, 3.0]);
    let (figure, surface) = match rng.random_range(0..4) {
        0 => (
            Figure::Ellipse {
                centre: Vec2::ZERO,
                axis: Vec2::X,
                radii: Vec2::new(long, size) * 0.6,
            },
            Surface::Cloth(a),
        ),
        1 => (
            Figure::Rectangle {
                centre: Vec2::ZERO,
                axis: Vec2::X,
                half: Vec2::new(long, size) * 0.6,
            },
            Surface::Flat(a, b),
        ),
        2 => {
            // A pen or stick.
            let ends = [Vec2::ZERO, Vec2::new(uniform(rng, [60.0, 160.0]), 0.0)];
            (
                Figure::Capsule {
                    ends,
                    radii: [uniform(rng, [2.5, 6.0]), uniform(rng, [2.0, 6.0])],
                },
                Surface::Cloth(a),
            )
        }
        _ => {
            let corners = rng.random_range(3..7);
            let corner =
                |k: usize, reach: f32| Vec2::from_angle(k as f32 * std::f32::consts::TAU / corners as f32) * reach;
            (
                Figure::Polygon(
                    (0..corners)
                        .map(|k| corner(k, size * uniform(rng, [0.5, 1.3])))
                        .collect(),
                ),
                Surface::Flat(a, b),
            )
        }
    };
    Occluder {
        anchor: Anchor::Inside {
            share: rng.random(),
            direction: unit_vector(rng),
        },
        behind: Vec::new(),
        front: vec![Part { figure, surface }],
        noise: ValueNoise::new(rng),
        shadow: shadow(rng),
        in_pixels: false,
    }
}

/// A disc that matches no background: its colour is jittered as theirs is.
fn disc_on_sheet<R: Rng + ?Sized>(rng: &mut R) -> Occluder {
    let (matrix, offset) = color_jitter(rng);
    let color = (matrix * any_color(rng) + offset).max(Vec3::ZERO);
    let radius_px = uniform(rng, DISC_RADIUS_PX);
    let anchor = Anchor::Inside {
        share: rng.random(),
        direction: Vec2::X,
    };
    disc(color, radius_px, anchor, rng)
}

/// A disc of one colour.
fn disc<R: Rng + ?Sized>(color: Vec3, radius_px: f32, anchor: Anchor, rng: &mut R) -> Occluder {
    Occluder {
        anchor,
        behind: Vec::new(),
        front: vec![Part {
            figure: Figure::disc(Vec2::ZERO, radius_px),
            surface: Surface::Flat(color, color),
        }],
        noise: ValueNoise::new(rng),
        shadow: (Vec2::ZERO, 1.0, 0.0),
        in_pixels: true,
    }
}

/// A sheet as occluders see it: vertices of its outline in order, all vertices, the camera.
pub(crate) struct Held<'a> {
    pub(crate) outline: &'a [usize],
    pub(crate) vertices_camera: &'a [DVec3],
    pub(crate) camera: &'a Camera,
}

impl Held<'_> {
    /// Pixel position and pixels per mm at a vertex.
    fn pixel(&self, vertex: usize) -> Option<(Vec2, f32)> {
        let p_camera = self.vertices_camera[vertex];
        let pixel = self.camera.project(p_camera)?.as_vec2();
        let scale = (self.camera.focal().x / p_camera.z) as f32;
        (pixel.abs().max_element() < 1e5 && scale < 100.0).then_some((pixel, scale))
    }

    fn centre(&self) -> Vec2 {
        let mean = self.vertices_camera.iter().sum::<DVec3>() / self.vertices_camera.len().max(1) as f64;
        self.camera.project(mean).map_or(Vec2::ZERO, |p| p.as_vec2())
    }
}

/// An occluder's parts laid into the image: figures in pixels.
pub(crate) struct Placed {
    behind: Vec<Part>,
    front: Vec<Part>,
    scale: f32,
    shadow_offset: Vec2,
    shadow_softness: f32,
    shadow_strength: f32,
    noise: ValueNoise,
}

impl Occluder {
    /// Whether it is a body, with a size in mm, and none of the paper's discs.
    pub(crate) fn is_body(&self) -> bool {
        !self.in_pixels
    }

    /// Lays the occluder into the image of `sheet`; `None` when its anchor is behind the camera.
    pub(crate) fn place(&self, sheet: &Held<'_>) -> Option<Placed> {
        let (origin, axis, scale) = match self.anchor {
            Anchor::Outline { share, turn } => {
                let number = (share * sheet.outline.len() as f32) as usize;
                let (origin, scale) = sheet.pixel(*sheet.outline.get(number)?)?;
                let inwards = (sheet.centre() - origin).normalize_or(Vec2::X);
                (origin, Vec2::from_angle(turn).rotate(inwards), scale)
            }
            Anchor::Image(share) => {
                let size = Vec2::new(sheet.camera.width() as f32, sheet.camera.height() as f32);
                (share * size, Vec2::X, 1.0)
            }
            Anchor::Inside { share, direction } => {
                let number = (share * sheet.vertices_camera.len() as f32) as usize;
                let (origin, scale) = sheet.pixel(number.min(sheet.vertices_camera.len().checked_sub(1)?))?;
                (origin, direction, scale)
            }
        };
        let scale = if self.in_pixels { 1.0 } else { scale };
        let lay = |parts: &[Part]| {
            let place = |part: &Part| Part {
                figure: moved(&part.figure, origin, axis, scale),
                surface: part.surface.clone(),
            };
            parts.iter().map(place).collect()
        };
        Some(Placed {
            behind: lay(&self.behind),
            front: lay(&self.front),
            scale,
            shadow_offset: self.shadow.0 * scale,
            shadow_softness: (self.shadow.1 * scale).max(1.0),
            shadow_strength: self.shadow.2,
            noise: self.noise,
        })
    }
}

/// A figure turned so that x points along `axis`, scaled, and moved to `origin`.
fn moved(figure: &Figure, origin: Vec2, axis: Vec2, scale: f32) -> Figure {
    let point = |p: Vec2| origin + axis.rotate(p) * scale;
    match figure {
        Figure::Capsule { ends, radii } => Figure::Capsule {
            ends: ends.map(point),
            radii: radii.map(|r| r * scale),
        },
        Figure::Ellipse {
            centre,
            axis: own,
            radii,
        } => Figure::Ellipse {
            centre: point(*centre),
            axis: axis.rotate(*own),
            radii: *radii * scale,
        },
        Figure::Rectangle {
            centre,
            axis: own,
            half,
        } => Figure::Rectangle {
            centre: point(*centre),
            axis: axis.rotate(*own),
            half: *half * scale,
        },
        Figure::Polygon(corners) => Figure::Polygon(corners.iter().map(|&p| point(p)).collect()),
    }
}

impl Placed {
    /// Parts in pixels before everything, without a shadow, drawn for bodies of `scale` pixels a mm.
    pub(crate) fn in_front(front: Vec<Part>, scale: f32, noise: ValueNoise) -> Self {
        Self {
            behind: Vec::new(),
            front,
            scale,
            shadow_offset: Vec2::ZERO,
            shadow_softness: 1.0,
            shadow_strength: 0.0,
            noise,
        }
    }

    /// Row-major pixels whose centre the front parts cover.
    pub(crate) fn covered_pixels(&self, frame: &Frame) -> Vec<usize> {
        covered_by(&self.front, frame)
    }

    /// Row-major pixels whose centre the parts behind the sheet cover.
    pub(crate) fn covered_behind(&self, frame: &Frame) -> Vec<usize> {
        covered_by(&self.behind, frame)
    }

    /// Paints what is behind the sheet.
    pub(crate) fn paint_behind(&self, frame: &mut Frame, light: &Lighting, camera: &Camera) {
        self.paint(&self.behind, frame, light, camera);
    }

    /// Paints the shadow and what is before the sheet, and takes the covered pixels out of the truth.
    pub(crate) fn paint_front(&self, frame: &mut Frame, truth: &mut Maps, light: &Lighting, camera: &Camera) {
        self.paint_shadow(frame);
        self.paint(&self.front, frame, light, camera);
        for pixel in self.covered_pixels(frame) {
            truth.clear(pixel);
        }
    }

    fn paint_shadow(&self, frame: &mut Frame) {
        if self.shadow_strength == 0.0 || self.front.is_empty() {
            return;
        }
        let reach = self.shadow_softness + 1.0;
        let bounds = self.front.iter().map(|part| part.figure.bounds());
        let (low, high) = bounds.fold((Vec2::INFINITY, Vec2::NEG_INFINITY), |(low, high), (a, b)| {
            (low.min(a), high.max(b))
        });
        let (columns, rows) = frame.window((low + self.shadow_offset - reach, high + self.shadow_offset + reach));
        for row in rows {
            for column in columns.clone() {
                let pixel = row * frame.width + column;
                let p = frame.centre(pixel) - self.shadow_offset;
                let distance = self
                    .front
                    .iter()
                    .map(|part| part.figure.distance(p))
                    .fold(f32::INFINITY, f32::min);
                let t = (0.5 - 0.5 * distance / self.shadow_softness).clamp(0.0, 1.0);
                if t > 0.0 {
                    frame.set(
                        pixel,
                        frame.color(pixel) * (1.0 - self.shadow_strength * t * t * (3.0 - 2.0 * t)),
                    );
                }
            }
        }
    }

    fn paint(&self, parts: &[Part], frame: &mut Frame, light: &Lighting, camera: &Camera) {
        let (focal, principal) = (camera.focal().as_vec2(), camera.principal_point().as_vec2());
        for part in parts {
            let figure = &part.figure;
            let (low, high) = figure.bounds();
            frame.paint(figure, |p| {
                let ray = (p - principal) / focal;
                let round = |albedo: Vec3| {
                    let normal = figure.normal(p);
                    let rim = 1.0 - RIM_DARKENING * (1.0 + normal.z).powi(2);
                    light.matt(albedo, normal, ray) * rim
                };
                let color = match &part.surface {
                    Surface::Skin(albedo) => {
                        let mottled = 1.0 + 0.12 * self.noise.fractal((p - low) / (6.0 * self.scale), 3);
                        round(*albedo * mottled)
                    }
                    Surface::Nail(albedo) => round(*albedo),
                    Surface::Cloth(albedo) => {
                        let folds = 1.0 + 0.2 * self.noise.fractal((p - low) / (20.0 * self.scale), 4);
                        round(*albedo * folds)
                    }
                    Surface::Flat(a, b) => {
                        let t = ((p - low) / (high - low)).element_sum() / 2.0;
                        light.matt(a.lerp(*b, t), Vec3::NEG_Z, ray)
                    }
                };
                (color, 1.0)
            });
        }
    }
}

/// Row-major pixels whose centre some parts cover.
fn covered_by(parts: &[Part], frame: &Frame) -> Vec<usize> {
    let mut pixels = Vec::new();
    for part in parts {
        let (columns, rows) = frame.window(part.figure.bounds());
        for row in rows {
            let at = |column: usize| row * frame.width + column;
            pixels.extend(
                columns
                    .clone()
                    .map(at)
                    .filter(|&pixel| part.figure.distance(frame.centre(pixel)) < 0.0),
            );
        }
    }
    pixels.sort_unstable();
    pixels.dedup();
    pixels
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::noise::{Stream, generator};
    use deepsft_geometry::{Picture, Template, training_camera};

    #[test]
    fn occluders_cover_pixels_of_the_frame_and_only_those_leave_the_truth() {
        let template = Template::thin_shell(Picture::from_fn(1, 1, |_, _| [0; 3]), 297.0, 210.0).unwrap();
        let vertices: Vec<DVec3> = template
            .mesh()
            .vertices()
            .iter()
            .map(|p| *p + DVec3::Z * 500.0)
            .collect();
        let camera = training_camera();
        let outline: Vec<usize> = (0..template.grid().unwrap().0).collect();
        let sheet = Held {
            outline: &outline,
            vertices_camera: &vertices,
            camera: &camera,
        };
        let mut seen = 0;
        for index in 0..40 {
            for occluder in sample_occluders(
                1.0,
                OccluderKind::HandsAndThings,
                &mut generator(1, index, Stream::Scene),
            ) {
                let mut frame = Frame::filled(480, 270, Vec3::ONE);
                let mut truth = Maps::new(480, 270, vec![500.0; 480 * 270], vec![[0.5; 2]; 480 * 270]).unwrap();
                let placed = occluder.place(&sheet).unwrap();
                let covered = placed.covered_pixels(&frame);
                placed.paint_front(&mut frame, &mut truth, &Lighting::frontal(), &camera);
                assert!((0..480 * 270).all(|pixel| truth.inside(pixel) == covered.binary_search(&pixel).is_err()));
                seen += covered.len();
            }
        }
        assert!(seen > 40 * 500, "{seen}");
    }

    #[test]
    fn the_papers_discs_lie_anywhere_in_the_image_in_one_colour_and_have_the_papers_sizes() {
        let camera = training_camera();
        let sheet = Held {
            outline: &[],
            vertices_camera: &[],
            camera: &camera,
        };
        let kind = OccluderKind::Discs {
            most: 4,
            diameter_px: [1.0, 10.0],
        };
        let (mut counts, mut reach) = ([0; 5], Vec2::ZERO);
        for index in 0..500 {
            let discs = sample_occluders(1.0, kind, &mut generator(2, index, Stream::Scene));
            counts[discs.len()] += 1;
            for disc in discs {
                let placed = disc.place(&sheet).unwrap();
                let (low, high) = placed.front[0].figure.bounds();
                let size = high - low;
                assert!(
                    (size.x - size.y).abs() < 1e-3 && (0.999..10.001).contains(&size.x),
                    "{size}"
                );
                reach = reach.max(low);
                let mut frame = Frame::filled(480, 270, Vec3::ZERO);
                let mut truth = Maps::empty(480, 270);
                placed.paint_front(&mut frame, &mut truth, &Lighting::frontal(), &camera);
                // Pixels that are covered whole: their centre is half a diagonal or more inside.
                let figure = &placed.front[0].figure;
                let covered = placed.covered_pixels(&frame);
                let mut whole = covered
                    .into_iter()
                    .filter(|&p| figure.distance(frame.centre(p)) < -0.71);
                let first = whole.next().map(|pixel| frame.color(pixel));
                assert!(whole.all(|pixel| first.is_some_and(|first| frame.color(pixel).distance(first) < 1e-6)));
            }
        }
        // Each number of discs is a fifth of 500: 100 +- 9; five standard deviations.
        assert!(counts.iter().all(|count| (55..145).contains(count)), "{counts:?}");
        assert!(reach.x > 460.0 && reach.y > 255.0, "{reach}");
    }
}
