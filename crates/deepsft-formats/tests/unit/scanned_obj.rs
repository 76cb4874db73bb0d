//! OBJ files with their materials.

use deepsft_formats::{FormatError, Scan, decode_picture, encode_png, read_scan};
use deepsft_geometry::Picture;
use std::cell::RefCell;
use std::path::{Path, PathBuf};

const OBJ: &str = "mtllib a.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nvt 0 0\nvt 1 0\nvt 0 1\nusemtl paint\nf 1/1 2/2 3/3\n";

/// What is read of a triangle whose materials are `mtl`, with a picture at `pictures/art.png`.
fn read(mtl: &str) -> Result<Scan, FormatError> {
    let art = encode_png(&Picture::from_fn(2, 2, |_, _| [9; 3])).unwrap();
    read_scan(
        "a.obj",
        OBJ.as_bytes(),
        None,
        &decode_picture,
        &|path| match path.to_str() {
            Some("a.mtl") => Ok(mtl.as_bytes().to_vec()),
            Some("pictures/art.png") => Ok(art.clone()),
            _ => {
                let outside = path.is_absolute() || path.starts_with("..") || path.starts_with("C:");
                assert!(!outside, "{} was asked for", path.display());
                let reason = format!("{} is not there", path.display());
                Err(FormatError::Scan(reason))
            }
        },
    )
}

#[test]
fn a_colour_of_one_number_and_other_odd_lines_of_materials_are_passed_over() {
    let scan = read("newmtl paint\nKd 0.8\nKs\nNs shiny\nmap_Kd pictures/art.png\n").unwrap();
    assert_eq!((scan.parts[0].texture, scan.textures.len()), (Some(0), 1));
}

#[test]
fn options_may_stand_before_the_name_of_a_texture() {
    let scan = read("newmtl paint\n\tmap_Kd -s 1 1 1 -clamp on pictures\\art.png \r\n").unwrap();
    assert_eq!(scan.parts[0].texture, Some(0));
}

#[test]
fn a_texture_outside_of_the_folder_is_not_read_but_the_one_beside_the_scan_is() {
    for name in [
        "/pictures/art.png",
        "../pictures/art.png",
        "-s 1 1 1 /pictures/art.png",
        "C:\\pictures\\art.png",
    ] {
        let without = read(&format!("newmtl paint\nmap_Kd {name}\n")).unwrap();
        assert_eq!(without.parts[0].texture, None);
        assert!(
            without.notes.iter().any(|note| note.contains("its texture")),
            "{name}: {:?}",
            without.notes
        );
        let beside = files(
            OBJ,
            &[("a.mtl", &format!("newmtl paint\nmap_Kd {name}\n")), ("art.png", "")],
        )
        .unwrap();
        assert_eq!(beside.parts[0].texture, Some(0), "{name}");
        assert!(
            beside.notes.iter().any(|note| note.contains("beside it was taken")),
            "{:?}",
            beside.notes
        );
    }
}

/// What is read of an OBJ file beside these files; those without text are pictures.
fn files(obj: &str, beside: &[(&str, &str)]) -> Result<Scan, FormatError> {
    let art = encode_png(&Picture::from_fn(2, 2, |_, _| [9; 3])).unwrap();
    read_scan("a.obj", obj.as_bytes(), None, &decode_picture, &|path| {
        let file = beside.iter().find(|(name, _)| Path::new(name) == path);
        let missing = || FormatError::Scan(format!("{} is not there", path.display()));
        let (_, text) = file.ok_or_else(missing)?;
        Ok(if text.is_empty() {
            art.clone()
        } else {
            text.as_bytes().to_vec()
        })
    })
}

#[test]
fn material_files_may_be_missing_several_in_a_line_or_in_a_folder() {
    const MTL: &str = "Newmtl paint\nMAP_KD art.png\n";
    for (names, place) in [
        ("gone.mtl\nmtllib a.mtl", ["a.mtl", "art.png"]),
        ("gone.mtl a.mtl", ["a.mtl", "art.png"]),
        ("my paint.mtl", ["my paint.mtl", "art.png"]),
        ("maps/a.mtl", ["maps/a.mtl", "maps/art.png"]),
        ("maps\\a.mtl", ["maps/a.mtl", "art.png"]),
    ] {
        let obj = OBJ.replace("a.mtl", names);
        let scan = files(&obj, &[(place[0], MTL), (place[1], "")]).unwrap();
        assert_eq!(scan.parts[0].texture, Some(0), "{names}");
    }
    let bare = files(OBJ, &[]).unwrap();
    assert_eq!((bare.parts[0].texture, bare.notes.len()), (None, 1));
    assert!(bare.notes[0].contains("a.mtl"), "{:?}", bare.notes);
}

#[test]
fn without_a_texture_the_colours_of_vertices_count_and_else_that_of_the_material() {
    let mtl = "newmtl paint\nKd 0.2 0.4 1\nmap_Kd gone.png\n";
    let scan = files(OBJ, &[("a.mtl", mtl)]).unwrap();
    assert_eq!(
        (scan.parts[0].texture, scan.parts[0].colors.as_slice()),
        (None, [[51, 102, 255]; 3].as_slice())
    );
    assert!(scan.notes[0].contains("gone.png"), "{:?}", scan.notes);
    let of_vertices = OBJ
        .replace("v 0 0 0", "v 0 0 0 1 0 0")
        .replace("v 1 0 0", "v 1 0 0 0 1 0")
        .replace("v 0 1 0", "v 0 1 0 0 0 1");
    let scan = files(&of_vertices, &[("a.mtl", mtl)]).unwrap();
    assert_eq!(scan.parts[0].colors, [[255, 0, 0], [0, 255, 0], [0, 0, 255]]);
    // Of 0 to 255, and faces without a place in the texture beside others that have one.
    let of_bytes = of_vertices.replace("1 0 0\n", "255 0 0\n") + "f 1 2 3\n";
    let scan = files(
        &of_bytes,
        &[("a.mtl", "newmtl paint\nmap_Kd art.png\n"), ("art.png", "")],
    )
    .unwrap();
    let colors: Vec<_> = scan
        .parts
        .iter()
        .map(|part| (part.texture, part.colors.first().copied()))
        .collect();
    assert_eq!(colors, [(Some(0), None), (None, Some([255, 0, 0]))]);
}

#[test]
fn a_mark_of_the_byte_order_and_lines_that_go_on_are_read() {
    let obj = format!("\u{feff}{}", OBJ.replace("f 1/1 2/2 3/3", "f 1/1 \\\r\n 2/2 \\\n3/3"));
    let scan = files(&obj, &[]).unwrap();
    assert_eq!(
        (scan.parts[0].faces.as_slice(), scan.notes.len()),
        ([[0, 1, 2]].as_slice(), 1)
    );
}

/// The paths that are asked for of an OBJ file that names this material file, and what is said of it.
fn asked(material_file: &str) -> (Vec<PathBuf>, Vec<String>) {
    let paths = RefCell::new(Vec::new());
    let obj = OBJ.replace("a.mtl", material_file);
    let read = read_scan("a.obj", obj.as_bytes(), None, &decode_picture, &|beside: &Path| {
        paths.borrow_mut().push(beside.to_path_buf());
        Err(FormatError::Scan("it is not there".to_owned()))
    });
    (paths.into_inner(), read.unwrap().notes)
}

#[test]
fn no_path_that_is_absolute_or_climbs_out_is_asked_for() {
    for name in [
        "/dev/zero",
        "/etc/passwd",
        "../art.png",
        "a/../../b.png",
        "C:\\art.png",
        "..\\art.png",
        "..",
        "\\\\host\\art.png",
    ] {
        let (paths, notes) = asked(name);
        let last = name.rsplit(['/', '\\']).next().filter(|last| *last != "..");
        assert!(
            paths.iter().all(|path| Some(path.as_path()) == last.map(Path::new)),
            "{name}: {paths:?}"
        );
        assert!(
            notes[0].contains(&format!("material file {name:?}")),
            "{name}: {notes:?}"
        );
    }
    assert_eq!(asked("pictures\\art.png").0[0], Path::new("pictures/art.png"));
    assert_eq!(asked("./art.png").0[0], Path::new("./art.png"));
}

#[test]
fn polygons_are_fans_and_names_are_kept() {
    let positions = "v 0 0 0\nv 1 0 0 1.0\nv 1 1 0\nv 0 1 0\nvt 0 0\nvt 1 0\nvt 1 1\nvt 0 1\n";
    let faces = "usemtl a b\nf 1/1 2/2 3/3 -1/-1 # a square\nusemtl c\nf 1/1/7 2/2 3/3\nf 1 2\n";
    let text = format!("mtllib a.mtl\no box\n{positions}{faces}");
    let mtl = "newmtl c\nmap_Kd c.png\nnewmtl a b\nmap_Kd a b.png\n";
    let asked = RefCell::new(Vec::new());
    let read = |text: &str| {
        read_scan(
            "a.obj",
            text.as_bytes(),
            None,
            &decode_picture,
            &|path| match path.to_str() {
                Some("a.mtl") => Ok(mtl.into()),
                path => {
                    asked.borrow_mut().extend(path.map(str::to_owned));
                    encode_png(&Picture::from_fn(2, 2, |_, _| [9; 3]))
                }
            },
        )
    };
    let scan = read(&text).unwrap();
    let faces: Vec<_> = scan.parts.iter().map(|part| part.faces.as_slice()).collect();
    assert_eq!(faces, [[[0, 1, 2], [3, 4, 5]].as_slice(), [[0, 1, 2]].as_slice()]);
    assert!(scan.parts.iter().all(|part| part.name == "box"));
    assert_eq!(scan.parts[0].positions[5].to_array(), [0.0, 1.0, 0.0]);
    // The textures in the order in which the parts ask for them.
    assert_eq!(asked.take(), ["a b.png", "c.png"]);
    let scan = read(&text.replace("1/1/7", "1//7")).unwrap();
    assert!(
        scan.notes[0].contains("\"box\" have no texture coordinates"),
        "{:?}",
        scan.notes
    );
    assert!(scan.parts[1].faces.is_empty());
}
