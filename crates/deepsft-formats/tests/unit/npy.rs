//! NumPy's format, against bytes that NumPy wrote.

use deepsft_formats::{FormatError, bool_npy, f32_npy, f32_npy_header, rows_from_npy};

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

/// An array of the bytes of f64 values as NumPy writes it in version 2.
fn f64_npy(order: &str, shape: &str, values: &[f64]) -> Vec<u8> {
    let header = format!("{{'descr': '<f8', 'fortran_order': {order}, 'shape': {shape}, }}\n");
    let mut bytes = b"\x93NUMPY\x02\x00".to_vec();
    bytes.extend((header.len() as u32).to_le_bytes());
    bytes.extend(header.as_bytes());
    bytes.extend(values.iter().flat_map(|value| value.to_le_bytes()));
    bytes
}

#[test]
fn rows_come_back_in_both_orders() {
    assert_eq!(rows_from_npy(&by_numpy()).unwrap(), [[1.5], [-1.0]]);
    let values = [1.0, 2.0, 3.0, 4.0, 5.0, 6.0];
    for (order, shape, rows) in [
        ("False", "(2, 3)", vec![vec![1.0, 2.0, 3.0], vec![4.0, 5.0, 6.0]]),
        ("True", "(2, 3)", vec![vec![1.0, 3.0, 5.0], vec![2.0, 4.0, 6.0]]),
        (
            "False",
            "(1, 3, 2)",
            vec![vec![1.0, 2.0], vec![3.0, 4.0], vec![5.0, 6.0]],
        ),
    ] {
        assert_eq!(
            rows_from_npy(&f64_npy(order, shape, &values)).unwrap(),
            rows,
            "{order} {shape}"
        );
    }
}

#[test]
fn what_is_no_array_of_rows_is_refused() {
    let whole = f64_npy("False", "(1, 2)", &[1.0, 2.0]);
    assert!((0..whole.len()).all(|end| rows_from_npy(&whole[..end]).is_err()));
    for (bytes, reason) in [
        (b"1 2 3".to_vec(), "no .npy file"),
        (whole[..whole.len() - 1].to_vec(), "cut short"),
        (whole[..20].to_vec(), "cut short"),
        (f64_npy("False", "(2,)", &[1.0, 2.0]), "(rows, columns)"),
        (f64_npy("False", "(2, 0)", &[]), "(rows, columns)"),
        (f64_npy("False", "(4294967296, 4294967296)", &[]), "cut short"),
        (f64_npy("True", "(1, 1, 2)", &[1.0, 2.0]), "ascontiguousarray"),
        (bool_npy(&[2], [true, false]).unwrap(), "astype(float)"),
    ] {
        let error = rows_from_npy(&bytes).map(drop).unwrap_err().to_string();
        assert!(error.contains(reason), "{reason} is not in {error}");
    }
}
