//! Scans whose texture is no template's: it repeats, mirrors, lies on itself or is not there. It is made anew.

use deepsft_formats::{Scan, ScanPart, ScannedTemplate, Wrap, assemble_scan};
use deepsft_geometry::Picture;
use deepsft_geometry::glam::{DVec2, DVec3};
use std::array::from_fn;
use std::f64::consts::{PI, TAU};

/// Largest difference of colours before and after, levels: half a texel of the pictures of these tests, whose steepest slopes have eight
/// levels a texel.
const LEVELS: f64 = 5.0;

/// Squares along each side of the raster on which places are counted.
const RASTER: usize = 2048;

/// A surface over `columns` x `rows` cells of the unit square, at `place` and with the texture coordinates `uv` (v down) of (s, t).
fn sheet(
    [columns, rows]: [usize; 2],
    place: impl Fn(DVec2) -> DVec3,
    uv: impl Fn(DVec2) -> DVec2,
    texture: Option<usize>,
) -> ScanPart {
    let count = [columns + 1, rows + 1];
    let at = |k: usize| {
        DVec2::new(
            (k % count[0]) as f64 / columns as f64,
            (k / count[0]) as f64 / rows as f64,
        )
    };
    let vertices = 0..count[0] * count[1];
    let first = (0..columns * rows).map(|k| k / columns * count[0] + k % columns);
    ScanPart {
        name: "sheet".into(),
        positions: vertices.clone().map(|k| place(at(k))).collect(),
        texture_coordinates: vertices.map(|k| uv(at(k))).collect(),
        faces: (first.flat_map(|k| [[k, k + count[0], k + count[0] + 1], [k, k + count[0] + 1, k + 1]])).collect(),
        texture,
        wraps: [Wrap::Repeat; 2],
        colors: Vec::new(),
    }
}

/// A flat square of side 2 around the origin, print towards the viewer.
fn flat(at: DVec2) -> DVec3 {
    DVec3::new(2.0 * at.x - 1.0, 1.0 - 2.0 * at.y, 0.0)
}

fn scan(parts: Vec<ScanPart>, textures: Vec<Picture>) -> Scan {
    Scan {
        parts,
        textures,
        mm_per_unit: 50.0,
        notes: Vec::new(),
    }
}

/// A picture of a function of (u, v).
fn painted(side: usize, color: impl Fn(DVec2) -> [f64; 3]) -> Picture {
    let middle = |k: usize| (k as f64 + 0.5) / side as f64;
    Picture::from_fn(side, side, |x, y| {
        color(DVec2::new(middle(x), middle(y))).map(|part| part.round() as u8)
    })
}

/// Waves that go on where the texture begins again.
fn waves(uv: DVec2) -> [f64; 3] {
    [uv.x, uv.y, uv.x + uv.y].map(|phase| 128.0 + 100.0 * (TAU * phase).sin())
}

/// A slope that does not.
fn slope(uv: DVec2) -> [f64; 3] {
    [20.0 + 200.0 * uv.x, 20.0 + 200.0 * uv.y, 230.0 - 100.0 * uv.x]
}

/// A texture was made in which every place is one place of the surface, no print is mirrored, and all of it has the color that the file
/// gives to its points (in the units of the file), also in the mipmap.
fn is_baked_well(scan: Scan, expected: impl Fn(DVec3) -> [f64; 3]) -> ScannedTemplate {
    let faces: usize = scan.parts.iter().map(|part| part.faces.len()).sum();
    let scanned = assemble_scan(scan).unwrap();
    assert!(scanned.is_baked);
    assert!(
        scanned
            .notes
            .iter()
            .any(|note| note.contains("baked into a texture of")),
        "{:?}",
        scanned.notes
    );
    let (mesh, texture) = (scanned.template.mesh(), scanned.template.texture());
    assert_eq!(mesh.faces().len(), faces);
    let mut uses = vec![0_u8; RASTER * RASTER];
    let small = texture.halved();
    for face in mesh.faces() {
        let places = face.map(|v| mesh.texture_coordinates()[v]);
        let points = face.map(|v| mesh.vertices()[v]);
        let [a, b, c] = places.map(|place| place * RASTER as f64);
        let area = (b - a).perp_dot(c - a);
        assert!(area < 0.0, "a print is mirrored");
        let (low, high) = (
            a.min(b).min(c).floor().as_usizevec2(),
            a.max(b).max(c).ceil().as_usizevec2(),
        );
        for y in low.y..high.y.min(RASTER) {
            for x in low.x..high.x.min(RASTER) {
                let p = DVec2::new(x as f64 + 0.5, y as f64 + 0.5);
                let inside = |a: DVec2, b: DVec2| (b - a).perp_dot(p - a) / area > 1e-6;
                if inside(a, b) && inside(b, c) && inside(c, a) {
                    uses[y * RASTER + x] += 1;
                }
            }
        }
        for weights in [
            [0.34, 0.33, 0.33],
            [0.9, 0.05, 0.05],
            [0.05, 0.9, 0.05],
            [0.02, 0.49, 0.49],
        ] {
            let (mut uv, mut p) = (DVec2::ZERO, DVec3::ZERO);
            for k in 0..3 {
                (uv, p) = (uv + weights[k] * places[k], p + weights[k] * points[k]);
            }
            let expected = expected(p * DVec3::new(1.0, -1.0, -1.0) / 50.0);
            for (level, picture) in [texture, &small].into_iter().enumerate() {
                let at = uv * picture.size().as_dvec2();
                let color = picture.sample(at.x, at.y).map(f64::from);
                let off: [f64; 3] = from_fn(|k| (color[k] - expected[k]).abs());
                let most = LEVELS * (1 + level) as f64;
                assert!(
                    off.iter().all(|off| *off < most),
                    "{p}: {color:?} for {expected:?} at level {level}"
                );
            }
        }
    }
    let twice = uses.iter().filter(|&&uses| uses > 1).count();
    assert_eq!(twice, 0, "places of several faces");
    assert!(uses.contains(&1));
    scanned
}

#[test]
fn a_texture_goes_on_beyond_its_borders_as_the_file_says() {
    let twice = |at: DVec2| at * DVec2::new(2.3, 1.7) - 0.6;
    let uv_of = |p: DVec3| twice((DVec2::new(p.x, -p.y) + 1.0) / 2.0);
    let mirrored = |t: f64| 1.0 - (t.rem_euclid(2.0) - 1.0).abs();
    let repeated = |uv: DVec2| waves(uv);
    let two_ways = |uv: DVec2| slope(DVec2::new(mirrored(uv.x), uv.y.clamp(0.0, 1.0)));
    let part = sheet([8, 8], flat, twice, Some(0));
    let scanned = is_baked_well(scan(vec![part.clone()], vec![painted(256, waves)]), |p| {
        repeated(uv_of(p))
    });
    assert_eq!(scanned.topology.charts, 1);
    // As fine as the file's: 2.3 x 1.7 times 256 texels.
    let texels = scanned.template.texture().size().area() as f64;
    assert!(
        texels > 0.8 * 2.3 * 1.7 * 65_536.0 && texels < 1.6 * 2.3 * 1.7 * 65_536.0,
        "{texels}"
    );
    let mut part = part;
    part.wraps = [Wrap::Mirror, Wrap::Clamp];
    is_baked_well(scan(vec![part], vec![painted(256, slope)]), |p| two_ways(uv_of(p)));
}

#[test]
fn two_halves_on_one_texture_get_a_place_each_and_read_as_on_the_object() {
    // A roof, whose sides are mirrors of one another; all of it hangs together.
    let roof = |at: DVec2| DVec3::new(2.0 * at.x - 1.0, 1.0 - 2.0 * at.y, 0.5 - (2.0 * at.x - 1.0).abs());
    let half = |at: DVec2| DVec2::new((2.0 * at.x - 1.0).abs(), at.y);
    let part = sheet([8, 4], roof, half, Some(0));
    let scanned = is_baked_well(scan(vec![part], vec![painted(256, slope)]), |p| {
        slope(DVec2::new(p.x.abs(), (1.0 - p.y) / 2.0))
    });
    assert_eq!(
        (
            scanned.topology.charts,
            scanned.topology.pieces,
            scanned.topology.seam_edges
        ),
        (2, 1, 4)
    );
}

#[test]
fn a_chart_that_lies_on_itself_is_split() {
    // A long band, in the texture twice around.
    let band = |at: DVec2| DVec3::new(6.0 * at.x - 3.0, 0.5 - at.y, 0.0);
    let around = |at: DVec2| {
        let angle = 2.0 * TAU * at.x;
        0.5 + (0.45 - 0.25 * at.y) * DVec2::new(angle.cos(), -angle.sin())
    };
    let part = sheet([64, 4], band, around, Some(0));
    // Linear between the corners of cells, which the ring is not: a picture without detail along a cell.
    let scanned = is_baked_well(scan(vec![part], vec![painted(512, |_| [90.0, 60.0, 30.0])]), |_| {
        [90.0, 60.0, 30.0]
    });
    assert!((2..8).contains(&scanned.topology.charts), "{:?}", scanned.topology);
}

#[test]
fn faces_without_texture_take_the_colours_of_their_vertices_or_material() {
    let bent = |at: DVec2| {
        let angle = PI * (at.x - 0.5);
        DVec3::new(angle.sin(), 0.5 - at.y, angle.cos() - 0.5)
    };
    let of_point = |p: DVec3| [128.0 + 100.0 * p.x, 128.0 + 200.0 * p.y, 40.0];
    let mut rolled = sheet([40, 20], bent, |_| DVec2::ZERO, None);
    rolled.colors = rolled
        .positions
        .iter()
        .map(|p| of_point(*p).map(|part| part.round() as u8))
        .collect();
    let scanned = is_baked_well(scan(vec![rolled], Vec::new()), of_point);
    // Half a turn in steps of less than 50 degrees to both sides.
    assert!((2..=3).contains(&scanned.topology.charts), "{:?}", scanned.topology);
    // One part with a texture that its material makes darker (0.25 of the light), one with a colour.
    let mut tinted = sheet([4, 4], flat, |at| at, Some(0));
    tinted.colors = vec![[137, 255, 255]; 25];
    let mut plain = sheet(
        [4, 4],
        |at| flat(at) * DVec3::new(1.0, 1.0, 0.0) + DVec3::Z,
        |_| DVec2::ZERO,
        None,
    );
    plain.colors = vec![[200, 30, 60]; 25];
    let darker = |value: f64| {
        let linear = |value: f64| ((value / 255.0 + 0.055) / 1.055).powf(2.4);
        255.0 * (1.055 * (0.25 * linear(value)).powf(1.0 / 2.4) - 0.055)
    };
    is_baked_well(scan(vec![tinted, plain], vec![painted(256, slope)]), |p| {
        let [r, g, b] = slope(DVec2::new(p.x + 1.0, 1.0 - p.y) / 2.0);
        // The middle between both sheets is the origin: the part with a texture lies behind it.
        if p.z > 0.0 {
            [200.0, 30.0, 60.0]
        } else {
            [darker(r), g, b]
        }
    });
}

#[test]
fn a_palette_of_which_each_face_has_one_point_becomes_a_texture_of_the_surface() {
    let palette = painted(16, |uv| {
        if uv.x < 0.5 {
            [250.0, 0.0, 0.0]
        } else {
            [0.0, 0.0, 250.0]
        }
    });
    let mut left = sheet(
        [2, 4],
        |at| flat(at) * DVec3::new(0.5, 1.0, 1.0) - 0.5 * DVec3::X,
        |_| DVec2::new(0.2, 0.5),
        Some(0),
    );
    let right = sheet(
        [2, 4],
        |at| flat(at) * DVec3::new(0.5, 1.0, 1.0) + 0.5 * DVec3::X,
        |_| DVec2::new(0.8, 0.5),
        Some(0),
    );
    let first = left.positions.len();
    left.positions.extend(right.positions);
    left.texture_coordinates.extend(right.texture_coordinates);
    left.faces
        .extend(right.faces.iter().map(|face| face.map(|v| v + first)));
    let color = |p: DVec3| {
        if p.x < 0.0 {
            [250.0, 0.0, 0.0]
        } else {
            [0.0, 0.0, 250.0]
        }
    };
    // Its texture has no area: nothing lies on anything, but nothing can be registered either.
    let scanned = is_baked_well(scan(vec![left], vec![palette]), color);
    assert_eq!(scanned.topology.charts, 1);
}

#[test]
fn a_model_of_one_colour_is_refused_and_what_has_every_face_twice_has_it_once() {
    let mut plain = sheet([4, 4], flat, |_| DVec2::ZERO, None);
    plain.colors = vec![[200; 3]; 25];
    let error = assemble_scan(scan(vec![plain], Vec::new())).unwrap_err().to_string();
    assert!(error.contains("one colour") && error.contains("--texture"), "{error}");
    let mut doubled = sheet([4, 4], flat, |at| at, Some(0));
    let backs: Vec<[usize; 3]> = doubled.faces.iter().map(|&[a, b, c]| [a, c, b]).collect();
    doubled.faces.extend(backs);
    let scanned = assemble_scan(scan(vec![doubled], vec![painted(64, slope)])).unwrap();
    assert_eq!((scanned.template.mesh().faces().len(), scanned.is_baked), (32, false));
    assert!(
        scanned.notes[0].starts_with("32 faces that lie on others"),
        "{:?}",
        scanned.notes
    );
}

#[test]
fn a_twisted_band_is_cut_where_it_meets_its_own_back() {
    let twisted = |at: DVec2| {
        let (turn, across) = (
            TAU * at.x.rem_euclid(1.0),
            (at.y - 0.5) * if at.x == 1.0 { -1.0 } else { 1.0 },
        );
        let radius = 1.0 + 0.5 * across * (turn / 2.0).cos();
        DVec3::new(
            radius * turn.cos(),
            0.5 * across * (turn / 2.0).sin(),
            radius * turn.sin(),
        )
    };
    let part = sheet([40, 4], twisted, |at| at, Some(0));
    let scanned = assemble_scan(scan(vec![part], vec![painted(64, slope)])).unwrap();
    let note = scanned
        .notes
        .iter()
        .find(|note| note.contains("no side for their front"));
    assert!(
        note.is_some() && scanned.template.mesh().faces().len() > 300,
        "{:?}",
        scanned.notes
    );
}
