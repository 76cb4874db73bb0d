//! What covers parts of the sheet: hands, things, and the paper's discs; where each sits, and laid into an image.

mod painting;
mod sampling;

use crate::figure::Figure;
use crate::noise::ValueNoise;
use deepsft_geometry::Camera;
use deepsft_geometry::glam::{DVec3, Vec2, Vec3};
pub(crate) use painting::Placed;
pub(crate) use sampling::sample_occluders;

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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::OccluderKind;
    use crate::frame::Frame;
    use crate::noise::{Stream, generator};
    use crate::shading::Lighting;
    use deepsft_geometry::{Maps, Picture, Template, training_camera};

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
