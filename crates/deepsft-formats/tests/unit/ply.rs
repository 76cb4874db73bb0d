//! PLY files, as text and binary of both orders of bytes.

use deepsft_formats::{FormatError, Scan, decode_picture, encode_png, mesh_vertices, read_scan};
use deepsft_geometry::Picture;
use deepsft_geometry::glam::{DVec2, DVec3};

fn read(bytes: &[u8]) -> Result<Scan, FormatError> {
    read_scan("a.PLY", bytes, None, &decode_picture, &|path| match path.to_str() {
        Some("art work.png") => encode_png(&Picture::from_fn(2, 2, |_, _| [9; 3])),
        _ => Err(FormatError::Scan(format!("{} is not there", path.display()))),
    })
}

fn refused(bytes: &[u8]) -> String {
    read(bytes).unwrap_err().to_string()
}

/// A square whose corners have places in one of two textures.
const PLACED: &str = "ply\r\nformat ascii 1.0\r\ncomment made by hand\ncomment TextureFile gone.png\ncomment TextureFile art work.png\n\
    element camera 1\nproperty float focal\nelement vertex 4\nproperty float x\nproperty float y\nproperty float z\n\
    element face 2\nproperty list uchar int vertex_indices\nproperty list uchar float texcoord\nproperty uchar texnumber\nend_header\n\
    35\n0 0 0\n2 0 0\n2 3 1e0\n0 3 0\n4 0 1 2 3 8 0 0 1 0 1 1 0 1 1\n3 0 1 2 6 0 0 .5 0 .5 .5 0\n";

#[test]
fn faces_have_places_in_the_textures_that_comments_name() {
    let scan = read(PLACED.as_bytes()).unwrap();
    assert_eq!((scan.parts.len(), scan.textures.len(), scan.mm_per_unit), (2, 1, 1.0));
    let part = scan.parts.iter().find(|part| part.texture == Some(0)).unwrap();
    assert_eq!(
        part.positions,
        [
            DVec3::ZERO,
            DVec3::new(2.0, 0.0, 0.0),
            DVec3::new(2.0, 3.0, 1.0),
            DVec3::new(0.0, 3.0, 0.0)
        ]
    );
    // t points up.
    assert_eq!(part.texture_coordinates, [DVec2::Y, DVec2::ONE, DVec2::X, DVec2::ZERO]);
    assert_eq!(part.faces, [[0, 1, 2], [0, 2, 3]]);
    assert!(scan.notes[0].contains("gone.png"), "{:?}", scan.notes);
    let moved = PLACED.replace(
        "property float z\n",
        "property float z\nproperty float s\nproperty float t\n",
    );
    let moved = moved
        .replace("0 3 0\n", "0 3 0 0 1\n")
        .replace("\n0 0 0\n", "\n0 0 0 0 0\n")
        .replace("1e0\n", "1 1 1\n");
    let moved = moved
        .replace("\n2 0 0\n", "\n2 0 0 1 0\n")
        .replace(" 8 0 0 1 0 1 1 0 1 1", " 0 1");
    let of_vertices = read(moved.as_bytes()).unwrap();
    assert!(of_vertices.parts.contains(part), "{:?}", of_vertices.parts);
}

/// A triangle with colours, binary.
fn colored(order: &str, bytes: fn(f32) -> [u8; 4]) -> Vec<u8> {
    let header = format!(
        "ply\nformat binary_{order}_endian 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\n\
         property uchar red\nproperty uchar green\nproperty uchar blue\nelement face 1\nproperty list uchar uchar vertex_index\nend_header\n"
    );
    let mut file = header.into_bytes();
    for (place, color) in [
        ([0.0, 0.5, 0.0], [255, 0, 7]),
        ([3.0, 0.0, 0.0], [0, 255, 8]),
        ([0.0, 3.0, -1.0], [9, 9, 9]),
    ] {
        file.extend(place.into_iter().flat_map(bytes));
        file.extend(color);
    }
    file.extend([3, 0, 1, 2]);
    file
}

#[test]
fn vertices_have_colours_in_binary_files_of_both_orders() {
    let little = read(&colored("little", f32::to_le_bytes)).unwrap();
    assert_eq!(little.parts[0].colors, [[255, 0, 7], [0, 255, 8], [9; 3]]);
    assert_eq!(little.parts[0].positions[2], DVec3::new(0.0, 3.0, -1.0));
    assert_eq!(
        (little.parts[0].texture, little.parts[0].faces.as_slice()),
        (None, [[0, 1, 2]].as_slice())
    );
    assert_eq!(read(&colored("big", f32::to_be_bytes)).unwrap(), little);
}

#[test]
fn what_is_wrong_with_a_ply_file_is_told() {
    let whole = colored("little", f32::to_le_bytes);
    assert!(refused(&whole[..whole.len() - 1]).contains("cut short"));
    assert!(refused(&whole[..60]).contains("header"));
    let text = |from: &str, to: &str| {
        assert!(PLACED.contains(from), "{from}");
        refused(PLACED.replace(from, to).as_bytes())
    };
    assert!(text("format ascii 1.0", "comment none").contains("no format"));
    assert!(text("element face 2", "element face many").contains("element face many"));
    assert!(text("property float z", "property tensor z").contains("property tensor z"));
    assert!(text("vertex_indices", "corners").contains("vertex_indices"));
    assert!(text("property float x", "property float east").contains("no positions"));
    assert!(text("4 0 1 2 3 8", "4 0 1 2 4 8").contains("vertex 4, there are 4"));
    assert!(text("4 0 1 2 3 8", "4 0 1 2 -3 8").contains("whole numbers"));
    assert!(text("2 0 0\n", "2 zero 0\n").contains("number is missing"));
    assert!(text("element face 2", "element face 0").contains("cloud of points"));
    // A count that is a lie takes no memory.
    assert!(text("element vertex 4", "element vertex 4000000000000").contains("cut short"));
    let error = read_scan(
        "a.ply",
        &whole,
        Some(Picture::from_fn(2, 2, |_, _| [9; 3])),
        &decode_picture,
        &|_| Ok(Vec::new()),
    );
    assert!(error.unwrap_err().to_string().contains("no texture coordinates"));
}

#[test]
fn vertices_alone_keep_their_numbers() {
    let corners = [[0.0, 0.0, 0.0], [2.0, 0.0, 0.0], [2.0, 3.0, 1.0], [0.0, 3.0, 0.0]].map(DVec3::from);
    assert_eq!(mesh_vertices("a.PLY", PLACED.as_bytes()).unwrap(), corners);
    let obj = b"v 0 0 0\nv 2 0 0\nv 2 3 1\nv 0 3 0\nf 3 2 1\n";
    assert_eq!(mesh_vertices("a.obj", obj).unwrap(), corners);
    for (name, bytes) in [
        ("a.stl", &b"v 0 0 0"[..]),
        ("a.ply", b"ply\nformat ascii 1.0\nend_header\n"),
        ("a.obj", b"v 1 2"),
    ] {
        assert!(mesh_vertices(name, bytes).is_err(), "{name}");
    }
}
