//! NumPy's format, against bytes that NumPy wrote.

use deepsft_formats::{FormatError, bool_npy, f32_npy, f32_npy_header};

/// What `numpy.save` (2.x) writes for `numpy.array([[1.5], [-1.0]], dtype="<f4")`.
fn by_numpy() -> Vec<u8> {
    let mut bytes = b"\x93NUMPY\x01\x00\x76\x00".to_vec();
    bytes.extend(b"{'descr': '<f4', 'fortran_order': False, 'shape': (2, 1), }");
    bytes.resize(127, b' ');
    bytes.push(b'\n');
    bytes.extend([0, 0, 0xC0, 0x3F, 0, 0, 0x80, 0xBF]);
    bytes
}

#[test]
fn the_bytes_are_those_that_numpy_writes() {
    assert_eq!(f32_npy(&[1], [1.5, -1.0]).unwrap(), by_numpy());
}

#[test]
fn a_header_is_what_comes_before_the_values() {
    assert_eq!(f32_npy_header(&[2, 1]), by_numpy()[..128]);
}

#[test]
fn values_that_do_not_fill_rows_are_refused() {
    for row in [&[3][..], &[0], &[usize::MAX, 2]] {
        let refused = f32_npy(row, [1.5, -1.0]);
        assert!(matches!(refused, Err(FormatError::ValueCount(_))), "{row:?}");
    }
}

#[test]
fn a_mask_takes_one_byte_a_pixel() {
    let bytes = bool_npy(&[480], (0..270 * 480).map(|i| i == 1)).unwrap();
    let values = bytes.len() - 270 * 480;
    assert_eq!(values % 64, 0);
    assert_eq!(bytes[values..values + 3], [0, 1, 0]);
    assert!(String::from_utf8_lossy(&bytes[10..values]).contains("'shape': (270, 480)"));
}
