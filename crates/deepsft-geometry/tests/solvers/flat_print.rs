//! The photographed print, laid flat.

use crate::sheet::{bent, folded, template};
use deepsft_geometry::fitting::SurfaceLocator;
use deepsft_geometry::glam::{DVec2, DVec3};
use deepsft_geometry::raster::VisibleSurface;
use deepsft_geometry::{
    Camera, FlatMedian, FlatPrint, GeometryError, Maps, MipLevel, Picture, Surface, Template, Verdict, training_camera,
};
use std::iter::successors;

fn camera() -> Camera {
    let large = training_camera().resized((1440, 810)).unwrap();
    large.with_distortion([-0.15, 0.03, 0.001, 0.0, 0.0]).unwrap()
}

fn surface(vertices_camera: Vec<DVec3>) -> Surface {
    Surface {
        camera: training_camera(),
        confidence: vec![1.0; vertices_camera.len()],
        vertices_camera,
        is_hidden: Vec::new(),
        deviations: Vec::new(),
        verdict: Verdict::default(),
    }
}

/// What the camera takes of the sheet before black, with noise, and the maps of that.
fn photograph(template: &Template, vertices: &[DVec3]) -> (Picture, Maps) {
    let truth = VisibleSurface::new(template.mesh(), vertices, &camera()).maps();
    let texture = template.texture();
    let image = Picture::from_fn(truth.size().width, truth.size().height, |x, y| {
        let pixel = y * truth.size().width + x;
        if !truth.inside(pixel) {
            return [0; 3];
        }
        let at = truth.uv(pixel) * texture.size().as_dvec2();
        let noise = ((x * 7919 + y * 104_729 + x * y * 31) % 41) as f32 - 20.0;
        texture.sample(at.x, at.y).map(|c| (c + noise) as u8)
    });
    (image, truth)
}

fn flattened(template: &Template, surface: &Surface, image: &Picture, width: usize) -> FlatPrint {
    surface.flatten(template, (image, &camera()), width).unwrap()
}

/// Mean difference from the template's texture, of 255, where the image shows the print.
fn difference(template: &Template, flat: &FlatPrint) -> f64 {
    // The print in pixels about as large.
    let mut levels = successors(Some(MipLevel::finest(template.texture().clone())), MipLevel::coarser);
    let print = levels
        .find(|level| level.extent.x < 1.5 * flat.picture.width() as f64)
        .unwrap();
    let (mut sum, mut count) = (0.0, 0.0);
    for (place, confidence) in flat.confidence.iter().enumerate() {
        let (x, y) = (place % flat.picture.width(), place / flat.picture.width());
        let uv = DVec2::new(x as f64 + 0.5, y as f64 + 0.5) / flat.picture.size().as_dvec2();
        let drawn = print.sample(uv);
        if *confidence > 0.0 {
            let pixel = flat.picture.pixel(x, y);
            sum += (0..3)
                .map(|k| f64::from((f32::from(pixel[k]) - drawn[k]).abs()))
                .sum::<f64>()
                / 3.0;
            count += 1.0;
        }
    }
    sum / count
}

#[test]
fn a_bent_sheet_laid_flat_is_its_print_again() {
    let template = template();
    let vertices = bent(&template, 0.3);
    let (image, _) = photograph(&template, &vertices);
    // A small print is the mean of what the image shows: without most of the noise.
    for width in [75, 594] {
        let flat = flattened(&template, &surface(vertices.clone()), &image, width);
        let seen = flat.confidence.iter().filter(|confidence| **confidence > 0.0).count();
        assert!(seen as f64 > 0.99 * flat.confidence.len() as f64, "{seen} pixels");
        let error = difference(&template, &flat);
        assert!(error < 10.0, "{error} of 255 at {width}");
        let moved: Vec<DVec3> = vertices.iter().map(|p| p + 4.0 * DVec3::X).collect();
        let moved = difference(&template, &flattened(&template, &surface(moved), &image, width));
        assert!(moved > 2.0 * error, "{error}, moved by 4 mm {moved}");
    }
}

#[test]
fn what_the_image_does_not_show_is_white_and_has_no_confidence() {
    let template = template();
    // The right fifth is folded over, so it shows its back and hides what is under it.
    let vertices = folded(&template, -2.9);
    let (image, truth) = photograph(&template, &vertices);
    let flat = flattened(&template, &surface(vertices.clone()), &image, 297);
    let mut counts = [[0; 2]; 2];
    for (place, confidence) in flat.confidence.iter().enumerate() {
        let uv = DVec2::new((place % 297) as f64 + 0.5, (place / 297) as f64 + 0.5) / DVec2::new(297.0, 210.0);
        let point = template_point(&template, &vertices, uv);
        let shown = camera().project(point).and_then(|pixel| {
            let pixel = pixel.y as usize * truth.size().width + pixel.x as usize;
            truth.inside(pixel).then(|| truth.uv(pixel))
        });
        let is_shown = shown.is_some_and(|seen| seen.distance(uv) < 0.02);
        counts[usize::from(is_shown)][usize::from(*confidence > 0.0)] += 1;
        if *confidence == 0.0 {
            assert_eq!(flat.picture.pixel(place % 297, place / 297), [255; 3]);
        }
    }
    let [[unseen, wrong], [missing, seen]] = counts;
    assert!(unseen > 9000 && seen > 30_000, "{counts:?}");
    assert!(wrong < 600 && missing < 600, "{counts:?}");
}

/// Where the grid of the sheet has a place of its print.
fn template_point(template: &Template, vertices: &[DVec3], uv: DVec2) -> DVec3 {
    let (columns, rows) = template.grid().unwrap();
    let at = uv * DVec2::new((columns - 1) as f64, (rows - 1) as f64);
    let low = at.floor().min(DVec2::new((columns - 2) as f64, (rows - 2) as f64));
    let (part, first) = (at - low, low.y as usize * columns + low.x as usize);
    let row = |first: usize| vertices[first].lerp(vertices[first + 1], part.x);
    row(first).lerp(row(first + columns), part.y)
}

#[test]
fn what_something_hides_has_no_confidence_and_what_is_far_has_little() {
    let template = template();
    let vertices = bent(&template, 0.0);
    let (image, _) = photograph(&template, &vertices);
    let mut surface = surface(vertices);
    let coordinates = template.mesh().texture_coordinates();
    surface.is_hidden = coordinates.iter().map(|uv| uv.x < 0.5).collect();
    let flat = flattened(&template, &surface, &image, 100);
    let row = &flat.confidence[35 * 100..36 * 100];
    assert!(
        row[..45].iter().all(|confidence| *confidence == 0.0) && row[55..].iter().all(|confidence| *confidence > 0.9)
    );
    // 3000 pixels for 297 mm are several times as many as the image has.
    let large = flattened(&template, &surface, &image, 3000);
    let middle = large.confidence[1000 * 3000 + 2250];
    assert!((0.1..0.5).contains(&middle), "{middle}");
}

#[test]
fn what_lies_out_of_the_image_has_no_confidence() {
    let template = template();
    let vertices: Vec<DVec3> = bent(&template, 0.0).iter().map(|p| p + 250.0 * DVec3::X).collect();
    let (image, _) = photograph(&template, &vertices);
    let flat = flattened(&template, &surface(vertices.clone()), &image, 99);
    let beyond = |place: usize| {
        let uv = DVec2::new((place % 99) as f64 + 0.5, (place / 99) as f64 + 0.5) / DVec2::new(99.0, 70.0);
        let pixel = camera().project(template_point(&template, &vertices, uv));
        pixel.is_none_or(|pixel| pixel.x > 1440.0)
    };
    let out: Vec<bool> = (0..flat.confidence.len()).map(beyond).collect();
    let count = out.iter().filter(|out| **out).count();
    assert!((1000..6000).contains(&count), "{count}");
    let wrong = out
        .iter()
        .zip(&flat.confidence)
        .filter(|(out, c)| **out == (**c > 0.0))
        .count();
    assert!(wrong < 100, "{wrong}");
}

#[test]
fn what_does_not_fit_together_is_an_error() {
    let template = template();
    let (vertices, image) = (bent(&template, 0.0), Picture::from_fn(8, 8, |_, _| [0; 3]));
    let of = |vertices: &[DVec3], image: &Picture, width: usize| {
        let surface = surface(vertices.to_vec());
        surface.flatten(&template, (image, &camera()), width).unwrap_err()
    };
    let whole = Picture::from_fn(1440, 810, |_, _| [0; 3]);
    assert!(matches!(of(&vertices, &image, 9), GeometryError::MapSize { .. }));
    assert!(matches!(
        of(&vertices[1..], &whole, 9),
        GeometryError::StartLength { .. }
    ));
    assert!(matches!(
        of(&vertices, &whole, 0),
        GeometryError::CameraParameter { .. }
    ));
}

#[test]
fn the_median_of_a_video_is_the_print_without_the_hand_and_the_highlight_that_move() {
    let template = template();
    let (mut median, mut middle, mut flattened_frames) = (FlatMedian::default(), None, 0);
    // More frames than are kept. The hand hides a fifth of the image, the highlight lies elsewhere.
    for frame in 0..45_usize {
        let vertices = bent(&template, 0.2 + 0.003 * frame as f64);
        let (seen, _) = photograph(&template, &vertices);
        let at = 1440.0 * (0.1 + 0.8 * frame as f64 / 44.0);
        let image = Picture::from_fn(seen.width(), seen.height(), |x, y| {
            let (x_px, y_px) = (x as f64, y as f64);
            match (
                (x_px - at).abs() < 144.0,
                (1440.0 - x_px - at).hypot(y_px - 400.0) < 90.0,
            ) {
                (true, _) => [200, 150, 120],
                (_, true) => [255; 3],
                _ => seen.pixel(x, y),
            }
        });
        let flatten = || surface(vertices.clone()).flatten(&template, (&image, &camera()), 150);
        median
            .add(|| {
                flattened_frames += 1;
                let flat = flatten()?;
                if frame == 22 {
                    middle = Some(flat.clone());
                }
                Ok(flat)
            })
            .unwrap();
    }
    assert!((33..45).contains(&flattened_frames), "{flattened_frames}");
    let (flat, middle) = (median.median().unwrap(), middle.unwrap());
    let [whole, one] = [&flat, &middle].map(|flat| difference(&template, flat));
    assert!(whole < 5.0 && one > 1.5 * whole, "{whole}, of one frame {one}");
    let least = flat.confidence.iter().copied().fold(f32::INFINITY, f32::min);
    assert!(
        least > 0.5 && flat.confidence.iter().all(|confidence| *confidence <= 1.0),
        "{least}"
    );
    assert_eq!(FlatMedian::default().median(), None);
    let other = surface(bent(&template, 0.3)).flatten(
        &template,
        (&photograph(&template, &bent(&template, 0.3)).0, &camera()),
        80,
    );
    // The next frame that is kept.
    let refused = (0..4).map(|_| median.add(|| other.clone())).find(Result::is_err);
    assert!(
        matches!(refused, Some(Err(GeometryError::MapSize { .. }))),
        "{refused:?}"
    );
}

#[test]
fn a_print_under_a_shadow_and_a_warm_lamp_loses_both_and_keeps_what_was_written_on_it() {
    let (width, height) = (850, 600);
    let template = template();
    let print = |x: f64, y: f64| {
        let extent = template.texture().size().as_dvec2();
        template.texture().sample(x * extent.x, y * extent.y)
    };
    // Black print says nothing of the light, and no camera sees it quite black.
    let is_black = |x: usize, y: usize| (600..720).contains(&x) && (100..220).contains(&y);
    let texture = Picture::from_fn(width, height, |x, y| {
        if is_black(x, y) {
            return [0; 3];
        }
        let at = [(x as f64 + 0.5) / width as f64, (y as f64 + 0.5) / height as f64];
        print(at[0], at[1]).map(|c| (c + 0.5) as u8)
    });
    // A pen has crossed the print, and the shadow's border is as wide as a finger's.
    let is_written = |x: usize, y: usize| (x + 2 * y) % 97 < 4;
    let light = |x: usize, y: usize| {
        let shadow = ((x + y) as f32 - 700.0) / 40.0;
        0.9 - 0.5 / (1.0 + (-shadow).exp())
    };
    let flat = FlatPrint {
        picture: Picture::from_fn(width, height, |x, y| {
            let color = if is_written(x, y) { [20; 3] } else { texture.pixel(x, y) };
            let color = if is_black(x, y) { [5; 3] } else { color };
            let tint = [1.0, 0.9, 0.7];
            [0, 1, 2].map(|k| (f32::from(color[k]) * light(x, y) * tint[k]).round() as u8)
        }),
        confidence: (0..width * height)
            .map(|place| f32::from(u8::from(place % width >= 60)))
            .collect(),
    };
    let unshaded = flat.without_shading(&texture);
    let (mut off, mut before, mut written, mut count) = (0.0, 0.0, 0.0, 0.0);
    for place in 0..width * height {
        let (x, y) = (place % width, place / width);
        let [is, was, true_color] =
            [&unshaded.picture, &flat.picture, &texture].map(|picture| picture.pixel(x, y).map(f32::from));
        if x < 60 {
            assert_eq!(is, was);
        } else if is_black(x, y) {
            assert!(is[1] < 40.0, "{is:?} at {x}, {y}");
        } else if is_written(x, y) {
            written = f32::max(written, is[1]);
        } else {
            let difference = |a: [f32; 3]| (0..3).map(|k| (a[k] - true_color[k]).abs()).sum::<f32>() / 3.0;
            (off, before, count) = (off + difference(is), before + difference(was), count + 1.0);
        }
    }
    let [off, before] = [off, before].map(|sum: f32| sum / count);
    println!("{before} -> {off} of 255, written {written}");
    assert!(
        off < 1.0 && before > 50.0 && written < 40.0,
        "{before} -> {off} of 255, written {written}"
    );
}

#[test]
fn maps_in_a_photograph_have_all_of_its_pixels_and_its_lens() {
    let (template, camera) = (template(), camera());
    let vertices = bent(&template, 0.0);
    let mut surface = surface(vertices.clone());
    let maps = surface.maps_in(&camera, template.mesh());
    assert_eq!(maps.size(), camera.size());
    let pixels = |maps: &Maps| (0..maps.depth().len()).filter(|&p| maps.inside(p)).collect::<Vec<_>>();
    let seen = pixels(&maps);
    assert!(seen.len() > 8 * pixels(&surface.maps(template.mesh())).len());
    let locator = SurfaceLocator::new(template.mesh());
    for pixel in seen.iter().copied().step_by(997) {
        let centre = DVec2::new((pixel % 1440) as f64 + 0.5, (pixel / 1440) as f64 + 0.5);
        let point = camera.unproject(centre, f64::from(maps.depth()[pixel]));
        let place = locator.locate(maps.uv(pixel)).unwrap();
        let of_mesh = place.position(template.mesh().faces(), &vertices);
        assert!(point.distance(of_mesh) < 0.1, "{point} and {of_mesh}");
    }
    surface.is_hidden = vec![true; vertices.len()];
    assert!(pixels(&surface.maps_in(&camera, template.mesh())).is_empty());
}
