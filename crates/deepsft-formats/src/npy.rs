//! NumPy's `.npy` format, version 1.0, little endian, C order.

use crate::error::FormatError;

/// NumPy's names of the kinds of values.
const F32: &str = "<f4";
const F64: &str = "<f8";
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

/// Reads the rows of an `.npy` file of f32 or f64 values. An array of more than two dimensions has a row for each place of all but the last.
///
/// # Errors
/// [`FormatError::Npy`] says what is wrong with it.
pub fn rows_from_npy(bytes: &[u8]) -> Result<Vec<Vec<f64>>, FormatError> {
    let refused = |reason: &str| FormatError::Npy(reason.to_owned());
    let cut = || refused("it is cut short, or no .npy file: save it again with numpy.save");
    let (start, rest) = bytes.split_first_chunk::<8>().ok_or_else(cut)?;
    // The header's length has two bytes in version 1 and four in later ones.
    let length_bytes = if start[6] == 1 { 2 } else { 4 };
    let (length, rest) = rest.split_at_checked(length_bytes).ok_or_else(cut)?;
    let length = length.iter().rfold(0, |length, &byte| length << 8 | usize::from(byte));
    let (header, values) = rest.split_at_checked(length).ok_or_else(cut)?;
    let header = str::from_utf8(header)
        .ok()
        .filter(|_| start.starts_with(b"\x93NUMPY"))
        .ok_or_else(cut)?;
    let values: Vec<f64> = if header.contains(F64) {
        (values.as_chunks().0.iter())
            .map(|&value| f64::from_le_bytes(value))
            .collect()
    } else if header.contains(F32) {
        (values.as_chunks().0.iter())
            .map(|&value| f32::from_le_bytes(value).into())
            .collect()
    } else {
        return Err(refused(
            "its values are no f32 or f64 (little endian): save it with astype(float)",
        ));
    };
    let shape = header
        .split_once("'shape': (")
        .and_then(|(_, shape)| shape.split_once(')'));
    let sides = shape.map_or("", |(sides, _)| sides).split(',').map(str::trim);
    let sides: Result<Vec<usize>, _> = sides.filter(|side| !side.is_empty()).map(str::parse).collect();
    let is_transposed = header.contains("'fortran_order': True");
    let count = |sides: &[usize]| sides.iter().try_fold(1_usize, |count, &side| count.checked_mul(side));
    match sides.as_deref() {
        Ok([.., 0]) | Ok([] | [_]) | Err(_) => {
            Err(refused("it is no array of rows: save one of shape (rows, columns)"))
        }
        Ok(sides) if count(sides) != Some(values.len()) => Err(cut()),
        Ok(&[rows, _]) if is_transposed => Ok((0..rows)
            .map(|row| values.iter().skip(row).step_by(rows).copied().collect())
            .collect()),
        Ok(_) if is_transposed => Err(refused(
            "it is in Fortran's order: save it with numpy.ascontiguousarray",
        )),
        Ok(&[.., columns]) => Ok(values.chunks_exact(columns).map(<[f64]>::to_vec).collect()),
    }
}
