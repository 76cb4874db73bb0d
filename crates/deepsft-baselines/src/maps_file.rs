//! Maps as files that other programs write: NumPy arrays.

use anyhow::{Context, Result, ensure};
use deepsft_formats::{f32_npy, f32_npy_header, write_file};
use deepsft_geometry::{ImageSize, Maps};
use std::{fs, path::Path};

/// Bytes before the text of a header, in version 1.0: magic, version, length.
const PREFIX: usize = 10;

/// The file of a frame's maps.
pub fn name(frame: usize) -> String {
    format!("{frame:06}.npy")
}

/// The values of a pixel.
fn channels(registration: bool) -> usize {
    if registration { 3 } else { 1 }
}

/// The maps as an array of [rows, columns, 3] f32: depth in mm, u, v; or [rows, columns, 1] without `registration`. Depth is 0 outside.
pub fn bytes(maps: &Maps, registration: bool) -> Result<Vec<u8>> {
    let mut values = Vec::new();
    for pixel in 0..maps.depth().len() {
        let [u, v] = maps.registration()[pixel];
        let all = [maps.depth()[pixel], u, v].map(|value| if maps.inside(pixel) { value } else { 0.0 });
        values.extend(&all[..channels(registration)]);
    }
    Ok(f32_npy(&[maps.size().width, channels(registration)], values)?)
}

/// Writes the answer to a frame, of `size`, into `folder`; none is a frame without the object.
/// Errors name the file that cannot be written.
pub fn write(folder: &Path, frame: usize, answer: Option<&Maps>, size: ImageSize, registration: bool) -> Result<()> {
    let bytes = bytes(answer.unwrap_or(&Maps::empty(size)), registration)?;
    Ok(write_file(&folder.join(name(frame)), &bytes)?)
}

/// Reads the maps of a frame of `size`, and whether they have a registration. Depth that is not positive or not a number is outside.
/// Errors name the file that is not there or no such array.
pub fn read(folder: &Path, frame: usize, size: ImageSize) -> Result<(Maps, bool)> {
    let path = folder.join(name(frame));
    let of_file = |reason: &str| format!("{}: {reason}", path.display());
    let file = fs::read(&path).with_context(|| of_file("every frame needs a file, all 0 where nothing is found"))?;
    parsed(&file, size).with_context(|| of_file("expected the array that the benchmark's README describes"))
}

fn parsed(file: &[u8], size: ImageSize) -> Result<(Maps, bool)> {
    let start = file.split_first_chunk::<PREFIX>();
    let start = start.filter(|(start, _)| start.starts_with(b"\x93NUMPY\x01\x00"));
    let (start, rest) = start.context("no .npy file of version 1.0")?;
    let length = usize::from(u16::from_le_bytes([start[8], start[9]]));
    let (header, values) = rest.split_at_checked(length).context("the file is cut")?;
    let trimmed = |header: &[u8]| String::from_utf8_lossy(header).trim_end().to_owned();
    let is_of = |registration: &bool| {
        let expected = f32_npy_header(&[size.height, size.width, channels(*registration)]);
        trimmed(&expected[PREFIX..]) == trimmed(header)
    };
    let registration = [true, false].into_iter().find(is_of).with_context(|| {
        let (header, ImageSize { width, height }) = (trimmed(header), size);
        format!("it is {header}, not f32 of ({height}, {width}, 3) or (.., 1) in C order")
    })?;
    let values: Vec<f32> = values.as_chunks().0.iter().map(|&b| f32::from_le_bytes(b)).collect();
    let (count, expected) = (values.len(), size.area() * channels(registration));
    ensure!(count == expected, "it holds {count} values, not {expected}");
    let mut maps = Maps::empty(size);
    let pixels = values.chunks_exact(channels(registration)).enumerate();
    for (pixel, value) in pixels.filter(|(_, value)| value[0] > 0.0) {
        let is_finite = value.iter().all(|v| v.is_finite());
        ensure!(is_finite, "pixel {pixel} inside holds a value that is not finite");
        let uv = if registration { [value[1], value[2]] } else { [0.0; 2] };
        maps.set(pixel, value[0], uv);
    }
    Ok((maps, registration))
}
