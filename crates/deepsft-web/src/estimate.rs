//! One frame's estimate as JavaScript holds it.

use crate::mesh::RawMesh;
use crate::object::{object, rgba};
use deepsft::{Estimate, FinderKind};
use js_sys::{Float32Array, Object, Uint8Array, Uint8ClampedArray};
use wasm_bindgen::prelude::*;

/// Milliseconds of the stages of one frame.
#[derive(Default)]
pub struct Times {
    pub warp_ms: f64,
    pub network_ms: f64,
    pub judge_ms: f64,
    /// All that finding by features takes, the fit that confirms it included.
    pub features_ms: f64,
}

/// The maps of one frame, row-major, 270 rows of 480 columns, of an upright frame 480 rows of 270, in the canonical camera's image.
/// The arrays belong to JavaScript: they stay valid after `free()`, and may be transferred to another thread.
#[wasm_bindgen]
pub struct RawEstimate {
    width: usize,
    focal: f64,
    depth: Float32Array,
    registration: Float32Array,
    mask: Uint8Array,
    canonical: Uint8ClampedArray,
    found: bool,
    confidence: f32,
    by: Option<FinderKind>,
    fitted: Option<RawMesh>,
    times: Object,
}

impl RawEstimate {
    /// Copies the maps and the canonical image out of WebAssembly's memory.
    pub fn new(estimate: &Estimate, times: &Times) -> Self {
        let maps = &estimate.maps;
        let mask: Vec<u8> = maps.mask().into_iter().map(u8::from).collect();
        let fitted = estimate.surface.as_ref();
        Self {
            width: maps.width(),
            focal: estimate.canonical_camera.focal().x,
            depth: maps.depth().into(),
            registration: maps.registration().as_flattened().into(),
            mask: mask.as_slice().into(),
            canonical: rgba(&estimate.canonical).as_slice().into(),
            found: estimate.judgement.found,
            confidence: estimate.judgement.confidence,
            by: estimate.by,
            fitted: fitted.map(|surface| RawMesh::of(surface, maps, 0.0)),
            times: times.to_object(),
        }
    }
}

#[wasm_bindgen]
impl RawEstimate {
    /// Columns of the maps and of the canonical image.
    #[wasm_bindgen(getter)]
    pub fn width(&self) -> usize {
        self.width
    }

    /// Focal length of the canonical image, pixels: shorter where the object is too near for the training camera's.
    #[wasm_bindgen(getter)]
    pub fn focal(&self) -> f64 {
        self.focal
    }

    /// Distance along the camera's axis in mm, -1 outside the object; a number for each pixel.
    #[wasm_bindgen(getter)]
    pub fn depth(&self) -> Float32Array {
        self.depth.clone()
    }

    /// Texture position (u, v) of what each pixel shows, (-1, -1) outside the object; two numbers for each pixel.
    #[wasm_bindgen(getter)]
    pub fn registration(&self) -> Float32Array {
        self.registration.clone()
    }

    /// 1 where the object is seen, else 0; for each pixel.
    #[wasm_bindgen(getter)]
    pub fn mask(&self) -> Uint8Array {
        self.mask.clone()
    }

    /// The image the maps belong to, RGBA; four numbers for each pixel.
    #[wasm_bindgen(getter)]
    pub fn canonical(&self) -> Uint8ClampedArray {
        self.canonical.clone()
    }

    /// Whether the object is in the frame.
    #[wasm_bindgen(getter)]
    pub fn found(&self) -> bool {
        self.found
    }

    /// How well the image agrees with the template seen through the registration, 0 to 1.
    #[wasm_bindgen(getter)]
    pub fn confidence(&self) -> f32 {
        self.confidence
    }

    /// Which finder gave the maps.
    #[wasm_bindgen(getter, unchecked_return_type = "\"network\" | \"features\" | undefined")]
    pub fn by(&self) -> Option<String> {
        self.by.map(|by| by.name().to_owned())
    }

    /// The mesh of the maps, where one was fitted on the way: given once.
    #[wasm_bindgen(js_name = takeFitted)]
    pub fn take_fitted(&mut self) -> Option<RawMesh> {
        self.fitted.take()
    }

    /// Milliseconds of the canonical warp, the network (with its read-back), the judgement, and of finding by features.
    #[wasm_bindgen(
        getter,
        unchecked_return_type = "{ warpMs: number, networkMs: number, judgeMs: number, featuresMs: number }"
    )]
    pub fn times(&self) -> Object {
        self.times.clone()
    }
}

impl Times {
    fn to_object(&self) -> Object {
        object([
            ("warpMs", self.warp_ms.into()),
            ("networkMs", self.network_ms.into()),
            ("judgeMs", self.judge_ms.into()),
            ("featuresMs", self.features_ms.into()),
        ])
    }
}
