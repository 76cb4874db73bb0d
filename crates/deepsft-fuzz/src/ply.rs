//! Scans as PLY files, of text and binary, with a texture beside them.

use crate::files::{join, parts};
use crate::obj::read_files;
use crate::picture;
use anyhow::Result;
use deepsft::encode_png;

/// The files are the scan and its texture.
pub(crate) fn read(input: &[u8]) -> Result<()> {
    let [scan, texture] = parts(input);
    read_files("scan.ply", &scan, false, &texture, &|_| texture.clone())
}

pub(crate) fn seeds() -> Result<Vec<Vec<u8>>> {
    let texture = encode_png(&picture::small(4, 3))?;
    let placed = "ply\nformat ascii 1.0\ncomment TextureFile art.png\nelement vertex 4\nproperty float x\nproperty float y\n\
        property float z\nelement face 1\nproperty list uchar int vertex_indices\nproperty list uchar float texcoord\n\
        property int texnumber\nend_header\n0 0 0\n2 0 0\n2 2 1\n0 2 0\n4 0 1 2 3 8 0 0 1 0 1 1 0 1 0\n";
    let header = "ply\nformat binary_little_endian 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\n\
        property uchar red\nproperty uchar green\nproperty uchar blue\nelement face 1\n\
        property list uchar uint vertex_index\nend_header\n";
    let mut colored = header.as_bytes().to_vec();
    for (place, color) in [
        ([0.0_f32, 0.0, 0.0], [255, 0, 0]),
        ([3.0, 0.0, 0.0], [0, 255, 0]),
        ([0.0, 3.0, 0.0], [9, 9, 9]),
    ] {
        place.iter().for_each(|x| colored.extend(x.to_le_bytes()));
        colored.extend(color);
    }
    colored.push(3);
    (0..3_u32).for_each(|corner| colored.extend(corner.to_le_bytes()));
    // Longer than texels can be counted.
    let needle = "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\nproperty uchar red\n\
        property uchar green\nproperty uchar blue\nelement face 1\nproperty list uchar int vertex_indices\nend_header\n\
        0 0 0 255 0 0\n3 0 0 0 255 0\n7.68e31 0 4.3e21 9 9 9\n3 0 1 2\n";
    let needle = needle.as_bytes().to_vec();
    Ok(vec![join(&[placed.as_bytes(), &texture]), colored, needle])
}
