//! PNG files in inputs.

use flate2::Crc;

const SIGNATURE: &[u8] = b"\x89PNG\r\n\x1a\n";

/// Bytes of a chunk beside its content: length, name, checksum.
const CHUNK: usize = 12;

/// The bytes with the right checksum in every chunk of every PNG file in them: no mutation finds one.
pub(crate) fn repaired(bytes: &[u8]) -> Vec<u8> {
    let mut repaired = bytes.to_vec();
    let mut at = 0;
    while let Some(found) = repaired[at..]
        .windows(SIGNATURE.len())
        .position(|window| window == SIGNATURE)
    {
        at += found + SIGNATURE.len();
        while let Some(length) = repaired[at..].first_chunk().copied().map(u32::from_be_bytes) {
            let end = at.saturating_add(length as usize).saturating_add(CHUNK);
            let Some(chunk) = repaired.get_mut(at..end) else { break };
            seal(chunk);
            // What follows the last chunk is no PNG.
            let is_last = chunk[4..8] == *b"IEND";
            at = end;
            if is_last {
                break;
            }
        }
    }
    repaired
}

/// Writes the checksum of a chunk.
fn seal(chunk: &mut [u8]) {
    let (content, checksum) = chunk.split_at_mut(chunk.len() - 4);
    let mut crc = Crc::new();
    crc.update(&content[4..]);
    checksum.copy_from_slice(&crc.sum().to_be_bytes());
}

/// A PNG file whose rows, with a filter's number before each, are not compressed, so that mutations change pixels. `kind`
/// is depth, colour type and interlacing as in the header; `before` are chunks (name, content) before the pixels.
pub(crate) fn stored(
    size: [u32; 2],
    [depth, color, interlaced]: [u8; 3],
    before: &[(&[u8; 4], &[u8])],
    rows: &[u8],
) -> Vec<u8> {
    let [width, height] = size.map(u32::to_be_bytes);
    let header = [&width[..], &height, &[depth, color, 0, 0, interlaced]].concat();
    // zlib with one stored block; nobody looks at its checksum.
    let length = (rows.len() as u16).to_le_bytes();
    let pixels = [&[0x78, 0x01, 1][..], &length, &length.map(|byte| !byte), rows, &[0; 4]].concat();
    let chunks = [(b"IHDR", &header[..])].into_iter().chain(before.iter().copied());
    let mut file = SIGNATURE.to_vec();
    for (name, content) in chunks.chain([(b"IDAT", &pixels[..]), (b"IEND", &[])]) {
        file.extend((content.len() as u32).to_be_bytes());
        file.extend([&name[..], content, &[0; 4]].concat());
    }
    repaired(&file)
}

#[cfg(test)]
mod tests {
    use super::*;
    use deepsft::{decode_picture, encode_png};
    use deepsft_geometry::Picture;

    #[test]
    fn checksums_are_repaired_wherever_a_png_file_begins() {
        let picture = Picture::from_fn(3, 2, |x, y| [x as u8, y as u8, 7]);
        let png = encode_png(&picture).unwrap();
        let mut broken = [b"before".as_slice(), &png, b"between", &png].concat();
        for at in [6 + 29, 6 + png.len() + 7 + 29] {
            broken[at] ^= 0x55;
        }
        let repaired = repaired(&broken);
        assert_eq!(repaired, [b"before".as_slice(), &png, b"between", &png].concat());
        assert_eq!(self::repaired(&png[..20]), png[..20]);
    }

    #[test]
    fn stored_pixels_are_read_as_they_are() {
        let rows = [0, 1, 2, 3, 4, 5, 6, 0, 7, 8, 9, 10, 11, 12];
        let picture = decode_picture(&stored([2, 2], [8, 2, 0], &[], &rows)).unwrap();
        assert_eq!(picture.rgb(), [1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12]);
    }
}
