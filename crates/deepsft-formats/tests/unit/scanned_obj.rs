//! OBJ files with their materials.

use deepsft_formats::{FormatError, Scan, encode_png, read_scan};
use deepsft_geometry::Picture;
use std::path::Path;

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
            Err(FormatError::Scan { reason })
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
    let outside = |name: &str| {
        let obj = OBJ.replace("a.mtl", name);
        read_scan("a.obj", obj.as_bytes(), None, &|path: &Path| {
            panic!("{}", path.display())
        })
    };
    let error = outside("/dev/zero").unwrap_err().to_string();
    assert!(
        error.contains("/dev/zero") && error.contains("not in its folder"),
        "{error}"
    );
}
