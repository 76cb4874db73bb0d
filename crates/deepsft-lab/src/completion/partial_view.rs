//! Exact maps of a deformed object of which a part is hidden, for measuring completion.

use super::rod_bend::RodBend;
use deepsft_geometry::glam::{DAffine3, DQuat, DVec2, DVec3, EulerRot};
use deepsft_geometry::raster::VisibleSurface;
use deepsft_geometry::{Camera, Maps, TriangleMesh};
use deepsft_synth::random::{Stream, between, generator, sign};
use deepsft_synth::{PoseConfig, SynthConfig, Synthesizer, fraction_in_view, sample_pose};
use rand::{Rng, RngExt};

/// Poses are drawn until at least this fraction of the vertices is in view.
const MIN_IN_VIEW: f64 = 0.98;

/// Draws before a frame is taken as it is.
const TRIES: usize = 40;

/// Largest turn of a bent volumic object, radians: twist, and bends about y and z.
const MAX_TURN: DVec3 = DVec3::new(0.8, 1.4, 1.4);

/// A deformed object, where it is, and what is seen of it past one contiguous occluder.
#[derive(Clone, Debug, PartialEq)]
pub struct PartialView {
    /// All vertices of the template's mesh, camera frame, mm.
    pub vertices_camera: Vec<DVec3>,
    /// Exact depth and registration of what is seen.
    pub maps: Maps,
    /// The fraction of the vertices that was to be hidden, self-occlusion included.
    pub hidden_fraction: f64,
}

/// Where the occluder lies.
#[derive(Clone, Copy, Debug)]
enum Occluder {
    /// On one side of a straight edge.
    Side(DVec2),
    /// Round.
    Disc(DVec2),
    /// All around a round hole.
    Surroundings(DVec2),
}

impl Occluder {
    fn sample<R: Rng + ?Sized>(pixels: &[DVec2], rng: &mut R) -> Self {
        let centre = pixels[rng.random_range(0..pixels.len())];
        match rng.random_range(0..3) {
            0 => Self::Side(DVec2::from_angle(between([0.0, std::f64::consts::TAU], rng))),
            1 => Self::Disc(centre),
            _ => Self::Surroundings(centre),
        }
    }

    /// The smaller, the sooner a pixel is covered as the occluder grows.
    fn order(self, pixel: DVec2) -> f64 {
        match self {
            Self::Side(direction) => pixel.dot(direction),
            Self::Disc(centre) => pixel.distance(centre),
            Self::Surroundings(centre) => -pixel.distance(centre),
        }
    }
}

impl PartialView {
    /// Frame `index` of `seed`: a sheet bent and posed as in the synthesizer's samples, almost wholly in view, a
    /// fraction between the ends of `hidden` of its vertices hidden.
    pub fn of_sheet(synthesizer: &Synthesizer, hidden: [f64; 2], seed: u64, index: u64) -> Self {
        let mut rng = generator(seed, index, Stream::Shape);
        let SynthConfig { camera, .. } = synthesizer.config();
        let mesh = synthesizer.template().mesh();
        let draw = |rng: &mut _| synthesizer.sample_vertices(rng);
        Self::of_shape(mesh, camera, hidden, &mut rng, draw)
    }

    /// Frame `index` of `seed`: a volumic object that is long in x, bent and twisted smoothly, turned at random.
    pub fn of_volumic(mesh: &TriangleMesh, camera: &Camera, hidden: [f64; 2], seed: u64, index: u64) -> Self {
        let mut rng = generator(seed, index, Stream::Shape);
        Self::of_shape(mesh, camera, hidden, &mut rng, |rng| {
            let mut turn = || sign(rng) * between([0.0, 1.0], rng);
            let bend = RodBend {
                turn_rad: MAX_TURN * DVec3::new(turn(), turn(), turn()),
                growth: 0.8 * turn(),
            };
            // Any side may look at the camera.
            let roll = DQuat::from_euler(EulerRot::XYZ, std::f64::consts::PI * turn(), 0.0, 0.0);
            let vertices: Vec<DVec3> = bend.apply(mesh.vertices()).into_iter().map(|p| roll * p).collect();
            let pose: DAffine3 = sample_pose(camera, &vertices, &PoseConfig::default(), rng);
            vertices.into_iter().map(|p| pose.transform_point3(p)).collect()
        })
    }

    fn of_shape<R: Rng + ?Sized>(
        mesh: &TriangleMesh,
        camera: &Camera,
        hidden: [f64; 2],
        rng: &mut R,
        mut draw: impl FnMut(&mut R) -> Vec<DVec3>,
    ) -> Self {
        let target = between(hidden, rng);
        let mut tries = 0;
        loop {
            tries += 1;
            let vertices_camera = draw(rng);
            let in_view = fraction_in_view(camera, &vertices_camera, &DAffine3::IDENTITY);
            let surface = VisibleSurface::new(mesh, &vertices_camera, camera);
            let seen = seen_vertices(mesh, &vertices_camera, &surface, camera);
            let covered = target - (1.0 - seen.len() as f64 / vertices_camera.len().max(1) as f64);
            let usable = in_view >= MIN_IN_VIEW && covered >= 0.0 && !seen.is_empty();
            if !usable && tries < TRIES {
                continue;
            }
            let mut maps = surface.maps();
            if covered > 0.0 && !seen.is_empty() {
                let occluder = Occluder::sample(&seen, rng);
                cover(&mut maps, &seen, occluder, covered * vertices_camera.len() as f64);
            }
            return Self {
                vertices_camera,
                maps,
                hidden_fraction: target,
            };
        }
    }
}

/// Image positions of the vertices of faces that are seen in some pixel.
fn seen_vertices(mesh: &TriangleMesh, vertices: &[DVec3], surface: &VisibleSurface, camera: &Camera) -> Vec<DVec2> {
    let mut seen = vec![false; vertices.len()];
    for (_, _, face, _) in surface.front() {
        mesh.faces()[face].into_iter().for_each(|v| seen[v] = true);
    }
    let seen = seen.iter().zip(vertices).filter(|(seen, _)| **seen);
    seen.filter_map(|(_, p)| camera.project(*p)).collect()
}

/// Clears the pixels that `occluder` covers when it has grown over `count` of the vertices.
fn cover(maps: &mut Maps, seen: &[DVec2], occluder: Occluder, count: f64) {
    let mut orders: Vec<f64> = seen.iter().map(|&p| occluder.order(p)).collect();
    orders.sort_unstable_by(f64::total_cmp);
    let last = (count as usize).min(orders.len().saturating_sub(1));
    let Some(&limit) = orders.get(last) else { return };
    for pixel in 0..maps.depth().len() {
        let centre = DVec2::new((pixel % maps.width()) as f64 + 0.5, (pixel / maps.width()) as f64 + 0.5);
        if occluder.order(centre) <= limit {
            maps.clear(pixel);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use deepsft_geometry::solver::VertexPoint;
    use deepsft_geometry::{Picture, Template, VisibleVertices, training_camera};
    use deepsft_synth::capsule;

    /// Fraction of vertices that the maps do not show, and the RMSE of the found ones, mm.
    fn hidden_and_error(mesh: &TriangleMesh, view: &PartialView) -> (f64, f64) {
        let found = VisibleVertices::new(mesh, 0)
            .find(&view.maps, &training_camera())
            .unwrap();
        let square = |p: &VertexPoint| p.p_camera.distance_squared(view.vertices_camera[p.vertex]);
        let mean = found.iter().map(square).sum::<f64>() / found.len() as f64;
        (1.0 - found.len() as f64 / mesh.vertices().len() as f64, mean.sqrt())
    }

    #[test]
    fn the_wanted_fraction_of_a_sheet_is_hidden_and_the_rest_is_found_where_it_is() {
        let template = Template::thin_shell(Picture::from_fn(8, 8, |x, _| [30 * x as u8; 3]), 297.0, 210.0).unwrap();
        let synthesizer = Synthesizer::new(&template, SynthConfig::default()).unwrap();
        for index in 0..20 {
            let view = PartialView::of_sheet(&synthesizer, [0.3, 0.7], 5, index);
            let (hidden, error) = hidden_and_error(template.mesh(), &view);
            assert!(
                (hidden - view.hidden_fraction).abs() < 0.12,
                "{index}: {hidden} for {}",
                view.hidden_fraction
            );
            // A vertex at a mask's edge is extrapolated by up to a pixel: 2 mm far away, more where the sheet is steep.
            assert!(error < 1.0, "{index}: {error} mm");
        }
    }

    #[test]
    fn at_least_the_back_of_a_capsule_is_hidden() {
        let mesh = capsule(240.0, 30.0, 41, 24).unwrap();
        for index in 0..20 {
            let view = PartialView::of_volumic(&mesh, &training_camera(), [0.5, 0.7], 5, index);
            let (hidden, error) = hidden_and_error(&mesh, &view);
            assert!((0.4..0.85).contains(&hidden), "{index}: {hidden}");
            // All along its silhouette the tube is seen edge-on.
            assert!(error < 2.0, "{index}: {error} mm");
        }
    }

    #[test]
    fn frames_are_a_function_of_seed_and_index() {
        let mesh = capsule(240.0, 30.0, 21, 12).unwrap();
        let view = |index| PartialView::of_volumic(&mesh, &training_camera(), [0.5, 0.7], 9, index);
        assert_eq!(view(3), view(3));
        assert_ne!(view(3), view(4));
    }
}
