//! Templates of targets as JavaScript hands them to engine and tracker.

use crate::{
    failure::{Code, Failure},
    input::{files_from, picture_from},
    scan::{PictureDecoder, scanned_template},
    settle,
};
use deepsft::geometry::Template;
use deepsft::{TEMPLATE_FILE, TemplateFile};
use js_sys::Promise;
use wasm_bindgen::prelude::*;

/// A template without a network. Its makers reject with an `Error` whose `code` is `target-unusable`, `image-unreadable`, `model-load`,
/// `model-version` or `internal`.
#[wasm_bindgen]
pub struct TargetTemplate(pub(crate) Template);

fn promised(template: impl FnOnce() -> Result<Template, Failure> + 'static) -> Promise {
    settle::promise(async move { template().map(TargetTemplate) })
}

#[wasm_bindgen]
impl TargetTemplate {
    /// The sheet of `width_mm` x `height_mm` with a picture (RGBA, alpha left out), or the label around a tin, bottle or tube of
    /// `diameter_mm`.
    #[wasm_bindgen(js_name = ofPicture, unchecked_return_type = "Promise<TargetTemplate>")]
    pub fn of_picture(
        #[wasm_bindgen(unchecked_param_type = "Uint8Array | Uint8ClampedArray")] rgba: Vec<u8>,
        width: usize,
        height: usize,
        width_mm: f64,
        height_mm: f64,
        diameter_mm: Option<f64>,
    ) -> Promise {
        promised(move || {
            let picture = picture_from(&rgba, (width, height))?;
            match diameter_mm {
                None => Template::thin_shell(picture, width_mm, height_mm).map_err(Failure::of_target),
                Some(diameter) => {
                    Template::around_cylinder(picture, [width_mm, height_mm], diameter).map_err(Failure::of_target)
                }
            }
        })
    }

    /// The template of a folder's files, by name.
    #[wasm_bindgen(js_name = ofFolder, unchecked_return_type = "Promise<TargetTemplate>")]
    pub fn of_folder(
        #[wasm_bindgen(unchecked_param_type = "Iterable<[string, Uint8Array]>")] files: JsValue,
    ) -> Promise {
        promised(move || {
            let files = files_from(&files)?;
            let file = |name: &str| {
                let missing = || Failure::new(Code::TargetUnusable, format!("The template lacks {name}."));
                files.get(name).map(Vec::as_slice).ok_or_else(missing)
            };
            let description = TemplateFile::parse(file(TEMPLATE_FILE)?).map_err(Failure::of_target)?;
            let mesh = description.mesh().map(file).transpose()?;
            let template = description.template(file(description.texture())?, mesh);
            template.map_err(Failure::of_target)
        })
    }

    /// The object of a scan's files, as for [`crate::scan::read_scan`].
    #[wasm_bindgen(js_name = ofScan, unchecked_return_type = "Promise<TargetTemplate>")]
    pub fn of_scan(
        #[wasm_bindgen(unchecked_param_type = "Iterable<[string, Uint8Array]>")] files: JsValue,
        mm_per_unit: f64,
        decode: PictureDecoder,
    ) -> Promise {
        settle::promise(async move {
            let files = files_from(&files)?;
            let (_, scanned, _) = scanned_template(&files, Some(mm_per_unit), &decode).await?;
            Ok(Self(scanned.template))
        })
    }
}
