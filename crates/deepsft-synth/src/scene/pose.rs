//! Random poses of a sheet before the camera, as a person holds it.

use crate::deform::centroid;
use crate::random::{between, chance};
use deepsft_geometry::{
    Camera,
    glam::{DAffine3, DQuat, DVec2, DVec3, EulerRot},
};
use rand::Rng;
use serde::Serialize;

/// Draws before the best pose so far is taken.
const POSE_TRIES: usize = 64;

/// Greatest angle in degrees between the template's z axis and the line of sight to the centroid. Away from the image's
/// centre that line is not the camera's axis. Near 90 the sheet is seen edge-on and its print cannot be read.
const MAX_VIEW_DEG: f64 = 75.0;

/// Least depth (z) of any vertex in mm.
const MIN_DEPTH_MM: f64 = 60.0;

/// What poses are drawn.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct PoseConfig {
    /// Least and greatest depth (z) of the sheet's centroid in mm. It is uniform in the logarithm, so that every ratio of image
    /// scales is equally frequent. Default 250 to 900, made for an A4 sheet before the training camera; other sizes want other
    /// distances.
    pub distance_mm: [f64; 2],
    /// Greatest angle in degrees between the template's z axis and the camera's. The tilt's sine is
    /// uniform, so that the density falls with its cosine and steep views stay the exception; the
    /// tilt's axis is uniform in the image plane. Default 65.
    pub max_tilt_deg: f64,
    /// Greatest in-plane rotation to either side in degrees, uniform. Default 180: any way up.
    pub max_roll_deg: f64,
    /// Least fraction of the vertices inside the image. Default 0.4.
    pub min_in_view: f64,
    /// Probability that a pose may reach over the image's edge although it would fit. Default 0.35.
    pub partly_out_probability: f64,
    /// Draws uniform poses, as the paper's section 5.1 has it: within 45 degrees about each of the camera's axes (the paper
    /// says "the camera's optical axes", which we read as all three), within 150 mm along x and y, 400 to 900 mm away, all
    /// independent. Distance, tilt, roll and the probability of reaching over the edge are then ignored; the bounds on
    /// what is in view still hold. Default false.
    pub uniform: bool,
}

/// Ranges of [`PoseConfig::uniform`]: angle about each axis, to either side, shift along x and y, and depth. The paper does
/// not say where its t_z of 100 to 600 mm is counted from; at 100 mm an A4 sheet cannot be in view. At 300 mm the flat sheet
/// just fits the 270 rows of the training camera, so that is where.
const UNIFORM_ROTATION_DEG: f64 = 45.0;
const UNIFORM_SHIFT_MM: f64 = 150.0;
const UNIFORM_DEPTH_MM: [f64; 2] = [400.0, 900.0];

impl Default for PoseConfig {
    fn default() -> Self {
        Self {
            distance_mm: [250.0, 900.0],
            max_tilt_deg: 65.0,
            max_roll_deg: 180.0,
            min_in_view: 0.4,
            partly_out_probability: 0.35,
            uniform: false,
        }
    }
}

/// Draws a `camera_from_template` for a sheet with the given vertices (mm, template frame). The sheet is rolled in its plane,
/// tilted, then moved so that its centroid has the drawn depth and lies anywhere in view. The identity rotation shows it
/// frontal and unmirrored.
///
/// Poses that bring a vertex nearer than 60 mm, too little of the sheet into view or the
/// sheet edge-on are drawn again. When none of 64 draws will do (a sheet too large for the distances), the best of
/// them is moved back until its nearest vertex has them. A pure function of its arguments.
pub(crate) fn sample_pose<R: Rng + ?Sized>(
    camera: &Camera,
    vertices_template: &[DVec3],
    config: &PoseConfig,
    rng: &mut R,
) -> DAffine3 {
    let mut best: Option<(f64, DAffine3)> = None;
    for _ in 0..POSE_TRIES {
        let pose = draw_pose(camera, vertices_template, config, rng);
        let in_view = fraction_in_view(camera, vertices_template, &pose);
        let near = nearest(vertices_template, &pose) - MIN_DEPTH_MM;
        let readable = view_angle(vertices_template, &pose) <= MAX_VIEW_DEG.to_radians();
        if near >= 0.0 && in_view >= config.min_in_view && readable {
            return pose;
        }
        let score = if near >= 0.0 { in_view } else { near };
        if best.is_none_or(|(best_score, _)| score > best_score) {
            best = Some((score, pose));
        }
    }
    let mut pose = best.map_or(DAffine3::IDENTITY, |(_, pose)| pose);
    let missing = MIN_DEPTH_MM - nearest(vertices_template, &pose);
    if missing > 0.0 && missing.is_finite() {
        let center = pose.transform_point3(centroid(vertices_template));
        let away = if center.z > 0.0 { center / center.z } else { DVec3::Z };
        pose.translation += away * missing;
    }
    pose
}

/// Fraction of the vertices (template frame) that a pose projects inside the image.
pub(crate) fn fraction_in_view(camera: &Camera, vertices_template: &[DVec3], camera_from_template: &DAffine3) -> f64 {
    let limit = camera.size().as_dvec2();
    let inside = vertices_template.iter().filter(|vertex| {
        let pixel = camera.project(camera_from_template.transform_point3(**vertex));
        pixel.is_some_and(|p| p.cmpge(DVec2::ZERO).all() && p.cmple(limit).all())
    });
    inside.count() as f64 / vertices_template.len().max(1) as f64
}

fn draw_uniform<R: Rng + ?Sized>(vertices: &[DVec3], rng: &mut R) -> DAffine3 {
    let mut within = |most: f64| between([-most, most], rng);
    let [x, y, z] = [UNIFORM_ROTATION_DEG.to_radians(); 3].map(&mut within);
    let [right, down] = [UNIFORM_SHIFT_MM; 2].map(&mut within);
    let rotation = DQuat::from_euler(EulerRot::XYZ, x, y, z);
    let place = DVec3::new(right, down, between(UNIFORM_DEPTH_MM, rng));
    DAffine3::from_rotation_translation(rotation, place - rotation * centroid(vertices))
}

fn draw_pose<R: Rng + ?Sized>(camera: &Camera, vertices: &[DVec3], config: &PoseConfig, rng: &mut R) -> DAffine3 {
    if config.uniform {
        return draw_uniform(vertices, rng);
    }
    let distance = between(config.distance_mm.map(f64::ln), rng).exp();
    let tilt = (between([0.0, 1.0], rng) * config.max_tilt_deg.to_radians().sin()).asin();
    let axis = DVec2::from_angle(between([0.0, std::f64::consts::TAU], rng)).extend(0.0);
    let roll = between([-1.0, 1.0], rng) * config.max_roll_deg.to_radians();
    let rotation = DQuat::from_axis_angle(axis, tilt) * DQuat::from_rotation_z(roll);
    let centroid = centroid(vertices);
    // The sheet on the optical axis tells how far it can be shifted and still fit.
    let centered = DAffine3::from_rotation_translation(rotation, DVec3::Z * distance - rotation * centroid);
    let (low, high) = bounding_box(camera, vertices, &centered);
    let size = camera.size().as_dvec2();
    let (to_low, to_high) = (-low, size - high);
    let extra = if chance(config.partly_out_probability, rng) {
        (high - low) * 0.5
    } else {
        DVec2::ZERO
    };
    let (from, to) = (to_low.min(to_high) - extra, to_low.max(to_high) + extra);
    let shift = DVec2::new(between([from.x, to.x], rng), between([from.y, to.y], rng));
    let pixel = camera.principal_point() + shift;
    DAffine3::from_rotation_translation(rotation, camera.unproject(pixel, distance) - rotation * centroid)
}

/// Bounding box in pixels of the vertices' projections; the whole image when none is before the
/// camera.
fn bounding_box(camera: &Camera, vertices: &[DVec3], pose: &DAffine3) -> (DVec2, DVec2) {
    let pixels = vertices
        .iter()
        .filter_map(|vertex| camera.project(pose.transform_point3(*vertex)));
    let all = pixels
        .map(|p| (p, p))
        .reduce(|(low, high), (p, _)| (low.min(p), high.max(p)));
    all.unwrap_or((DVec2::ZERO, camera.size().as_dvec2()))
}

/// Angle in radians between the template's z axis and the line of sight to the centroid.
fn view_angle(vertices: &[DVec3], pose: &DAffine3) -> f64 {
    pose.transform_vector3(DVec3::Z)
        .angle_between(pose.transform_point3(centroid(vertices)))
}

fn nearest(vertices: &[DVec3], pose: &DAffine3) -> f64 {
    vertices
        .iter()
        .map(|vertex| pose.transform_point3(*vertex).z)
        .fold(f64::INFINITY, f64::min)
}
