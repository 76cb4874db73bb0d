//! Plain values of JavaScript.

use deepsft::geometry::Picture;
use js_sys::{Object, Reflect, Uint8ClampedArray};
use wasm_bindgen::JsValue;

pub fn object<const N: usize>(properties: [(&str, JsValue); N]) -> Object {
    let object = Object::new();
    for (name, value) in properties {
        // Only fails on objects that were frozen.
        let _ = Reflect::set(&object, &name.into(), &value);
    }
    object
}

/// The bytes of a picture with an opaque alpha channel.
pub fn rgba(picture: &Picture) -> Uint8ClampedArray {
    let pixels = picture.rgb().as_chunks::<3>().0.iter();
    let bytes: Vec<u8> = pixels.flat_map(|&[r, g, b]| [r, g, b, u8::MAX]).collect();
    bytes.as_slice().into()
}
