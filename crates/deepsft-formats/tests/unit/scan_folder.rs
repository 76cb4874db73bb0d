//! Scans in a folder: the files beside them.

use deepsft_formats::{Scan, encode_png, read_scan_file};
use deepsft_geometry::Picture;
use std::fs;

const BARE: &str = "v 0 0 0\nv 1 0 0\nv 0 1 0\nvt 0 0\nvt 1 0\nvt 0 1\nf 1/1 2/2 3/3\n";

#[test]
fn a_scan_that_names_no_texture_has_the_one_picture_beside_it() {
    let folder = tempfile::tempdir().unwrap();
    let place = |name: &str| folder.path().join(name);
    let picture = |shade: u8| encode_png(&Picture::from_fn(3, 2, |_, _| [shade; 3])).unwrap();
    let read = |obj: &str| -> Scan {
        fs::write(place("scan.obj"), obj).unwrap();
        read_scan_file(&place("scan.obj"), None).unwrap()
    };
    let bare = read(BARE);
    assert_eq!((bare.textures.len(), bare.parts[0].texture), (0, None));
    fs::write(place("print.png"), picture(70)).unwrap();
    let lost = read(&format!("mtllib gone.mtl\n{BARE}"));
    assert_eq!(
        (lost.textures[0].pixel(0, 0), lost.parts[0].texture),
        ([70; 3], Some(0))
    );
    assert!(
        lost.notes.iter().any(|note| note.contains("gone.mtl")),
        "{:?}",
        lost.notes
    );
    assert!(
        lost.notes.iter().any(|note| note.contains("print.png")),
        "{:?}",
        lost.notes
    );
    // Colours of its own go before it.
    let positions = "v 0 0 0 1 0 0\nv 1 0 0 0 1 0\nv 0 1 0 0 0 1\n";
    let colored = read(&format!("{positions}{}", &BARE[BARE.find("vt").unwrap()..]));
    assert_eq!(colored.textures.len(), 0, "{:?}", colored.parts[0].colors);
    // Which of two is meant nobody knows.
    fs::write(place("other.png"), picture(7)).unwrap();
    assert_eq!(read(BARE).textures.len(), 0);
    let given = read_scan_file(&place("scan.obj"), Some(&place("other.png"))).unwrap();
    assert_eq!(given.textures[0].pixel(0, 0), [7; 3]);
    fs::remove_file(place("print.png")).unwrap();
    fs::write(place("other.png"), "no picture").unwrap();
    assert_eq!(read(BARE).textures.len(), 0);
}
