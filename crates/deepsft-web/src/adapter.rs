//! What the browser says about the graphics adapter. wgpu passes on only its `description`, which
//! browsers leave empty; vendor and architecture are what they give.

use wasm_bindgen::prelude::*;
use wasm_bindgen_futures::JsFuture;

#[wasm_bindgen]
extern "C" {
    #[wasm_bindgen(js_namespace = ["navigator", "gpu"], js_name = requestAdapter, catch)]
    fn request_adapter(options: &JsValue) -> Result<js_sys::Promise, JsValue>;

    type GpuAdapter;
    #[wasm_bindgen(method, getter)]
    fn info(this: &GpuAdapter) -> Option<GpuAdapterInfo>;

    type GpuAdapterInfo;
    #[wasm_bindgen(method, getter)]
    fn vendor(this: &GpuAdapterInfo) -> Option<String>;
    #[wasm_bindgen(method, getter)]
    fn architecture(this: &GpuAdapterInfo) -> Option<String>;
    #[wasm_bindgen(method, getter)]
    fn description(this: &GpuAdapterInfo) -> Option<String>;
    #[wasm_bindgen(method, getter, js_name = isFallbackAdapter)]
    fn is_fallback_adapter(this: &GpuAdapterInfo) -> Option<bool>;
}

/// Architectures (in the browser's spelling) that are programs on the CPU.
const SOFTWARE: [&str; 4] = ["swiftshader", "llvmpipe", "lavapipe", "basic render"];

/// Vendor, architecture and description of the adapter that wgpu gets, and whether it is a program on
/// the CPU. `None` when the browser does not say.
pub async fn describe() -> Option<(String, bool)> {
    let options = js_sys::Object::new();
    js_sys::Reflect::set(&options, &"powerPreference".into(), &"high-performance".into()).ok()?;
    let adapter = JsFuture::from(request_adapter(&options).ok()?).await.ok()?;
    if adapter.is_null() || adapter.is_undefined() {
        return None;
    }
    let info = adapter.unchecked_into::<GpuAdapter>().info()?;
    let parts = [info.vendor(), info.architecture(), info.description()];
    let name = parts
        .into_iter()
        .flatten()
        .filter(|part| !part.is_empty())
        .collect::<Vec<_>>()
        .join(" ");
    let lower = name.to_lowercase();
    let software = info.is_fallback_adapter() == Some(true) || SOFTWARE.iter().any(|known| lower.contains(known));
    Some((name, software))
}
