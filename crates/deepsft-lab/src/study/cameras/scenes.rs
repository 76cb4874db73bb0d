//! The same scenes through several cameras.

use anyhow::{Context, Result};
use deepsft_formats::{decode_picture, encode_jpeg};
use deepsft_geometry::glam::{DVec2, DVec3};
use deepsft_geometry::{Camera, CanonicalWarp, Picture, Template, training_camera};
use deepsft_synth::random::{Stream, generator};
use deepsft_synth::{EffectsConfig, PoseConfig, Sample, SynthConfig, Synthesizer};
use rand::{Rng, RngExt};

/// A phone's wide-angle camera, its lens left as it is: 92 degrees across in video of 1920 x 1080 pixels, drawn together by a sixth at the
/// sides. Focal length and coefficients (OpenCV's) are our choice.
const WIDE_PHONE: (usize, usize, [f64; 4], [f64; 5]) = (
    1920,
    1080,
    [1100.0, 1102.0, 966.0, 533.0],
    [-0.20, 0.05, 0.0006, -0.0004, -0.004],
);

/// Pixels of the image that all cameras' images are made of for each of the training camera's, along a side.
const FINENESS: f64 = 3.0;

/// Places along each side of an image that say which rays it holds.
const BORDER: usize = 64;

/// The training camera, the paper's three and the phone, each across, then each upright, with their names.
pub fn cameras() -> Result<Vec<(String, Camera)>> {
    let mut across = vec![("training", training_camera())];
    for name in ["kinect-v2", "realsense-d435", "gopro-hero3"] {
        across.push((name, Camera::preset(name).context("it is no preset")?));
    }
    let (width, height, [fx, fy, cx, cy], distortion) = WIDE_PHONE;
    let phone =
        Camera::pinhole((width, height), DVec2::new(fx, fy), DVec2::new(cx, cy))?.with_distortion(distortion)?;
    across.push(("wide-phone", phone));
    let upright = across
        .iter()
        .map(|(name, camera)| (format!("{name}, upright"), camera.turned_anticlockwise()));
    let named = across.iter().map(|(name, camera)| (format!("{name}, across"), *camera));
    Ok(named.chain(upright).collect())
}

/// Scenes in which all cameras, which stand at one place and look the same way, see the whole sheet: rendered once through a wide, fine
/// pinhole, from which each camera's image is resampled.
pub struct Scenes<'a> {
    cameras: &'a [(String, Camera)],
    world: Synthesizer,
    /// Draws shapes and poses: what this one sees, all do.
    common: Synthesizer,
    seed: u64,
}

pub struct SharedScene {
    /// With its truth, in the wide image.
    pub world: Sample,
    index: u64,
}

impl<'a> Scenes<'a> {
    pub fn new(template: &Template, cameras: &'a [(String, Camera)], distance_mm: [f64; 2], seed: u64) -> Result<Self> {
        let mut widest = [DVec2::INFINITY, DVec2::NEG_INFINITY];
        let mut common = [DVec2::NEG_INFINITY, DVec2::INFINITY];
        for (_, camera) in cameras {
            for k in 0..=BORDER {
                let (size, at) = (camera.size().as_dvec2(), k as f64 / BORDER as f64);
                let [left, right] = [0.0, size.x].map(|x| camera.ray_from_pixel(DVec2::new(x, size.y * at)));
                let [top, bottom] = [0.0, size.y].map(|y| camera.ray_from_pixel(DVec2::new(size.x * at, y)));
                for ray in [left, right, top, bottom] {
                    widest = [widest[0].min(ray), widest[1].max(ray)];
                }
                common[0] = common[0].max(DVec2::new(left.x, top.y));
                common[1] = common[1].min(DVec2::new(right.x, bottom.y));
            }
        }
        let focal = training_camera().focal().x;
        let default = EffectsConfig::default();
        // Blur is of the scene and as wide in every camera, noise and compression are each camera's own. Vignetting, bars and haloes
        // would belong to the wide image.
        let wider = |range: [f64; 2]| range.map(|px| px * FINENESS);
        let effects = EffectsConfig {
            defocus_px: wider(default.defocus_px),
            motion_px: wider(default.motion_px),
            noise_levels: [0.0; 2],
            vignetting: [0.0; 2],
            sharpening_probability: 0.0,
            jpeg_probability: 0.0,
            bars_probability: 0.0,
            ..default
        };
        let config = SynthConfig {
            empty_probability: 0.0,
            effects,
            ..SynthConfig::default()
        };
        let pose = PoseConfig {
            distance_mm,
            min_in_view: 1.0,
            partly_out_probability: 0.0,
            ..PoseConfig::default()
        };
        let of = |[low, high]: [DVec2; 2], focal: f64| {
            let size = ((high - low) * focal).ceil().as_uvec2();
            Camera::pinhole(
                (size.x as usize, size.y as usize),
                DVec2::new(focal, focal),
                DVec2::new(-low.x * focal, -low.y * focal),
            )
        };
        let world = SynthConfig {
            camera: of(widest, FINENESS * focal)?,
            ..config.clone()
        };
        let common = SynthConfig {
            camera: of(common, focal)?,
            pose,
            ..config
        };
        Ok(Self {
            cameras,
            world: Synthesizer::new(template, world)?,
            common: Synthesizer::new(template, common)?,
            seed,
        })
    }

    /// The scenes that count, one after the other.
    pub fn iter(&self) -> impl Iterator<Item = Result<SharedScene>> {
        let scene = |index| -> Result<Option<SharedScene>> {
            let mut random = generator(self.seed, index, Stream::Shape);
            let vertices = self.common.sample_vertices(&mut random);
            if !self.cameras.iter().all(|(_, camera)| holds(camera, &vertices)) {
                return Ok(None);
            }
            let world = self.world.scene(self.seed, index).render(vertices, index)?;
            let least = self.world.config().min_visible_px as f64 * FINENESS * FINENESS;
            Ok((world.truth.area() as f64 >= least).then_some(SharedScene { world, index }))
        };
        (0..).filter_map(move |index| scene(index).transpose())
    }

    /// What `camera` makes of a scene: the wide image through its lens, with its own noise and compression, drawn from the ranges of the
    /// training data. All cameras gather the same light: noise for each pixel grows with their number.
    pub fn image(&self, scene: &SharedScene, camera: &Camera) -> Result<Picture> {
        let image = CanonicalWarp::new(&scene.world.camera, camera).apply(&scene.world.image)?;
        let mut random = generator(self.seed, scene.index, Stream::Disturbance);
        let EffectsConfig {
            noise_levels: [least, most],
            jpeg_probability,
            jpeg_quality: [low, high],
            ..
        } = EffectsConfig::default();
        let levels = least + (most - least) * random.random::<f64>().powf(1.5);
        let quality = random.random_range(low..high).round() as u8;
        let is_compressed = random.random_bool(jpeg_probability);
        let levels = levels * camera.focal().x / training_camera().focal().x;
        let image = noisy(&image, levels, &mut random);
        Ok(match is_compressed {
            true => decode_picture(&encode_jpeg(&image, quality)?)?,
            false => image,
        })
    }
}

/// Whether all of a mesh is inside a camera's image.
fn holds(camera: &Camera, vertices: &[DVec3]) -> bool {
    let limit = camera.size().as_dvec2();
    let inside = |p: DVec2| p.cmpge(DVec2::ZERO).all() && p.cmple(limit).all();
    vertices.iter().all(|&p| camera.project(p).is_some_and(inside))
}

/// With Gaussian noise of this standard deviation, grey levels.
fn noisy(picture: &Picture, levels: f64, random: &mut impl Rng) -> Picture {
    // The sum of four bytes has the mean 510 and the variance 4 (256^2 - 1) / 12.
    let scale = levels as f32 / 147.8;
    let mut normal = || {
        let bytes: [u8; 4] = random.random();
        (bytes.map(f32::from).iter().sum::<f32>() - 510.0) * scale
    };
    let [width, height] = [picture.width(), picture.height()];
    Picture::from_fn(width, height, |x, y| {
        picture
            .pixel(x, y)
            .map(|value| (f32::from(value) + normal()).round().clamp(0.0, 255.0) as u8)
    })
}
