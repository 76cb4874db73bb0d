//! Scanned sheets laid flat.

use deepsft_geometry::glam::{DQuat, DVec2, DVec3};
use deepsft_geometry::{Picture, Template, TriangleMesh, UnrollError, UnrolledSheet, unroll};
use std::f64::consts::PI;

/// Of the sheets here, mm.
const SIZE: DVec2 = DVec2::new(200.0, 120.0);

/// Chords of 5 mm on a radius of 60 mm are shorter than their arcs by 0.03 %.
const CHORDS: f64 = 1e-3;

/// A grid over the unit square of 41 x 25 vertices: places by `shape`, texture coordinates by `uv`.
fn scanned(shape: impl Fn(DVec2) -> DVec3, uv: impl Fn(DVec2) -> DVec2) -> Template {
    let (columns, rows) = (41, 25);
    let places: Vec<DVec2> = (0..columns * rows)
        .map(|i| {
            DVec2::new(
                (i % columns) as f64 / (columns - 1) as f64,
                (i / columns) as f64 / (rows - 1) as f64,
            )
        })
        .collect();
    let mut faces = Vec::new();
    for i in (0..columns * (rows - 1)).filter(|i| i % columns + 1 < columns) {
        faces.extend([[i, i + columns, i + columns + 1], [i, i + columns + 1, i + 1]]);
    }
    let vertices = places.iter().map(|&place| shape(place)).collect();
    let mesh = TriangleMesh::new(vertices, places.iter().map(|&place| uv(place)).collect(), faces).unwrap();
    Template::of_mesh(mesh, four_colours()).unwrap()
}

/// Red, green, blue and yellow quarters, from the upper left, row by row.
fn four_colours() -> Picture {
    let colours = [[220, 30, 30], [30, 200, 30], [30, 30, 220], [220, 220, 30]];
    Picture::from_fn(400, 240, |x, y| {
        colours[2 * usize::from(y >= 120) + usize::from(x >= 200)]
    })
}

/// A place of the sheet rolled about an axis across it, by an angle of `mm / radius`, its front outside.
fn rolled(place: DVec2, radius: f64) -> DVec3 {
    let turn = (place.x - 0.5) * SIZE.x / radius;
    DVec3::new(radius * turn.sin(), (place.y - 0.5) * SIZE.y, -radius * turn.cos())
}

fn colour_at(sheet: &UnrolledSheet, u: f64, v: f64) -> [u8; 3] {
    let picture = sheet.template.texture();
    picture.pixel(
        (u * picture.width() as f64) as usize,
        (v * picture.height() as f64) as usize,
    )
}

fn assert_is_the_sheet(sheet: &UnrolledSheet, tolerance: f64) {
    let size = sheet.template.size_mm();
    assert!((size / SIZE - 1.0).abs().max_element() < tolerance, "{size}");
    for (place, colour) in [(0.25, 0.25), (0.75, 0.25), (0.25, 0.75), (0.75, 0.75)]
        .into_iter()
        .zip([[220, 30, 30], [30, 200, 30], [30, 30, 220], [220, 220, 30]])
    {
        assert_eq!(colour_at(sheet, place.0, place.1), colour, "{place:?}");
    }
}

#[test]
fn a_sheet_that_was_rolled_by_190_degrees_has_its_size_and_its_picture_again() {
    let sheet = unroll(&scanned(|place| rolled(place, 60.0), |place| place)).unwrap();
    assert!(sheet.stretch < CHORDS, "{}", sheet.stretch);
    assert_is_the_sheet(&sheet, CHORDS);
}

#[test]
fn how_the_sheet_lies_in_its_texture_does_not_matter() {
    // By a quarter turned, in a corner of it.
    let turned = |place: DVec2| DVec2::new(0.1 + 0.3 * (1.0 - place.y), 0.2 + 0.6 * place.x);
    let template = scanned(|place| rolled(place, 60.0), turned);
    let art = four_colours();
    let texture = Picture::from_fn(800, 800, |x, y| {
        let uv = DVec2::new((x as f64 + 0.5) / 800.0, (y as f64 + 0.5) / 800.0);
        let place = DVec2::new((uv.y - 0.2) / 0.6, 1.0 - (uv.x - 0.1) / 0.3);
        art.sample(place.x * 400.0, place.y * 240.0).map(|value| value as u8)
    });
    assert_is_the_sheet(&unroll(&template.with_texture(texture)).unwrap(), CHORDS);
}

#[test]
fn a_sheet_of_two_charts_that_lies_on_the_ground_is_seen_from_above() {
    let template = scanned(
        |place| {
            // Turned back by a quarter: its upper side is the far one, its front above.
            DQuat::from_rotation_x(-PI / 2.0) * rolled(place, 100.0)
        },
        |place| place,
    );
    // The right half once more, as a chart of its own below the other.
    let mesh = template.mesh();
    let is_right = |face: &[usize; 3]| face.iter().all(|&v| mesh.texture_coordinates()[v].x >= 0.5 - 1e-9);
    let count = mesh.vertices().len();
    let vertices = [mesh.vertices(), mesh.vertices()].concat();
    let left = |uv: &DVec2| DVec2::new(uv.x.min(0.5), uv.y / 2.0);
    let right = |uv: &DVec2| DVec2::new((uv.x - 0.5).max(0.0), 0.5 + uv.y / 2.0);
    let uv = mesh.texture_coordinates();
    let uv: Vec<DVec2> = uv.iter().map(left).chain(uv.iter().map(right)).collect();
    let faces = mesh
        .faces()
        .iter()
        .map(|face| if is_right(face) { face.map(|v| v + count) } else { *face });
    let (vertices, uv, faces) = used(vertices, uv, faces.collect());
    let art = four_colours();
    let texture = Picture::from_fn(400, 480, |x, y| match y < 240 {
        true => art.pixel(x, y),
        false => art.pixel(x + 200, y - 240),
    });
    let split = Template::of_mesh(TriangleMesh::new(vertices, uv, faces).unwrap(), texture).unwrap();
    assert_is_the_sheet(&unroll(&split).unwrap(), CHORDS);
}

/// Without the vertices that no face has.
fn used(vertices: Vec<DVec3>, uv: Vec<DVec2>, faces: Vec<[usize; 3]>) -> (Vec<DVec3>, Vec<DVec2>, Vec<[usize; 3]>) {
    let mut number = vec![None; vertices.len()];
    let mut kept = (Vec::new(), Vec::new(), Vec::new());
    for face in faces {
        kept.2.push(face.map(|v| {
            *number[v].get_or_insert_with(|| {
                kept.0.push(vertices[v]);
                kept.1.push(uv[v]);
                kept.0.len() - 1
            })
        }));
    }
    kept
}

#[test]
fn the_noise_of_a_scanner_changes_the_size_by_less_than_one_percent() {
    // A quarter of a millimetre either way on cells of 5 mm, from a fixed sequence.
    let noise = |place: DVec2| ((place.x * 12_345.678 + place.y * 987.654).sin() * 43_758.547).fract();
    let sheet = unroll(&scanned(
        |place| {
            let p = rolled(place, 60.0);
            p + 0.25 * noise(place) * DVec3::new(p.x, 0.0, p.z).normalize()
        },
        |place| place,
    ));
    let sheet = sheet.unwrap();
    assert!(sheet.stretch > CHORDS, "{}", sheet.stretch);
    assert_is_the_sheet(&sheet, 0.01);
}

#[test]
fn what_is_no_sheet_is_refused_by_what_is_wrong_with_it() {
    let refused = |shape: &dyn Fn(DVec2) -> DVec3| {
        let result = unroll(&scanned(shape, |place| place));
        result.map(|sheet| sheet.stretch).unwrap_err()
    };
    // 46 degrees of a ball to each side upwards, 69 to the sides.
    let bulging = refused(&|place| {
        let (longitude, latitude) = ((place.x - 0.5) * 2.4, (place.y - 0.5) * 1.6);
        100.0
            * DVec3::new(
                longitude.sin() * latitude.cos(),
                latitude.sin(),
                -longitude.cos() * latitude.cos(),
            )
    });
    assert!(matches!(bulging, UnrollError::Stretch(_)), "{bulging}");
    // The side of a can, whose last column is its first one.
    let tube = refused(&|place| {
        let turn = 2.0 * PI * (place.x % 1.0);
        DVec3::new(40.0 * turn.sin(), 120.0 * place.y, -40.0 * turn.cos())
    });
    assert!(matches!(tube, UnrollError::Stretch(_)), "{tube}");
    let wedge = refused(&|place| DVec3::new(200.0 * place.x * (0.2 + 0.8 * place.y), 120.0 * place.y, 0.0));
    assert!(
        matches!(wedge, UnrollError::Outline(percent) if (percent - 60.0).abs() < 1.0),
        "{wedge}"
    );
    let (a, b, c, d) = (DVec3::ZERO, 50.0 * DVec3::X, 50.0 * DVec3::Y, 50.0 * DVec3::Z);
    // A chart for each face, beside the others.
    let of_faces = |corners: &[[DVec3; 3]]| {
        let chart = |k: usize| [(0.0, 0.0), (0.2, 0.0), (0.0, 0.2)].map(|(u, v)| DVec2::new(0.25 * k as f64 + u, v));
        let faces = (0..corners.len()).map(|k| [3 * k, 3 * k + 1, 3 * k + 2]).collect();
        let uv = (0..corners.len()).flat_map(chart).collect();
        let mesh = TriangleMesh::new(corners.concat(), uv, faces).unwrap();
        Template::of_mesh(mesh, four_colours()).unwrap()
    };
    let closed = of_faces(&[[a, c, b], [a, b, d], [b, c, d], [a, d, c]]);
    assert_eq!(unroll(&closed).unwrap_err(), UnrollError::WithoutBorder);
    let apart = of_faces(&[[a, c, b], [a + d, c + d, b + d]]);
    assert_eq!(unroll(&apart).unwrap_err(), UnrollError::Pieces(2));
}

/// The sheet rolled by 190 degrees and scanned from both sides: its front is the upper half of the texture, its back the lower. With `rim` steps
/// around its border it is closed.
fn two_sided(thickness: f64, rim: usize, texture: Picture) -> Template {
    let front = scanned(|place| rolled(place, 60.0), |place| place * DVec2::new(1.0, 0.45));
    let (columns, rows) = (41, 25);
    let inside = |place: DVec2, depth: f64| {
        let turn = (place.x - 0.5) * SIZE.x / 60.0;
        let radius = 60.0 - depth;
        DVec3::new(radius * turn.sin(), (place.y - 0.5) * SIZE.y, -radius * turn.cos())
    };
    let place = |i: usize| {
        DVec2::new(
            (i % columns) as f64 / (columns - 1) as f64,
            (i / columns) as f64 / (rows - 1) as f64,
        )
    };
    let count = columns * rows;
    let mut vertices = front.mesh().vertices().to_vec();
    let mut uv = front.mesh().texture_coordinates().to_vec();
    let mut faces = front.mesh().faces().to_vec();
    vertices.extend((0..count).map(|i| inside(place(i), thickness)));
    uv.extend((0..count).map(|i| place(i) * DVec2::new(1.0, 0.45) + DVec2::new(0.0, 0.5)));
    faces.extend(
        front
            .mesh()
            .faces()
            .iter()
            .map(|&[a, b, c]| [a + count, c + count, b + count]),
    );
    // As the border of the front runs: down on the left, to the right below, up, and back.
    let border: Vec<usize> = ((0..rows - 1).map(|row| row * columns))
        .chain((0..columns - 1).map(|column| (rows - 1) * columns + column))
        .chain((1..rows).rev().map(|row| row * columns + columns - 1))
        .chain((1..columns).rev())
        .collect();
    for step in 0..=rim {
        let angle = PI * step as f64 / rim.max(1) as f64;
        for &i in &border {
            let outwards = (place(i) - 0.5).map(|side| if side.abs() == 0.5 { side.signum() } else { 0.0 });
            let at = place(i) + outwards * thickness / 2.0 * angle.sin().max(0.0) / SIZE;
            // The first and last ring are seams: the same place to the bit.
            let at = if step == 0 || step == rim { place(i) } else { at };
            vertices.push(match step {
                0 => vertices[i],
                _ if step == rim => vertices[i + count],
                _ => inside(at, thickness / 2.0 * (1.0 - angle.cos())),
            });
            uv.push(DVec2::new(0.5, 0.98));
        }
    }
    for ring in 0..rim {
        let first = 2 * count + ring * border.len();
        for k in 0..border.len() {
            let [a, b] = [k, (k + 1) % border.len()].map(|k| first + k);
            let [below_a, below_b] = [a, b].map(|v| v + border.len());
            faces.extend([[b, a, below_a], [b, below_a, below_b]]);
        }
    }
    if rim == 0 {
        vertices.truncate(2 * count);
        uv.truncate(2 * count);
    }
    Template::of_mesh(TriangleMesh::new(vertices, uv, faces).unwrap(), texture).unwrap()
}

/// Four colours in stripes on the front, or on the back as it is seen through the front, and something else on the other side.
fn printed(is_front: bool, other: impl Fn(usize, usize) -> [u8; 3]) -> Picture {
    let art = four_colours();
    Picture::from_fn(400, 480, |x, y| {
        let row = (if y < 240 { y } else { y - 240 }) * 10 / 9;
        match (y < 240) == is_front {
            true => art.pixel(x, row.min(239)),
            false => other(x, y),
        }
    })
}

#[test]
fn of_a_sheet_scanned_from_both_sides_the_printed_side_is_taken() {
    // Two layers, a card with a sharp rim, and one with a round rim.
    for (thickness, rim) in [(0.2, 0), (1.0, 1), (1.5, 8)] {
        let sheet = unroll(&two_sided(thickness, rim, printed(true, |_, _| [240; 3])));
        let sheet = sheet.unwrap_or_else(|error| panic!("{thickness} mm, {rim} steps: {error}"));
        let back = sheet.back_mm.unwrap();
        assert!((back - thickness).abs() < 0.1, "{back} mm of {thickness}");
        assert_is_the_sheet(&sheet, 0.01);
        // On the inside of the roll the print is mirrored, and the sheet shorter.
        let inside = unroll(&two_sided(thickness, rim, printed(false, |_, _| [240; 3]))).unwrap();
        assert_eq!(colour_at(&inside, 0.25, 0.25), [30, 200, 30]);
        assert_eq!(colour_at(&inside, 0.25, 0.75), [220, 220, 30]);
    }
}

#[test]
fn of_two_sides_with_the_same_on_them_that_with_more_texture_is_taken() {
    let checks = |x: usize, y: usize| {
        if (x / 20 + y / 20).is_multiple_of(2) {
            [250; 3]
        } else {
            [10; 3]
        }
    };
    // The back has few texels: its chart is a tenth as wide.
    let both = Picture::from_fn(400, 480, checks);
    let template = two_sided(1.0, 1, both);
    let mesh = template.mesh();
    let is_back = |i: &usize| (41 * 25..2 * 41 * 25).contains(i);
    let narrow = (0..mesh.vertices().len()).map(|i| {
        let uv = mesh.texture_coordinates()[i];
        if is_back(&i) { DVec2::new(0.8 * uv.x, uv.y) } else { uv }
    });
    let mesh = TriangleMesh::new(mesh.vertices().to_vec(), narrow.collect(), mesh.faces().to_vec()).unwrap();
    let sheet = unroll(&Template::of_mesh(mesh, template.texture().clone()).unwrap()).unwrap();
    assert!(sheet.back_mm.is_some());
    // The front, whose arc is the longer one.
    assert!(
        (sheet.template.size_mm().x - SIZE.x).abs() < 0.5,
        "{}",
        sheet.template.size_mm()
    );
}

#[test]
fn what_is_thicker_than_a_sheet_is_no_sheet() {
    let slab = unroll(&two_sided(4.0, 1, printed(true, |_, _| [240; 3])));
    assert_eq!(slab.unwrap_err(), UnrollError::WithoutBorder);
}
