//! Scans of people's own objects: their shape, and the flat sheet that a bent one unrolls to.

use crate::{
    failure::{Code, Failure},
    input::{files_from, picture_from},
    mesh::{positions, template_mesh},
    object::{object, rgba},
    settle,
};
use deepsft::geometry::{Picture, UnrolledSheet, unroll};
use deepsft::{FormatError, decode_picture};
use deepsft_formats::{Scan, ScannedTemplate, assemble_scan};
use js_sys::{Array, Function, Object, Promise, Reflect, Uint8Array, Uint8ClampedArray};
use std::{cell::RefCell, collections::BTreeMap, path::Path};
use wasm_bindgen::prelude::*;
use wasm_bindgen_futures::JsFuture;

/// Endings of a scan's own file.
const SCANS: [&str; 4] = ["obj", "ply", "glb", "gltf"];

/// Endings of pictures that the engine or a browser decodes.
const PICTURES: [&str; 11] = [
    "png", "jpg", "jpeg", "webp", "avif", "gif", "bmp", "heic", "heif", "tif", "tiff",
];

/// Reads a scan out of its files by name: OBJ with MTL and pictures, PLY, glTF or GLB. The one picture beside a scan without materials is its
/// texture.
///
/// `mm_per_unit` are millimetres of the file's unit; when absent 1000 for glTF and 1 for OBJ and PLY. Resolves to the surface (mm, x right, y
/// down, front towards -z), its texture, and the flat sheet it unrolls to; where it does not, `refusal` says why; `notes` say what was put
/// right or left out. `decode` reads pictures that are neither PNG nor JPEG. Rejects with an `Error` whose
/// `code` is `target-unusable`, `model-load` or `internal`.
#[wasm_bindgen(
    js_name = readScan,
    unchecked_return_type = "Promise<{ name: string, mmPerUnit: number, vertices: Float32Array, mesh: { faces: Uint32Array, textureCoordinates: Float32Array }, texture: { width: number, height: number, rgba: Uint8ClampedArray<ArrayBuffer> }, sheet: { sizeMm: [number, number], backMm: number | null, picture: { width: number, height: number, rgba: Uint8ClampedArray<ArrayBuffer> } } | null, refusal: string | null, notes: string[] }>"
)]
pub fn read_scan(
    #[wasm_bindgen(unchecked_param_type = "Iterable<[string, Uint8Array]>")] files: JsValue,
    mm_per_unit: Option<f64>,
    decode: PictureDecoder,
) -> Promise {
    settle::promise(async move {
        let files = files_from(&files)?;
        let (name, scanned, mm_per_unit) = scanned_template(&files, mm_per_unit, &decode).await?;
        let template = scanned.template;
        let (sheet, refusal) = match unroll(&template) {
            Ok(UnrolledSheet { template, back_mm, .. }) => {
                let size = template.size_mm();
                let size = Array::of2(&size.x.into(), &size.y.into());
                let picture = picture_object(template.texture());
                (
                    object([
                        ("sizeMm", size.into()),
                        ("backMm", back_mm.map_or(JsValue::NULL, JsValue::from)),
                        ("picture", picture.into()),
                    ])
                    .into(),
                    JsValue::NULL,
                )
            }
            Err(error) => (JsValue::NULL, JsValue::from(error.to_string())),
        };
        Ok(object([
            ("name", name.into()),
            ("mmPerUnit", mm_per_unit.into()),
            ("vertices", positions(template.mesh().vertices()).into()),
            ("mesh", template_mesh(template.mesh()).into()),
            ("texture", picture_object(template.texture()).into()),
            ("sheet", sheet),
            ("refusal", refusal),
            (
                "notes",
                Array::from_iter(scanned.notes.iter().map(|note| JsValue::from(note.as_str()))).into(),
            ),
        ]))
    })
}

#[wasm_bindgen]
extern "C" {
    /// The browser's decoder of pictures, for kinds that the engine's does not know.
    #[wasm_bindgen(typescript_type = "(bytes: Uint8Array<ArrayBuffer>) => Promise<ImageData>")]
    pub type PictureDecoder;
}

/// The template of a scan's files by name, with the name of the scan's own file and the millimetres of its unit that were taken.
pub async fn scanned_template<'a>(
    files: &'a BTreeMap<String, Vec<u8>>,
    mm_per_unit: Option<f64>,
    decode: &PictureDecoder,
) -> Result<(&'a str, ScannedTemplate, f64), Failure> {
    let (name, bytes) = scan_of(files)?;
    let broken = |error: FormatError| Failure::new(Code::TargetUnusable, format!("{name} cannot be used: {error}."));
    // Each picture that the engine does not know, as the browser decodes it: `None` where neither does.
    let mut decoded = BTreeMap::<Vec<u8>, Option<Picture>>::new();
    let mut scan = loop {
        // Read again with each of them: they lie within other files, and it takes its time.
        let unknown = RefCell::new(None);
        let decoder = |bytes: &[u8]| match decoded.get(bytes) {
            Some(Some(picture)) => Ok(picture.clone()),
            Some(None) => decode_picture(bytes),
            None => decode_picture(bytes).inspect_err(|_| drop(unknown.replace(Some(bytes.to_vec())))),
        };
        match (read(name, bytes, files, &decoder), unknown.take()) {
            (scan, None) => break scan.map_err(broken)?,
            (_, Some(bytes)) => {
                let picture = decode_in_browser(decode, &bytes).await;
                decoded.insert(bytes, picture);
            }
        }
    };
    scan.mm_per_unit = mm_per_unit.unwrap_or(scan.mm_per_unit);
    let mm_per_unit = scan.mm_per_unit;
    Ok((name, assemble_scan(scan).map_err(broken)?, mm_per_unit))
}

async fn decode_in_browser(decode: &PictureDecoder, bytes: &[u8]) -> Option<Picture> {
    let decode: &Function = decode.unchecked_ref();
    let promise = decode.call1(&JsValue::UNDEFINED, &Uint8Array::from(bytes)).ok()?;
    let image = JsFuture::from(promise.dyn_into::<Promise>().ok()?).await.ok()?;
    let part = |name: &str| Reflect::get(&image, &name.into()).ok();
    let side = |name: &str| Some(part(name)?.as_f64()? as usize);
    let rgba = part("data")?.dyn_into::<Uint8ClampedArray>().ok()?.to_vec();
    picture_from(&rgba, (side("width")?, side("height")?)).ok()
}

fn read(
    name: &str,
    bytes: &[u8],
    files: &BTreeMap<String, Vec<u8>>,
    decode: &dyn Fn(&[u8]) -> Result<Picture, FormatError>,
) -> Result<Scan, FormatError> {
    let texture = lone_texture(files).map(decode).transpose()?;
    let beside = |path: &Path| {
        let missing = || {
            let reason = format!("{} is missing: choose it together with the scan", path.display());
            FormatError::Scan(reason)
        };
        // Files that people choose have no folders, those of archives may have others, and files from Windows may write their letters otherwise.
        let wanted = path.file_name().unwrap_or_default();
        let mut alike = files.iter().filter(|(name, _)| {
            Path::new(name)
                .file_name()
                .is_some_and(|name| wanted.eq_ignore_ascii_case(name))
        });
        let file = files
            .get(&*path.to_string_lossy())
            .or_else(|| alike.next().map(|(_, bytes)| bytes));
        file.cloned().ok_or_else(missing)
    };
    deepsft_formats::read_scan(name, bytes, texture, decode, &beside)
}

/// The files whose names end so.
fn ending<'a>(files: &'a BTreeMap<String, Vec<u8>>, endings: &[&str]) -> Vec<(&'a str, &'a [u8])> {
    let has = |name: &str| {
        let ending = Path::new(name).extension().unwrap_or_default();
        endings.contains(&ending.to_string_lossy().to_lowercase().as_str())
    };
    let files = files.iter().filter(|(name, _)| has(name));
    files.map(|(name, bytes)| (name.as_str(), bytes.as_slice())).collect()
}

/// The one file that is a scan.
fn scan_of(files: &BTreeMap<String, Vec<u8>>) -> Result<(&str, &[u8]), Failure> {
    let refused = |message: &str| Err(Failure::new(Code::TargetUnusable, message));
    match ending(files, &SCANS)[..] {
        [scan] => Ok(scan),
        [] => refused(
            "There is no scan among these files: one of .glb, .gltf, .obj and .ply is expected, alone or in a ZIP; export other kinds as GLB.",
        ),
        _ => refused("There are several scans among these files: choose one."),
    }
}

/// The texture's file of a scan that comes with one picture and no materials.
fn lone_texture(files: &BTreeMap<String, Vec<u8>>) -> Option<&[u8]> {
    let is_bare = !ending(files, &["obj"]).is_empty() && ending(files, &["mtl"]).is_empty();
    match ending(files, &PICTURES)[..] {
        [(_, bytes)] if is_bare => Some(bytes),
        _ => None,
    }
}

fn picture_object(picture: &Picture) -> Object {
    object([
        ("width", (picture.width() as f64).into()),
        ("height", (picture.height() as f64).into()),
        ("rgba", rgba(picture).into()),
    ])
}
