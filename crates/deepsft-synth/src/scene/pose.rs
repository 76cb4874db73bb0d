//! Random poses of a sheet before the camera, as a person holds it.

use crate::random::{between, chance};
use deepsft_geometry::{
    Camera,
    glam::{DAffine3, DQuat, DVec2, DVec3, EulerRot},
};
use rand::Rng;
use serde::Serialize;

/// Draws before the best pose so far is taken.
const POSE_TRIES: usize = 64;

/// What poses are drawn.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct PoseConfig {
    /// Least and greatest depth (z) of the sheet's centroid in mm, uniform in the logarithm of the
    /// depth so that every ratio of image scales is equally frequent. Default 250 to 900, made for an
    /// A4 sheet before the training camera; other sizes want other distances.
    pub distance_mm: [f64; 2],
    /// Greatest angle in degrees between the template's z axis and the camera's. The tilt's sine is
    /// uniform, so that the density falls with its cosine and steep views stay the exception; the
    /// tilt's axis is uniform in the image plane. Default 65.
    pub max_tilt_deg: f64,
    /// Greatest angle in degrees between the template's z axis and the line of sight to the centroid,
    /// which away from the image's centre is not the camera's axis. Default 75; near 90 the sheet is
    /// seen edge-on and its print cannot be read.
    pub max_view_deg: f64,
    /// Greatest in-plane rotation to either side in degrees, uniform. Default 180: any way up.
    pub max_roll_deg: f64,
    /// Least fraction of the vertices inside the image. Default 0.4.
    pub min_in_view: f64,
    /// Probability that a pose may reach over the image's edge although it would fit. Default 0.35.
    pub partly_out_probability: f64,
    /// Least depth (z) of any vertex in mm. Default 60.
    pub min_depth_mm: f64,
    /// Draws poses from these ranges of rotation and translation instead. Distance, tilt, roll and the probability of
    /// reaching over the edge are then ignored; the bounds on what is in view still hold. Default none.
    pub uniform: Option<UniformPose>,
}

/// Rotation about the camera's axes and translation of the sheet's centroid, each number uniform and independent of the
/// others: the paper's section 5.1.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct UniformPose {
    /// Largest angle about each of the camera's x, y and z axes, to either side, degrees; the rotation is
    /// R_x R_y R_z (the paper says "the camera's optical axes", which we read as all three).
    pub most_rotation_deg: f64,
    /// Largest shift along x and along y from the optical axis, mm.
    pub most_shift_mm: f64,
    /// Depth, mm.
    pub depth_mm: [f64; 2],
}

impl Default for PoseConfig {
    fn default() -> Self {
        Self {
            distance_mm: [250.0, 900.0],
            max_tilt_deg: 65.0,
            max_view_deg: 75.0,
            max_roll_deg: 180.0,
            min_in_view: 0.4,
            partly_out_probability: 0.35,
            min_depth_mm: 60.0,
            uniform: None,
        }
    }
}

/// A random `camera_from_template` for a sheet with the given vertices (mm, template frame): rolled
/// in its plane, tilted, then moved so that its centroid has the drawn depth and lies anywhere in
/// view. The identity rotation shows it frontal and unmirrored.
///
/// Poses that bring a vertex nearer than `min_depth_mm`, too little of the sheet into view or the
/// sheet edge-on are drawn again. When none of 64 draws will do (a sheet too large for the distances), the best of
/// them is moved back until its nearest vertex has `min_depth_mm`. A pure function of its arguments.
pub fn sample_pose<R: Rng + ?Sized>(
    camera: &Camera,
    vertices_template: &[DVec3],
    config: &PoseConfig,
    rng: &mut R,
) -> DAffine3 {
    let mut best: Option<(f64, DAffine3)> = None;
    for _ in 0..POSE_TRIES {
        let pose = draw_pose(camera, vertices_template, config, rng);
        let in_view = fraction_in_view(camera, vertices_template, &pose);
        let near = nearest(vertices_template, &pose) - config.min_depth_mm;
        let readable = view_angle(vertices_template, &pose) <= config.max_view_deg.to_radians();
        if near >= 0.0 && in_view >= config.min_in_view && readable {
            return pose;
        }
        let score = if near >= 0.0 { in_view } else { near };
        if best.is_none_or(|(best_score, _)| score > best_score) {
            best = Some((score, pose));
        }
    }
    let mut pose = best.map_or(DAffine3::IDENTITY, |(_, pose)| pose);
    let missing = config.min_depth_mm - nearest(vertices_template, &pose);
    if missing > 0.0 && missing.is_finite() {
        let center = pose.transform_point3(centroid(vertices_template));
        let away = if center.z > 0.0 { center / center.z } else { DVec3::Z };
        pose.translation += away * missing;
    }
    pose
}

/// Fraction of the vertices (template frame) that a pose projects inside the image.
pub fn fraction_in_view(camera: &Camera, vertices_template: &[DVec3], camera_from_template: &DAffine3) -> f64 {
    let limit = DVec2::new(f64::from(camera.width()), f64::from(camera.height()));
    let inside = vertices_template.iter().filter(|vertex| {
        let pixel = camera.project(camera_from_template.transform_point3(**vertex));
        pixel.is_some_and(|p| p.cmpge(DVec2::ZERO).all() && p.cmple(limit).all())
    });
    inside.count() as f64 / vertices_template.len().max(1) as f64
}

impl UniformPose {
    fn draw<R: Rng + ?Sized>(&self, vertices: &[DVec3], rng: &mut R) -> DAffine3 {
        let mut within = |most: f64| between([-most, most], rng);
        let [x, y, z] = [self.most_rotation_deg.to_radians(); 3].map(&mut within);
        let [right, down] = [self.most_shift_mm; 2].map(&mut within);
        let rotation = DQuat::from_euler(EulerRot::XYZ, x, y, z);
        let place = DVec3::new(right, down, between(self.depth_mm, rng));
        DAffine3::from_rotation_translation(rotation, place - rotation * centroid(vertices))
    }
}

fn draw_pose<R: Rng + ?Sized>(camera: &Camera, vertices: &[DVec3], config: &PoseConfig, rng: &mut R) -> DAffine3 {
    if let Some(uniform) = &config.uniform {
        return uniform.draw(vertices, rng);
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
    let size = DVec2::new(f64::from(camera.width()), f64::from(camera.height()));
    let (to_low, to_high) = (-low, size - high);
    let extra = if chance(config.partly_out_probability, rng) {
        (high - low) * 0.5
    } else {
        DVec2::ZERO
    };
    let (from, to) = (to_low.min(to_high) - extra, to_low.max(to_high) + extra);
    let shift = DVec2::new(between([from.x, to.x], rng), between([from.y, to.y], rng));
    let pixel = camera.pixel_from_ray(DVec2::ZERO) + shift;
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
    all.unwrap_or((
        DVec2::ZERO,
        DVec2::new(f64::from(camera.width()), f64::from(camera.height())),
    ))
}

fn centroid(vertices: &[DVec3]) -> DVec3 {
    vertices.iter().sum::<DVec3>() / vertices.len().max(1) as f64
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::deform::{DeformationConfig, deform};
    use deepsft_geometry::{Picture, Template, training_camera};
    use rand::SeedableRng;
    use rand_pcg::Pcg64Mcg;

    fn sheet(width_mm: f64, height_mm: f64) -> Template {
        Template::thin_shell(Picture::from_fn(1, 1, |_, _| [0; 3]), width_mm, height_mm).unwrap()
    }

    /// Tilt and roll in radians of a rotation tilt * roll: the angle between the z axes, and the
    /// rotation about z that is left.
    fn tilt_and_roll(pose: &DAffine3) -> (f64, f64) {
        let rotation = DQuat::from_mat3(&pose.matrix3);
        let tilt = (rotation * DVec3::Z).angle_between(DVec3::Z);
        let roll = 2.0 * rotation.z.atan2(rotation.w);
        (
            tilt,
            (roll + std::f64::consts::PI).rem_euclid(std::f64::consts::TAU) - std::f64::consts::PI,
        )
    }

    #[test]
    fn poses_of_bent_sheets_keep_every_bound_and_fill_the_ranges() {
        let (camera, config) = (training_camera(), PoseConfig::default());
        let template = sheet(297.0, 210.0);
        let (mut near, mut far, mut flat, mut steep, mut upside_down, mut whole, mut cut) = (0, 0, 0, 0, 0, 0, 0);
        for seed in 0..1000 {
            let mut rng = Pcg64Mcg::seed_from_u64(seed);
            let vertices = deform(&template, &DeformationConfig::default(), &mut rng);
            let pose = sample_pose(&camera, &vertices, &config, &mut rng);
            let distance = pose.transform_point3(centroid(&vertices)).z;
            let (tilt, roll) = tilt_and_roll(&pose);
            let in_view = fraction_in_view(&camera, &vertices, &pose);
            assert!(
                (250.0 - 1e-6..=900.0 + 1e-6).contains(&distance),
                "seed {seed}: {distance} mm"
            );
            assert!(tilt.to_degrees() < 65.0 + 1e-6, "seed {seed}");
            assert!(view_angle(&vertices, &pose).to_degrees() < 75.0 + 1e-6, "seed {seed}");
            assert!(in_view >= 0.4, "seed {seed}: {in_view} in view");
            assert!(nearest(&vertices, &pose) >= 60.0, "seed {seed}");
            assert!((pose.matrix3.determinant() - 1.0).abs() < 1e-9);
            near += usize::from(distance < 350.0);
            far += usize::from(distance > 700.0);
            flat += usize::from(tilt.to_degrees() < 20.0);
            steep += usize::from(tilt.to_degrees() > 50.0);
            upside_down += usize::from(roll.to_degrees().abs() > 90.0);
            whole += usize::from(in_view == 1.0);
            cut += usize::from(in_view < 0.8);
        }
        // Shares of the drawn distribution: ln(350 / 250) / ln(3.6) = 26 %, ln(900 / 700) / ln(3.6)
        // = 20 %, sin 20 / sin 65 = 38 %, 1 - sin 50 / sin 65 = 15 %, half; drawing again moves them a little.
        for (count, fraction) in [
            (near, 0.26),
            (far, 0.20),
            (flat, 0.38),
            (steep, 0.15),
            (upside_down, 0.5),
        ] {
            assert!(
                (f64::from(count as u32) / 1000.0 - fraction).abs() < 0.06,
                "{count} of 1000, expected {fraction}"
            );
        }
        assert!(
            whole > 300 && cut > 100,
            "{whole} whole, {cut} cut off by the image's edge"
        );
    }

    #[test]
    fn sheets_are_seen_in_every_part_of_the_image() {
        let (camera, config) = (training_camera(), PoseConfig::default());
        let template = sheet(297.0, 210.0);
        let vertices = template.mesh().vertices();
        let mut counts = [0; 9];
        for seed in 0..500 {
            let pose = sample_pose(&camera, vertices, &config, &mut Pcg64Mcg::seed_from_u64(seed));
            let center = camera.project(pose.translation).unwrap();
            let part = |at: f64, size: f64| ((3.0 * at / size).max(0.0) as usize).min(2);
            counts[3 * part(center.y, 270.0) + part(center.x, 480.0)] += 1;
        }
        assert!(counts.iter().all(|&count| count > 15), "{counts:?}");
    }

    #[test]
    fn a_sheet_too_large_for_the_distances_still_lies_before_the_camera() {
        let camera = training_camera();
        for (width, height) in [(3000.0, 2000.0), (900.0, 900.0)] {
            let template = sheet(width, height);
            for seed in 0..50 {
                let vertices = template.mesh().vertices();
                let pose = sample_pose(
                    &camera,
                    vertices,
                    &PoseConfig::default(),
                    &mut Pcg64Mcg::seed_from_u64(seed),
                );
                assert!(
                    nearest(vertices, &pose) >= 60.0 - 1e-6,
                    "{width} x {height} mm, seed {seed}"
                );
                assert!(fraction_in_view(&camera, vertices, &pose) > 0.0);
            }
        }
    }

    #[test]
    fn the_same_seed_gives_the_same_pose_and_others_do_not() {
        let (camera, config) = (training_camera(), PoseConfig::default());
        let template = sheet(210.0, 297.0);
        let pose = |seed| {
            sample_pose(
                &camera,
                template.mesh().vertices(),
                &config,
                &mut Pcg64Mcg::seed_from_u64(seed),
            )
        };
        assert_eq!(pose(5), pose(5));
        assert_ne!(pose(5), pose(6));
    }

    #[test]
    fn without_tilt_and_roll_the_sheet_is_frontal_and_unmirrored() {
        let camera = training_camera();
        let template = sheet(297.0, 210.0);
        let config = PoseConfig {
            max_tilt_deg: 0.0,
            max_roll_deg: 0.0,
            ..PoseConfig::default()
        };
        let pose = sample_pose(
            &camera,
            template.mesh().vertices(),
            &config,
            &mut Pcg64Mcg::seed_from_u64(1),
        );
        let pixel = |u, v| {
            camera
                .project(pose.transform_point3(template.point_template(DVec2::new(u, v)).unwrap()))
                .unwrap()
        };
        let (corner, right, down) = (pixel(0.0, 0.0), pixel(1.0, 0.0), pixel(0.0, 1.0));
        assert!(right.x > corner.x && (right.y - corner.y).abs() < 1e-9);
        assert!(down.y > corner.y && (down.x - corner.x).abs() < 1e-9);
    }
}
