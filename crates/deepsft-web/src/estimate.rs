//! One frame's estimate as JavaScript holds it.

use crate::mesh::mesh_object;
use crate::object::{object, rgba};
use deepsft::geometry::CalibratedCamera;
use deepsft::{Estimate, EstimateTimes};
use js_sys::{Array, Float32Array, Object, Uint8Array};
use wasm_bindgen::prelude::*;

#[wasm_bindgen(typescript_custom_section)]
const TYPE: &str = r#"
/** The maps of one frame, row-major, 270 rows of 480 columns, of an upright frame 480 rows of 270, in the canonical camera's image. */
export interface RawEstimate {
  /** Columns of the maps and of the canonical image. */
  width: number;
  /** Focal length of the canonical image, pixels: shorter where the object is too near for the training camera's. */
  focal: number;
  /** Distance along the camera's axis in mm, -1 outside the object; a number for each pixel. */
  depth: Float32Array;
  /** Texture position (u, v) of what each pixel shows, (-1, -1) outside the object; two numbers for each pixel. */
  registration: Float32Array;
  /** 1 where the object is seen, else 0; for each pixel. */
  mask: Uint8Array;
  /** The image the maps belong to, RGBA; four numbers for each pixel. */
  canonical: Uint8ClampedArray;
  /** Whether the object is in the frame. */
  found: boolean;
  /** How well the image agrees with the template seen through the registration, 0 to 1. */
  confidence: number;
  /** Whether the image determines the shape too. */
  shapeDetermined: boolean;
  /** The name of the finder that gave the maps. */
  by: "network" | "features" | null;
  /** The camera as the sheet tells it: fx, fy, cx, cy, pixels, and the standard deviation of fx as a fraction of it. */
  told: number[] | null;
  /** The mesh of the maps, where one was fitted on the way. */
  fitted: RawMesh | null;
  /** Milliseconds of a network's canonical warp, the network (with its read-back), the judgement, and of finding by features, warp and fit included. */
  times: { warpMs: number, networkMs: number, judgeMs: number, featuresMs: number };
}
"#;

/// A plain object, the `RawEstimate` of TypeScript. Its arrays belong to JavaScript: they may be transferred to another thread.
pub fn estimate_object(
    estimate: &Estimate,
    told: Option<&CalibratedCamera>,
    times: EstimateTimes,
    features_ms: f64,
) -> Object {
    let maps = &estimate.maps;
    let mask: Vec<u8> = maps.mask().into_iter().map(u8::from).collect();
    let registration = Float32Array::from(maps.registration().as_flattened());
    let surface = estimate.surface.as_ref();
    let fitted = surface.map(|surface| mesh_object(surface, maps, 0.0));
    let times = object([
        ("warpMs", times.warp_ms.into()),
        ("networkMs", times.network_ms.into()),
        ("judgeMs", times.judge_ms.into()),
        ("featuresMs", features_ms.into()),
    ]);
    let told = told.map_or(JsValue::NULL, |told| {
        let (focal, centre) = (told.camera.focal(), told.camera.principal_point());
        let numbers = [focal.x, focal.y, centre.x, centre.y, told.focal_deviation];
        numbers.map(JsValue::from).into_iter().collect::<Array>().into()
    });
    object([
        ("told", told),
        ("width", (maps.size().width as u32).into()),
        ("focal", estimate.canonical_camera.focal().x.into()),
        ("depth", Float32Array::from(maps.depth()).into()),
        ("registration", registration.into()),
        ("mask", Uint8Array::from(mask.as_slice()).into()),
        ("canonical", rgba(&estimate.canonical).into()),
        ("found", estimate.judgement.found.into()),
        ("confidence", estimate.judgement.confidence.into()),
        ("shapeDetermined", estimate.judgement.shape_determined.into()),
        ("by", estimate.by.map_or(JsValue::NULL, |by| by.name().into())),
        ("fitted", fitted.map_or(JsValue::NULL, JsValue::from)),
        ("times", times.into()),
    ])
}
