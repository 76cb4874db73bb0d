//! Rendered depth, registration and light against formulas, through the public interface.

use deepsft_geometry::glam::{DVec2, DVec3};
use deepsft_geometry::{Camera, Picture, Template, training_camera};
use deepsft_synth::{Sample, SynthConfig, Synthesizer};

const WIDTH_MM: f64 = 297.0;
const HEIGHT_MM: f64 = 210.0;

/// Grey of the paper, sRGB, and its linear light (IEC 61966-2-1).
const GREY: u8 = 200;

fn synthesizer(config: SynthConfig) -> Synthesizer {
    let texture = Picture::from_fn(64, 48, |_, _| [GREY; 3]);
    let template = Template::thin_shell(texture, WIDTH_MM, HEIGHT_MM).unwrap();
    Synthesizer::new(&template, config).unwrap()
}

fn linear(byte: f64) -> f64 {
    ((byte / 255.0 + 0.055) / 1.055).powf(2.4)
}

/// Renders the template with its vertices at `place(x, y)`, mm.
fn render(synthesizer: &Synthesizer, place: impl Fn(f64, f64) -> DVec3) -> Sample {
    let vertices = synthesizer.template().mesh().vertices().iter().map(|p| place(p.x, p.y));
    synthesizer.render_clean(vertices.collect()).unwrap()
}

fn ray(camera: &Camera, pixel: usize) -> DVec3 {
    let (column, row) = (pixel % 480, pixel / 480);
    camera
        .ray_from_pixel(DVec2::new(column as f64 + 0.5, row as f64 + 0.5))
        .extend(1.0)
}

#[test]
fn a_plane_in_any_pose_has_exact_depth_and_registration_before_the_papers_camera_too() {
    for config in [SynthConfig::default(), SynthConfig::paper()] {
        let synthesizer = synthesizer(config);
        let camera = training_camera();
        for (right, down, origin) in [
            (
                DVec3::new(0.9, 0.2, -0.4),
                DVec3::new(0.1, 0.8, 0.5),
                DVec3::new(40.0, -25.0, 520.0),
            ),
            (
                DVec3::new(0.4, -0.8, 0.3),
                DVec3::new(0.9, 0.3, 0.2),
                DVec3::new(-90.0, 30.0, 640.0),
            ),
        ] {
            let right = right.normalize();
            let down = (down - right * down.dot(right)).normalize();
            let normal = right.cross(down);
            let sample = render(&synthesizer, |x, y| origin + right * x + down * y);
            let mut inside = 0;
            for pixel in 0..480 * 270 {
                let ray = ray(&camera, pixel);
                let depth = origin.dot(normal) / ray.dot(normal);
                let offset = ray * depth - origin;
                let uv = DVec2::new(offset.dot(right) / WIDTH_MM + 0.5, offset.dot(down) / HEIGHT_MM + 0.5);
                let margin = (0.5 - (uv - 0.5).abs()).min_element();
                // What rounding puts on either side of the outline does not count.
                if margin.abs() > 1e-6 {
                    assert_eq!(sample.truth.inside(pixel), margin > 0.0, "pixel {pixel}, uv {uv}");
                }
                if !sample.truth.inside(pixel) {
                    continue;
                }
                inside += 1;
                // Half a unit in the last place of a single between 512 and 1024 is 3e-5.
                assert!(
                    (f64::from(sample.truth.depth()[pixel]) - depth).abs() < 1e-4,
                    "pixel {pixel}"
                );
                let seen = sample.truth.registration()[pixel].map(f64::from);
                assert!(
                    (seen[0] - uv.x).abs() < 1e-6 && (seen[1] - uv.y).abs() < 1e-6,
                    "pixel {pixel}"
                );
            }
            // The sheet's area over the squared depth, times f^2 and the cosine of the tilt: at least a few thousand.
            assert!(inside > 5000, "{inside}");
        }
    }
}

/// The point at which a ray in the (x, z) plane meets the chord of the arc over one cell, and how far along the cell.
fn meet_chord(slope: f64, from: DVec2, to: DVec2) -> (f64, f64) {
    // from + t (to - from) = depth (slope, 1)
    let step = to - from;
    let t = (from.y * slope - from.x) / (step.x - step.y * slope);
    (from.y + t * step.y, t)
}

#[test]
fn a_cylinder_is_exact_facet_by_facet() {
    // The mesh of a sheet rolled about an upright axis is a prism: every facet lies in a plane over a chord of the circle,
    // upright edges stay straight, and along a facet u runs evenly. So depth, u and v have a closed form, to rounding.
    let synthesizer = synthesizer(SynthConfig::default());
    let camera = training_camera();
    let (radius, near) = (150.0, 420.0);
    let arc = |x: f64| DVec2::new(radius * (x / radius).sin(), near + radius * (1.0 - (x / radius).cos()));
    let sample = render(&synthesizer, |x, y| DVec3::new(arc(x).x, y, arc(x).y));
    let cells = synthesizer.template().grid().unwrap().0 - 1;
    let edge = |k: usize| (k as f64 / cells as f64 - 0.5) * WIDTH_MM;
    let (mut inside, mut worst) = (0, 0.0_f64);
    for pixel in (0..480 * 270).filter(|&pixel| sample.truth.inside(pixel)) {
        inside += 1;
        let ray = ray(&camera, pixel);
        let chords = (0..cells).map(|k| (k, meet_chord(ray.x, arc(edge(k)), arc(edge(k + 1)))));
        // The nearest facet the ray meets; a hair outside of it for rays through an edge.
        let met = chords.filter(|(_, (_, t))| (-1e-9..=1.0 + 1e-9).contains(t));
        let (k, (depth, t)) = met.min_by(|a, b| a.1.0.total_cmp(&b.1.0)).unwrap();
        let uv = DVec2::new((k as f64 + t) / cells as f64, ray.y * depth / HEIGHT_MM + 0.5);
        let seen = sample.truth.registration()[pixel].map(f64::from);
        let off = (seen[0] - uv.x).abs().max((seen[1] - uv.y).abs());
        // Where the surface is steep, u changes by 1/297 a mm of depth times the tangent: still below 1e-5.
        assert!(off < 1e-5, "pixel {pixel}: {off}");
        assert!(
            (f64::from(sample.truth.depth()[pixel]) - depth).abs() < 2e-4,
            "pixel {pixel}"
        );
        // And the smooth cylinder itself is no farther off than a facet's sagitta over the cosine of the view.
        let (a, b, c) = (ray.x * ray.x + 1.0, near + radius, near * near + 2.0 * near * radius);
        let smooth = (b - (b * b - a * c).max(0.0).sqrt()) / a;
        let angle = (ray.x * smooth / radius).clamp(-1.0, 1.0).asin();
        let cosine = DVec2::new(-angle.sin(), angle.cos()).dot(DVec2::new(ray.x, 1.0).normalize());
        if cosine > 0.4 {
            let sagitta = radius * (1.0 - (WIDTH_MM / cells as f64 / radius / 2.0).cos());
            worst = worst.max((depth - smooth).abs() * cosine / sagitta);
        }
    }
    assert!(inside > 15_000, "{inside}");
    assert!((0.5..1.01).contains(&worst), "{worst} sagittas");
}

#[test]
fn a_tilted_plane_is_as_bright_as_lamberts_law_says() {
    // Clean renders: 0.4 ambient and 0.6 of a light along the optical axis, so 0.4 + 0.6 cos(tilt).
    let synthesizer = synthesizer(SynthConfig::default());
    for tilt_deg in [0.0_f64, 30.0, 60.0] {
        let (sin, cos) = tilt_deg.to_radians().sin_cos();
        let sample = render(&synthesizer, |x, y| DVec3::new(x * cos, y, 700.0 + x * sin));
        let expected = linear(f64::from(GREY)) * (0.4 + 0.6 * cos);
        let centre = sample.image.pixel(240, 135)[0];
        // A byte is 1 % of the light here; the texture's bytes round once more.
        let off = linear(f64::from(centre)) / expected - 1.0;
        assert!(off.abs() < 0.015, "{tilt_deg} degrees: {off}");
    }
}
