//! NumPy's `.npy` format, version 1.0, little endian, C order.

/// The bytes of an `.npy` file of f32 values.
pub fn f32_npy(shape: &[usize], values: impl IntoIterator<Item = f32>) -> Vec<u8> {
    npy("<f4", shape, values.into_iter().flat_map(f32::to_le_bytes))
}

/// The bytes of an `.npy` file of booleans.
pub fn bool_npy(shape: &[usize], values: impl IntoIterator<Item = bool>) -> Vec<u8> {
    npy("|b1", shape, values.into_iter().map(u8::from))
}

fn npy(descr: &str, shape: &[usize], content: impl Iterator<Item = u8>) -> Vec<u8> {
    let mut sides = shape.iter().map(usize::to_string).collect::<Vec<_>>().join(", ");
    if shape.len() == 1 {
        sides.push(','); // Python's way to tell a tuple of one from a number in brackets.
    }
    let mut header = format!("{{'descr': '{descr}', 'fortran_order': False, 'shape': ({sides}), }}");
    // Magic, version and length take 10 bytes; the header is padded so that the values start at a
    // multiple of 64, and ends with a line feed.
    let padded = (10 + header.len() + 1).next_multiple_of(64) - 10;
    header.extend(std::iter::repeat_n(' ', padded - header.len() - 1));
    header.push('\n');
    let mut bytes = b"\x93NUMPY\x01\x00".to_vec();
    bytes.extend((padded as u16).to_le_bytes());
    bytes.extend(header.into_bytes());
    bytes.extend(content);
    bytes
}
