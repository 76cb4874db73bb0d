//! What JavaScript hands over, checked.

use crate::failure::{Code, Failure};
use deepsft::CameraOrigin;
use deepsft::geometry::glam::DVec2;
use deepsft::geometry::{Camera, ImageSize, Maps, Picture};
use js_sys::{Array, Uint8Array};
use std::collections::BTreeMap;
use wasm_bindgen::prelude::*;

/// The files of a model or template out of a JavaScript `Map` or list of pairs.
pub fn files_from(files: &JsValue) -> Result<BTreeMap<String, Vec<u8>>, Failure> {
    let refused = || Failure::new(Code::ModelLoad, "The files must be a Map from names to Uint8Arrays.");
    let entries = js_sys::try_iter(files).ok().flatten().ok_or_else(refused)?;
    entries
        .map(|entry| {
            let pair = entry
                .ok()
                .and_then(|entry| entry.dyn_into::<Array>().ok())
                .ok_or_else(refused)?;
            let name = pair.get(0).as_string().ok_or_else(refused)?;
            let bytes = pair.get(1).dyn_into::<Uint8Array>().map_err(|_| refused())?;
            Ok((name, bytes.to_vec()))
        })
        .collect()
}

/// The camera of an image of this size out of `[fx, fy, cx, cy, k1, k2, p1, p2, k3]`, or with a fisheye's
/// `[fx, fy, cx, cy, k1, k2, k3, k4]`.
pub fn camera_from(size: impl Into<ImageSize>, numbers: &[f64]) -> Result<Camera, Failure> {
    let size = size.into();
    let pinhole = |fx, fy, cx, cy| Camera::pinhole(size, DVec2::new(fx, fy), DVec2::new(cx, cy));
    match *numbers {
        [fx, fy, cx, cy, k1, k2, p1, p2, k3] => Ok(pinhole(fx, fy, cx, cy)?.with_distortion([k1, k2, p1, p2, k3])?),
        [fx, fy, cx, cy, k1, k2, k3, k4] => Ok(pinhole(fx, fy, cx, cy)?.with_fisheye([k1, k2, k3, k4])?),
        _ => {
            let message = format!(
                "A camera has 9 numbers (fx, fy, cx, cy, k1, k2, p1, p2, k3) or 8 (fx, fy, cx, cy, k1, k2, k3, k4), not {}.",
                numbers.len()
            );
            Err(Failure::new(Code::CameraIntrinsics, message))
        }
    }
}

/// The view of focal length `focal` (pixels) for images of `size`: the canonical camera, or one that is zoomed out.
pub fn view_from(canonical: &Camera, focal: f64) -> Result<Camera, Failure> {
    let own = canonical.focal();
    // To the bit: an image of that view is then taken as it is.
    let zoomed = DVec2::new(focal, focal * (own.y / own.x));
    Ok(Camera::pinhole(canonical.size(), zoomed, canonical.principal_point())?)
}

/// The picture of RGBA bytes, alpha left out.
pub fn picture_from(rgba: &[u8], size: impl Into<ImageSize>) -> Result<Picture, Failure> {
    let size = size.into();
    let expected = size.area().saturating_mul(4);
    if rgba.len() != expected {
        let message = format!(
            "An image of {size} pixels has {expected} bytes of RGBA, not {}.",
            rgba.len()
        );
        return Err(Failure::new(Code::ImageUnreadable, message));
    }
    // Not collected byte by byte: a video does this for each frame.
    let mut rgb = vec![0; 3 * size.area()];
    for (to, &[r, g, b, _]) in rgb.as_chunks_mut().0.iter_mut().zip(rgba.as_chunks().0) {
        *to = [r, g, b];
    }
    Ok(Picture::new(size.width, size.height, rgb)?)
}

/// A frame of `size` pixels with its camera, as [`picture_from`] and [`camera_from`] say.
pub fn frame_from(rgba: &[u8], size: (usize, usize), camera: &[f64]) -> Result<(Picture, Camera), Failure> {
    let camera = camera_from(size, camera)?;
    Ok((picture_from(rgba, size)?, camera))
}

/// How well a camera is known, by the `CameraSource` of JavaScript.
pub fn camera_origin(source: &str) -> CameraOrigin {
    match source {
        "exif" => CameraOrigin::Exif,
        "estimated" => CameraOrigin::Assumed,
        _ => CameraOrigin::Known,
    }
}

/// Maps of a canonical image of `width` columns out of a depth and two texture coordinates for each pixel.
pub fn maps_from(width: u32, depth: Vec<f32>, registration: &[f32]) -> Result<Maps, Failure> {
    let width = (width as usize).max(1);
    let (pairs, rest) = registration.as_chunks::<2>();
    if !rest.is_empty() {
        let message = format!(
            "A registration map has two values a pixel; {} are none.",
            registration.len()
        );
        return Err(Failure::new(Code::ImageUnreadable, message));
    }
    Ok(Maps::new(width, depth.len() / width, depth, pairs.to_vec())?)
}
