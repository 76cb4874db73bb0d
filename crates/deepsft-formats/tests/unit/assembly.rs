//! Scans as programs leave them: coordinates beyond the texture, crumbs, turned faces, parts without a texture.

use deepsft_formats::{Scan, ScanPart, Wrap, assemble_scan};
use deepsft_geometry::Picture;
use deepsft_geometry::glam::{DVec2, DVec3};

/// A square whose texture coordinates have these corners, v down, with a texture of 1000 x 1000.
fn square(low: [f64; 2], high: [f64; 2]) -> Scan {
    let corners = [(0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (0.0, 1.0)];
    let side = |t: f64, k: usize| if t == 0.0 { low[k] } else { high[k] };
    let uv = |&(s, t): &(f64, f64)| DVec2::new(side(s, 0), side(t, 1));
    Scan {
        parts: vec![ScanPart {
            name: "square".into(),
            positions: corners.iter().map(|&(x, y)| DVec3::new(x, -y, 0.0)).collect(),
            texture_coordinates: corners.iter().map(uv).collect(),
            faces: vec![[0, 3, 2], [0, 2, 1]],
            texture: Some(0),
            wraps: [Wrap::Repeat; 2],
            colors: Vec::new(),
        }],
        textures: vec![Picture::from_fn(1000, 1000, |_, _| [9; 3])],
        mm_per_unit: 100.0,
        notes: Vec::new(),
    }
}

/// The texture coordinates of the square as a template: least and greatest.
fn bounds(scan: Scan) -> ([f64; 2], [f64; 2], usize) {
    let imported = assemble_scan(scan).unwrap();
    let uv = imported.template.mesh().texture_coordinates();
    let low = uv.iter().copied().reduce(DVec2::min).unwrap();
    let high = uv.iter().copied().reduce(DVec2::max).unwrap();
    (low.to_array(), high.to_array(), imported.notes.len())
}

#[test]
fn coordinates_that_pass_the_border_by_a_hair_are_moved_onto_it() {
    assert_eq!(
        bounds(square([0.895, 0.0], [1.001, 1.0])),
        ([0.895, 0.0], [1.0, 1.0], 1)
    );
    assert_eq!(
        bounds(square([-0.0015, 0.25], [0.5, 0.5])),
        ([0.0, 0.25], [0.5, 0.5], 1)
    );
    // A small chart at the right border stays there.
    let (low, high, _) = bounds(square([0.999, 0.25], [1.0005, 0.5]));
    assert_eq!((low[0], high[0]), (0.999, 1.0));
    // Whole tiles away, and nothing to say.
    let (low, high, notes) = bounds(square([3.25, -1.75], [3.5, -1.5]));
    assert_eq!((low, high, notes), ([0.25, 0.25], [0.5, 0.5], 0));
}

#[test]
fn what_passes_the_border_by_more_is_a_texture_that_repeats() {
    for (low, high) in [
        ([0.0, 0.0], [1.05, 1.0]),
        ([0.5, 0.0], [1.5, 1.0]),
        ([0.0, -0.5], [1.0, 1.5]),
    ] {
        let scanned = assemble_scan(square(low, high)).unwrap();
        assert!(
            scanned.is_baked && scanned.notes[0].contains("repeated"),
            "{:?}",
            scanned.notes
        );
    }
    assert!(!assemble_scan(square([0.5, 0.0], [1.001, 1.0])).unwrap().is_baked);
}

/// A grid of `n` x `n` squares.
fn grid(n: usize) -> Scan {
    let mut scan = square([0.0, 0.0], [1.0, 1.0]);
    let at = |k: usize| (k % (n + 1), k / (n + 1));
    let place = |k| DVec2::new(at(k).0 as f64, at(k).1 as f64) / n as f64;
    let part = &mut scan.parts[0];
    part.texture_coordinates = (0..(n + 1) * (n + 1)).map(place).collect();
    part.positions = part
        .texture_coordinates
        .iter()
        .map(|uv| DVec3::new(uv.x, -uv.y, 0.0))
        .collect();
    let corners = (0..n * n).map(|k| k / n * (n + 1) + k % n);
    part.faces = corners
        .flat_map(|k| [[k, k + n + 1, k + n + 2], [k, k + n + 2, k + 1]])
        .collect();
    scan
}

#[test]
fn crumbs_beside_the_object_are_left_out_and_turned_faces_are_turned_back() {
    let whole = assemble_scan(grid(8)).unwrap();
    assert_eq!((whole.notes.len(), whole.template.mesh().faces().len()), (0, 128));
    let mut scan = grid(8);
    let part = &mut scan.parts[0];
    part.faces[17].swap(1, 2);
    part.faces[90].swap(0, 2);
    for k in 0..20 {
        let first = part.positions.len();
        for (x, y) in [(0.0, 0.0), (0.01, 0.0), (0.0, 0.01)] {
            part.positions.push(DVec3::new(2.0 + f64::from(k) + x, y, 0.0));
            part.texture_coordinates.push(DVec2::new(x, y));
        }
        part.faces.push([first, first + 1, first + 2]);
    }
    let mended = assemble_scan(scan).unwrap();
    assert!(
        mended
            .notes
            .iter()
            .any(|note| note.starts_with("2 faces") && note.contains("turned")),
        "{:?}",
        mended.notes
    );
    assert!(
        mended.notes.iter().any(|note| note.starts_with("20 small pieces")),
        "{:?}",
        mended.notes
    );
    assert_eq!(mended.template.mesh().vertices().len(), 81);
    assert_eq!(
        (mended.template.mesh().faces().len(), mended.topology),
        (128, whole.topology)
    );
    // What is made of small pieces keeps them.
    let mut leaves = grid(40);
    let part = &mut leaves.parts[0];
    let corners: Vec<usize> = part.faces.concat();
    part.positions = corners.iter().map(|&v| part.positions[v] * 1.0).collect();
    part.texture_coordinates = corners.iter().map(|&v| part.texture_coordinates[v]).collect();
    part.faces = (0..3200).map(|k| [3 * k, 3 * k + 1, 3 * k + 2]).collect();
    for (k, position) in part.positions.iter_mut().enumerate() {
        position.z = (k / 3) as f64;
    }
    assert_eq!(assemble_scan(leaves).unwrap().topology.pieces, 3200);
}

#[test]
fn faces_that_stand_on_an_edge_of_two_others_are_left_out_unless_they_are_much_of_the_whole() {
    let whole = assemble_scan(grid(8)).unwrap();
    // On an edge within, each as tall as `height`.
    let standing = |edges: &[[usize; 2]], height: f64| {
        let mut scan = grid(8);
        let part = &mut scan.parts[0];
        for (k, &[a, b]) in edges.iter().enumerate() {
            let up = DVec3::new(0.001 * k as f64, 0.0, height);
            part.positions.push(part.positions[a] + up);
            part.texture_coordinates.push(part.texture_coordinates[a]);
            part.faces.push([a, b, part.positions.len() - 1]);
        }
        assemble_scan(scan).unwrap()
    };
    let mended = standing(&[[40, 41], [40, 41], [22, 31]], 0.01);
    assert_eq!(
        mended.notes,
        ["3 faces that stand on an edge of two others were left out"]
    );
    assert_eq!(
        (mended.template.mesh().faces().len(), mended.topology),
        (128, whole.topology)
    );
    // A crest is meant.
    let crest = standing(&[[37, 38], [38, 39], [39, 40], [40, 41], [41, 42]], 0.5);
    assert_eq!(crest.template.mesh().faces().len(), 133);
}

#[test]
fn faces_with_broken_numbers_and_parts_without_texture_are_left_out_with_a_word() {
    let mut scan = grid(8);
    scan.parts[0].positions[0].x = f64::NAN;
    let mut stand = grid(1).parts.remove(0);
    (stand.name, stand.texture) = ("stand".into(), None);
    scan.parts.push(stand.clone());
    let imported = assemble_scan(scan).unwrap();
    assert_eq!(imported.template.mesh().faces().len(), 126);
    assert_eq!(imported.notes.len(), 2, "{:?}", imported.notes);
    assert!(imported.notes[0].contains("\"stand\"") && imported.notes[1].starts_with("2 faces"));
    let mut bare = grid(1);
    bare.parts = vec![stand];
    bare.notes.push("its material file \"a.mtl\" is missing".into());
    let error = assemble_scan(bare).unwrap_err().to_string();
    assert!(error.contains("--texture") && error.contains("a.mtl"), "{error}");
}
