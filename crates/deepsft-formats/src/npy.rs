//! NumPy's `.npy` format, version 1.0, little endian, C order.

use crate::error::FormatError;

/// NumPy's names of the kinds of values.
const F32: &str = "<f4";
const BOOL: &str = "|b1";

/// The bytes of an `.npy` file of f32 values, row by row; `row` is the shape of one. There are as many rows as the values fill.
///
/// # Errors
/// [`FormatError::ValueCount`] when the last row is not filled.
pub fn f32_npy(row: &[usize], values: impl IntoIterator<Item = f32>) -> Result<Vec<u8>, FormatError> {
    npy(F32, row, values.into_iter().map(f32::to_le_bytes))
}

/// As [`f32_npy`], of booleans.
pub fn bool_npy(row: &[usize], values: impl IntoIterator<Item = bool>) -> Result<Vec<u8>, FormatError> {
    npy(BOOL, row, values.into_iter().map(|value| [u8::from(value)]))
}

/// What comes before the values in an `.npy` file of f32 values, for who writes those one after another (little endian).
pub fn f32_npy_header(shape: &[usize]) -> Vec<u8> {
    header(F32, shape)
}

fn npy<const N: usize>(of: &str, row: &[usize], values: impl Iterator<Item = [u8; N]>) -> Result<Vec<u8>, FormatError> {
    let content: Vec<u8> = values.flatten().collect();
    let row_bytes = row.iter().fold(N, |product, &side| product.saturating_mul(side));
    let shape = [&[content.len() / row_bytes.max(1)], row].concat();
    let filled = content.len().is_multiple_of(row_bytes);
    let bytes = filled.then(|| [header(of, &shape), content].concat());
    bytes.ok_or_else(|| FormatError::ValueCount(row.to_vec()))
}

fn header(descr: &str, shape: &[usize]) -> Vec<u8> {
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
    bytes
}
