//! A mesh fitted to the pixels of the camera's own image.

use crate::sheet::{bent, folded, image, template};
use deepsft_geometry::fitting::{FrameFitter, Start};
use deepsft_geometry::glam::{DVec2, DVec3};
use deepsft_geometry::metrics::frame_metrics;
use deepsft_geometry::raster::VisibleSurface;
use deepsft_geometry::{Camera, CanonicalWarp, GeometryError, Picture, Surface, Template, Verdict, training_camera};

/// A sheet with strokes of 1 to 5 mm, which the canonical image hardly shows.
fn finely_printed() -> Template {
    let print = Picture::from_fn(1188, 840, |x, y| {
        let (x, y) = (x as f64 / 4.0, y as f64 / 4.0);
        let wave = |a: f64, b: f64, c: f64| (a * x + b * y + c * (x * y) / 200.0).sin();
        let strokes = wave(1.1, 0.6, 0.2) + wave(0.4, -1.5, 0.3) + wave(0.2, 0.15, 0.1);
        [(125.0 + 40.0 * strokes) as u8; 3]
    });
    Template::thin_shell(print, 297.0, 210.0).unwrap()
}

/// What a camera with three times the canonical image's pixels along each side takes of the sheet, with noise.
fn photograph(template: &Template, vertices: &[DVec3], camera: &Camera) -> Picture {
    let truth = VisibleSurface::new(template.mesh(), vertices, camera).maps();
    let texture = template.texture();
    let size = texture.size().as_dvec2();
    Picture::from_fn(truth.size().width, truth.size().height, |x, y| {
        let pixel = y * truth.size().width + x;
        if !truth.inside(pixel) {
            return [if (x / 36 + y / 27) % 2 == 0 { 60 } else { 150 }; 3];
        }
        let at = truth.uv(pixel) * size;
        let noise = ((x * 7919 + y * 104_729 + x * y * 31) % 41) as f32 - 20.0;
        texture.sample(at.x, at.y).map(|c| (0.8 * c + 20.0 + noise) as u8)
    })
}

/// RMS distance of the vertices from the true ones, mm.
fn distance(surface: &Surface, truth: &[DVec3]) -> f64 {
    let squares = surface
        .vertices_camera
        .iter()
        .zip(truth)
        .map(|(p, q)| p.distance_squared(*q));
    (squares.sum::<f64>() / truth.len() as f64).sqrt()
}

#[test]
fn the_pixels_of_a_larger_image_make_the_mesh_more_exact_through_any_lens() {
    let (template, canonical) = (finely_printed(), training_camera());
    let large = canonical.resized((1440, 810)).unwrap();
    let vertices: Vec<DVec3> = bent(&template, 0.0).iter().map(|p| p + 150.0 * DVec3::Z).collect();
    let start = Start::Mesh(vertices.iter().map(|p| p + DVec3::new(3.0, 2.0, 12.0)).collect());
    let mut fitter = FrameFitter::new(&template).unwrap();
    for camera in [large, large.with_distortion([-0.15, 0.03, 0.001, 0.0, 0.0]).unwrap()] {
        let image = photograph(&template, &vertices, &camera);
        let small = CanonicalWarp::new(&camera, &canonical).apply(&image).unwrap();
        let fitted = fitter.fit(&small, &canonical, &start).unwrap().unwrap();
        let close = fitter.fit_close_ups(&image, &camera, fitted.clone()).unwrap();
        let [before, after] = [&fitted, &close].map(|surface| distance(surface, &vertices));
        assert!(after < 0.5 * before, "{before} mm, {after} mm");
        assert!(close.verdict.is_found() && close.camera == canonical);
        assert!(
            close.verdict.detail > 2.0 && close.verdict.explained > 0.95,
            "{:?}",
            close.verdict
        );
        // About as many pixels as before: they are those of the canonical image.
        let px = close.verdict.confirmed_px / fitted.verdict.confirmed_px;
        assert!((0.8..1.3).contains(&px), "{px}");
        // The canonical image itself has no more to say, but for how sure the mesh is: less than with more pixels.
        let same = fitter.fit_close_ups(&small, &canonical, fitted.clone()).unwrap();
        let median = |surface: &Surface| {
            let mut sorted = surface.deviations.clone();
            sorted.sort_unstable_by(f32::total_cmp);
            sorted[sorted.len() / 2]
        };
        assert!(
            median(&close) < 0.7 * median(&same),
            "{} mm, {} mm",
            median(&close),
            median(&same)
        );
        assert!(close.is_shape_determined() && !fitted.is_shape_determined());
        // Nor where it could as well lie elsewhere.
        let mut ambiguous = close.clone();
        ambiguous.verdict.ambiguity = Some(0.99);
        assert!(!ambiguous.is_shape_determined());
        let deviations = same.deviations.clone();
        assert_eq!(
            same,
            Surface {
                deviations,
                ..fitted.clone()
            }
        );
        let wrong = fitter.fit_close_ups(&small, &camera, fitted.clone());
        assert!(matches!(wrong, Err(GeometryError::MapSize { .. })));
        let short = Surface {
            vertices_camera: vertices[1..].to_vec(),
            ..fitted
        };
        let wrong = fitter.fit_close_ups(&image, &camera, short);
        assert!(matches!(wrong, Err(GeometryError::StartLength { .. })));
    }
}

#[test]
fn a_sheet_that_hangs_out_of_the_image_is_not_bent_by_the_image_s_end() {
    let (template, canonical) = (finely_printed(), training_camera());
    // It leaves black bars in the canonical image.
    let narrow = Camera::pinhole((960, 721), DVec2::splat(864.0), DVec2::new(480.0, 360.5)).unwrap();
    let wide = canonical.resized((1280, 720)).unwrap();
    let mut fitter = FrameFitter::new(&template).unwrap();
    let through_lens = wide.with_distortion([-0.15, 0.03, 0.0, 0.0, 0.0]).unwrap();
    for (camera, x, y) in [(narrow, 210.0, 0.0), (wide, 180.0, 120.0), (through_lens, 240.0, 0.0)] {
        let aside = DVec3::new(x, y, 50.0);
        let vertices: Vec<DVec3> = bent(&template, 0.0).iter().map(|p| p + aside).collect();
        let image = photograph(&template, &vertices, &camera);
        let small = CanonicalWarp::new(&camera, &canonical).apply(&image).unwrap();
        let start = Start::Mesh(vertices.iter().map(|p| p + DVec3::new(2.0, 1.0, 8.0)).collect());
        let fitted = fitter.fit(&small, &canonical, &start).unwrap().unwrap();
        let close = fitter.fit_close_ups(&image, &camera, fitted).unwrap();
        // 5.2 mm, 3.2 mm and 7.8 mm where black pixels beyond the image are compared.
        let error = distance(&close, &vertices);
        assert!(error < 2.4, "{}: {error} mm", camera.size());
    }
}

/// A print that came out uneven: its middle third is 2.5 % shorter than the template says.
#[test]
fn a_print_that_is_uneven_by_some_per_cent_is_followed_in_close_ups() {
    let (template, canonical) = (finely_printed(), training_camera());
    let camera = canonical.resized((1440, 810)).unwrap();
    let uneven = |p: &DVec3| p - DVec3::X * (0.025 * p.x.clamp(-50.0, 50.0)) + 500.0 * DVec3::Z;
    let vertices: Vec<DVec3> = template.mesh().vertices().iter().map(uneven).collect();
    let image = photograph(&template, &vertices, &camera);
    let truth = VisibleSurface::new(template.mesh(), &vertices, &canonical).maps();
    let small = CanonicalWarp::new(&camera, &canonical).apply(&image).unwrap();
    let start = template.mesh().vertices().iter().map(|p| p + 500.0 * DVec3::Z);
    let start = Start::Mesh(start.collect());
    let mut fitter = FrameFitter::new(&template).unwrap();
    let fitted = fitter.fit(&small, &canonical, &start).unwrap().unwrap();
    let close = fitter.fit_close_ups(&image, &camera, fitted.clone()).unwrap();
    let [before, after] = [&fitted, &close].map(|surface| {
        let maps = surface.maps(template.mesh());
        let metrics = frame_metrics(&maps, &truth, &canonical, template.size_mm()).unwrap();
        metrics.registration_rmse_px.unwrap()
    });
    assert!(after < 0.6 * before && after < 0.12, "{before} px, {after} px");
}

/// A disc and a bar on white.
fn nearly_blank() -> Template {
    let print = Picture::from_fn(594, 420, |x, y| {
        let (x, y) = (x as f64 / 2.0 - 110.0, y as f64 / 2.0 - 90.0);
        let is_bar = (60.0..120.0).contains(&x) && (20.0..28.0).contains(&y);
        if is_bar || x * x + y * y < 900.0 {
            [170, 30, 40]
        } else {
            [245; 3]
        }
    });
    Template::thin_shell(print, 297.0, 210.0).unwrap()
}

#[test]
fn a_nearly_blank_sheet_is_held_by_its_border() {
    let (template, canonical) = (nearly_blank(), training_camera());
    let camera = canonical.resized((960, 540)).unwrap();
    let vertices: Vec<DVec3> = bent(&template, 0.0).iter().map(|p| p + 50.0 * DVec3::Z).collect();
    let image = photograph(&template, &vertices, &camera);
    let small = CanonicalWarp::new(&camera, &canonical).apply(&image).unwrap();
    let start = Start::Mesh(vertices.iter().map(|p| p + DVec3::new(2.0, 3.0, 0.06 * p.x)).collect());
    let mut fitter = FrameFitter::new(&template).unwrap();
    let fitted = fitter.fit(&small, &canonical, &start).unwrap().unwrap();
    let close = fitter.fit_close_ups(&image, &camera, fitted).unwrap();
    // 8 mm without.
    let error = distance(&close, &vertices);
    assert!(error < 2.5, "{error} mm");
}

/// What a hand covers may lie otherwise than it seems, and the mesh says so.
#[test]
fn what_the_image_does_not_hold_is_loose() {
    let (template, canonical) = (finely_printed(), training_camera());
    let camera = canonical.resized((960, 540)).unwrap();
    let vertices: Vec<DVec3> = bent(&template, 0.0).iter().map(|p| p + 50.0 * DVec3::Z).collect();
    let truth = VisibleSurface::new(template.mesh(), &vertices, &camera).maps();
    let seen = photograph(&template, &vertices, &camera);
    let covered = Picture::from_fn(960, 540, |x, y| {
        let pixel = y * 960 + x;
        let is_right = truth.inside(pixel) && truth.uv(pixel).x > 0.6;
        if is_right { [150; 3] } else { seen.pixel(x, y) }
    });
    let mut fitter = FrameFitter::new(&template).unwrap();
    let mut loosest = |image: &Picture| {
        let small = CanonicalWarp::new(&camera, &canonical).apply(image).unwrap();
        let start = Start::Mesh(vertices.iter().map(|p| p + DVec3::new(1.0, 1.0, 4.0)).collect());
        let fitted = fitter.fit(&small, &canonical, &start).unwrap().unwrap();
        let close = fitter.fit_close_ups(image, &camera, fitted).unwrap();
        [0.0..0.4, 0.8..1.01].map(|range| {
            let uv = template.mesh().texture_coordinates().iter();
            let of = uv.zip(&close.deviations).filter(|(uv, _)| range.contains(&uv.x));
            of.map(|(_, deviation)| *deviation).fold(0.0, f32::max)
        })
    };
    let ([left, right], [held, loose]) = (loosest(&seen), loosest(&covered));
    assert!(right < 2.0 * left, "{left} mm, {right} mm");
    assert!(
        loose > 4.0 * right && held < 2.0 * left,
        "{held} mm beside {loose} mm, {left} mm"
    );
}

/// The stiffness of the sheet holds a corner that is folded towards the camera as fast as one that is folded away.
#[test]
fn a_sheet_that_is_folded_the_wrong_way_is_folded_anew() {
    let (template, camera) = (template(), training_camera());
    let truth = folded(&template, 0.5);
    let image = image(&template, &VisibleSurface::new(template.mesh(), &truth, &camera).maps());
    let mut fitter = FrameFitter::new(&template).unwrap();
    let wrong = Surface {
        camera,
        vertices_camera: folded(&template, -0.2),
        confidence: vec![1.0; truth.len()],
        is_hidden: vec![false; truth.len()],
        deviations: Vec::new(),
        verdict: Verdict::default(),
    };
    let before = distance(&wrong, &truth);
    let fitted = fitter.fit_close_ups(&image, &camera, wrong).unwrap();
    let after = distance(&fitted, &truth);
    assert!(before > 8.0 && after < 2.0, "{before} mm, {after} mm");
    assert!(fitted.verdict.is_found(), "{:?}", fitted.verdict);
}
