//! Maps as files that other programs write: NumPy arrays.

use anyhow::{Context, Result, bail, ensure};
use deepsft_formats::{f32_npy, f32_npy_header, write_file};
use deepsft_geometry::{ImageSize, Maps};
use std::{fs, path::Path};

/// Bytes before the text of a header, in version 1.0: magic, version, length.
const PREFIX: usize = 10;

/// The file of a frame's maps.
pub fn name(frame: usize) -> String {
    format!("{frame:06}.npy")
}

/// The maps as an array of [rows, columns, 3] f32: depth in mm, u, v; or [rows, columns, 1] without `registration`. Depth is 0 outside.
///
/// # Errors
/// Never: there are as many values as the shape says.
pub fn bytes(maps: &Maps, registration: bool) -> Result<Vec<u8>> {
    let mut values = Vec::new();
    for pixel in 0..maps.depth().len() {
        let inside = maps.inside(pixel);
        let [u, v] = maps.registration()[pixel];
        let all = if inside { [maps.depth()[pixel], u, v] } else { [0.0; 3] };
        values.extend(&all[..channels(registration)]);
    }
    Ok(f32_npy(&[maps.size().width, channels(registration)], values)?)
}

fn channels(registration: bool) -> usize {
    if registration { 3 } else { 1 }
}

/// Writes the answer to a frame, of `size`, into `folder`; none is a frame without the object.
///
/// # Errors
/// Names the file that cannot be written.
pub fn write(folder: &Path, frame: usize, answer: Option<&Maps>, size: ImageSize, registration: bool) -> Result<()> {
    let nothing = Maps::empty(size);
    Ok(write_file(
        &folder.join(name(frame)),
        &bytes(answer.unwrap_or(&nothing), registration)?,
    )?)
}

/// Reads the maps of a frame of `size`, and whether they have a registration. Depth that is not positive or not a number is outside.
///
/// # Errors
/// Names the file that is not there or no such array.
pub fn read(folder: &Path, frame: usize, size: ImageSize) -> Result<(Maps, bool)> {
    let path = folder.join(name(frame));
    let file = fs::read(&path).with_context(|| {
        format!(
            "{}: every frame needs a file, all 0 where nothing is found",
            path.display()
        )
    })?;
    parsed(&file, size).with_context(|| {
        format!(
            "{}: expected the array that the benchmark's README describes",
            path.display()
        )
    })
}

fn parsed(file: &[u8], size: ImageSize) -> Result<(Maps, bool)> {
    ensure!(
        file.starts_with(b"\x93NUMPY\x01\x00") && file.len() > PREFIX,
        "no .npy file of version 1.0"
    );
    let length = usize::from(u16::from_le_bytes([file[8], file[9]]));
    let header = file.get(PREFIX..PREFIX + length).context("the file is cut")?;
    let trimmed = |header: &[u8]| String::from_utf8_lossy(header).trim_end().to_owned();
    let has = |registration: bool| {
        let expected = f32_npy_header(&[size.height, size.width, channels(registration)]);
        trimmed(&expected[PREFIX..]) == trimmed(header)
    };
    let registration = match (has(true), has(false)) {
        (true, _) => true,
        (_, true) => false,
        _ => bail!(
            "it is {}, not f32 of ({}, {}, 3) or (.., 1) in C order",
            trimmed(header),
            size.height,
            size.width
        ),
    };
    let values: Vec<f32> = (file[PREFIX + length..].chunks_exact(4))
        .map(|bytes| f32::from_le_bytes([bytes[0], bytes[1], bytes[2], bytes[3]]))
        .collect();
    let channels = channels(registration);
    let expected = size.area() * channels;
    ensure!(
        values.len() == expected,
        "it holds {} values, not {expected}",
        values.len()
    );
    let mut maps = Maps::empty(size);
    for (pixel, value) in values.chunks_exact(channels).enumerate() {
        if value[0] > 0.0 {
            ensure!(
                value.iter().all(|v| v.is_finite()),
                "pixel {pixel} inside holds a value that is not finite"
            );
            maps.set(
                pixel,
                value[0],
                if registration { [value[1], value[2]] } else { [0.0; 2] },
            );
        }
    }
    Ok((maps, registration))
}
