//! OBJ files with their materials.

use deepsft_formats::{FormatError, Scan, encode_png, read_scan};
use deepsft_geometry::Picture;
use std::cell::RefCell;
use std::path::{Path, PathBuf};

const OBJ: &str = "mtllib a.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nvt 0 0\nvt 1 0\nvt 0 1\nusemtl paint\nf 1/1 2/2 3/3\n";

/// What is read of a triangle whose materials are `mtl`, with a picture at `pictures/art.png`.
fn read(mtl: &str) -> Result<Scan, FormatError> {
    let art = encode_png(&Picture::from_fn(2, 2, |_, _| [9; 3])).unwrap();
    read_scan("a.obj", OBJ.as_bytes(), None, &|path| match path.to_str() {
        Some("a.mtl") => Ok(mtl.as_bytes().to_vec()),
        Some("pictures/art.png") => Ok(art.clone()),
        _ => {
            let outside = path.is_absolute() || path.starts_with("..") || path.starts_with("C:");
            assert!(!outside, "{} was asked for", path.display());
            let reason = format!("{} is not there", path.display());
            Err(FormatError::Scan(reason))
        }
    })
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
fn a_texture_outside_of_the_folder_is_not_read() {
    for name in [
        "/pictures/art.png",
        "../pictures/art.png",
        "-s 1 1 1 /pictures/art.png",
        "C:\\pictures\\art.png",
    ] {
        let error = read(&format!("newmtl paint\nmap_Kd {name}\n")).unwrap_err().to_string();
        assert!(error.contains("its texture"), "{name}: {error}");
    }
}

/// What is said of an OBJ file that names this material file, and the path that is asked for.
fn asked(material_file: &str) -> (String, Option<PathBuf>) {
    let path = RefCell::new(None);
    let obj = OBJ.replace("a.mtl", material_file);
    let read = read_scan("a.obj", obj.as_bytes(), None, &|beside: &Path| {
        *path.borrow_mut() = Some(beside.to_path_buf());
        let reason = "it is not there".to_owned();
        Err(FormatError::Scan(reason))
    });
    (read.unwrap_err().to_string(), path.into_inner())
}

#[test]
fn paths_that_are_absolute_or_climb_out_are_refused() {
    for name in [
        "/dev/zero",
        "/etc/passwd",
        "../art.png",
        "a/../../b.png",
        "C:\\art.png",
        "..\\art.png",
        "",
        "\\\\host\\art.png",
    ] {
        let (error, path) = asked(name);
        assert!(error.contains(&format!("{name:?}")), "{name}: {error}");
        assert!(error.contains("not in its folder") && path.is_none(), "{name}: {error}");
    }
    let inside = |name: &str| asked(name).1.unwrap();
    assert_eq!(inside("pictures\\my art.png"), Path::new("pictures/my art.png"));
    assert_eq!(inside("./art.png"), Path::new("./art.png"));
}

#[test]
fn polygons_are_fans_and_names_are_kept() {
    let positions = "v 0 0 0\nv 1 0 0 1.0\nv 1 1 0\nv 0 1 0\nvt 0 0\nvt 1 0\nvt 1 1\nvt 0 1\n";
    let faces = "usemtl a b\nf 1/1 2/2 3/3 -1/-1 # a square\nusemtl c\nf 1/1/7 2/2 3/3\nf 1 2\n";
    let text = format!("mtllib a.mtl\no box\n{positions}{faces}");
    let mtl = "newmtl c\nmap_Kd c.png\nnewmtl a b\nmap_Kd a b.png\n";
    let asked = RefCell::new(Vec::new());
    let read = |text: &str| {
        read_scan("a.obj", text.as_bytes(), None, &|path| match path.to_str() {
            Some("a.mtl") => Ok(mtl.into()),
            path => {
                asked.borrow_mut().extend(path.map(str::to_owned));
                encode_png(&Picture::from_fn(2, 2, |_, _| [9; 3]))
            }
        })
    };
    let scan = read(&text).unwrap();
    let faces: Vec<_> = scan.parts.iter().map(|part| part.faces.as_slice()).collect();
    assert_eq!(faces, [[[0, 1, 2], [0, 2, 3]].as_slice(), [[0, 1, 2]].as_slice()]);
    assert!(scan.parts.iter().all(|part| part.name == "box"));
    assert_eq!(scan.parts[0].positions[3].to_array(), [0.0, 1.0, 0.0]);
    // The textures in the order in which the parts ask for them.
    assert_eq!(asked.take(), ["a b.png", "c.png"]);
    let error = read(&text.replace("1/1/7", "1//7")).unwrap_err().to_string();
    assert!(error.contains("\"box\" have no texture coordinates"), "{error}");
}
